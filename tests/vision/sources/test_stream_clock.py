from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.vision.sources.stream_clock import Lateness, StreamClock, StreamTime


def feed(
    clock: StreamClock, stamps: list[float | None], arrivals: list[float]
) -> list[StreamTime | None]:
    return [
        clock.take(stamp, arrival, "media") for stamp, arrival in zip(stamps, arrivals, strict=True)
    ]


def given(times: list[StreamTime | None]) -> list[StreamTime]:
    return [time for time in times if time is not None]


def test_lateness_is_delay_above_the_least_of_the_window(rng: np.random.Generator) -> None:
    arrivals = np.cumsum(rng.uniform(0.01, 0.5, 400))
    delays = rng.exponential(0.1, 400) + 5e-5 * arrivals - 1e6  # clocks drift, their zeros differ
    lateness = Lateness(window_s=10.0)
    found = [lateness.of(d, a) for d, a in zip(delays, arrivals, strict=True)]
    slowly = [
        delays[k] - delays[: k + 1][arrivals[: k + 1] >= arrivals[k] - 10.0].min()
        for k in range(400)
    ]
    assert_allclose(found, slowly)
    assert min(found) == 0


def test_media_times_start_at_zero_and_keep_their_steps(rng: np.random.Generator) -> None:
    stamps = 1e5 + np.cumsum(rng.uniform(0.01, 0.1, 50))
    arrivals = stamps - 9e4 + rng.exponential(0.05, 50)
    times = feed(StreamClock(), stamps.tolist(), np.maximum.accumulate(arrivals).tolist())
    assert times[0] is None  # alone it does not tell whether the stamps ascend
    rest = given(times)
    assert_allclose([time.t for time in rest], stamps[1:] - stamps[1], atol=1e-9)
    assert {(time.clock, time.segment) for time in rest} == {("media", 0)}


def test_a_burst_after_a_jam_is_late_and_not_a_jump() -> None:
    stamps: list[float | None] = [0.1 * k for k in range(60)]
    arrivals = [0.1 * k if k < 10 else max(0.1 * k, 5.0) + 1e-3 * k for k in range(60)]
    times = given(feed(StreamClock(), stamps, arrivals))
    assert {time.segment for time in times} == {0}
    assert times[9].late_s == pytest.approx(4.01, abs=0.02)  # picture 10
    assert times[-1].late_s == pytest.approx(0.06, abs=0.02)


@pytest.mark.parametrize(
    "stamps", [[None] * 8, [0.0] * 8, [None, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
)
def test_without_stamps_the_arrival_counts(stamps: list[float | None]) -> None:
    arrivals = [100 + 0.1 * k for k in range(8)]
    times = feed(StreamClock(), stamps, arrivals)
    rest = given(times)
    assert len(rest) >= 4
    assert [time.t for time in rest] == arrivals[-len(rest) :]
    assert {(time.clock, time.segment, time.late_s) for time in rest} == {("arrival", 0, None)}


def test_a_stream_may_find_its_times_at_the_third_picture() -> None:
    times = given(feed(StreamClock(), [0.0, 0.0, 0.04, 0.08], [0.0, 0.01, 0.05, 0.09]))
    assert [(time.t, time.clock) for time in times] == [(0.0, "media"), (0.04, "media")]


@pytest.mark.parametrize("odd", [None, 0.2, 0.15])
def test_one_stamp_that_does_not_ascend_is_left_out(odd: float | None) -> None:
    times = feed(StreamClock(), [0.0, 0.1, 0.2, odd, 0.4], [0.0, 0.1, 0.2, 0.3, 0.4])
    assert [None if time is None else round(time.t, 9) for time in times] == [
        None,
        0,
        0.1,
        None,
        0.3,
    ]


@pytest.mark.parametrize(
    ("jump", "segments"), [(-0.4, 1), (-0.7, 2), (1.5, 1), (2.5, 2), (-1e5, 2), (1e5, 2)]
)
def test_stamps_that_jump_begin_a_segment(jump: float, segments: int) -> None:
    stamps: list[float | None] = [50 + 0.1 * k + (jump if k >= 20 else 0) for k in range(40)]
    times = given(feed(StreamClock(), stamps, [0.1 * k for k in range(40)]))
    assert len({time.segment for time in times}) == segments
    assert np.all(np.diff([time.t for time in times]) > 0)


def test_segments_continue_in_time_as_they_came() -> None:
    clock = StreamClock()
    first = given(feed(clock, [7.0, 7.1, 7.2], [100.0, 100.1, 100.2]))
    clock.reconnected()
    second = given(feed(clock, [0.0, 0.1, 0.2], [160.0, 160.1, 160.2]))
    assert_allclose([time.t for time in first], [0.0, 0.1])
    assert_allclose([time.t for time in second], [60.0, 60.1])
    assert [time.segment for time in first + second] == [0, 0, 1, 1]


def test_times_ascend_though_a_segment_ran_ahead_of_its_arrival() -> None:
    """A server that begins with a second of old pictures."""
    clock = StreamClock()
    first = given(feed(clock, [0.1 * k for k in range(12)], [5.0 + 1e-3 * k for k in range(12)]))
    clock.reconnected()
    second = given(feed(clock, [0.0, 0.1, 0.2], [5.3, 5.4, 5.5]))
    assert first[-1].t == pytest.approx(1.0)
    assert second[0].t > first[-1].t
    assert second[1].t - second[0].t == pytest.approx(0.1)


def test_a_connection_that_gave_one_picture_is_no_segment() -> None:
    clock = StreamClock()
    assert feed(clock, [0.0], [1.0]) == [None]
    clock.reconnected()
    assert given(feed(clock, [0.0, 0.1], [2.0, 2.1]))[0].segment == 0


def test_device_times_are_kept() -> None:
    clock = StreamClock()
    for k, expected in enumerate((None, 5000.1, 5000.2)):
        time = clock.take(5000 + 0.1 * k, 9000 + 0.1 * k, "device")
        assert (time is None) == (expected is None)
        if time is not None:
            assert time.t == expected
            assert time.clock == "device"


def test_two_arrivals_in_one_tick_still_ascend() -> None:
    times = given(feed(StreamClock(), [None] * 4, [1.0, 1.0, 1.0, 1.0]))
    assert np.all(np.diff([time.t for time in times]) > 0)

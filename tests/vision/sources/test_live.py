"""Losses and returns, with a camera that does as it is told; tests/peers has real ones."""

from __future__ import annotations

from queue import Queue
from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.errors import UnreachableError
from airground.vision.sources import FrameSource, LiveSource
from airground.vision.sources.decoder import OpeningError, Picture
from vision.sources.films import number_of, numbered, until

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from airground.vision.frame import Clock

GONE = None


class Puppet:
    """A camera whose pictures the test hands over one by one; `GONE` pulls the plug."""

    stamped: Clock = "media"
    rate_hz = duration_s = frame_count = None
    absolute = True

    def __init__(self) -> None:
        self.pictures: Queue[Picture | None] = Queue()
        self.corrupt = 0
        self.closed = False

    def read(self) -> Picture | None:
        return self.pictures.get()

    def close(self) -> None:
        self.closed = True

    def show(self, *numbers: int, stamped: bool = True) -> None:
        for k in numbers:
            self.pictures.put(Picture(numbered(k), 0.04 * k if stamped else None, k))


class Bench:
    """A live source on puppets: one for each time it connects."""

    def __init__(self, puppets: list[Puppet | Exception], **settings: float) -> None:
        self.left = list(puppets)
        self.puppets = [puppet for puppet in puppets if isinstance(puppet, Puppet)]
        options = {"patience_s": 60.0, "stall_s": 60.0, **settings}
        self.source = LiveSource("puppet", self.connect, **options)  # type: ignore[arg-type]

    def connect(self) -> Puppet:
        item = self.left.pop(0) if self.left else OpeningError("it is off")
        if isinstance(item, Exception):
            raise item
        return item


@pytest.fixture
def bench() -> Iterator[Callable[..., Bench]]:
    made: list[Bench] = []

    def make(*puppets: Puppet | Exception, **settings: float) -> Bench:
        made.append(Bench(list(puppets), **settings))
        return made[-1]

    yield make
    for one in made:
        for puppet in one.puppets:
            puppet.pictures.put(GONE)
        one.source.close()
        assert not one.source.running


def test_only_the_newest_waits(bench: Callable[..., Bench]) -> None:
    puppet = Puppet()
    source = bench(puppet).source
    assert isinstance(source, FrameSource)
    assert source.health.state == "opening"
    source.start()
    puppet.show(0, 1, 2, 3, 4, 5)
    until(lambda: source.health.dropped == 4)  # picture 0 only tells that the stamps ascend
    frame = source.read()
    assert frame is not None
    assert (frame.index, number_of(frame.image), frame.clock) == (5, 5, "media")
    assert frame.t == pytest.approx(0.16)  # after picture 1
    assert source.read(0) is None
    assert source.health.frames == 1
    assert source.clock == "media"


def test_iterating_goes_on_until_closed(bench: Callable[..., Bench]) -> None:
    puppet = Puppet()
    source = bench(puppet).source.start()
    seen = []
    puppet.show(0, 1)
    for frame in source:
        seen.append(frame.index)
        if frame.index == 3:
            puppet.pictures.put(GONE)
            source.close()
        puppet.show(frame.index + 1)
    assert seen == [1, 2, 3]
    assert source.health.state == "ended"
    assert puppet.closed


def test_a_camera_that_comes_back(bench: Callable[..., Bench]) -> None:
    first, second = Puppet(), Puppet()
    source = bench(first, OpeningError("it starts"), second).source.start()
    first.show(0, 1)
    before = source.read()
    first.corrupt = 2
    first.show(2, 3)
    first.pictures.put(GONE)
    until(lambda: source.health.state == "lost")
    assert first.closed
    second.corrupt = 1
    second.show(0, 1)
    until(lambda: source.health.state == "live")
    after = next(frame for frame in source if frame.segment == 1)
    assert before is not None
    assert before.segment == 0
    assert after.t > before.t
    assert after.index == 5  # four of the first, and the second's picture 1
    assert source.health.reconnects == 1
    assert source.health.corrupt == 3
    assert source.health.notes[0].startswith("came back after")


def test_nothing_for_too_long_is_an_error_and_may_be_tried_again(
    bench: Callable[..., Bench],
) -> None:
    puppet = Puppet()
    made = bench(puppet, patience_s=0.2)
    source = made.source
    source.patience_s = 60
    source.start()
    puppet.show(0, 1)
    assert source.read() is not None
    puppet.pictures.put(GONE)
    source.patience_s = 0.2
    with pytest.raises(UnreachableError, match=r"lost puppet: nothing for \d+ s"):
        source.read()
    back = Puppet()
    back.show(0, 1)
    made.puppets.append(back)
    made.left.append(back)
    source.patience_s = 60
    assert source.read() is not None


def test_never_there(bench: Callable[..., Bench]) -> None:
    source = bench(patience_s=0.1).source.start()
    with pytest.raises(
        UnreachableError, match="cannot reach puppet: it is off; check that it is on"
    ):
        source.wait()
    assert source.health.state == "opening"


def test_a_refusal_is_final_before_the_first_picture(bench: Callable[..., Bench]) -> None:
    source = bench(OpeningError("no such user", final=True), patience_s=1000).source.start()
    with pytest.raises(UnreachableError, match="cannot reach puppet: no such user$"):
        source.read()


def test_a_fault_of_ours_is_not_swallowed(bench: Callable[..., Bench]) -> None:
    source = bench(ZeroDivisionError("a bug")).source.start()
    with pytest.raises(ZeroDivisionError, match="a bug"):
        source.read()


def test_a_stall_is_lost_at_once_though_the_thread_still_waits(bench: Callable[..., Bench]) -> None:
    puppet = Puppet()
    source = bench(puppet, stall_s=0.3).source.start()
    puppet.show(0, 1)
    until(lambda: source.health.state == "live")
    until(lambda: source.health.state == "lost")
    assert not puppet.closed


def test_the_picture_that_a_stalled_stream_gives_up_last_is_not_shown(
    bench: Callable[..., Bench],
) -> None:
    puppet = Puppet()
    source = bench(puppet, stall_s=0.2).source.start()
    puppet.show(0, 1)
    assert source.read() is not None
    until(lambda: source.health.state == "lost")
    puppet.show(2)
    until(lambda: puppet.closed)
    assert source.read(0) is None


def test_a_frozen_picture_is_noticed(bench: Callable[..., Bench]) -> None:
    puppet = Puppet()
    source = bench(puppet).source.start()
    puppet.show(0, 1)
    source.read()
    assert source.health.frozen_s == 0
    frozen = [Picture(numbered(1), 0.04 * k, k) for k in range(2, 5)]
    for picture in frozen:
        puppet.pictures.put(picture)
        source.read()
    still = source.health.frozen_s
    assert still > 0
    puppet.show(5)
    source.read()
    assert source.health.frozen_s == 0


def test_repeated_stamps_are_counted_and_left_out(bench: Callable[..., Bench]) -> None:
    puppet = Puppet()
    source = bench(puppet).source.start()
    puppet.show(0, 1)
    source.read()
    puppet.pictures.put(Picture(numbered(2), 0.04, 2))
    puppet.show(3)
    frame = source.read()
    assert frame is not None
    assert frame.index == 3
    assert source.health.repeated == 1


def test_a_rate_replaces_the_times(bench: Callable[..., Bench]) -> None:
    puppet = Puppet()
    source = bench(puppet, rate_hz=10.0).source.start()
    puppet.show(0, 1, 2, 3, stamped=False)
    until(lambda: source.health.dropped == 2)
    frame = source.read()
    assert frame is not None
    assert (frame.t, frame.clock, source.clock) == (0.3, "rate", "rate")


def test_waiting_leaves_the_first_frame_to_be_read(bench: Callable[..., Bench]) -> None:
    puppet = Puppet()
    puppet.show(0, 1)
    source = bench(puppet).source.start().wait()
    frame = source.read(0)
    assert frame is not None
    assert frame.index == 1


def test_a_timeout_gives_none(bench: Callable[..., Bench]) -> None:
    assert bench(Puppet()).source.start().read(0.01) is None


def test_closing_before_the_start_and_twice(bench: Callable[..., Bench]) -> None:
    source = bench().source
    source.close()
    source.close()
    assert source.read() is None
    assert np.isfinite(source.health.frozen_s)

"""Who is who: crossings, gaps, clutter, things that look like one, labels; and laws of any tracker."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.errors import InputError
from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker, TrackerOptions, TrackerState
from vision.tracker.points import Detector, Scene, drive, robots, watch

RATE = 30.0


def run(scene: Scene, options: TrackerOptions | None = None) -> list[TrackerState]:
    tracker = Tracker(options)
    return [tracker.update(sightings) for sightings in scene.sightings]


def names_of(scene: Scene, states: list[TrackerState]) -> list[list[str]]:
    """Of each thing: the names of the tracks that had its sightings, one after the other."""
    out: list[list[str]] = [[] for _ in range(scene.uv.shape[1])]
    for k, state in enumerate(states):
        for row in np.flatnonzero(state.confirmed & (state.sighting >= 0)):
            thing = scene.owner[k][state.sighting[row]]
            if thing >= 0 and not state.merged_with[row] and out[thing][-1:] != [state.names[row]]:
                out[thing].append(state.names[row])
    return out


def straight(
    starts: list[tuple[float, float]],
    rates: list[tuple[float, float]],
    detector: Detector,
    rng: np.random.Generator,
    seconds: float = 3.0,
) -> Scene:
    t = np.arange(0, seconds, 1 / RATE)
    uv = np.array(starts)[None] + t[:, None, None] * np.array(rates)[None]
    return watch(t, uv, np.broadcast_to(np.array(rates), uv.shape), detector, rng)


CLEAN = Detector(miss=0.0, clutter=0.0, merge_px=0.0, dropouts_per_minute=0.0)


def test_a_thing_is_followed_and_named(rng: np.random.Generator) -> None:
    states = run(straight([(100, 100)], [(120, -30)], CLEAN, rng))
    (track,) = states[-1].tracks
    assert (track.name, track.label, track.confirmed, track.lost_for) == ("track-1", "", True, 0.0)
    np.testing.assert_allclose(track.uv, [100 + 120 * track.t, 100 - 30 * track.t], atol=2)
    np.testing.assert_allclose(track.uv_dot, [120, -30], atol=30)
    assert not track.ambiguous
    assert np.isnan(track.angle)
    assert track.quality > 0.99
    ahead = Tracker()
    for sightings in straight([(100, 100)], [(120, -30)], CLEAN, rng).sightings:
        ahead.update(sightings)
    then = ahead.predict(3.0).track("track-1")
    np.testing.assert_allclose(then.uv, [460, 10], atol=3)
    assert then.sighting is None


def test_two_that_cross_keep_their_names(rng: np.random.Generator) -> None:
    """Seen as one for up to a second, each with its way to go."""
    for turn in (0.5, 1.0, np.pi / 2, np.pi):
        speed = 100.0
        rates = [(speed, 0.0), (speed * np.cos(turn), speed * np.sin(turn))]
        starts = [(400 - 1.5 * u, 300 - 1.5 * v) for u, v in rates]
        scene = straight(starts, rates, Detector(clutter=0.0, dropouts_per_minute=0.0), rng)
        assert scene.shared.any()
        states = run(scene)
        first = {tuple(n[:1]) for n in names_of(scene, states)}
        assert len(first) == 2
        for names in names_of(scene, states):
            assert names[0] == names[-1]
        assert any(state.merged_with[0] for state in states if len(state))


def test_a_second_in_hiding_does_not_change_a_name(rng: np.random.Generator) -> None:
    t = np.arange(0, 4, 1 / RATE)
    uv, uv_dot = drive(6, t, rng)
    detector = Detector(clutter=5.0, merge_px=0.0, dropouts_per_minute=0.0)
    alive = np.ones((len(t), 6), dtype=bool)
    alive[(t > 1.5) & (t < 2.5), :2] = False
    scene = watch(t, uv, uv_dot, detector, rng, alive=alive)
    states = run(scene)
    names = names_of(scene, states)
    assert [n[0] for n in names] == [n[-1] for n in names]
    lost = [state.lost_for[state.confirmed].max() for state in states if state.confirmed.any()]
    assert 0.9 < max(lost) < 1.2


def test_clutter_is_not_taken_for_things(rng: np.random.Generator) -> None:
    scene = robots(int(rng.integers(1 << 30)), 0, 5.0, Detector(clutter=5.0))
    states = run(scene)
    assert sum(int(state.confirmed.any()) for state in states) == 0


def test_many_robots(rng: np.random.Generator) -> None:
    """Twenty that cross, are missed, hidden and seen as one: few exchanges, no crowd of false tracks."""
    scene = robots(7, 20, 6.0)
    states = run(scene)
    assert abs(np.mean([state.confirmed.sum() for state in states[60:]]) - 20) < 1.5
    ends = [names[0] == names[-1] for names in names_of(scene, states) if names]
    assert np.mean(ends) >= 0.85


def test_two_hundred(rng: np.random.Generator) -> None:
    detector = Detector(size_px=(4000, 3000), clutter=10.0, dropouts_per_minute=0.0)
    scene = robots(3, 200, 0.7, detector)
    states = run(scene)
    assert abs(int(states[-1].confirmed.sum()) - 200) <= 4
    assert len(set(states[-1].names)) == len(states[-1])


def test_births_and_deaths(rng: np.random.Generator) -> None:
    t = np.arange(0, 6, 1 / RATE)
    uv, uv_dot = drive(2, t, rng)
    alive = np.ones((len(t), 2), dtype=bool)
    alive[t < 2, 1] = False
    alive[t > 3, 0] = False
    quiet = Detector(clutter=0.0, merge_px=0.0, dropouts_per_minute=0.0)
    states = run(watch(t, uv, uv_dot, quiet, rng, alive=alive))
    assert states[45].names == ("track-1",)
    assert set(states[85].names) == {"track-1", "track-2"}
    assert states[-1].names == ("track-2",)


def test_uneven_frames_and_a_gap(rng: np.random.Generator) -> None:
    t = np.cumsum(rng.choice([0.01, 0.03, 0.1], 120))
    t[60:] += 0.7
    uv, uv_dot = drive(5, t, rng, speed_pxps=80.0)
    scene = watch(t, uv, uv_dot, CLEAN, rng)
    names = names_of(scene, run(scene))
    assert [len(n) for n in names] == [1] * 5


@pytest.mark.parametrize("again", [1.0, 0.5])
def test_time_must_go_on(again: float) -> None:
    tracker = Tracker()
    tracker.update(Sightings.round(1.0, [[3.0, 4.0]], 1.0))
    with pytest.raises(InputError, match="restart"):
        tracker.update(Sightings.none(again))
    tracker.restart()
    state = tracker.update(Sightings.round(again, [[3.0, 4.0]], 1.0))
    assert state.serial.tolist() == [2]
    tracker.reset()
    assert tracker.update(Sightings.round(0.1, [[3.0, 4.0]], 1.0)).serial.tolist() == [1]


def test_predicting_the_past_is_refused() -> None:
    tracker = Tracker()
    tracker.update(Sightings.round(1.0, [[3.0, 4.0]], 1.0))
    for t in (0.9, np.nan):
        with pytest.raises(InputError, match="not before"):
            tracker.predict(t)


def test_nothing_is_nothing() -> None:
    tracker = Tracker()
    assert tracker.t is None
    assert len(tracker.update(Sightings.none(0.0))) == 0
    assert tracker.update(Sightings.none(0.1)).tracks == ()
    assert len(tracker.predict(5.0)) == 0


@pytest.mark.parametrize(
    "wrong",
    [{"detection": 1.0}, {"lost_s": 0.0}, {"accelerations_pxps2": ()}, {"hypotheses": 0}],
)
def test_options_are_checked(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        TrackerOptions(**wrong)  # type: ignore[arg-type]


@settings(max_examples=3)
@given(st.integers(0, 2**32 - 1))
def test_order_and_place_of_sightings_do_not_matter(seed: int) -> None:
    """Rows in another order, and the image turned and moved, give the same tracks by the same names."""
    rng = np.random.default_rng(seed)
    scene = robots(seed, 6, 0.8, Detector(size_px=(250, 250)))
    plain, mixed, turned, again = Tracker(), Tracker(), Tracker(), Tracker()
    angle = rng.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    move = rng.uniform(-500, 500, 2)
    for sightings in scene.sightings:
        order = rng.permutation(len(sightings))
        one, two = plain.update(sightings), mixed.update(sightings.take(order))
        three = turned.update(Sightings.round(sightings.t, sightings.uv @ turn.T + move, 0.5))
        four = again.update(sightings)
        assert one.names == two.names == three.names == four.names
        np.testing.assert_allclose(two.uv, one.uv, atol=1e-7)
        np.testing.assert_allclose(three.uv, one.uv @ turn.T + move, atol=1e-4)
        np.testing.assert_array_equal(four.uv, one.uv)
        np.testing.assert_array_equal(four.covariance, one.covariance)
        back = np.append(order, -1)[two.sighting]
        np.testing.assert_array_equal(back, one.sighting)


def labelled(t: float, places: dict[str, tuple[float, float]]) -> Sightings:
    return Sightings.round(t, list(places.values()), 0.3, labels=tuple(places))


def feed(tracker: Tracker, frames: int, first: int = 0, swap: bool = False) -> TrackerState:
    for k in range(first, first + frames):
        t = k / RATE
        a, b = (100 + 60 * t, 100.0), (100 + 60 * t, 160.0)
        state = tracker.update(labelled(t, {"7": b, "9": a} if swap else {"7": a, "9": b}))
    return state


def test_labels_are_names() -> None:
    state = feed(Tracker(), 10)
    assert set(state.names) == {"7", "9"}
    assert state.labels == state.names
    assert state.track("9").uv[1] == pytest.approx(160, abs=1)
    with pytest.raises(KeyError):
        state.track("8")


def test_labels_that_are_exchanged_for_a_frame_do_not_exchange_tracks() -> None:
    tracker = Tracker()
    feed(tracker, 20)
    state = feed(tracker, 1, 20, swap=True)
    assert state.track("7").sighting is None
    assert state.track("7").uv[1] == pytest.approx(100, abs=1)
    assert feed(tracker, 5, 21).track("7").sighting == 0


def test_labels_that_stay_exchanged_are_believed() -> None:
    tracker = Tracker()
    feed(tracker, 20)
    state = feed(tracker, 15, 20, swap=True)
    assert sorted(n for n, c in zip(state.names, state.confirmed, strict=True) if c) == ["7", "9"]
    assert state.track("7").uv[1] == pytest.approx(160, abs=1)


def test_two_tags_alike_are_both_in_doubt() -> None:
    tracker = Tracker()
    for k in range(20):
        state = tracker.update(
            Sightings.round(k / RATE, [[100, 100], [400, 100]], 0.3, labels=("7", "7"))
        )
    assert set(state.names) == {"7", "7#2"}
    assert all(track.ambiguous for track in state.tracks)


def test_a_label_goes_to_its_own_track_even_when_another_is_nearer(
    rng: np.random.Generator,
) -> None:
    """Two tagged things whose ways touch."""
    tracker = Tracker()
    for k in range(90):
        t = k / RATE
        bend = 40 * abs(t - 1.5)
        uv = np.array([[100 + 60 * t, 300 - bend], [100 + 60 * t, 300 + bend]])
        state = tracker.update(Sightings.round(t, uv, 0.3, labels=("up", "down")))
        for name, row in (("up", 0), ("down", 1)):
            if k > 10:
                assert state.track(name).sighting == row


def test_heading_is_followed_across_pi() -> None:
    tracker = Tracker()
    for k in range(60):
        t = k / RATE
        angle = np.array([(3.0 + 0.5 * t + np.pi) % (2 * np.pi) - np.pi])
        state = tracker.update(
            Sightings(
                t,
                np.array([[50.0, 50.0]]),
                np.eye(2)[None],
                angle=angle,
                angle_sigma=np.array([0.02]),
            )
        )
    (track,) = state.tracks
    assert track.angle == pytest.approx(float(angle[0]), abs=0.05)
    assert 0 < track.angle_sigma < 0.02


def test_heading_tells_who_is_who() -> None:
    """Two that meet head on and stop as one, and come out again: only their headings tell."""
    tracker = Tracker()
    for k in range(100):
        t = k / RATE
        gap = max(40 * abs(t - 1.6) - 10, 0)
        uv = np.array([[200 - gap, 100], [200 + gap, 100]])
        angle = np.array([0.0, np.pi - 0.01])
        if gap < 10:
            uv, angle = np.array([[200.0, 100.0]]), np.array([np.nan])
        n = len(uv)
        state = tracker.update(
            Sightings(
                t,
                uv,
                np.tile(0.1 * np.eye(2), (n, 1, 1)),
                angle=angle,
                angle_sigma=np.where(np.isnan(angle), np.nan, 0.05),
            )
        )
        if k == 20:
            left = state.names[int(np.argmin(state.uv[:, 0]))]
    assert state.track(left).uv[0] < 190


def test_what_nobody_can_tell_is_called_ambiguous() -> None:
    """Two alike stand as one for two seconds and part slowly."""
    tracker = Tracker()
    for k in range(210):
        t = k / RATE
        gap = 60 * max(1 - t, 0) if t < 4 else 30 * (t - 4)
        uv = np.array([[200 - gap, 100], [200 + gap, 100]])
        state = tracker.update(Sightings.round(t, uv if gap > 8 else uv.mean(axis=0)[None], 0.3))
    assert state.confirmed.sum() == 2
    assert all(track.ambiguous for track in state.confirmed_tracks)


def test_somebody_who_looked_ends_the_doubt() -> None:
    tracker = Tracker()
    for k in range(20):
        state = tracker.update(
            Sightings.round(k / RATE, [[100, 100], [400, 100]], 0.3, labels=("7", "7"))
        )
    tracker.affirm("7")
    assert not tracker.predict(20 / RATE).track("7").ambiguous
    assert state.track("7").ambiguous  # what was said stays said
    with pytest.raises(InputError, match="expected one of"):
        tracker.affirm("8")

"""Which track is which robot: right, or none; judged by scenes whose makers know."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest

from airground.calibration import Motion, Tracks, calibrate, identify
from airground.calibration.identify_chain import Span, chained
from airground.calibration.identify_evidence import spans_of
from airground.errors import InputError, UndeterminedError
from airground.geometry import align_rotation, n_error
from airground.sim.recordings import Recording, RecordingNoise, RecordingPlan, record

NOISE = RecordingNoise(
    tracks_hz=10.0,
    motion_hz=20.0,
    pixel_px=0.7,
    speed_share=0.03,
    slip=0.02,
    heading_rad=0.02,
    outlier_share=0.01,
    time_offset_s=0.4,
)
PLAN = RecordingPlan(drive="random_turns", speed_mps=0.8, duration_s=40.0, corner_radius=0.1)
OTHERS = (
    replace(PLAN, drive="rectangle", speed_mps=0.6, turned_deg=80.0, share=0.7),
    replace(PLAN, drive="figure_eight", speed_mps=0.5, turned_deg=-60.0, share=0.5),
    replace(PLAN, drive="eight_segments", speed_mps=1.0, turned_deg=130.0),
)


@dataclass
class Scene:
    """Tracks under meaningless names, and who they are."""

    rows: list[tuple[str, str, np.ndarray, np.ndarray]]

    def add(self, owner: str, t: np.ndarray, uv: np.ndarray) -> str:
        name = f"track-{len(self.rows) + 1}"
        self.rows.append((name, owner, t, uv))
        return name

    @property
    def tracks(self) -> Tracks:
        names = [name for name, _, t, _ in self.rows for _ in t]
        t = np.concatenate([t for *_, t, _ in self.rows])
        return Tracks.from_rows(t, names, np.concatenate([uv for *_, uv in self.rows]))

    def owner(self, name: str) -> str:
        return next(owner for known, owner, *_ in self.rows if known == name)


@cache
def robot(seed: int = 0, plan: RecordingPlan = PLAN) -> Recording:
    return record(plan, NOISE, seed=seed)


def crowd(rng: np.random.Generator, others: int = len(OTHERS)) -> Scene:
    """Other vehicles, parked ones, and somebody who walks about."""
    scene = Scene([])
    for k, plan in enumerate(OTHERS[:others]):
        seen = robot(50 + k, plan).tracks
        scene.add(f"other-{k}", seen.t, seen.uv)
    t = np.arange(0, 40, 0.1)
    for _ in range(3):
        place = rng.uniform([100, 100], [1180, 620])
        scene.add("parked", t, place + rng.normal(0, 0.7, (len(t), 2)))
    walk = np.cumsum(np.cumsum(rng.normal(0, 0.1, (len(t), 2)), axis=0) * 0.1, axis=0)
    scene.add("person", t, [640, 360] + walk + rng.normal(0, 1, walk.shape))
    return scene


def pieces(scene: Scene, owner: str, seen: Tracks, edges: list[tuple[float, float]]) -> None:
    for first, last in edges:
        mine = (seen.t >= first) & (seen.t < last)
        scene.add(owner, seen.t[mine], seen.uv[mine])


def test_a_robot_in_pieces_among_others(rng: np.random.Generator) -> None:
    scene, seen = crowd(rng), robot()
    pieces(scene, "robot-1", seen.tracks, [(0, 9), (11, 20), (22, 30), (32, 40)])
    found = identify(scene.tracks, seen.motion)
    mine = found.of("robot-1")
    assert mine.identified
    assert mine.confidence >= 0.95
    assert {scene.owner(s.track) for s in mine.spans} == {"robot-1"}
    assert sum(s.sightings for s in mine.spans) > 0.9 * len(seen.tracks) * 34 / 40
    assert found.time_offset_s == pytest.approx(0.4, abs=0.1)
    assert len(found.tracks) == len(scene.tracks)
    # The renamed tracks are what calibrate wants.
    model = calibrate(found.tracks, seen.motion).model
    aligned, _ = align_rotation(seen.truth.g, model)
    assert n_error(seen.truth.g, aligned) < 0.05


def test_several_robots_share_one_g(rng: np.random.Generator) -> None:
    one, two = robot(), robot(7, replace(PLAN, turned_deg=-100.0, speed_mps=0.6))
    scene = crowd(rng)
    pieces(scene, "a", one.tracks, [(0, 18), (20, 40)])
    pieces(scene, "b", two.tracks, [(0, 25), (27, 40)])
    motion = joined({"a": one.motion, "b": two.motion})
    found = identify(scene.tracks, motion)
    for name in ("a", "b"):
        assert found.of(name).identified
        assert {scene.owner(s.track) for s in found.of(name).spans} == {name}


def test_a_robot_that_is_not_there_is_not_found(rng: np.random.Generator) -> None:
    for seed in range(3):
        found = identify(crowd(rng).tracks, robot(seed).motion)
        assert not found.of("robot-1").identified
        assert found.of("robot-1").confidence < 0.95
        assert found.model is None
        with pytest.raises(UndeterminedError, match="no robot was identified: robot-1: .*; "):
            found.require()


def follower(seen: Recording, behind_s: float, aside_m: float, rng: np.random.Generator) -> Tracks:
    """A vehicle on the robot's way, later, or beside it in formation."""
    truth, t = seen.truth, seen.tracks.t[seen.tracks.t > behind_s]
    xy = truth.drive.at(t - behind_s).xy + [aside_m, 0.0]
    uv = truth.camera.project(xy) + rng.normal(0, 0.7, (len(t), 2))
    return Tracks.from_rows(t, ["x"] * len(t), uv)


@pytest.mark.parametrize(("behind_s", "aside_m"), [(1.3, 0.0), (0.0, 0.3)])
def test_a_convoy_is_not_guessed(behind_s: float, aside_m: float, rng: np.random.Generator) -> None:
    scene, seen = crowd(rng), robot()
    scene.add("robot-1", seen.tracks.t, seen.tracks.uv)
    mate = follower(seen, behind_s, aside_m, rng)
    scene.add("mate", mate.t, mate.uv)
    mine = identify(scene.tracks, seen.motion).of("robot-1")
    assert not mine.identified
    assert "convoy" in mine.reason
    assert "turn" in mine.advice


def test_a_known_clock_tells_who_follows_whom(rng: np.random.Generator) -> None:
    scene, seen = crowd(rng, 1), robot()
    name = scene.add("robot-1", seen.tracks.t, seen.tracks.uv)
    mate = follower(seen, 1.3, 0.0, rng)
    scene.add("mate", mate.t, mate.uv)
    mine = identify(scene.tracks, seen.motion, time_offset_s=0.4).of("robot-1")
    assert {s.track for s in mine.spans} == {name}


def test_two_robots_that_move_as_one_are_not_guessed(rng: np.random.Generator) -> None:
    scene, seen = crowd(rng, 1), robot()
    scene.add("a", seen.tracks.t, seen.tracks.uv)
    mate = follower(seen, 0.0, 0.3, rng)
    scene.add("b", mate.t, mate.uv)
    twin = record(PLAN, NOISE, seed=np.random.default_rng(0)).motion
    found = identify(scene.tracks, joined({"a": seen.motion, "b": twin}))
    assert not any(robot.identified for robot in found.robots)


def test_mirrored_and_reversed_copies_are_told_apart(rng: np.random.Generator) -> None:
    scene, seen = crowd(rng, 1), robot()
    t, uv = seen.tracks.t, seen.tracks.uv
    scene.add("mirrored", t, [1279, 0] + uv * [-1, 1])
    scene.add("reversed", t, uv[::-1])
    alone = identify(scene.tracks, seen.motion).of("robot-1")
    assert not alone.identified
    name = scene.add("robot-1", t, uv)
    assert {s.track for s in identify(scene.tracks, seen.motion).of("robot-1").spans} == {name}


def test_a_left_handed_ground_frame_has_to_be_said(rng: np.random.Generator) -> None:
    scene, seen = crowd(rng, 1), robot()
    name = scene.add("robot-1", seen.tracks.t, seen.tracks.uv)
    motion = replace(seen.motion, heading=-np.asarray(seen.motion.heading))
    wrong = identify(scene.tracks, motion).of("robot-1")
    assert not wrong.identified
    assert "left-handed" in wrong.reason
    right = identify(scene.tracks, motion, left_handed=True).of("robot-1")
    assert {s.track for s in right.spans} == {name}


def test_a_track_that_changes_to_another_object_is_cut(rng: np.random.Generator) -> None:
    scene, seen = crowd(rng, 1), robot()
    other = record(OTHERS[0], NOISE, seed=90).tracks
    mine, its = seen.tracks.t < 24, other.t >= 24
    t = np.concatenate([seen.tracks.t[mine], other.t[its]])
    name = scene.add("both", t, np.concatenate([seen.tracks.uv[mine], other.uv[its]]))
    (span,) = identify(scene.tracks, seen.motion).of("robot-1").spans
    assert span.track == name
    assert span.last_s == pytest.approx(24, abs=1.5)


def test_a_pause_goes_with_what_comes_after_it(rng: np.random.Generator) -> None:
    # At rest nothing tells by its motion, but only the robot is where the robot starts from.
    scene, seen = crowd(rng, 1), robot()
    t, uv = seen.tracks.t + 6.0, seen.tracks.uv
    rest = np.arange(0, 5.9, 0.1)
    name = scene.add("robot-1", rest, uv[0] + rng.normal(0, 0.7, (len(rest), 2)))
    scene.add("robot-1", t, uv)
    m = seen.motion
    before = np.arange(-1, m.t[0] + 6 - 0.05, 0.05)
    heading = np.concatenate([np.full(len(before), m.heading[0]), m.heading])  # type: ignore[index]
    speed = np.concatenate([np.zeros(len(before)), m.speed])
    later = np.concatenate([before, m.t + 6])
    motion = Motion.from_rows(later, ["robot-1"] * len(later), heading=heading, speed=speed)
    spans = identify(scene.tracks, motion).of("robot-1").spans
    assert spans[0].track == name
    assert len(spans) == 2


def test_no_motion_no_answer(rng: np.random.Generator) -> None:
    t = np.arange(0, 40, 0.05)
    motion = Motion.from_rows(t, ["r"] * len(t), heading=t * 0, speed=t * 0)
    identity = identify(crowd(rng).tracks, motion).of("r")
    assert not identity.identified
    assert "no motion" in identity.reason
    parked = Tracks.from_rows(t, ["p"] * len(t), 300 + rng.normal(0, 0.5, (len(t), 2)))
    assert "no track moves" in identify(parked, robot().motion).of("robot-1").reason


def test_a_straight_line_tells_nothing(rng: np.random.Generator) -> None:
    plan = replace(PLAN, drive="straight", speed_mps=None, duration_s=8.0, ramp_s=0.0)
    seen = record(plan, NOISE, seed=3)
    assert not identify(seen.tracks, seen.motion).of("robot-1").identified


def test_names_in_the_tracks_are_not_believed(rng: np.random.Generator) -> None:
    seen, other = robot(), record(OTHERS[0], NOISE, seed=50).tracks
    names = ["robot-1"] * len(other) + ["unnamed"] * len(seen.tracks)
    t, uv = np.concatenate([other.t, seen.tracks.t]), np.concatenate([other.uv, seen.tracks.uv])
    notes: list[str] = []
    found = identify(Tracks.from_rows(t, names, uv), seen.motion, note=notes.append)
    assert [s.track for s in found.of("robot-1").spans] == ["unnamed"]
    assert {"robot-1", "robot-1?"} <= set(found.tracks.targets)
    assert len(found.tracks.t[found.tracks.rows("robot-1?")]) == len(other)
    assert "robot-1?" in notes[0]


def test_tiny_and_odd_input() -> None:
    motion = robot().motion
    for t, names in (([0.0], ["a"]), ([0.0, 0.1], ["a", "b"]), ([0.0, 5.0, 9.0], ["a"] * 3)):
        tracks = Tracks.from_rows(t, names, np.arange(2 * len(t)).reshape(-1, 2))
        assert not identify(tracks, motion).of("robot-1").identified
    lonely = Motion.from_rows([0.0], ["r"], heading=[0.0], speed=[1.0])
    assert not identify(robot().tracks, lonely).of("r").identified
    with pytest.raises(KeyError):
        identify(robot().tracks, lonely).of("nobody")


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"least_confidence": 1.0}, "least_confidence"),
        ({"reach_s": 0.0}, "reach_s"),
        ({"time_offset_s": np.nan}, "time_offset_s"),
    ],
)
def test_options_out_of_range(options: dict[str, float], match: str) -> None:
    seen = robot()
    with pytest.raises(InputError, match=match):
        identify(seen.tracks, seen.motion, **options)  # type: ignore[arg-type]


def test_the_same_input_the_same_answer(rng: np.random.Generator) -> None:
    scene, seen = crowd(rng, 1), robot()
    scene.add("robot-1", seen.tracks.t, seen.tracks.uv)
    one, two = (identify(scene.tracks, seen.motion) for _ in range(2))
    assert one.robots == two.robots
    assert one.model is not None
    assert two.model is not None
    assert (one.model.g == two.model.g).all()


def test_spans_are_the_best_of_all_sequences(rng: np.random.Generator) -> None:
    for _ in range(30):
        gain = rng.normal(0, 3, 9)
        best = max(
            sum(g for g, s in zip(gain, states, strict=True) if s)
            - 2.0 * sum(a != b for a, b in pairwise(states))
            for states in product([0, 1], repeat=len(gain))
        )
        found = spans_of(gain, switch=2.0)
        inside = np.zeros(len(gain), dtype=bool)
        for first, stop, _ in found:
            inside[first:stop] = True
        cuts = int(np.sum(inside[1:] != inside[:-1]))
        assert float(gain[inside].sum()) - 2.0 * cuts == pytest.approx(max(best, 0.0))


def test_chains_are_the_best_of_all_that_do_not_overlap(rng: np.random.Generator) -> None:
    for _ in range(20):
        start = rng.uniform(0, 20, 7)
        spans = [
            Span(0, k, 0, 5, s, s + rng.uniform(2, 9), rng.uniform(1, 9), 1.0)
            for k, s in enumerate(start)
        ]
        best = 0.0
        for chosen in product([False, True], repeat=7):
            some = sorted(
                (s for s, c in zip(spans, chosen, strict=True) if c), key=lambda s: s.first_s
            )
            if all(a.last_s - 0.5 < b.first_s for a, b in pairwise(some)):
                best = max(best, sum(s.gain for s in some))
        assert sum(s.gain for s in chained(spans)) == pytest.approx(best)


def joined(motions: dict[str, Motion]) -> Motion:
    t = np.concatenate([m.t for m in motions.values()])
    names = [name for name, m in motions.items() for _ in m.t]
    heading = np.concatenate([np.asarray(m.heading) for m in motions.values()])
    speed = np.concatenate([np.asarray(m.speed) for m in motions.values()])
    return Motion.from_rows(t, names, heading=heading, speed=speed)

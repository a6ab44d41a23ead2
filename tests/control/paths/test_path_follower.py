"""Robots that follow paths, seen by a camera that the follower does not know; they move by exact arcs."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import STOP, Floor, Guidance, Limits, RobotState, VelocityCommand
from airground.control.paths.image_path import ImagePath
from airground.control.paths.path_follower import PathFollower
from airground.control.paths.sketch import smooth_sketch
from airground.control.paths.sketch_path import path_through
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.geometry.arrays import FloatArray
from airground.sim import demo_world
from airground.sim.unicycle import arc

CAMERA = demo_world().camera
ORIGIN = np.array([640.0, 400.0])
FLOOR = Floor(LimitedHomography(CAMERA.g), ORIGIN)
LIMITS = Limits()
CAR = Limits(turn_radius_m=0.3)
CORNERS = np.array([(200.0, 600), (700, 560), (680, 250), (1100, 300)])
ZIGZAG = np.array([(200.0, 600), (800, 500), (220, 450)])


@dataclass
class Drive:
    """What a follower did."""

    xy: FloatArray
    uv: FloatArray
    theta: FloatArray
    commands: list[VelocityCommand]
    progress: FloatArray
    last: Guidance = field(repr=False)


def drive(
    follower: PathFollower,
    start: FloatArray,
    theta: float,
    *,
    dt: float = 0.05,
    limit_s: float = 90.0,
    late: int = 0,
    noise: np.random.Generator | None = None,
) -> Drive:
    """Until it is done; `late` steps pass before a command is obeyed."""
    xy, progress, moves = np.array(start, dtype=np.float64), 0.0, VelocityCommand(0.0, 0.0)
    rows, commands = [], []
    for k in range(int(limit_s / dt)):
        uv = CAMERA.project(xy)
        seen = uv if noise is None else uv + noise.normal(0, 1.0, 2)
        guidance = follower.step(
            RobotState(k * dt, seen, theta, moves.v, moves.omega), progress, dt
        )
        progress = guidance.progress
        rows.append((*xy, *uv, theta, progress))
        commands.append(guidance.command)
        if guidance.done or guidance.trouble:
            break
        moves = commands[-1 - late] if late < len(commands) else STOP
        xy = xy + arc(theta, moves.v, moves.omega, dt)
        theta += moves.omega * dt
    table = np.array(rows)
    return Drive(table[:, :2], table[:, 2:4], table[:, 4], commands, table[:, 5], guidance)


def away(points: FloatArray, line: FloatArray) -> FloatArray:
    """Distance of each point from a polyline, by all pairs."""
    a, d = line[:-1], np.diff(line, axis=0)
    square = np.maximum((d**2).sum(axis=1), 1e-12)
    f = ((points[:, None] - a) * d).sum(axis=2) / square
    foot = a + np.clip(f, 0, 1)[:, :, None] * d
    return np.asarray(np.hypot(*(points[:, None] - foot).transpose(2, 0, 1)).min(axis=1))


def ground(path: ImagePath) -> FloatArray:
    """By the camera, not by g."""
    return CAMERA.unproject(path.uv)


def start_of(path: ImagePath) -> tuple[FloatArray, float]:
    xy = ground(path)
    return xy[0], float(np.arctan2(*(xy[3] - xy[0])[::-1]))


def stroke(corners: FloatArray) -> FloatArray:
    """Points every few pixels."""
    parts = [np.linspace(a, b, 80) for a, b in pairwise(corners)]
    return np.concatenate(parts)


@pytest.mark.parametrize(("dt", "limits"), [(0.02, LIMITS), (0.05, LIMITS), (0.05, CAR)])
def test_it_stays_on_the_path_and_stops_at_its_end(dt: float, limits: Limits) -> None:
    path = smooth_sketch(FLOOR, stroke(CORNERS), limits)
    ran = drive(PathFollower(path, limits), *start_of(path), dt=dt)
    assert ran.last.done
    assert ran.last.command == STOP
    assert np.hypot(*(ran.xy[-1] - ground(path)[-1])) < 0.01
    off = away(ran.uv, path.uv)
    assert np.sqrt(np.mean(off**2)) < 0.3
    assert off.max() < 1.0
    v = np.array([c.v for c in ran.commands])
    omega = np.array([c.omega for c in ran.commands])
    assert v.max() <= limits.speed_mps
    assert v.max() > 0.95 * limits.speed_mps  # the speed is that of the plan
    assert v.min() >= 0
    assert np.abs(omega).max() <= limits.turn_rate_radps
    assert (np.abs(omega) * v).max() <= limits.lateral_acceleration_mps2 * 1.01
    assert (np.abs(omega) * limits.turn_radius_m <= v + 1e-9).all()
    assert np.diff(v)[:-1].min() / dt > -1.1 * limits.deceleration_mps2
    assert v[-2] < 0.05  # the last step is to rest
    # The last decimetre is driven more gently than planned, at v = gap / (4 tau), tau = 0.1 s: about 1.3 s more.
    assert len(v) * dt == pytest.approx(path.duration + 1.3, rel=0.06)
    # Each said error is the one that is.
    assert ran.last.error_m == pytest.approx(np.hypot(*(ran.xy[-1] - ground(path)[-1])), abs=1e-3)


def test_from_anywhere_it_comes_to_the_path_without_circling(rng: np.random.Generator) -> None:
    angle = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    uv = np.column_stack([640 + 300 * np.cos(angle), 420 + 170 * np.sin(angle)])
    for limits in (LIMITS, CAR):
        path = path_through(FLOOR, uv, limits, closed=True)
        follower, line = PathFollower(path, limits, laps=3), ground(path)
        for _ in range(4):
            start = rng.uniform([-2, 2.8], [2, 5.5])
            ran = drive(follower, start, rng.uniform(-3, 3), limit_s=50.0, dt=0.1)
            off = away(ran.xy, line)
            far = np.flatnonzero(off > 0.02)
            on = int(far[-1]) + 1 if len(far) else 0  # from there it stays
            assert on < len(off) - 100
            turned = np.abs(np.diff(ran.theta[: on + 1])).sum()
            by_path = 2 * np.pi * abs(ran.progress[on] - ran.progress[0]) / path.length
            assert turned < 2 * np.pi + by_path


def test_cusps_are_stops(rng: np.random.Generator) -> None:
    for limits in (LIMITS, CAR):
        path = smooth_sketch(FLOOR, stroke(ZIGZAG), limits)
        ran = drive(PathFollower(path, limits), *start_of(path))
        assert ran.last.done
        assert np.hypot(*(ran.xy[-1] - ground(path)[-1])) < 0.01
        tip = ground(path)[path.breaks[0]]
        assert np.hypot(*(ran.xy - tip).T).min() < 0.01
        v = np.array([c.v for c in ran.commands])
        k = int(np.argmin(np.hypot(*(ran.xy - tip).T)))
        assert np.abs(v[k - 1 : k + 2]).min() < 0.02
        if limits is CAR:
            assert v[k + 20 :].min() < -0.1
            assert v.min() >= -CAR.reverse_mps
            assert np.abs(ran.theta[-1] - ran.theta[k]) < 0.5  # it did not turn round
        else:
            assert v.min() >= 0
            assert np.abs(ran.theta[-1] - ran.theta[k]) > 2.0
        assert away(ran.xy, ground(path)).max() < 0.03
        assert (np.diff(ran.progress) > -0.02).all()


def test_laps_and_crossings() -> None:
    angle = np.linspace(0, 2 * np.pi, 150, endpoint=False)
    xy = [0, 4.1] + np.column_stack([1.0 * np.sin(angle), 0.7 * np.sin(2 * angle)])
    path = path_through(FLOOR, CAMERA.project(xy), LIMITS, closed=True)
    follower = PathFollower(path, LIMITS, laps=2)
    ran = drive(follower, *start_of(path), dt=0.05)
    assert ran.last.done
    assert follower.length == pytest.approx(2 * path.length)
    assert np.hypot(*np.diff(ran.xy, axis=0).T).sum() == pytest.approx(2 * path.length, rel=5e-3)
    assert np.hypot(*(ran.xy[-1] - xy[0])) < 0.01
    assert away(ran.xy, ground(path)).max() < 0.01
    half = np.abs(ran.progress - path.length) < 0.1
    assert min(c.v for c, at in zip(ran.commands, half, strict=True) if at) > 0.3  # rolling by
    # From beside the middle of a lap: first to the start, then the laps.
    late = drive(PathFollower(path, LIMITS), xy[100] + [0.1, 0.0], 0.0, limit_s=60)
    assert late.last.done
    assert late.progress[0] < 0
    assert np.hypot(*np.diff(late.xy, axis=0).T).sum() > path.length


def test_a_wrong_g_noise_and_delay_are_borne(rng: np.random.Generator) -> None:
    wrong = CAMERA.g * (1 + 0.05 * rng.uniform(-1, 1, (3, 2)) * [[1], [1], [0.2]])
    floor = Floor(LimitedHomography(wrong), ORIGIN)
    path = smooth_sketch(floor, stroke(CORNERS), LIMITS)
    follower = PathFollower(path, LIMITS)
    for late, noise, rms, end in ((0, None, 1.5, 0.01), (1, None, 1.5, 0.01), (1, rng, 2.0, 0.03)):
        ran = drive(follower, *start_of(path), late=late, noise=noise)
        assert ran.last.done
        off = away(ran.uv, path.uv)  # on the line that was drawn, in the image
        assert np.sqrt(np.mean(off**2)) < rms
        assert np.hypot(*(ran.xy[-1] - ground(path)[-1])) < end


def test_the_image_and_the_ground_agree() -> None:
    """The robot turns until its image heads for the image of the point ahead on the path's tangent."""
    path = smooth_sketch(FLOOR, stroke(CORNERS), LIMITS)
    follower = PathFollower(path, LIMITS)
    s, v = 1.2, 0.3
    point = path.at(s)
    side = np.array([-np.sin(point.theta), np.cos(point.theta)])
    uv = FLOOR.pixel(point.xy + 0.07 * side)
    aim = follower.aim(uv, s, v)
    here, there = CAMERA.unproject(uv), CAMERA.unproject(aim)
    wanted = np.arctan2(*(there - here)[::-1])
    w = np.linalg.solve(FLOOR.model.jacobian(uv), aim - uv)  # the law in the image
    assert np.arctan2(w[1], w[0]) == pytest.approx(wanted, abs=1e-6)
    ahead = CAMERA.project_velocity(here, [np.cos(wanted), np.sin(wanted)])
    assert np.cross([*ahead, 0], [*(aim - uv), 0])[2] == pytest.approx(0, abs=1e-3)
    # Turning towards it: by the gain, and as the wanted heading itself turns with the motion.
    reach = follower.lookahead_m + follower.lookahead_s * v

    def bend(theta: float) -> float:
        return follower.step(RobotState(0.0, uv, theta, v), s, 0.05).command.omega

    gain = (bend(wanted - 0.01) - bend(wanted + 0.01)) / 0.02
    assert gain == pytest.approx(follower.heading_gain + v * reach / (reach**2 + 0.07**2), rel=0.02)
    assert abs(bend(wanted)) < 1.0


def test_what_it_cannot_answer_is_trouble() -> None:
    path = smooth_sketch(FLOOR, stroke(CORNERS), LIMITS)
    follower = PathFollower(path, LIMITS)
    for uv, theta, v in (
        ([np.nan, 1.0], 0.0, 0.0),
        ([640.0, -3000.0], 0.0, 0.0),
        ([300.0, 600.0], np.nan, 0.0),
        ([300.0, 600.0], 0.0, np.inf),
    ):
        said = follower.step(RobotState(0.0, np.array(uv), theta, v), 0.3, 0.05)
        assert said.trouble
        assert said.command == STOP
        assert not said.done
        assert said.progress == 0.3
    for name, value in (("heading_gain", 0.0), ("response_s", -1.0), ("lookahead_m", np.nan)):
        with pytest.raises(InputError, match=name):
            PathFollower(path, LIMITS, **{name: value})  # type: ignore[arg-type]
    with pytest.raises(InputError, match="laps"):
        PathFollower(path, LIMITS, laps=0)


def test_done_stays_done() -> None:
    path = smooth_sketch(FLOOR, stroke(CORNERS), LIMITS)
    follower = PathFollower(path, LIMITS)
    said = follower.step(RobotState(0.0, path.uv[-1], 0.0), path.length - 0.01, 0.05)
    assert said.done
    pushed = follower.step(RobotState(0.1, path.uv[-30], 0.0), said.progress, 0.05)
    assert pushed.done
    assert pushed.command == STOP
    assert pushed.error_m == pytest.approx(np.hypot(*(path.xy[-30] - path.xy[-1])), abs=1e-6)
    assert_allclose(pushed.wanted_uv, path.uv[-1], atol=1e-4)

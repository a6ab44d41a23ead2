"""Paths by arc length and by time against the camera, brute force and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import Floor, Limits
from airground.control.paths.image_path import ImagePath
from airground.control.paths.sketch import smooth_sketch
from airground.control.paths.sketch_path import Run, path_of_runs, path_through
from airground.control.paths.sketch_spline import evaluate, slopes
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import demo_world

CAMERA = demo_world().camera
ORIGIN = np.array([640.0, 400.0])
FLOOR = Floor(LimitedHomography(CAMERA.g), ORIGIN)
LIMITS = Limits()
CENTRE, RADIUS = np.array([0.2, 4.0]), 0.8


def circle_on_the_ground() -> ImagePath:
    angle = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    xy = CENTRE + RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    return path_through(FLOOR, CAMERA.project(xy), LIMITS, closed=True)


def eight() -> ImagePath:
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    xy = [0, 4.1] + np.column_stack([1.5 * np.sin(angle), np.sin(2 * angle)])
    return path_through(FLOOR, CAMERA.project(xy), LIMITS, closed=True)


def there_and_back(direction: int = 1) -> ImagePath:
    """Out along a line, and back on nearly the same."""
    line = np.linspace(0, 1, 30)[:, None]
    out, back = line * [2.0, 0.3], [2.0, 0.3] - line * [2.0, 0.1]
    free = np.full(30, np.inf)
    return path_of_runs(FLOOR, [Run(out, free), Run(back, free, direction)], LIMITS)


def test_a_circle_is_one() -> None:
    path = circle_on_the_ground()
    assert path.closed
    assert path.length == pytest.approx(2 * np.pi * RADIUS, rel=1e-6)
    assert_allclose(path.curvature, 1 / RADIUS, rtol=1e-3)
    assert path.speed.max() == LIMITS.speed_mps == path.speed.min()
    assert path.duration == pytest.approx(path.length / LIMITS.speed_mps, rel=1e-6)
    for s in (-1.0, 0.0, 0.123, 4.0, 7.5):
        point = path.at(s)
        truth = CENTRE + RADIUS * np.array([np.cos(s / RADIUS), np.sin(s / RADIUS)])
        assert_allclose(point.uv, CAMERA.project(truth), atol=0.01)
        assert np.cos(point.theta - s / RADIUS - np.pi / 2) == pytest.approx(1, abs=1e-6)
        assert point.curvature == pytest.approx(1 / RADIUS, rel=1e-3)


def test_at_is_smooth_and_keeps_arc_length() -> None:
    path = eight()
    s = np.linspace(0.3, 0.9, 500)
    xy = np.array([path.at(x).xy for x in s])
    theta = np.array([path.at(x).theta for x in s])
    kappa = np.array([path.at(x).curvature for x in s])
    step = np.hypot(*np.diff(xy, axis=0).T)
    assert_allclose(step, np.diff(s), rtol=1e-4)
    way = np.unwrap(np.arctan2(*np.diff(xy, axis=0).T[::-1]))
    assert_allclose(np.unwrap(theta)[:-1] + np.diff(np.unwrap(theta)) / 2, way, atol=1e-4)
    assert_allclose(np.diff(theta) / np.diff(s), (kappa[1:] + kappa[:-1]) / 2, atol=0.02)


def test_nearest_against_brute_force(rng: np.random.Generator) -> None:
    path = eight()
    s = np.linspace(0, path.length, 20001)
    dense = np.array([path.at(x).xy for x in s])
    for _ in range(20):
        at = rng.uniform(0, path.length)
        point = path.at(at)
        side = np.array([-np.sin(point.theta), np.cos(point.theta)])
        off = point.xy + rng.uniform(-0.15, 0.15) * side
        uv = FLOOR.pixel(off)
        near = path.nearest(uv, near_s=at + rng.uniform(-0.1, 0.1))
        stretch = np.abs((s - at + path.length / 2) % path.length - path.length / 2) < 0.3
        best = np.hypot(*(dense[stretch] - off).T).min()
        assert np.hypot(*(path.at(near).xy - off)) == pytest.approx(best, abs=1e-5)
        anywhere = path.nearest(uv)
        best = np.hypot(*(dense - off).T).min()
        assert np.hypot(*(path.at(anywhere).xy - off)) == pytest.approx(best, abs=1e-4)
    assert np.isnan(path.nearest(np.array([640.0, -5000.0])))


def test_a_crossing_does_not_confuse_the_search() -> None:
    path = eight()
    s, seen = 0.0, []
    for true in np.arange(0.02, 2.5 * path.length, 0.02):
        s = path.nearest(path.at(true).uv, near_s=s, within_m=0.1)
        seen.append(s - true)
    assert np.abs(seen).max() < 1e-3  # it goes on from lap to lap, straight over the crossing
    backwards = path.nearest(path.at(-0.05).uv, near_s=0.02)
    assert backwards == pytest.approx(-0.05, abs=1e-4)
    assert path.nearest(path.at(1.0).uv, near_s=0.5, within_m=0.1) == pytest.approx(0.6)


def test_runs_that_overlap_are_told_apart_by_where_one_was() -> None:
    path = there_and_back(-1)
    uv = path.at(0.5).uv
    assert path.nearest(uv, near_s=0.4) == pytest.approx(0.5, abs=1e-3)
    late = path.nearest(uv, near_s=path.length - 0.4)
    assert late > path.run_ends[0]
    assert path.run_of(path.run_ends[0]) == 1
    assert path.at(0.5).direction == 1
    assert path.at(late).direction == -1


def test_trajectory_is_the_motion_of_the_image_point() -> None:
    for path in (eight(), there_and_back()):
        motion = path.trajectory()
        step = 1e-5
        last = path.duration - 0.01 if not path.closed else 3 * path.duration
        for t in np.linspace(0.013, last, 40):
            uv, uv_dot, uv_ddot = motion.at(t)
            before, after = motion.at(t - step), motion.at(t + step)
            assert_allclose(uv_dot, (after[0] - before[0]) / (2 * step), atol=0.02)
            jump = np.abs(after[2] - before[2]).max() > 5  # the acceleration has steps
            if not jump:
                assert_allclose(uv_ddot, (after[1] - before[1]) / (2 * step), atol=0.5)
            truth = CAMERA.unproject(uv) - CAMERA.unproject(ORIGIN)
            speed = np.hypot(*FLOOR.model.ground_velocity(uv, uv_dot))
            s = path.nearest(uv, near_s=motion.along(t)[0])
            assert_allclose(path.at(s).xy, truth, atol=1e-4)
            assert speed <= LIMITS.speed_mps * (1 + 1e-9)
    assert np.isinf(eight().trajectory().duration)
    motion = there_and_back().trajectory()
    for t in (-1.0, motion.duration, 1e9):
        uv, uv_dot, _ = motion.at(t)
        assert (uv_dot == 0).all()
    assert_allclose(uv, there_and_back().uv[-1])


def test_a_turn_on_the_spot_takes_time_and_reverse_none() -> None:
    forth, reverse = there_and_back(1), there_and_back(-1)
    k = forth.breaks[0]
    assert forth.s[k] == forth.s[k - 1]
    turn = np.pi - abs(np.arctan2(0.3, 2) - np.arctan2(0.1, 2))
    by_hand = turn / LIMITS.turn_rate_radps + LIMITS.turn_rate_radps / 4.0
    assert forth.time[k] - forth.time[k - 1] == pytest.approx(by_hand, rel=1e-6)
    assert reverse.time[k] - reverse.time[k - 1] < 0.4
    assert reverse.speed[k:].max() == LIMITS.reverse_mps
    waits = forth.trajectory().at((forth.time[k] + forth.time[k - 1]) / 2)
    assert_allclose(waits[0], forth.uv[k])
    assert (waits[1] == 0).all()


def test_wishes_are_upper_bounds() -> None:
    uv = np.column_stack([np.linspace(300, 900, 13), np.full(13, 500.0)])
    wish = np.full(13, np.nan)
    wish[5:8] = 0.2
    for path in (
        path_through(FLOOR, uv, LIMITS, speed_mps=wish),
        smooth_sketch(FLOOR, uv, LIMITS, speed_mps=wish),
    ):
        slow = (path.uv[:, 0] >= 550) & (path.uv[:, 0] <= 650)
        assert path.speed[slow].max() <= 0.2 + 1e-12
        assert path.speed.max() == 0.5
    for bad in (0.0, [0.1] * 12):
        with pytest.raises(InputError, match="speed_mps"):
            path_through(FLOOR, uv, LIMITS, speed_mps=bad)
        with pytest.raises(InputError, match="speed_mps"):
            smooth_sketch(FLOOR, uv, LIMITS, speed_mps=bad)


def test_what_is_no_path_is_refused() -> None:
    uv = np.column_stack([np.linspace(300, 900, 4), np.full(4, 500.0)])
    with pytest.raises(InputError, match="four points"):
        path_through(FLOOR, uv[:3], LIMITS)
    with pytest.raises(InputError, match="horizon"):
        path_through(FLOOR, uv - [0, 5000.0], LIMITS)
    with pytest.raises(InputError, match="same"):
        path_through(FLOOR, uv[[0, 1, 1, 2]], LIMITS)
    path = path_through(FLOOR, uv, LIMITS)
    fields = {name: getattr(path, name) for name in ("theta", "curvature", "speed", "time")}
    with pytest.raises(InputError, match="decrease"):
        ImagePath(FLOOR, path.xy, path.s[::-1], **fields)
    with pytest.raises(InputError, match="run"):
        ImagePath(FLOOR, path.xy, path.s, **fields, breaks=(3,))


@pytest.mark.parametrize("closed", [False, True])
def test_splines_are_those_of_scipy(rng: np.random.Generator, closed: bool) -> None:
    from scipy.interpolate import CubicSpline  # type: ignore[import-untyped,unused-ignore]

    p = rng.normal(0, 1, (60, 2))
    if closed:
        p[-1] = p[0]
        theirs = CubicSpline(np.arange(60), p, bc_type="periodic")
        ours = slopes(p, closed=True)
    else:
        ours = slopes(p)
        theirs = CubicSpline(np.arange(60), p, bc_type=((1, ours[0]), (1, ours[-1])))
    t = rng.uniform(0, 59, 200)
    for k, values in enumerate(evaluate(p, ours, t)):
        assert_allclose(values, theirs(t, k), atol=1e-9)
    cubic = np.column_stack([np.arange(6.0) ** 3, 2 - np.arange(6.0) ** 2])
    assert_allclose(slopes(cubic)[[0, -1]], [[0, 0], [75, -10]], atol=1e-9)  # exact at the ends

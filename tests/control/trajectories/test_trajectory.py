"""Image trajectories: rates against finite differences, ground motion against a pinhole camera."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import Floor
from airground.control.trajectories.spline import SplineTrajectory, times_at_speed
from airground.control.trajectories.trajectory import (
    FunctionTrajectory,
    GroundEllipse,
    GroundTrajectory,
    ImageEllipse,
)
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import demo_world

if TYPE_CHECKING:
    from airground.control import ImageTrajectory

CAMERA = demo_world().camera
ORIGIN = np.array([0.0, 4.1])
FLOOR = Floor(LimitedHomography(CAMERA.g), CAMERA.project(ORIGIN))
CENTRE = CAMERA.project(ORIGIN)
POINTS = np.array([[300.0, 500.0], [500.0, 330.0], [800.0, 330.0], [900.0, 500.0]])


def spiral(t: float) -> tuple[list[float], list[float], list[float]]:
    return [0.3 * t, 0.1 * t**2], [0.3, 0.2 * t], [0.0, 0.2]


KINDS: dict[str, ImageTrajectory] = {
    "image ellipse": ImageEllipse(CENTRE, (200.0, 90.0), 20.0, 0.4, 1.0),
    "ground ellipse": GroundEllipse(FLOOR, CENTRE, (1.5, 0.8), -20.0, 0.4, 1.0),
    "ground": GroundTrajectory(FLOOR, spiral, 3.0),
    "function": FunctionTrajectory(lambda t: ([t**2, 3.0], [2 * t, 0.0], [2.0, 0.0]), 4.0),
    "spline": SplineTrajectory(POINTS, [0.0, 1.0, 3.0, 4.5]),  # type: ignore[arg-type]
    "closed spline": SplineTrajectory(POINTS, [0.0, 1, 3, 4.5, 6], closed=True),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("kind", KINDS)
def test_rates_are_derivatives(kind: str) -> None:
    trajectory = KINDS[kind]
    step = 1e-4
    for t in np.linspace(0.05, min(trajectory.duration, 12.0) - 0.05, 13):
        back, here, ahead = (trajectory.at(float(t + s * step)) for s in (-1, 0, 1))
        assert_allclose(here[1], (ahead[0] - back[0]) / (2 * step), rtol=1e-5, atol=1e-4)
        assert_allclose(here[2], (ahead[1] - back[1]) / (2 * step), rtol=1e-4, atol=0.05)


def test_an_ellipse_on_the_ground_is_one() -> None:
    ellipse = KINDS["ground ellipse"]
    xy = CAMERA.unproject([ellipse.at(t)[0] for t in np.linspace(0, 20, 50)]) - ORIGIN
    c, s = np.cos(0.4), np.sin(0.4)
    along, across = xy @ [c, s], xy @ [-s, c]
    assert_allclose((along / 1.5) ** 2 + (across / 0.8) ** 2, 1.0, atol=1e-9)
    assert xy[0, 0] * xy[1, 1] < xy[0, 1] * xy[1, 0]  # a negative period goes the other way


def test_motion_on_the_ground_is_seen() -> None:
    assert_allclose(KINDS["ground"].at(2.0)[0], CAMERA.project(ORIGIN + [0.6, 0.4]), atol=1e-6)


def test_a_spline_passes_its_points_and_rests_at_its_ends() -> None:
    spline = KINDS["spline"]
    for t, uv in zip([0.0, 1.0, 3.0, 4.5], POINTS, strict=True):
        assert_allclose(spline.at(t)[0], uv, atol=1e-9)
    for t in (0.0, 4.5, -1.0, 9.0):
        assert_allclose(spline.at(t)[1], 0.0, atol=1e-9)
    for t in (1.0, 3.0):
        assert_allclose(spline.at(t - 1e-9)[2], spline.at(t)[2], atol=1e-4)
    ring = KINDS["closed spline"]
    assert ring.duration == inf
    for there, here in zip(ring.at(7.3), ring.at(1.3), strict=True):
        assert_allclose(there, here, atol=1e-9)
    assert_allclose(ring.at(6 - 1e-9)[2], ring.at(6 + 1e-9)[2], atol=1e-4)  # smooth over the seam


def test_before_and_after_it_stands() -> None:
    twice = ImageEllipse(CENTRE, (200.0, 90.0), 10.0, turns=0.5)
    assert twice.duration == 5.0
    assert_allclose(twice.at(7.0)[0], CENTRE - [200.0, 0.0])
    for trajectory in (twice, KINDS["ground"], KINDS["function"]):
        for t in (-1.0, 50.0):
            assert not np.any(trajectory.at(t)[1:])


def test_times_give_a_speed_on_the_ground() -> None:
    legs = np.hypot(*np.diff(CAMERA.unproject(POINTS), axis=0).T)
    assert_allclose(np.diff(times_at_speed(FLOOR, POINTS, 0.25)), legs / 0.25)
    assert len(times_at_speed(FLOOR, POINTS, 0.25, closed=True)) == 5
    for points, speed in ((POINTS[[0, 0]], 0.2), (POINTS, 0.0), (POINTS * [1, -9], 0.2)):
        with pytest.raises(InputError):
            times_at_speed(FLOOR, points, speed)


def test_what_cannot_be_is_refused() -> None:
    for semi, period, turns in (((0.0, 1.0), 9.0, 1), ((1.0, 1.0), 0.0, 1), ((1.0, 1.0), 9.0, 0)):
        with pytest.raises(InputError):
            ImageEllipse(CENTRE, semi, period, turns=turns)
        with pytest.raises(InputError):
            GroundEllipse(FLOOR, CENTRE, semi, period, turns=turns)
    with pytest.raises(InputError, match="horizon"):
        GroundEllipse(FLOOR, np.array([640.0, -2000.0]), (1.0, 1.0), 9.0)
    for times in ([0.0, 1.0], [1.0, 2.0, 3.0, 4.0], [0.0, 2.0, 2.0, 4.0]):
        with pytest.raises(InputError, match="times_s"):
            SplineTrajectory(POINTS, np.array(times))
    with pytest.raises(InputError, match="1 points"):
        SplineTrajectory(POINTS[:1], np.zeros(1))
    with pytest.raises(InputError, match="duration"):
        FunctionTrajectory(lambda _: ([0, 0], [0, 0], [0, 0]), 0.0)
    with pytest.raises(InputError, match="period"):
        GroundTrajectory(FLOOR, spiral, period=-1.0)
    with pytest.raises(InputError, match="velocity"):
        FunctionTrajectory(lambda _: ([0, 0], [0], [0, 0]))

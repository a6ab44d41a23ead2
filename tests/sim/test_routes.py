"""Routes and the drives along them: exact, in the image, and at rest where the robot turns on the spot."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.sim.camera import SimCamera
from airground.sim.route_drive import RouteDrive, lap_time, place_route, speed_for
from airground.sim.routes import DRIVES, Route, polyline, route

SMOOTH = ("figure_eight", "circle", "quarter_circle", "straight")


def drive(shape: Route, **options: float) -> RouteDrive:
    return RouteDrive(shape, (1.0, -2.0), 1.7, 0.4, **options)


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("radius", [0.0, 0.15])
def test_the_drive_is_a_unicycles(name: str, radius: float) -> None:
    """Position from speed and heading by Simpson's rule, which is none of the code's formulas."""
    moving = drive(route(name, radius=radius))
    step = 1e-3
    t = np.arange(0.0, moving.total_s + 0.5, step)
    fine = moving.at(np.arange(2 * len(t) - 1) * step / 2)
    v = fine.speed[:, None] * np.column_stack([np.cos(fine.theta), np.sin(fine.theta)])
    steps = step / 6 * (v[:-1:2] + 4 * v[1::2] + v[2::2])
    assert_allclose(np.diff(fine.xy[::2], axis=0), steps, atol=2e-7)  # kinks of ramps and arcs
    way = step / 6 * (fine.speed[:-1:2] + 4 * fine.speed[1::2] + fine.speed[2::2])
    assert_allclose(np.diff(fine.way[::2]), way, atol=2e-7)
    assert (fine.speed >= 0).all()
    assert fine.speed.max() == pytest.approx(0.4)
    assert_allclose(fine.speed[[0, -1]], 0.0, atol=1e-9)
    assert np.abs(np.diff(fine.theta)).max() < 0.01  # no jump of the heading


@pytest.mark.parametrize("name", DRIVES)
def test_closed_routes_close_and_open_ones_come_back(name: str) -> None:
    shape = route(name, radius=0.1)
    xy, theta = shape.corners()
    if shape.closed:
        assert_allclose(xy[-1], xy[0], atol=1e-12)
        assert np.cos(theta[-1] - theta[0]) == pytest.approx(1.0)
    back, _ = shape.repeated(2).corners()
    assert_allclose(back[-1], back[0], atol=1e-12)
    assert_allclose(shape.repeated(3).lengths.sum(), 3 * shape.lengths.sum())


def test_shapes_have_the_headings_that_they_are_named_for() -> None:
    expected = {"rectangle": 4, "lawn_mower": 3, "eight_segments": 8, "triangle": 3, "straight": 1}
    for name, count in expected.items():
        shape = route(name)
        _, theta = shape.corners()
        along = theta[:-1][shape.lengths > 0]
        assert len(np.unique(np.round(np.exp(1j * along), 9))) == count
    _, theta = route("eight_segments").corners()
    assert_allclose(np.diff(theta[:-1:2]), np.pi / 6)  # paper, section 3.1
    assert route("circle").turns.sum() == pytest.approx(2 * np.pi)
    assert route("figure_eight").turns.sum() == pytest.approx(0.0)


def test_rounding_keeps_the_legs_and_needs_no_stop() -> None:
    sharp, round_ = (route("rectangle", radius=r) for r in (0.0, 0.2))
    assert (sharp.lengths == 0).sum() == 4
    assert (round_.lengths > 0).all()
    assert_allclose(round_.lengths[1::2] / round_.turns[1::2], 0.2)  # the radius asked for
    assert_allclose(np.ptp(round_.outline(), axis=0), [1.6, 1.0], atol=1e-9)


def test_the_robot_stands_while_it_turns_on_the_spot() -> None:
    moving = drive(polyline([[0, 0], [1, 0], [1, 1]]), turn_rate_radps=0.5)
    t = np.linspace(-1, moving.total_s + 1, 20_001)
    pose = moving.at(t)
    turning = np.abs(np.gradient(pose.theta, t)) > 1e-9
    assert (pose.speed[turning] < 1e-3).all()
    assert turning.mean() * np.ptp(t) == pytest.approx(np.pi / 2 / 0.5, abs=0.01)
    assert_allclose(
        pose.xy[turning] - [1.0, -2.0], np.tile([1.7, 0.0], (turning.sum(), 1)), atol=1e-3
    )


def test_turns_without_time_are_the_papers() -> None:
    moving = RouteDrive(route("eight_segments"), (0.0, 0.0), 0.6, 0.12, 0.0, np.inf)
    assert moving.total_s == pytest.approx(40.0)
    pose = moving.at(np.arange(0.0, 40.0, 0.01))
    assert_allclose(pose.speed, 0.12)


@pytest.mark.parametrize("name", [n for n in DRIVES if n not in SMOOTH])
def test_the_speed_for_a_time_takes_that_time(name: str) -> None:
    shape = route(name, radius=0.0)
    speed = speed_for(shape, 3.0, 60.0, 0.5, 1.0)
    assert lap_time(shape, 3.0, speed, 0.5, 1.0) == pytest.approx(60.0)
    with pytest.raises(InputError, match="too short"):
        speed_for(shape, 3.0, 1.0, 0.5, 1.0)


@pytest.mark.parametrize("tilt", [0, 30, 55, 70, 75])
@pytest.mark.parametrize("name", ["rectangle", "circle", "random_turns"])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_placed_route_fills_its_window_and_no_more(tilt: int, name: str, share: float) -> None:
    camera = SimCamera.looking_down(
        focal_length_px=1000.0,
        tilt_rad=np.radians(tilt),
        height_m=4.0,
        image_size_px=(1280, 720),
        heading_rad=0.7,
    )
    outline = route(name).outline()
    origin, scale = place_route(camera, outline, share)
    uv = camera.project(origin + scale * outline)
    window = share * (np.array([1280, 720]) - 1)
    assert (np.ptp(uv, axis=0) <= window * (1 + 1e-9)).all()
    assert camera.visible(origin + scale * outline).all()
    assert (np.ptp(uv, axis=0) / window).max() > 0.6
    larger = camera.project(origin + scale * (outline + 0.02 * (outline - outline.mean(axis=0))))
    off = np.abs(larger - (np.array([1280, 720]) - 1) / 2).max(axis=0)
    depth = camera.image_from_ground[2] @ np.vstack(
        [(origin + scale * outline).T, np.ones(len(outline))]
    )
    assert (off > window / 2 * 0.98).any() or depth.max() > 0.9 * 5 * depth.min() or tilt > 50


def test_what_cannot_be_driven_is_refused() -> None:
    with pytest.raises(InputError, match="drive must be one of rectangle"):
        route("spiral")
    with pytest.raises(InputError, match="negative"):
        Route(np.array([-1.0]), np.array([0.0]), closed=False)
    with pytest.raises(InputError, match="neighbours"):
        polyline([[0, 0], [0, 0]])
    with pytest.raises(InputError, match="positive"):
        RouteDrive(route("circle"), (0.0, 0.0), 1.0, 0.0)
    camera = SimCamera.looking_down(
        focal_length_px=500.0, tilt_rad=0.1, height_m=1.0, image_size_px=(64, 48)
    )
    with pytest.raises(InputError, match="share"):
        place_route(camera, route("circle").outline(), 1.5)

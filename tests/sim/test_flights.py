"""Camera paths: smooth, seeded, as strong as asked for, and looking where they should."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.sim.flights import Shake, fly_over, hover, orbit
from airground.sim.scene import CameraOfTime
from airground.sim.scene_camera import Pinhole
from airground.sim.scene_kinds import drone_scene

SIZE = (1280, 720)
BASE = Pinhole.looking_down(
    focal_length_px=1100.0, tilt_rad=0.6, height_m=12.0, image_size_px=SIZE, heading_rad=1.0
)
ORBIT = orbit(
    centre_m=(2.0, 3.0), radius_m=8.0, height_m=12.0, period_s=60.0, focal_length_px=1100.0,
    image_size_px=SIZE, seed=4, shake=Shake.none(),
)  # fmt: skip
OVER = fly_over(BASE, to_m=(20.0, 5.0), period_s=40.0, pause_s=3.0, shake=Shake.none())


def track(camera: CameraOfTime, t: np.ndarray, point: tuple[float, float, float]) -> np.ndarray:
    return np.array([camera(float(s)).project(point) for s in t])


def test_hovering_shakes_by_a_few_pixels_at_a_few_hertz() -> None:
    camera = hover(BASE, seed=1, shake=Shake(drift_deg=0.0, drift_m=0.0))
    t = np.arange(0, 60, 0.02)
    spot = (float(12 * np.tan(0.6) * np.cos(1.0)), float(12 * np.tan(0.6) * np.sin(1.0)), 0.0)
    uv = track(camera, t, spot)
    uv = uv - uv.mean(axis=0)
    assert (uv.std(axis=0) > 1.0).all()
    assert (uv.std(axis=0) < 8.0).all()
    power = np.abs(np.fft.rfft(uv[:, 1])) ** 2
    hz = np.fft.rfftfreq(len(t), 0.02)
    inside = power[(hz > 0.5) & (hz < 3.2)].sum() / power[1:].sum()
    assert inside > 0.95


def test_turns_have_the_strength_asked_for() -> None:
    shake = Shake(gust_deg=0.2, gust_m=0.0, drift_deg=0.0, drift_m=0.0)
    turns = []
    for seed in range(20):
        camera = hover(BASE, seed=seed, shake=shake)
        for t in np.arange(0, 20, 1.37):
            R = camera(float(t)).camera_from_world @ BASE.camera_from_world.T
            turns.append(np.degrees([R[2, 1], R[0, 2], R[1, 0]]))
    assert_allclose(np.std(turns, axis=0), 0.2, rtol=0.15)


@pytest.mark.parametrize(
    "camera", [hover(BASE, seed=3), ORBIT, OVER], ids=["hover", "orbit", "over"]
)
def test_flights_are_smooth_and_rigid(camera: CameraOfTime) -> None:
    t = np.arange(0, 42, 0.01)
    places = np.array([camera(float(s)).centre_m for s in t])
    speed = np.diff(places, axis=0) / 0.01
    assert np.abs(np.diff(speed, axis=0)).max() / 0.01 < 25  # m/s2
    R = camera(7.3).camera_from_world
    assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    assert (places[:, 2] > 10).all()


def test_a_flight_is_the_same_again_and_another_for_another_seed() -> None:
    one, same, other = hover(BASE, seed=3), hover(BASE, seed=3), hover(BASE, seed=4)
    assert np.array_equal(one(2.5).projection, same(2.5).projection)
    assert not np.allclose(one(2.5).projection, other(2.5).projection, rtol=1e-5)


def test_an_orbit_looks_at_its_centre() -> None:
    middle = (np.array(SIZE) - 1) / 2
    seen = track(ORBIT, np.arange(0, 60, 7.0), (2.0, 3.0, 0.0))
    assert np.abs(seen - middle).max() < 1e-6
    assert_allclose(ORBIT(15.0).centre_m, [10.0, 3.0, 12.0], atol=1e-9)  # a quarter on


def test_flying_over_leaves_the_first_view_and_comes_back() -> None:
    corners = BASE.plane().unproject([[0, 0], [1279, 0], [0, 719], [1279, 719]])
    inside = []
    for t in (0.0, 20.0, 40.0):
        uv = OVER(t).plane().project(corners)
        inside.append(((uv > -1) & (uv < SIZE)).all(axis=1).any())
    assert inside == [True, False, True]
    assert_allclose(OVER(20.0).centre_m - BASE.centre_m, [20.0, 5.0, 0.0], atol=1e-9)
    assert_allclose(OVER(1.0).projection, BASE.projection, atol=1e-9)  # pauses


@pytest.mark.parametrize("flight", ["hover", "orbit"])
def test_the_vehicle_stays_in_view(flight: str) -> None:
    scene = drone_scene(5, flight=flight)  # type: ignore[arg-type]
    assert all(scene.truth(float(t))[0].in_view for t in np.arange(0, 90, 2.3))


def test_impossible_flights_are_refused() -> None:
    with pytest.raises(InputError, match="period"):
        fly_over(BASE, to_m=(1, 0), period_s=4.0, pause_s=2.0)
    with pytest.raises(InputError, match="orbit"):
        orbit(
            centre_m=(0, 0),
            radius_m=-1,
            height_m=3,
            period_s=9,
            focal_length_px=9,
            image_size_px=SIZE,
        )

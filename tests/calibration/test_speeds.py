"""Ground velocity of every target, robots and third parties."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from airground.calibration import Calibration, Tracks, calibrate, measure_speeds
from airground.errors import InputError
from drives import fit_drive, read, see
from scenes import scene

SCENE = scene(tilt_deg=40)
DRIVE = fit_drive(SCENE)
T = np.arange(0, 60, 1 / 30)


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return calibrate(
        see(SCENE, DRIVE, T),
        read(DRIVE, np.arange(-1, 61, 0.05)),
        time_offset_s=0.0,
        speed_scale_sigma=0.0,
    )


def test_a_third_party_is_measured(calibration: Calibration) -> None:
    cart = fit_drive(SCENE, period=27.0, ratio=3)
    speeds = measure_speeds(calibration, see(SCENE, cart, T, target="cart"))
    assert len(speeds.t) == len(T)
    error = np.linalg.norm(speeds.xy_dot - cart.xy_dot(speeds.t), axis=1)
    speed = np.linalg.norm(cart.xy_dot(speeds.t), axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.01 * speed.mean()
    np.testing.assert_array_equal(speeds.uv, see(SCENE, cart, T).uv)  # sightings as they were


def test_deviation_is_that_of_the_errors(
    calibration: Calibration, rng: np.random.Generator
) -> None:
    exact = dataclasses.replace(calibration, covariance=np.zeros((6, 6)))
    tracks = see(SCENE, DRIVE, T, noise=1.0, rng=rng)
    speeds = measure_speeds(exact, tracks)
    truth = np.linalg.norm(DRIVE.xy_dot(speeds.t), axis=1)
    ratio = (speeds.speed - truth) / speeds.speed_sigma
    assert 0.8 < np.std(ratio) < 1.3
    assert 0.90 < np.mean(np.abs(ratio) < 1.96) <= 0.99


def test_calibration_uncertainty_is_in_it(calibration: Calibration) -> None:
    tracks = see(SCENE, DRIVE, T)
    g = calibration.model.g.ravel()
    unsure = dataclasses.replace(calibration, covariance=0.02**2 * np.outer(g, g))
    sharp = dataclasses.replace(calibration, covariance=np.zeros((6, 6)))
    wide, narrow = measure_speeds(unsure, tracks), measure_speeds(sharp, tracks)
    fast = narrow.speed > 0.5 * narrow.speed.max()
    # A scale error of g of 2 % is one of 6 % in speed (eq. 15 is cubic in g).
    np.testing.assert_allclose(wide.speed_sigma[fast] / wide.speed[fast], 0.06, rtol=0.02)


def test_stated_pixel_noise_is_used(calibration: Calibration) -> None:
    plain = see(SCENE, DRIVE, T)
    coarse = dataclasses.replace(plain, sigma=np.full(len(plain), 2.0))
    finer = dataclasses.replace(plain, sigma=np.full(len(plain), 1.9999))
    exact = dataclasses.replace(calibration, covariance=np.zeros((6, 6)))
    a, b = measure_speeds(exact, coarse), measure_speeds(exact, finer)
    np.testing.assert_allclose(a.speed_sigma / b.speed_sigma, 2 / 1.9999, rtol=1e-6)


def test_lonely_sightings_and_sky_are_left_out_and_counted(calibration: Calibration) -> None:
    a, b, c = calibration.model.horizon * np.sign(calibration.model.nearness(calibration.origin_px))
    foot = -c * np.array([a, b]) / (a * a + b * b)
    sky = foot - 50 * np.array([a, b]) / np.hypot(a, b)
    t = np.concatenate([T[:20], [500.0], T[:5]])
    uv = np.concatenate(
        [see(SCENE, DRIVE, T[:20]).uv, [[600.0, 500.0]], sky + np.arange(5)[:, None] * [0.1, 0.0]]
    )
    names = ["robot"] * 20 + ["ghost"] + ["bird"] * 5
    speeds = measure_speeds(calibration, Tracks.from_rows(t, names, uv))
    assert (len(speeds.t), speeds.lonely, speeds.beyond) == (20, 1, 5)
    assert np.isfinite(speeds.xy_dot).all()
    assert np.isfinite(speeds.speed_sigma).all()
    assert [row["target"] for row in speeds.by_target()] == ["robot"]


def test_a_gap_is_not_bridged(calibration: Calibration) -> None:
    t = np.concatenate([T[:60], T[600:660]])
    speeds = measure_speeds(calibration, see(SCENE, DRIVE, t))
    error = np.linalg.norm(speeds.xy_dot - DRIVE.xy_dot(speeds.t), axis=1)
    assert error.max() < 0.02 * np.linalg.norm(DRIVE.xy_dot(t), axis=1).max()


def test_two_sightings_are_enough_and_their_noise_is_assumed(calibration: Calibration) -> None:
    speeds = measure_speeds(calibration, see(SCENE, DRIVE, T[:2]))
    assert len(speeds.t) == 2
    assert speeds.assumed_noise == ("robot",)
    assert (speeds.speed_sigma > 0).all()


def test_a_target_that_stands_has_speed_zero_and_a_deviation(calibration: Calibration) -> None:
    t = T[:100]
    speeds = measure_speeds(
        calibration, Tracks.from_rows(t, ["box"] * 100, np.tile([600.0, 500.0], (100, 1)))
    )
    assert (speeds.speed == 0).all()
    assert np.isfinite(speeds.speed_sigma).all()
    # One pixel in any window, over 0.4 s at most: sightings that do not change at all hide their noise.
    assert speeds.assumed_noise == ("box",)
    metre = calibration.model.pixels_per_metre([600.0, 500.0]).max()
    assert (speeds.speed_sigma > 0.1 / metre).all()


def test_two_sightings_far_apart_do_not_make_a_speed(calibration: Calibration) -> None:
    t = np.concatenate([T[:60], [0.0, 50.0]])
    uv = np.concatenate([see(SCENE, DRIVE, T[:60]).uv, [[600.0, 500.0], [700.0, 500.0]]])
    names = ["robot"] * 60 + ["cart"] * 2
    speeds = measure_speeds(calibration, Tracks.from_rows(t, names, uv))
    assert (len(speeds.t), speeds.lonely) == (60, 2)
    # In a file of slow sightings, the same two are neighbours.
    slow = np.concatenate([np.arange(60) * 50.0, [0.0, 50.0]])
    assert measure_speeds(calibration, Tracks.from_rows(slow, names, uv)).lonely == 0


@pytest.mark.parametrize("below", [1e-13, 1e-10, 1e-6])
def test_just_below_the_horizon_a_speed_is_anything(calibration: Calibration, below: float) -> None:
    a, b, c = calibration.model.horizon
    side = np.sign(calibration.model.nearness(calibration.origin_px))
    u = np.linspace(300.0, 500.0, 20)
    uv = np.column_stack([u, -(a * u + c) / b + np.sign(b) * side * below])
    uv = uv[calibration.is_ground(uv)]  # rounding may take some beyond
    speeds = measure_speeds(calibration, Tracks.from_rows(T[: len(uv)], ["bird"] * len(uv), uv))
    assert len(speeds.t) > 0
    assert (speeds.speed_sigma > 1e3).all()


@pytest.mark.parametrize(("column", "value"), [("uv", 1e200), ("t", 1e200), ("sigma", 1e200)])
def test_numbers_too_large_to_compute_with(
    calibration: Calibration, column: str, value: float
) -> None:
    seen = see(SCENE, DRIVE, T)
    columns = {"t": seen.t.copy(), "uv": seen.uv.copy(), "sigma": np.ones(len(T))}
    columns[column][-1] = value
    tracks = Tracks.from_rows(columns["t"], ["robot"] * len(T), columns["uv"], columns["sigma"])
    with pytest.raises(InputError, match=rf"tracks, {column}: found 1e\+200"):
        measure_speeds(calibration, tracks)


def test_times_too_close_to_compute_with(calibration: Calibration) -> None:
    tracks = see(SCENE, DRIVE, T)
    t = np.array(tracks.t)
    t[1] = t[0] + 1e-200
    with pytest.raises(InputError, match="two times of a target are 1e-200 s apart"):
        measure_speeds(calibration, dataclasses.replace(tracks, t=t))

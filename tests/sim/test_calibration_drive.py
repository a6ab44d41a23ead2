"""The drive of the embedded world: it is in view, it is a unicycle's, and its noise is what was asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration import MotionSamples, estimate_linear
from airground.errors import InputError
from airground.geometry import n_error
from airground.sim import DriveNoise, calibration_drive, demo_world, drive_eight

WORLD = demo_world()
SILENT = DriveNoise(
    pixel_px=0.0, heading_rad=0.0, speed_mps=0.0, slip=0.0, distance_m_per_sqrt_m=0.0
)


def test_the_robot_stays_in_view_with_a_margin() -> None:
    path = drive_eight(WORLD.path, 300.0)
    assert WORLD.camera.visible(path.xy, margin_px=60).all()
    uv = WORLD.camera.project(path.xy)
    extent = (uv.max(axis=0) - uv.min(axis=0)) / WORLD.image_size_px
    assert (extent > 0.5).all()  # and fills it, so that calibration can see perspective


def test_the_path_is_a_unicycles() -> None:
    path = drive_eight(WORLD.path, 75.0)
    steps, dt = np.diff(path.xy, axis=0), np.diff(path.t)
    middle = (path.theta[1:] + path.theta[:-1]) / 2
    along = steps[:, 0] * np.cos(middle) + steps[:, 1] * np.sin(middle)
    across = -steps[:, 0] * np.sin(middle) + steps[:, 1] * np.cos(middle)
    assert np.abs(across).max() < 1e-12  # it cannot slide sideways
    assert_allclose(along / dt, WORLD.path.speed_mps, rtol=1e-5)
    assert_allclose(np.diff(path.way) / dt, WORLD.path.speed_mps, rtol=1e-9)
    assert np.abs(np.diff(path.theta) / dt).max() < 1.2  # a turn rate that a robot can do


def test_the_path_is_the_figure_eight() -> None:
    path = drive_eight(WORLD.path, 300.0)
    x, y = ((path.xy - WORLD.path.centre_m) / WORLD.path.half_size_m).T
    # sin(2 phi)^2 = 4 sin(phi)^2 (1 - sin(phi)^2)
    assert np.abs(y**2 - 4 * x**2 * (1 - x**2)).max() < 5e-3
    assert x.min() == pytest.approx(-1, abs=1e-3)
    assert y.max() == pytest.approx(1, abs=1e-3)


def test_same_seed_same_recording_other_seed_another() -> None:
    a, b, c = (
        calibration_drive(WORLD, np.random.default_rng(seed), duration_s=5.0) for seed in (1, 1, 2)
    )
    assert np.array_equal(a.tracks.uv, b.tracks.uv)
    assert np.array_equal(a.motion.distance, b.motion.distance)  # type: ignore[arg-type]
    assert not np.array_equal(a.tracks.uv, c.tracks.uv)
    assert not np.array_equal(a.motion.heading, c.motion.heading)  # type: ignore[arg-type]
    assert np.array_equal(a.path.xy, c.path.xy)


def test_rates_targets_and_clock(rng: np.random.Generator) -> None:
    noise = DriveNoise(tracks_hz=25.0, motion_hz=10.0, time_offset_s=0.3)
    drive = calibration_drive(WORLD, rng, duration_s=45.0, noise=noise)
    assert drive.tracks.targets == ("robot", "cart")
    assert drive.motion.targets == ("robot",)
    robot = drive.tracks.t[drive.tracks.rows("robot")]
    assert len(robot) == 1126  # every frame, so it was always seen
    assert_allclose(np.diff(robot), 0.04)
    assert_allclose(drive.motion.t[[0, -1]], [0.3, 45.3])
    assert_allclose(np.diff(drive.motion.t), 0.1)


def test_without_noise_the_recording_is_the_truth(rng: np.random.Generator) -> None:
    drive = calibration_drive(WORLD, rng, duration_s=40.0, noise=SILENT)
    rows = drive.tracks.rows("robot")
    xy, _, _ = drive.path.at(drive.tracks.t[rows])
    assert_allclose(drive.tracks.uv[rows], WORLD.camera.project(xy), atol=1e-9)
    _, theta, way = drive.path.at(drive.motion.t)
    assert drive.motion.distance is not None
    assert drive.motion.heading is not None
    assert_allclose(drive.motion.distance, way, atol=1e-9)
    assert_allclose(np.cos(drive.motion.heading - theta), 1.0, atol=1e-12)
    assert drive.tracks.sigma is None


def test_noise_is_as_large_as_asked_for(rng: np.random.Generator) -> None:
    noise = DriveNoise(pixel_px=2.0, heading_rad=0.03, speed_mps=0.05, slip=0.0)
    drive = calibration_drive(WORLD, rng, duration_s=120.0, noise=noise)
    rows = drive.tracks.rows("robot")
    off = drive.tracks.uv[rows] - WORLD.camera.project(drive.path.at(drive.tracks.t[rows])[0])
    assert_allclose(off.std(axis=0), 2.0, rtol=0.06)
    assert abs(np.corrcoef(off[1:, 0], off[:-1, 0])[0, 1]) < 0.06  # white
    _, theta, _ = drive.path.at(drive.motion.t)
    assert drive.motion.heading is not None
    assert drive.motion.speed is not None
    assert np.angle(np.exp(1j * (drive.motion.heading - theta))).std() == pytest.approx(
        0.03, rel=0.1
    )
    assert (drive.motion.speed - 0.3).std() == pytest.approx(0.05, rel=0.1)


def test_slip_changes_slowly_and_is_in_speed_and_distance(rng: np.random.Generator) -> None:
    noise = replace(SILENT, slip=0.1, slip_s=4.0)
    slips = []
    for _ in range(40):
        drive = calibration_drive(WORLD, rng, duration_s=60.0, noise=noise)
        assert drive.motion.speed is not None
        assert drive.motion.distance is not None
        slip = drive.motion.speed / 0.3 - 1
        counted = np.diff(drive.motion.distance) / (0.3 / noise.motion_hz) - 1
        assert_allclose(counted, (slip[1:] + slip[:-1]) / 2, atol=1e-5)
        slips.append(slip)
    s = np.array(slips)
    assert s.std() == pytest.approx(0.1, rel=0.15)
    lag = round(4.0 * noise.motion_hz)
    assert np.mean(s[:, lag:] * s[:, :-lag]) / s.var() == pytest.approx(np.exp(-1), abs=0.12)
    assert s[:, 0].std() == pytest.approx(0.1, rel=0.4)  # from the start


def test_the_carts_true_speed_can_be_read_off_the_floor(rng: np.random.Generator) -> None:
    drive = calibration_drive(WORLD, rng, noise=SILENT)
    rows = drive.tracks.rows(drive.cart)
    assert drive.cart not in drive.motion.targets
    assert 50 < rows.stop - rows.start < 75 * 30  # drives in and out again
    xy = WORLD.camera.unproject(drive.tracks.uv[rows])
    velocity = (xy[-1] - xy[0]) / (drive.tracks.t[rows][-1] - drive.tracks.t[rows][0])
    assert_allclose(velocity, drive.cart_xy_dot, rtol=1e-9)
    assert np.linalg.norm(drive.cart_xy_dot) == pytest.approx(WORLD.cart.speed_mps)


def test_the_recording_calibrates_the_camera_that_made_it(rng: np.random.Generator) -> None:
    """Central differences of noise-free tracks, with the readings: another way to the same g."""
    noise = replace(SILENT, tracks_hz=20.0)
    drive = calibration_drive(WORLD, rng, noise=noise)
    rows = drive.tracks.rows("robot")
    uv, t = drive.tracks.uv[rows], drive.tracks.t[rows]
    assert drive.motion.heading is not None
    assert drive.motion.speed is not None
    heading, speed = drive.motion.heading, drive.motion.speed
    samples = MotionSamples(
        uv[1:-1],
        (uv[2:] - uv[:-2]) / (t[2:] - t[:-2])[:, None],
        (speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)]))[1:-1],
    )
    assert n_error(WORLD.camera.g, estimate_linear(samples)) < 2e-3


def test_what_cannot_be_recorded_is_refused(rng: np.random.Generator) -> None:
    with pytest.raises(InputError, match="duration_s"):
        calibration_drive(WORLD, rng, duration_s=0.5)
    with pytest.raises(InputError, match="positive"):
        DriveNoise(tracks_hz=0.0)
    lost = replace(WORLD, path=replace(WORLD.path, centre_m=(0.0, -50.0)))
    with pytest.raises(InputError, match="view"):
        calibration_drive(lost, rng, duration_s=5.0)

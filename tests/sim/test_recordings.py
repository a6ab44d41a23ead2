"""Seeded recordings: true without noise, and each fault is there, of the size asked for, and in the truth."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.geometry import n_error
from airground.sim.recording_noise import RecordingNoise
from airground.sim.recordings import Recording, RecordingPlan, distort, record
from airground.sim.routes import DRIVES

PLAN = RecordingPlan()
LONG = RecordingPlan(duration_s=400.0, laps=10)


def straight_path(recording: Recording) -> np.ndarray:
    """Readings integrated by the trapezoid rule, on the clock of the tracks, at the sightings of the first robot."""
    motion, truth = recording.motion, recording.truth
    rows = motion.rows("robot-1")
    t = motion.t[rows] - truth.noise.time_offset_s
    if motion.xy_dot is not None:
        v = motion.xy_dot[rows]
    else:
        assert motion.heading is not None
        heading = np.unwrap(motion.heading[rows])
        if motion.speed is not None:
            speed = motion.speed[rows]
        else:
            assert motion.distance is not None
            speed = np.gradient(motion.distance[rows], t)
        v = speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    steps = np.diff(t)[:, None] * (v[1:] + v[:-1]) / 2
    xy = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    seen = recording.tracks.t[recording.tracks.rows("robot-1")]
    return np.column_stack([np.interp(seen, t, a) for a in xy.T])


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("tilt", [0.0, 40.0, 75.0])
def test_without_noise_everything_is_true_and_in_the_image(drive: str, tilt: float) -> None:
    found = record(replace(PLAN, drive=drive, tilt_deg=tilt))
    tracks, truth = found.tracks, found.truth
    assert len(tracks) == 1201  # every frame of 40 s at 30 Hz
    assert_allclose(tracks.uv, truth.camera.project(truth.xy), atol=1e-9)
    assert truth.camera.visible(truth.xy, margin_px=30).all()
    integrated = straight_path(found)
    off = integrated - truth.xy
    # The rule's own error: kinks of the speed, and chords of arcs, at 30 Hz.
    assert np.abs(off - off[0]).max() < 2e-3 * np.ptp(truth.xy, axis=0).max()
    assert not truth.wrong.any()
    camera = truth.camera.image_from_ground
    assert n_error(truth.g, camera[:, :2] / np.cbrt(np.linalg.det(camera))) < 1e-12


@pytest.mark.parametrize("reading", ["speed", "distance", "xy_dot"])
def test_all_forms_of_readings_tell_the_same_way(
    reading: Literal["speed", "distance", "xy_dot"],
) -> None:
    plan = replace(PLAN, reading=reading, corner_radius=0.2, drive="rectangle")
    found = record(plan, RecordingNoise(motion_hz=50.0, time_offset_s=0.3))
    off = straight_path(found) - found.truth.xy
    assert np.abs(off - off[0]).max() < 5e-3
    assert found.motion.t[0] == pytest.approx(-0.7)  # a second of standing, and the clock


def test_same_seed_same_recording_other_seed_another() -> None:
    noise = RecordingNoise(pixel_px=1.0, speed_share=0.05, heading_rad=0.02, slip=0.02)
    a, b, c = (record(PLAN, noise, seed=k) for k in (1, 1, 2))
    assert np.array_equal(a.tracks.uv, b.tracks.uv)
    assert np.array_equal(a.motion.speed, b.motion.speed)  # type: ignore[arg-type]
    assert not np.array_equal(a.tracks.uv, c.tracks.uv)
    assert not np.array_equal(a.motion.heading, c.motion.heading)  # type: ignore[arg-type]


def test_white_noise_is_as_large_as_asked_for() -> None:
    noise = RecordingNoise(
        pixel_px=2.0, speed_mps=0.03, speed_share=0.1, heading_rad=0.04, states_sigma=True
    )
    found = record(LONG, noise)
    truth, motion = found.truth, found.motion
    off = found.tracks.uv - truth.camera.project(truth.xy)
    assert_allclose(off.std(axis=0), 2.0, rtol=0.03)
    assert motion.speed is not None
    assert motion.heading is not None
    assert motion.sigma_speed is not None
    wrong = motion.speed - truth.read.speed
    assert wrong.std() == pytest.approx(motion.sigma_speed[0], rel=0.03)
    assert abs(np.corrcoef(wrong[1:], wrong[:-1])[0, 1]) < 0.03
    turn = np.angle(np.exp(1j * (motion.heading - truth.read.theta)))
    assert turn.std() == pytest.approx(0.04, rel=0.03)
    assert found.tracks.sigma is not None
    assert found.tracks.sigma[0] == 2.0


def test_the_odometer_is_the_integral_of_the_noisy_speed() -> None:
    noise = RecordingNoise(speed_mps=0.05, slip=0.03, speed_scale=1.04)
    plan = replace(PLAN, drive="circle")
    speed = record(plan, noise).motion
    way = record(replace(plan, reading="distance"), noise).motion
    assert speed.speed is not None
    assert way.distance is not None
    steps = np.diff(speed.t) * (speed.speed[1:] + speed.speed[:-1]) / 2
    assert_allclose(np.diff(way.distance), steps, atol=1e-4)  # the ramps at both ends


def test_slip_and_drift_are_slow() -> None:
    noise = RecordingNoise(motion_hz=20.0, slip=0.1, slip_s=4.0, heading_drift=0.02)
    slips, ends = [], []
    for seed in range(40):
        truth = record(replace(PLAN, duration_s=60.0), noise, seed=seed).truth
        slips.append(truth.slip)
        ends.append(truth.drift[-1])
    s = np.array(slips)
    assert s.std() == pytest.approx(0.1, rel=0.1)
    assert np.mean(s[:, 80:] * s[:, :-80]) / s.var() == pytest.approx(np.exp(-1), abs=0.1)
    assert s[:, 0].std() == pytest.approx(0.1, rel=0.4)
    assert np.std(ends) == pytest.approx(0.02 * np.sqrt(62.0), rel=0.4)


def test_bias_scale_lever_and_several_robots() -> None:
    plan = replace(PLAN, robots=3, drive="rectangle", corner_radius=0.2)
    noise = RecordingNoise(
        heading_bias_rad=(0.0, 0.7, -2.0), speed_scale=(1.0, 1.05), lever_m=(0.2, -0.1)
    )
    found = record(plan, noise)
    truth, motion = found.truth, found.motion
    assert motion.targets == ("robot-1", "robot-2", "robot-3")
    assert motion.heading is not None
    assert motion.speed is not None
    for k, (bias, scale) in enumerate([(0.0, 1.0), (0.7, 1.05), (-2.0, 1.0)]):
        rows = motion.rows(f"robot-{k + 1}")
        turn = motion.heading[rows] - truth.read.theta[rows] - bias
        assert_allclose(np.cos(turn), 1.0, atol=1e-12)
        assert_allclose(motion.speed[rows], scale * truth.read.speed[rows])
    off = truth.xy - truth.axle.xy
    forward = np.column_stack([np.cos(truth.axle.theta), np.sin(truth.axle.theta)])
    assert_allclose(np.sum(off * forward, axis=1), 0.2)
    assert_allclose(off[:, 1] * forward[:, 0] - off[:, 0] * forward[:, 1], -0.1)
    first = truth.axle.xy[found.tracks.rows("robot-1")]
    second = truth.axle.xy[found.tracks.rows("robot-2")]
    assert np.linalg.norm(first - second, axis=1).min() > 0.1  # they do not drive as one


def test_the_lens_solves_its_own_equation() -> None:
    noise = RecordingNoise(lens_k1=-0.08, lens_centre_px=(600.0, 380.0))
    found = record(PLAN, noise)
    truth, centre = found.truth, np.array([600.0, 380.0])
    d = found.tracks.uv - centre
    radius2 = np.sum(d**2, axis=1, keepdims=True) / ((1280**2 + 720**2) / 4)
    assert_allclose(centre + d / (1 - 0.08 * radius2), truth.camera.project(truth.xy), atol=1e-8)
    bent = np.linalg.norm(found.tracks.uv - truth.camera.project(truth.xy), axis=1)
    assert 5 < bent.max() < 60
    assert np.isnan(distort(np.array([900.0, 0.0]), 1e-6, np.zeros(2))).all()  # no such point


def test_gross_faults_are_in_the_truth() -> None:
    noise = RecordingNoise(pixel_px=0.5, outlier_share=0.2, duplicate_share=0.1)
    found = record(LONG, noise)
    truth = found.truth
    off = np.linalg.norm(found.tracks.uv - truth.camera.project(truth.xy), axis=1)
    assert truth.wrong.mean() == pytest.approx(1 - 0.8 * 0.9, abs=0.02)
    assert (off[~truth.wrong] < 4).all()
    same = (np.diff(found.tracks.uv, axis=0) == 0).all(axis=1)
    assert same.mean() == pytest.approx(0.1, abs=0.01)
    assert found.tracks.uv.min() >= -0.5


def test_dropouts_come_in_stretches() -> None:
    found = record(LONG, RecordingNoise(dropout_share=0.3, dropout_s=1.0))
    assert len(found.tracks) / 12_001 == pytest.approx(0.7, abs=0.07)
    gaps = np.diff(found.tracks.t)
    assert gaps[gaps > 0.04].mean() == pytest.approx(1.0, rel=0.25)


def test_swapped_names_a_stuck_odometer_and_whole_pixels() -> None:
    plan = replace(PLAN, robots=2, reading="distance")
    found = record(
        plan, RecordingNoise(swapped_s=(10.0, 15.0), stuck_s=(20.0, 25.0), whole_pixels=True)
    )
    tracks, truth, motion = found.tracks, found.truth, found.motion
    swapped = (tracks.t >= 10.0) & (tracks.t < 15.0)
    assert np.array_equal(truth.robot != tracks.target_index, swapped)
    assert np.array_equal(truth.wrong, swapped)
    assert_allclose(tracks.uv, np.rint(truth.camera.project(truth.xy)))
    assert motion.distance is not None
    steps = np.diff(motion.distance)
    middle = (motion.t[1:] + motion.t[:-1]) / 2
    stuck, edge = (middle > 20.0) & (middle < 25.0), np.isin(np.rint(middle * 10), (200, 250))
    first = np.diff(motion.target_index) + motion.target_index[:-1] == 0
    assert (steps[first & stuck & ~edge] == 0).all()
    assert (steps[first & ~stuck & ~edge & (middle > 5) & (middle < 35)] > 0).all()


def test_speed_and_duration_can_be_given() -> None:
    found = record(replace(PLAN, speed_mps=0.5, duration_s=None, laps=2))
    assert found.truth.axle.speed.max() == pytest.approx(0.5)
    assert found.truth.axle.way[-1] == pytest.approx(
        2 * 4 * np.pi * found.truth.drive.scale_m, rel=1e-2
    )
    found = record(replace(PLAN, speed_mps=2.0, duration_s=100.0))
    assert found.truth.axle.way[-1] == pytest.approx(200.0, rel=0.01)
    with pytest.raises(InputError, match="duration_s"):
        record(replace(PLAN, duration_s=None))


def test_an_hour_is_recorded_in_seconds() -> None:
    noise = RecordingNoise(
        pixel_px=1.0, speed_share=0.1, slip=0.02, heading_drift=1e-3, outlier_share=0.1,
        dropout_share=0.01, lens_k1=-0.05,
    )  # fmt: skip
    started = time.perf_counter()
    found = record(RecordingPlan(drive="rectangle", duration_s=4000.0, laps=100), noise)
    assert len(found.tracks) > 110_000
    assert time.perf_counter() - started < 5.0  # 0.4 s on two slow cores; the rest is for busy ones


def test_what_cannot_be_recorded_is_refused() -> None:
    with pytest.raises(InputError, match="tracks_hz"):
        RecordingNoise(tracks_hz=0.0)
    with pytest.raises(InputError, match="pixel_px"):
        RecordingNoise(pixel_px=-1.0)
    with pytest.raises(InputError, match="outlier_share"):
        RecordingNoise(outlier_share=1.0)
    with pytest.raises(InputError, match="reading"):
        RecordingPlan(reading="pose")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="robots"):
        RecordingPlan(robots=0)

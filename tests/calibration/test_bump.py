"""A camera that is knocked is noticed, and nothing else is taken for it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.calibration.bump import BumpMonitor
from airground.calibration.online import OnlineCalibrator
from airground.calibration.online_rows import Outcome
from airground.calibration.online_state import OnlineOptions
from airground.calibration.online_strays import Strays
from airground.sim.recordings import Recording, RecordingNoise, RecordingPlan, record
from online_feed import feed

if TYPE_CHECKING:
    from scenes import Array

NOISE = RecordingNoise(
    tracks_hz=10.0, motion_hz=20.0, pixel_px=1.0, speed_share=0.04, heading_rad=0.04
)
BUMP_S = 40.0
FOCAL = 1000.0  # px; of the simulated camera


def turned(axis: str, angle_deg: float) -> Array:
    """(3, 3). Where the image goes when the camera turns by an angle: K R K^-1."""
    a = np.radians(angle_deg)
    c, s = np.cos(a), np.sin(a)
    R = {
        "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }[axis]
    K = np.array([[FOCAL, 0, 639.5], [0, FOCAL, 359.5], [0, 0, 1.0]])
    return np.asarray(K @ np.array(R) @ np.linalg.inv(K))


def knocked(recording: Recording, H: Array, when: float) -> Recording:
    tracks = recording.tracks
    w = np.column_stack([tracks.uv, np.ones(len(tracks))]) @ H.T
    uv = np.where((tracks.t > when)[:, None], w[:, :2] / w[:, 2:], tracks.uv)
    return replace(recording, tracks=replace(tracks, uv=uv))


def drive(
    rng: np.random.Generator, *, robots: int, duration_s: float, **noise: object
) -> Recording:
    plan = RecordingPlan(drive="figure_eight", robots=robots, share=0.6, speed_mps=0.4)
    return record(
        replace(plan, duration_s=duration_s),
        replace(NOISE, **noise),  # type: ignore[arg-type]
        seed=rng,
    )


@pytest.mark.parametrize(("axis", "angle_deg"), [("x", 1.0), ("y", 3.0), ("z", 10.0)])
def test_a_knock_is_seen_within_a_second(
    axis: str, angle_deg: float, rng: np.random.Generator
) -> None:
    recording = drive(rng, robots=3, duration_s=75.0, outlier_share=0.03)
    H = turned(axis, angle_deg)
    recording = knocked(recording, H, BUMP_S)
    calibrator = OnlineCalibrator(OnlineOptions(speed_scale_sigma=0.0))
    feed(calibrator, recording.tracks, recording.motion, until=BUMP_S + 0.9)
    (bump,) = [event for event in calibrator.events if event.kind == "bumped"]
    assert BUMP_S < bump.noticed_s < BUMP_S + 0.9
    assert BUMP_S - 0.2 < bump.t_s < BUMP_S + 0.5
    phases = [calibrator.state.phase]
    assert calibrator.calibration() is None  # what was known is void, and is not given away

    feed(calibrator, recording.tracks, recording.motion, after=BUMP_S + 0.9)
    phases.append(calibrator.state.phase)
    assert phases == ["bumped", "running"]
    found = calibrator.calibration()
    assert found is not None
    g = H @ recording.truth.g / np.cbrt(np.linalg.det(H))
    e = (found.model.g - g).ravel()
    size = np.sqrt(np.diag(found.covariance))
    C = found.covariance / np.outer(size, size)
    assert e / size @ np.linalg.solve(C, e / size) < 40.0  # only data from after it are in it


def test_one_robot_that_slips_or_stands_is_not_a_knock(rng: np.random.Generator) -> None:
    recording = drive(rng, robots=3, duration_s=60.0, stuck_s=(30.0, 40.0), outlier_share=0.05)
    motion = recording.motion
    assert motion.speed is not None
    slips = (motion.target_index == 1) & (motion.t > 45.0) & (motion.t < 55.0)
    motion = replace(motion, speed=np.where(slips, 1.3 * motion.speed, motion.speed))
    calibrator = OnlineCalibrator()
    feed(calibrator, recording.tracks, motion)
    assert {event.kind for event in calibrator.events} == {"started"}


def test_a_robot_alone_that_jumps_is_doubted_and_found_again(rng: np.random.Generator) -> None:
    recording = drive(rng, robots=1, duration_s=80.0)
    H = turned("y", 2.0)
    recording = knocked(recording, H, BUMP_S)
    calibrator = OnlineCalibrator(OnlineOptions(speed_scale_sigma=0.0))
    feed(calibrator, recording.tracks, recording.motion, until=BUMP_S - 1.0)
    before = calibrator.state.relative_sigma
    feed(calibrator, recording.tracks, recording.motion, after=BUMP_S - 1.0, until=BUMP_S + 1.5)
    assert [event.kind for event in calibrator.events][1] in ("doubted", "bumped")
    assert calibrator.state.relative_sigma > 5 * before
    feed(calibrator, recording.tracks, recording.motion, after=BUMP_S + 1.5)
    found = calibrator.calibration()
    assert found is not None
    g = H @ recording.truth.g / np.cbrt(np.linalg.det(H))
    assert np.linalg.norm(found.model.g - g) < 0.03 * np.linalg.norm(g)


def test_an_hour_of_clean_driving_raises_no_alarm(rng: np.random.Generator) -> None:
    recording = record(
        RecordingPlan(drive="figure_eight", duration_s=3600.0, speed_mps=0.3),
        replace(NOISE, tracks_hz=3.0, motion_hz=6.0, outlier_share=0.02),
        seed=rng,
    )
    calibrator = OnlineCalibrator(OnlineOptions(speed_noise=0.017, heading_noise=0.017))
    feed(calibrator, recording.tracks, recording.motion)
    assert [event.kind for event in calibrator.events] == ["started"]


def test_the_monitor_knows_noise_from_a_shift(rng: np.random.Generator) -> None:
    """Scores as the model has them raise nothing; the same with a small common shift do."""
    shift = np.array([0.0, 0.0, 0.0, 0.0, 0.6, -0.6])
    x = np.array([1.0, 0.1, -0.1, 1.0, 0.05, 0.1])
    for amount, wanted in ((0.0, False), (1.0, True)):
        monitor = BumpMonitor(6)
        seen = False
        for k in range(1200):
            score = rng.normal(size=(3, 6)) + amount * shift * (k > 600)
            outcome = Outcome(
                np.arange(3),
                np.full(3, 2.0),
                np.ones(3),
                score,
                np.broadcast_to(np.eye(6), (3, 6, 6)),
                np.zeros((3, 2)),
            )
            monitor.add(outcome, np.full(3, 0.1), np.ones((3, 2)), 0.1 * k)
            bump = monitor.check(0.1 * k, x)
            if bump is not None:
                seen = True
                assert k > 600
                assert bump.reason == "motion"
                break
        assert seen == wanted


def test_scattered_sightings_are_not_a_robot_elsewhere(rng: np.random.Generator) -> None:
    strays = Strays()
    for k in range(20):
        uv = (float(rng.uniform(0, 1280)), float(rng.uniform(0, 720)))
        lost, since = strays.refused(0, 0.1 * k, uv, (600.0 + k, 300.0), 1.0)
        assert not lost
        assert since is None
    strays.fits(0)
    for k in range(4):
        uv = (800.0 + k, 320.0)
        lost, since = strays.refused(0, 2.0 + 0.1 * k, uv, (600.0 + k, 300.0), 1.0)
    assert lost
    assert since == 2.0

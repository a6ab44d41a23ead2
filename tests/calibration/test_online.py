"""The recursive estimator as a user meets it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration import calibrate
from airground.calibration.online import OnlineCalibrator
from airground.calibration.online_path import OdometryNoise, ReadingPath
from airground.calibration.online_state import OnlineOptions
from airground.errors import InputError
from airground.geometry.lens import DivisionLens
from airground.sim.recordings import Recording, RecordingNoise, RecordingPlan, record
from online_feed import feed

if TYPE_CHECKING:
    from airground.calibration import Calibration
    from scenes import Array

EXACT_SCALE = OnlineOptions(speed_scale_sigma=0.0)
NOISE = RecordingNoise(
    tracks_hz=15.0, motion_hz=20.0, pixel_px=1.0, speed_share=0.04, heading_rad=0.04
)  # 0.04 / sqrt(20 Hz): a density of 0.009


def small(rng: np.random.Generator, **plan: object) -> Recording:
    defaults: dict[str, object] = {"drive": "figure_eight", "duration_s": 50.0}
    return record(RecordingPlan(**(defaults | plan)), NOISE, seed=rng)  # type: ignore[arg-type]


def whitened(calibration: Calibration, g: Array, covariance: Array | None = None) -> float:
    """Distance in deviations, root mean square over the six entries."""
    C = calibration.covariance if covariance is None else covariance
    e = (calibration.model.g - g).ravel()
    size = np.sqrt(np.diag(C))
    return float(np.sqrt(e / size @ np.linalg.solve(C / np.outer(size, size), e / size) / 6))


@pytest.mark.parametrize("tilt", [15.0, 55.0])
def test_agrees_with_the_batch_estimator_and_with_the_truth(
    tilt: float, rng: np.random.Generator
) -> None:
    recording = small(rng, tilt_deg=tilt)
    calibrator = OnlineCalibrator(EXACT_SCALE)
    feed(calibrator, recording.tracks, recording.motion)
    found = calibrator.calibration()
    assert found is not None
    assert found.fit.method == "trajectory"
    batch = calibrate(
        recording.tracks,
        recording.motion,
        time_offset_s=0.0,
        distortion="none",
        speed_scale_sigma=0.0,
    )
    # The batch also estimates noise levels and nuisances; what is shared is nearly all of it.
    assert whitened(found, batch.model.g) < 0.7
    assert whitened(found, recording.truth.g) < 2.2  # chi-square with 6 degrees of freedom: 1e-4
    assert calibrator.good_enough(0.05)
    assert not calibrator.good_enough(1e-4)
    assert [event.kind for event in calibrator.events] == ["started"]
    assert abs(found.fit.rms_px - 1.0) < 0.15


def test_frames_and_single_sightings_give_one_answer(rng: np.random.Generator) -> None:
    recording = small(rng, robots=3, duration_s=30.0)
    one, other = OnlineCalibrator(EXACT_SCALE), OnlineCalibrator(EXACT_SCALE)
    feed(one, recording.tracks, recording.motion)
    feed(other, recording.tracks, recording.motion, frames=True)
    first, second = one.calibration(), other.calibration()
    assert first is not None
    assert second is not None
    # Not the same numbers, as a frame is linearised at one point.
    assert whitened(first, second.model.g) < 0.3
    assert whitened(first, recording.truth.g) < 2.5
    assert one.state.counts.sightings == other.state.counts.sightings == len(recording.tracks)


def test_a_fifth_of_wild_sightings(rng: np.random.Generator) -> None:
    recording = record(
        RecordingPlan(drive="random_turns", duration_s=60.0),
        replace(NOISE, outlier_share=0.2),
        seed=rng,
    )
    calibrator = OnlineCalibrator(EXACT_SCALE)
    feed(calibrator, recording.tracks, recording.motion)
    found = calibrator.calibration()
    assert found is not None
    assert whitened(found, recording.truth.g) < 2.5
    assert 0.7 < found.fit.inlier_fraction < 0.9
    assert "bumped" not in [event.kind for event in calibrator.events]


def test_a_straight_line_gives_no_calibration(rng: np.random.Generator) -> None:
    recording = small(rng, drive="straight", duration_s=30.0)
    calibrator = OnlineCalibrator()
    feed(calibrator, recording.tracks, recording.motion)
    assert calibrator.calibration() is None
    assert calibrator.state.phase == "starting"
    assert not calibrator.good_enough(0.3)


def test_the_clock_offset_is_found(rng: np.random.Generator) -> None:
    recording = record(
        RecordingPlan(duration_s=50.0, speed_mps=0.5), replace(NOISE, time_offset_s=0.06), seed=rng
    )
    calibrator = OnlineCalibrator(replace(EXACT_SCALE, time_offset_sigma_s=0.1))
    feed(calibrator, recording.tracks, recording.motion)
    found = calibrator.calibration()
    assert found is not None
    assert abs(found.time_offset_s - 0.06) < 4 * found.time_offset_sigma_s < 0.1
    assert whitened(found, recording.truth.g) < 2.5


def test_late_double_unread_and_impossible_data(rng: np.random.Generator) -> None:
    calibrator = OnlineCalibrator()
    for k in range(30):
        calibrator.reading(0.1 * k, "a", heading=0.0, speed=0.1)
        calibrator.sighting(0.1 * k, "a", (100.0 + k, 200.0))
    calibrator.sighting(1.05, "a", (1.0, 1.0))
    calibrator.sighting(0.1 * 29, "a", (1.0, 1.0))
    calibrator.sighting(2.9, "ghost", (1.0, 1.0))
    calibrator.reading(0.5, "a", heading=0.0, speed=0.1)
    counts = calibrator.state.counts
    assert (counts.late, counts.duplicates, counts.unread, counts.late_readings) == (1, 1, 1, 1)
    assert counts.sightings == 33
    wrong: list[tuple[float, ...]] = [(np.nan, 1.0), (1.0, np.inf), (1.0,)]
    for uv in wrong:
        with pytest.raises(InputError):
            calibrator.sighting(4.0, "a", uv)
    with pytest.raises(InputError, match="finite"):
        calibrator.reading(np.nan, "a", heading=0.0, speed=0.1)
    with pytest.raises(InputError, match="either"):
        calibrator.reading(4.0, "a", heading=0.0)
    with pytest.raises(InputError, match="leave out"):
        calibrator.frame(4.0, ["a"], [[np.nan, 0.0]])
    with pytest.raises(InputError, match="shape"):
        calibrator.frame(4.0, ["a"], [[1.0, 0.0], [2.0, 0.0]])
    with pytest.raises(InputError):
        OnlineOptions(sigma_px=0.0)


def test_sightings_may_overtake_each_other_within_the_wait(rng: np.random.Generator) -> None:
    recording = small(rng, duration_s=30.0)
    tracks, motion = recording.tracks, recording.motion
    ordered, mixed = (
        OnlineCalibrator(EXACT_SCALE),
        OnlineCalibrator(replace(EXACT_SCALE, wait_s=0.3)),
    )
    feed(ordered, tracks, motion)
    for t, heading, speed in zip(motion.t, motion.heading, motion.speed, strict=True):  # type: ignore[arg-type]
        mixed.reading(t, "robot-1", heading=heading, speed=speed)
    for i in np.argsort(tracks.t + rng.uniform(0.0, 0.25, len(tracks))):
        mixed.sighting(tracks.t[i], "robot-1", tracks.uv[i])
    first, second = ordered.calibration(), mixed.calibration()
    assert mixed.state.counts.late == 0
    assert first is not None
    assert second is not None
    assert whitened(first, second.model.g) < 0.3


def test_a_gap_in_the_readings_is_not_bridged(rng: np.random.Generator) -> None:
    """The robot moves on unread for 3 s; it comes in anew, and nothing is refused or misjudged."""
    recording = small(rng, duration_s=50.0)
    motion = recording.motion
    gone = (motion.t > 30.0) & (motion.t < 33.0)
    assert motion.heading is not None
    assert motion.speed is not None
    cut = type(motion)(
        targets=motion.targets,
        target_index=motion.target_index[~gone],
        t=motion.t[~gone],
        heading=motion.heading[~gone],
        speed=motion.speed[~gone],
    )
    calibrator = OnlineCalibrator(EXACT_SCALE)
    feed(calibrator, recording.tracks, cut)
    found = calibrator.calibration()
    assert found is not None
    assert whitened(found, recording.truth.g) < 2.5
    counts = calibrator.state.counts
    assert counts.refused <= 3
    assert 35 <= counts.unread <= 50  # 3 s at 15 Hz


def test_memory_forgets(rng: np.random.Generator) -> None:
    recording = small(rng)
    long, short = (
        OnlineCalibrator(EXACT_SCALE),
        OnlineCalibrator(replace(EXACT_SCALE, memory_s=10.0)),
    )
    for calibrator in (long, short):
        feed(calibrator, recording.tracks, recording.motion)
    assert short.state.relative_sigma > 1.3 * long.state.relative_sigma
    assert short.calibration() is not None


def test_readings_integrate_as_ground_path_does(rng: np.random.Generator) -> None:
    from airground.calibration.ground_path import ground_path

    recording = small(rng, duration_s=20.0)
    motion = recording.motion
    batch = ground_path(motion, "robot-1")
    assert batch is not None
    assert motion.heading is not None
    assert motion.speed is not None
    path = ReadingPath(OdometryNoise(0.01, 0.02, 0.0))
    for t, heading, speed in zip(motion.t, motion.heading, motion.speed, strict=True):
        assert path.add_heading(float(t), float(heading), float(speed))
    ask = rng.uniform(motion.t[0], motion.t[-1], 50)
    expected, stretch = batch.at(ask)
    points = [path.at(float(t)) for t in ask]
    got = np.array([(p.x, p.y) for p in points if p is not None])
    assert (stretch == 0).all()
    assert_allclose(got, expected, atol=1e-9)
    assert path.at(float(motion.t[0]) - 1.0) is None
    assert path.at(float(motion.t[-1]) + 1.0) is None
    last = path.at(float(motion.t[-1]))
    assert last is not None
    power = float(np.sum(np.diff(motion.t) * (motion.speed[1:] ** 2 + motion.speed[:-1] ** 2) / 2))
    assert_allclose(last.qxx + last.qyy, (0.01**2 + 0.02**2) * power, rtol=0.02)


def test_a_known_lens_is_taken_out(rng: np.random.Generator) -> None:
    recording = record(RecordingPlan(duration_s=50.0), replace(NOISE, lens_k1=-0.15), seed=rng)
    truth = recording.truth
    lens = DivisionLens(truth.lens_k1_per_px2, truth.lens_centre_px)
    calibrator = OnlineCalibrator(replace(EXACT_SCALE, lens=lens))
    feed(calibrator, recording.tracks, recording.motion)
    found = calibrator.calibration()
    assert found is not None
    assert found.lens is lens
    assert whitened(found, truth.g) < 2.5
    blind = OnlineCalibrator(EXACT_SCALE)
    feed(blind, recording.tracks, recording.motion)
    other = blind.calibration()
    assert other is None or whitened(found, truth.g) < 0.2 * whitened(found, other.model.g)

"""The whole drive at once, from recordings to a calibration: all shapes of drives under cameras of all tilts."""

from __future__ import annotations

import zlib
from typing import Literal

import numpy as np
import pytest
from scipy.stats import chi2  # type: ignore[import-untyped,unused-ignore]

from airground.calibration import Calibration, calibrate
from airground.errors import UnobservableMotionError
from airground.geometry import n_error, velocity_map_error
from airground.sim.recordings import Recording, RecordingNoise, RecordingPlan, record
from judge import FAR, MODERATE, judge

Reading = Literal["speed", "distance", "xy_dot"]

DEVIATIONS = 4.0
READINGS: tuple[Reading, ...] = ("speed", "distance", "xy_dot")
TILTS_DEG = (0.0, 35.0, 55.0, 70.0)
SHAPES = (
    "rectangle",
    "lawn_mower",
    "triangle",
    "eight_segments",
    "figure_eight",
    "circle",
    "quarter_circle",
    "random_turns",
)
# Every shape under a low and a high camera, all tilts and all kinds of reading in turn.
CASES = [
    (shape, TILTS_DEG[(k + 2 * half) % 4], READINGS[(k + half) % 3])
    for k, shape in enumerate(SHAPES)
    for half in range(2)
]


def recorded(
    shape: str, tilt_deg: float, reading: Reading, seed: int, noise: RecordingNoise = MODERATE
) -> Recording:
    plan = RecordingPlan(drive=shape, tilt_deg=tilt_deg, duration_s=30.0, reading=reading)
    return record(plan, noise, seed=seed)


def calibrated(recording: Recording) -> Calibration:
    """The scale of the speeds is right in these recordings; knowing it leaves the data to be honest by themselves."""
    return calibrate(
        recording.tracks,
        recording.motion,
        image_size_px=recording.plan.image_size_px,
        speed_scale_sigma=0.0,
    )


@pytest.mark.parametrize(("shape", "tilt_deg", "reading"), CASES)
def test_the_error_is_within_what_is_stated(
    shape: str, tilt_deg: float, reading: Reading, rng: np.random.Generator
) -> None:
    recording = recorded(shape, tilt_deg, reading, int(rng.integers(1 << 30)))
    found = calibrated(recording)
    error = judge(recording, found)
    assert error.squared < FAR
    assert error.n < DEVIATIONS * error.stated
    # Wide statements would pass all that: here the drive determines g to a few per cent.
    blind = shape == "quarter_circle" and tilt_deg == 0.0  # to a lens: k1 of -0.06 makes 0.04
    assert error.stated < (0.1 if blind else 0.05)
    assert velocity_map_error(recording.truth.g, found.model, recording.tracks.uv) < 0.05
    assert found.observability.verdict == "ok"
    assert found.fit.method == "trajectory"
    off = found.time_offset_s - recording.truth.noise.time_offset_s
    assert abs(off) < DEVIATIONS * found.time_offset_sigma_s
    assert found.time_offset_sigma_s < 0.02


@pytest.mark.parametrize("reading", READINGS)
@pytest.mark.parametrize("tilt_deg", [0.0, 55.0])
def test_one_straight_line_is_refused_and_told_what_to_drive(
    tilt_deg: float, reading: Reading, rng: np.random.Generator
) -> None:
    recording = recorded("straight", tilt_deg, reading, int(rng.integers(1 << 30)))
    with pytest.raises(UnobservableMotionError, match="drive also at about") as caught:
        calibrated(recording)
    assert caught.value.rank < 6
    assert len(caught.value.headings_deg) == 1
    assert "\n" not in str(caught.value)


def test_the_covariance_is_the_truth_over_many_drives() -> None:
    """Whitened errors of all shapes together: chi-square with 6 degrees of freedom each.

    The limits are those of the mean of so many, at chance 1e-4 on each side, and a factor of 1.5 for what the noise
    levels' own uncertainty adds: they are estimated from the same data.
    """
    squares = []
    for k, (shape, tilt_deg, reading) in enumerate(CASES[::2]):
        recording = recorded(shape, tilt_deg, reading, zlib.crc32(b"many") + k)
        squares.append(judge(recording, calibrated(recording)).squared)
    low, high = chi2.isf([1 - 1e-4, 1e-4], 6 * len(squares)) / (6 * len(squares))
    assert low / 1.5 < np.mean(squares) / 6 < high * 1.5


def test_less_noise_less_error() -> None:
    """A tenth of the noise, about a tenth of the error: nothing but noise keeps g from the truth."""
    small = RecordingNoise(
        tracks_hz=20.0, motion_hz=20.0, pixel_px=0.1, speed_share=0.005, heading_rad=0.003
    )
    recording = recorded("figure_eight", 35.0, "speed", 5, small)
    assert n_error(recording.truth.g, calibrated(recording).model) < 0.002


def test_the_prior_on_the_speed_s_scale_widens_the_covariance_along_g(
    rng: np.random.Generator,
) -> None:
    recording = recorded("figure_eight", 35.0, "speed", int(rng.integers(1 << 30)))
    sharp = calibrated(recording)
    wide = calibrate(
        recording.tracks,
        recording.motion,
        image_size_px=recording.plan.image_size_px,
        speed_scale_sigma=0.03,
    )
    g = sharp.model.g.ravel()
    along = g @ (wide.covariance - sharp.covariance) @ g / (g @ g) ** 2
    # The inverse cube root of the speeds (eq. 17), but for what the prior leaves of the scale to the fit.
    assert along == pytest.approx(0.01**2, rel=0.02)

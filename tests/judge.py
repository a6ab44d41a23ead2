"""What tests of whole drives share: how noisy a usual recording is, and whether a calibration says how wrong it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import chi2  # type: ignore[import-untyped,unused-ignore]

from airground.sim.recordings import RecordingNoise

if TYPE_CHECKING:
    from airground.calibration import Calibration
    from airground.sim.recordings import Recording
    from scenes import Array

# A detector's pixel, and the scatter of a small robot's wheels and compass, white from reading to reading.
MODERATE = RecordingNoise(
    tracks_hz=20.0,
    motion_hz=20.0,
    pixel_px=1.0,
    speed_share=0.05,
    heading_rad=0.03,
    time_offset_s=0.1,
)
FAR = float(chi2.isf(1e-4, 6))  # squared; one honest answer in ten thousand is further off


@dataclass(frozen=True)
class Error:
    """How wrong a calibration is, and how wrong it says it is."""

    n: float
    """Eq. 22."""

    stated: float
    """Deviation of n that the covariance gives."""

    squared: float
    """Squared error of g in units of its covariance."""


def judge(recording: Recording, found: Calibration, *, any_turn: bool = False) -> Error:
    """Compare with the truth in the frame of the headings that the ground frame has, or in the best one."""
    names = [name for name, fit in found.targets.items() if not fit.heading_bias_sigma_rad]
    bias = float(recording.truth.heading_bias[recording.tracks.targets.index(names[0])])
    truth = turned(recording.truth.g, -bias)
    g, covariance = found.model.g, found.covariance
    if any_turn:  # slowly drifting headings have no zero
        angles = np.linspace(-0.5, 0.5, 2001)
        distance = [squared(turned(truth, a) - g, covariance) for a in angles]
        truth = turned(truth, angles[int(np.argmin(distance))])
    size = float(np.linalg.norm(truth))
    return Error(
        float(np.linalg.norm(truth - g)) / size,
        float(np.sqrt(np.trace(covariance))) / size,
        squared(truth - g, covariance),
    )


def turned(g: Array, angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(g @ np.array([[cos, -sin], [sin, cos]]))


def squared(error: Array, covariance: Array) -> float:
    return float(error.ravel() @ np.linalg.solve(covariance, error.ravel()))

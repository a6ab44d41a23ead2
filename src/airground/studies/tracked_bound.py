"""The paper's drive, tracked all the way: what its noise must mean for a bound of a given size.

The paper gives +-5 px and +-10 % of the speed, but not how often they are drawn. On its drive (8 segments of 5 s, 30
degrees apart) sighted at 30 fps, with the standard deviations of uniform noise, b / sqrt(3), n_rms is at least

| a velocity reading, x and y on their own, is drawn | n_rms |
|---|---|
| for each frame, independently (30 Hz) | 0.0053 |
| at 20 Hz, linear in between | 0.0063 |
| at 10 Hz | 0.0087 |
| at 5 Hz | 0.0121 |
| at 1 Hz | 0.0261 |
| once a segment | 0.0461 |
| never: no odometry noise | 0.0015 |

A bound near 0.010 therefore means 7 to 8 independent readings a second, or noise at 30 Hz whose standard deviation is
the whole of 5 px and 10 % (0.0092). The usual reading, a draw per frame at 30 Hz, gives half as much. One draw per
segment, as in the paper's own samples, leaves hardly less than the nine end points do (0.0620): pixels at 30 fps do not
help against an odometer that is wrong for 5 s.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse  # type: ignore[import-untyped,unused-ignore]

from airground.errors import InputError
from airground.studies.path_bound import PathBound, displacement_bound
from airground.studies.reading_noise import hat_weights
from airground.studies.simulation import PAPER, PaperSimulation

__all__ = ["tracked_bound"]


def tracked_bound(
    simulation: PaperSimulation = PAPER, *, tracks_hz: float = 30.0, motion_hz: float | None = None
) -> PathBound:
    """Bound of g for the paper's drive, sighted again and again.

    Parameters
    ----------
    simulation : PaperSimulation
        Drive and noise.
    tracks_hz : float
        Sightings a second.
    motion_hz : float, optional
        Independent readings of the velocity a second, linear in between; one for each segment where not given.

    Returns
    -------
    bound : PathBound
        For noise with the standard deviations of the paper's uniform noise.

    Raises
    ------
    InputError
        If a rate does not divide the drive into whole steps.
    """
    drive = simulation.drive
    sigma_mps = simulation.speed_bound_mps / np.sqrt(3)
    t = _ticks(drive.total_s, tracks_hz)
    if motion_hz is None:
        segment = np.minimum(
            ((t[1:] + t[:-1]) / 2 / drive.duration_s).astype(np.intp), drive.segments - 1
        )
        shape = (len(t) - 1, drive.segments)
        weights = sparse.csr_array((np.diff(t), (np.arange(len(t) - 1), segment)), shape=shape)
    else:
        weights = hat_weights(t, _ticks(drive.total_s, motion_hz))
    covariance = sparse.kron(weights @ weights.T * sigma_mps**2, np.eye(2))
    sigma_px = simulation.pixel_bound_px / np.sqrt(3)
    return displacement_bound(simulation.camera(), drive.at(t)[0], sigma_px, covariance)


def _ticks(total_s: float, hz: float) -> np.ndarray:
    count = round(total_s * hz)
    if count < 1 or abs(count - total_s * hz) > 1e-6:
        raise InputError(f"{hz} Hz do not divide {total_s} s into whole steps")
    return np.linspace(0.0, total_s, count + 1)

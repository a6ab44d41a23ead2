"""From recordings to a calibration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.calibration.by_linear import calibrate_linear
from airground.calibration.by_trajectory import calibrate_trajectory
from airground.calibration.recordings import refuse_extremes
from airground.errors import InputError
from airground.geometry.arrays import refuse_huge

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.calibration.calibration import Calibration
    from airground.calibration.recordings import Motion, Tracks

__all__ = ["SPEED_SCALE_SIGMA", "calibrate"]

SPEED_SCALE_SIGMA = 0.02  # real odometers read 2 to 5 % off, and one robot's own data cannot tell


def calibrate(
    tracks: Tracks,
    motion: Motion,
    *,
    method: Literal["trajectory", "linear"] = "trajectory",
    time_offset_s: float | None = None,
    distortion: Literal["auto", "none", "division"] = "auto",
    image_size_px: tuple[int, int] | None = None,
    speed_scale_sigma: float = SPEED_SCALE_SIGMA,
    note: Callable[[str], None] | None = None,
) -> Calibration:
    """Calibrate on recordings of robots that know their heading and speed (section 2.1).

    Parameters
    ----------
    tracks : Tracks
        Sightings; targets without readings are not used.
    motion : Motion
        Readings.
    method : {"trajectory", "linear"}
        The whole drive as one estimation problem, or the paper's eqs. 16 and 17.
    time_offset_s : float, optional [s]
        To be added to times of the tracks to get times of the readings; searched for within a second where not given.
    distortion : {"auto", "none", "division"}
        Lens: estimated where the data show one, never, or always; the linear method knows none.
    image_size_px : (int, int), optional [px]
        Width and height of the image; the lens's centre is its middle.
    speed_scale_sigma : float
        Relative standard deviation of a robot's speed scale: no data of one robot tell it, so it widens the covariance.
    note : callable, optional
        Is given one-line remarks on what was found and assumed.

    Returns
    -------
    calibration : Calibration
        With its covariance and a verdict.

    Raises
    ------
    UnobservableMotionError
        If the motion does not determine g; the message says what to drive next.
    InputError
        If tracks and motion do not belong together, or hold numbers too large to compute with.
    """
    if method not in ("trajectory", "linear"):
        raise InputError(f"method must be 'trajectory' or 'linear', not {method!r}")
    if distortion not in ("auto", "none", "division"):
        raise InputError(f"distortion must be 'auto', 'none' or 'division', not {distortion!r}")
    if method == "linear" and distortion == "division":
        raise InputError("the linear method does not estimate a lens; use the trajectory method")
    if not 0 <= speed_scale_sigma <= 1:
        raise InputError(f"speed_scale_sigma must lie in 0..1, not {speed_scale_sigma}")
    if time_offset_s is not None:
        if not np.isfinite(time_offset_s):
            raise InputError(f"time_offset_s must be finite, not {time_offset_s}")
        refuse_huge(time_offset_s, "time_offset_s")
    refuse_extremes(tracks, "tracks")
    refuse_extremes(motion, "motion")
    say = note or (lambda _: None)
    if method == "linear":
        return calibrate_linear(
            tracks,
            motion,
            time_offset_s=time_offset_s,
            image_size_px=image_size_px,
            speed_scale_sigma=speed_scale_sigma,
            say=say,
        )
    return calibrate_trajectory(
        tracks,
        motion,
        time_offset_s=time_offset_s,
        distortion=distortion,
        image_size_px=image_size_px,
        speed_scale_sigma=speed_scale_sigma,
        say=say,
    )

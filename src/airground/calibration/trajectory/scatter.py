"""How much readings scatter from one to the next: a bound on the odometry's white noise, before any fit.

The third difference of a series removes what is smooth; of white noise it leaves twenty times the variance. What is
not smooth in the drive itself counts as noise, so that this errs on the large side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.recordings import Motion

__all__ = ["reading_scatter"]

SMOOTH = 9  # readings
FEWEST = 12  # readings that tell anything
LEAST_DIFFERENCES = FEWEST - 4  # third ones, of the increments of so many readings
MOVING = 0.1  # of the usual speed


def reading_scatter(motion: Motion, target: str) -> tuple[float, float] | None:
    """White noise of a robot's readings, relative to its speed, per square root of the time.

    Parameters
    ----------
    motion : Motion
        Readings.
    target : str
        Which robot.

    Returns
    -------
    levels : (float, float) or None
        Of the speed [sqrt(s)] and of the heading [rad sqrt(s)]; None where too few readings tell.
    """
    rows = motion.rows(target)
    t = motion.t[rows]
    if len(t) < FEWEST:
        return None
    dt = np.diff(t)
    root = float(np.sqrt(np.median(dt)))
    v = motion.xy_dot
    levels = _of_headings(motion, rows, dt) if v is None else _of_velocities(v[rows])
    return None if levels is None else (levels[0] * root, levels[1] * root)


def _of_velocities(v: FloatArray) -> tuple[float, float] | None:
    speed = np.hypot(v[:, 0], v[:, 1])
    usual = _usual(speed)
    if usual <= 0:
        return None
    forward = v / np.maximum(speed, MOVING * usual)[:, None]
    rough = np.diff(v, n=3, axis=0)
    middle = (forward[1:-2] + forward[2:-1]) / 2
    moving = (speed[1:-2] > MOVING * usual) & (speed[2:-1] > MOVING * usual)
    if moving.sum() < LEAST_DIFFERENCES:
        return None
    along = np.sum(rough * middle, axis=1)[moving]
    across = (rough[:, 1] * middle[:, 0] - rough[:, 0] * middle[:, 1])[moving]
    return _level(along) / usual, _level(across) / usual


def _of_headings(motion: Motion, rows: slice, dt: FloatArray) -> tuple[float, float] | None:
    assert motion.heading is not None
    if motion.distance is not None:
        read = np.diff(motion.distance[rows]) / dt
    else:
        assert motion.speed is not None
        read = motion.speed[rows]
    usual = _usual(np.abs(read))
    if usual <= 0:
        return None
    if motion.sigma_speed is not None and motion.distance is None:
        along = float(np.median(motion.sigma_speed[rows])) / usual
    else:
        # Over some readings: an odometer coarser than its steps stands between them only seemingly.
        smooth = np.convolve(np.abs(read), np.full(SMOOTH, 1 / SMOOTH), mode="same")
        moving = smooth > MOVING * usual
        moving = moving[3:] & moving[2:-1] & moving[1:-2] & moving[:-3]
        if moving.sum() < LEAST_DIFFERENCES:
            return None  # also an odometer so coarse that it seems to stand between its steps
        along = _level(np.diff(read, n=3)[moving]) / usual
    if motion.sigma_heading is not None:
        across = float(np.median(motion.sigma_heading[rows]))
    else:
        across = _level(np.diff(np.unwrap(motion.heading[rows]), n=3))
    return along, across


def _usual(speed: FloatArray) -> float:
    moving = speed[speed > MOVING * float(speed.max(initial=0.0))]
    return float(np.median(moving)) if len(moving) else 0.0


def _level(third: FloatArray) -> float:
    """Deviation of the series from its third differences; steps of a rounded series count in full."""
    robust = 1.4826 * float(np.median(np.abs(third)))
    return max(robust, float(np.sqrt(np.mean(third**2))) / 2) / float(np.sqrt(20))

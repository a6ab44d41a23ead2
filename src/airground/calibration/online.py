"""Calibration while robots drive: the whole-drive model, one sighting at a time.

    calibrator = OnlineCalibrator()
    calibrator.reading(t, "robot-1", heading=theta, speed=v)      # as they come in
    calibrator.sighting(t, "robot-1", (u, v))
    calibration = calibrator.calibration()                        # None until the motion determines g

The same unknowns as in `calibrate` with the trajectory method, and the same answer but for second-order terms. Time
comes in with the data; nothing here looks at a clock.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.online_answer import as_calibration
from airground.calibration.online_course import Course
from airground.calibration.online_intake import Intake
from airground.calibration.online_state import OnlineEvent, OnlineOptions, OnlineState
from airground.errors import InputError
from airground.geometry.arrays import LARGEST

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from airground.calibration.calibration import Calibration
    from airground.calibration.guidance_information import Position

__all__ = ["OnlineCalibrator"]


class OnlineCalibrator:
    """Recursive estimator of g from sightings and readings in the order in which they arrive.

    Sightings wait until their robot's readings reach them; those of one robot may overtake each other while they wait.
    Sightings of several robots at one time are best given by `frame`: together they cost little more than one.

    Parameters
    ----------
    options : OnlineOptions, optional
        Noise, unknowns beside g, memory; the defaults where not given.
    """

    def __init__(self, options: OnlineOptions | None = None) -> None:
        self.options = options or OnlineOptions()
        self._intake = Intake(self.options)
        self._course = Course(self._intake, self.options)

    # What comes in

    def reading(
        self,
        t_s: float,
        target: str,
        *,
        heading: float | None = None,
        speed: float | None = None,
        xy_dot: ArrayLike | None = None,
    ) -> None:
        """Take a robot's reading: `xy_dot`, or `heading` and `speed`.

        Parameters
        ----------
        t_s : float [s]
            When, on the readings' clock.
        target : str
            Which robot.
        heading : float, optional [rad]
            Counter-clockwise from x; may wrap.
        speed : float, optional [m/s]
            Along the heading; negative in reverse.
        xy_dot : (2,) array_like, optional [m/s]
            Ground velocity in a frame that does not turn.

        Raises
        ------
        InputError
            If a number is not finite, or not one of the two forms is given.
        """
        path = self._intake.path(target)
        if xy_dot is not None and heading is None and speed is None:
            x_dot, y_dot = _pair(xy_dot, "xy_dot")
            _finite(t_s, x_dot, y_dot, "a reading")
            self._intake.read(taken=path.add_velocity(float(t_s), x_dot, y_dot))
        elif xy_dot is None and heading is not None and speed is not None:
            _finite(t_s, heading, speed, "a reading")
            taken = path.add_heading(float(t_s), float(heading), float(speed))
            self._intake.read(taken=taken)
        else:
            raise InputError("a reading is either xy_dot, or heading and speed")

    def sighting(
        self, t_s: float, target: str, uv: ArrayLike, *, sigma_px: float | None = None
    ) -> None:
        """Take a sighting of a robot; what is not a robot with readings is ignored, and counted.

        Parameters
        ----------
        t_s : float [s]
            When, on the camera's clock.
        target : str
            Which robot.
        uv : (2,) array_like [px]
            Where in the image.
        sigma_px : float, optional [px]
            Standard deviation of each coordinate, if the detector states it.

        Raises
        ------
        InputError
            If a number is not finite.
        """
        u, v = _pair(uv, "uv")
        if self._queue(t_s, target, u, v, sigma_px):
            self._drain()

    def frame(
        self,
        t_s: float,
        targets: Sequence[str],
        uv: ArrayLike,
        *,
        sigma_px: float | None = None,
    ) -> None:
        """Take all sightings of one camera frame.

        Parameters
        ----------
        t_s : float [s]
            When, on the camera's clock.
        targets : sequence of str
            Which robots, each once.
        uv : (N, 2) array_like [px]
            Where in the image.
        sigma_px : float, optional [px]
            Standard deviation of each coordinate, if the detector states it.

        Raises
        ------
        InputError
            If a number is not finite, or there are not as many positions as names.
        """
        points = np.asarray(uv, dtype=np.float64)
        if points.shape != (len(targets), 2):
            raise InputError(f"uv must have shape ({len(targets)}, 2), not {points.shape}")
        if not np.isfinite(points).all():
            raise InputError("uv has NaN or infinite entries; leave out what was not seen")
        for target, (u, v) in zip(targets, points.tolist(), strict=True):
            self._queue(t_s, target, u, v, sigma_px)
        self._drain()

    # What comes out

    @property
    def state(self) -> OnlineState:
        """Where the estimator stands, with all data that can be used by now."""
        self._drain(flush=True)
        tracker = self._course.tracker
        bumped = any(event.kind == "bumped" for event in self._course.events)
        return OnlineState(
            phase="running" if tracker is not None else "bumped" if bumped else "starting",
            since_s=self._course.since,
            relative_sigma=self._course.relative_sigma,
            counts=self._intake.counts(
                tracker.used if tracker else 0, tracker.refused if tracker else 0
            ),
        )

    @property
    def events(self) -> tuple[OnlineEvent, ...]:
        """What happened, oldest first."""
        return tuple(self._course.events)

    def good_enough(self, relative_sigma: float) -> bool:
        """Tell whether ground velocities are known well enough, where robots were seen.

        Parameters
        ----------
        relative_sigma : float
            Wanted relative standard deviation; below `speed_scale_sigma` it is out of reach.

        Returns
        -------
        enough : bool
            Root mean square over places and headings.
        """
        self._drain(flush=True)
        return self._course.relative_sigma <= relative_sigma

    def calibration(self) -> Calibration | None:
        """Give the calibration as it is now.

        Returns
        -------
        calibration : Calibration or None
            None while the motion does not determine g, or after the camera was moved.
        """
        self._drain(flush=True)
        tracker = self._course.tracker
        if tracker is None:
            return None
        return as_calibration(tracker, self._intake.names, self.options)

    def position(self, target: str | None = None) -> Position | None:
        """Tell how well it is known where a robot is, given g; for `next_leg`.

        Parameters
        ----------
        target : str, optional
            Which robot; the first where not given.

        Returns
        -------
        position : Position or None
            With its slope by the entries of g in pixels, row by row; None if nothing is known.
        """
        self._drain(flush=True)
        names = self._intake.names
        if self._course.tracker is None or not names or (target or names[0]) not in names:
            return None
        return self._course.tracker.position(names.index(target or names[0]))

    # Inside

    def _queue(self, t_s: float, target: str, u: float, v: float, sigma_px: float | None) -> bool:
        _finite(t_s, u, v, "a sighting")
        sigma = self.options.sigma_px if sigma_px is None else float(sigma_px)
        if not 0 < sigma < math.inf:
            raise InputError(f"sigma_px must be positive and finite, not {sigma_px}")
        if self.options.lens is not None:
            u, v = self.options.lens.undistort((u, v)).tolist()
            if not math.isfinite(u + v):
                return False  # beyond what the lens shows
        return self._intake.queue(float(t_s), target, u, v, sigma)

    def _drain(self, *, flush: bool = False) -> None:
        """Use what the readings have reached."""
        if not self._intake.waiting:
            return
        for group in self._intake.ready(self._offset(), flush=flush):
            self._course.take(group)

    def _offset(self) -> float:
        tracker = self._course.tracker
        if tracker is not None and self.options.time_offset_sigma_s > 0:
            return float(tracker.filter.x[6])
        return self.options.time_offset_s


def _pair(value: object, name: str) -> tuple[float, float]:
    try:
        first, second = value  # type: ignore[misc]
        return float(first), float(second)  # type: ignore[has-type]
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be two numbers, not {value!r}") from error


def _finite(a: float, b: float, c: float, what: str) -> None:
    if not (abs(a) <= LARGEST and abs(b) <= LARGEST and abs(c) <= LARGEST):  # NaN compares as False
        raise InputError(f"{what} must hold finite numbers up to {LARGEST:g}, not {a}, {b}, {c}")

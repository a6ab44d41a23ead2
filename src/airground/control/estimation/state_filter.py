"""Where a robot is when a command takes effect, from late sightings, readings and the commands in flight.

    state_filter = StateFilter(floor, StateOptions(actuation_delay_s=0.08))
    state_filter.see(t_exposed, uv)                        # as they arrive, late and in any order
    state_filter.read(t_read, speed=0.31, turn_rate=0.2)   # what there is of it, if anything
    state = state_filter.predict(now + 0.08)               # for a controller
    state_filter.sent(now, command)                        # what was sent, after all limits

An extended Kalman filter over `model`, run again over the data of the last second where one comes late.
Times are the camera's clock, but for readings (`StateOptions.time_offset_s`). Nothing here looks at a clock.

Without a compass the heading is unknown until the robot has moved by some centimetres: `ready` is False, `trouble`
says so, and the state's theta is NaN, for which controllers rest. A pilot then has the robot drive gently forward until
`ready`. Back serves as well if `sent` or an odometer tells so; else the front is where it drives to.
"""

from __future__ import annotations

from math import inf, isfinite, nan, pi, remainder
from typing import TYPE_CHECKING

import numpy as np

from airground.control.estimation.counts import StateCounts
from airground.control.estimation.history import History
from airground.control.estimation.model import LATERAL
from airground.control.estimation.moment import (
    READING,
    SIGHTING,
    Datum,
    Moment,
    Tally,
)
from airground.control.estimation.options import StateOptions
from airground.control.image_law import ImageLaw
from airground.control.state import RobotState
from airground.errors import InputError
from airground.geometry.arrays import numbers

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.control.command import VelocityCommand
    from airground.control.estimation.model import Gaussian
    from airground.control.floor import Floor

__all__ = ["StateFilter"]

_MOST_RAD = 1e6  # of a heading that was never wrapped
_UNTURNED = (pi / 3**0.5) ** 2  # variance of any heading at all


class StateFilter:
    """Belief about one robot, fed as data arrive. The order of arrival does not matter within the window.

    What is not usable is refused and counted, never raised: in a live loop a bad datum is no reason to stop.

    Parameters
    ----------
    floor : Floor
        The ground, seen by the camera.
    options : StateOptions, optional
        Vehicle, noise and delays; the defaults where not given.
    """

    def __init__(self, floor: Floor, options: StateOptions | None = None) -> None:
        self.floor = floor
        self.options = options or StateOptions()
        self._image = ImageLaw(floor)
        self._history = History(self.options)
        self._asked_t = -inf
        self._unusable = self._late = self._early = 0
        variance = self.options.sighting_sigma_px**2
        self._usual = (variance, 0.0, variance)

    # What comes in

    def see(self, t: float, uv: ArrayLike, covariance: ArrayLike | None = None) -> bool:
        """Take a sighting of the robot's mark over.

        Parameters
        ----------
        t : float [s]
            Time of exposure.
        uv : (2,) array_like [px]
            The mark, in the pixels of the model.
        covariance : (2, 2) array_like, optional [px^2]
            Of `uv`; from `StateOptions.sighting_sigma_px` where not given.

        Returns
        -------
        taken : bool
            Whether it was usable and in time. Whether it agrees shows later, in `counts`.

        Raises
        ------
        InputError
            If a shape is wrong.
        """
        point = numbers(uv, "uv")
        if point.shape != (2,):
            raise InputError(f"uv must have shape (2,), not {point.shape}")
        a, b, d = self._usual
        if covariance is not None:
            C = numbers(covariance, "covariance")
            if C.shape != (2, 2):
                raise InputError(f"covariance must have shape (2, 2), not {C.shape}")
            (a, b), (c, d) = C.tolist()
            b = 0.5 * (b + c)
        u, v = point.tolist()
        x, y = self.floor.position_of(u, v)
        if not (isfinite(t) and isfinite(x + y) and a > 0 and d > 0 and a * d >= b * b):
            return self._refuse()
        (i00, i10), (i01, i11) = (self._image.to_ground(u, v, *e) for e in ((1, 0), (0, 1)))
        xx = i00 * i00 * a + 2 * i00 * i01 * b + i01 * i01 * d
        xy_ = i00 * i10 * a + (i00 * i11 + i01 * i10) * b + i01 * i11 * d
        yy = i10 * i10 * a + 2 * i10 * i11 * b + i11 * i11 * d
        if not 0 < xx + yy < 1e6:  # a kilometre says nothing
            return self._refuse()
        return self._add(Datum(float(t), SIGHTING, (x, y, xx + 1e-12, xy_, yy + 1e-12)))

    def read(
        self,
        t: float,
        *,
        heading: float | None = None,
        speed: float | None = None,
        turn_rate: float | None = None,
    ) -> bool:
        """Take readings of the robot's own sensors over, as they come: together or alone.

        Parameters
        ----------
        t : float [s]
            When, by the robot's clock.
        heading : float, optional [rad]
            Compass, in the ground's frame; any number of turns.
        speed : float, optional [m/s]
            Odometer, along the heading; negative in reverse.
        turn_rate : float, optional [rad/s]
            Wheels or gyroscope.

        Returns
        -------
        taken : bool
            Whether all of them were usable and in time.
        """
        o, t = self.options, t - self.options.time_offset_s
        values, bad = [], 0
        for value, most in (
            (heading, _MOST_RAD),
            (speed, o.fastest_mps),
            (turn_rate, o.fastest_radps),
        ):
            usable = value is not None and isfinite(t) and abs(value) <= most
            bad += value is not None and not usable
            values.append(float(value) if value is not None and usable else inf)
        self._unusable += bad
        if min(values) == inf:
            return not bad
        return self._add(Datum(float(t), READING, tuple(values))) and not bad

    def sent(self, t: float, command: VelocityCommand) -> bool:
        """Be told of a command; it holds from `StateOptions.actuation_delay_s` later until the next one does.

        Parameters
        ----------
        t : float [s]
            When it was sent. Two at one time: the one told later holds.
        command : VelocityCommand
            As sent, after all limits; the stop of a watchdog too, as nobody else tells.

        Returns
        -------
        taken : bool
            False for numbers that are none, or are beyond the fastest.
        """
        o = self.options
        fast = max(abs(command.v), abs(command.lateral)) > o.fastest_mps
        if not (isfinite(t) and command.finite) or fast or abs(command.omega) > o.fastest_radps:
            return self._refuse()
        self._history.command(float(t) + o.actuation_delay_s, command)
        return True

    def _add(self, datum: Datum) -> bool:
        if self._asked_t > -inf and datum.t > self._asked_t + self.options.future_s:
            self._early += 1
            return False
        if not self._history.add(datum):
            self._late += 1
            return False
        return True

    def _refuse(self) -> bool:
        self._unusable += 1
        return False

    # What comes out

    def predict(self, t: float) -> RobotState:
        """State at a time, from all data up to it and the commands in effect until it.

        Parameters
        ----------
        t : float [s]
            For a controller: when the command that is computed now takes effect.

        Returns
        -------
        state : RobotState
            Of the axle. Where the heading is unknown, theta, v and omega are NaN and `uv` is where the mark was seen
            last; where nothing is known all is NaN and the covariance None.

        Raises
        ------
        InputError
            If the time is not a finite number.
        """
        if not isfinite(t):
            raise InputError(f"t must be a finite time in seconds, not {t}")
        self._asked_t = max(self._asked_t, t)
        moment = self._history.at(t)
        state = None
        if moment is not None and moment.belief is not None:
            state = _state(self.floor, t, moment.belief, moment.seen_t)
        elif moment is not None:
            state = self._headless(t, moment)
        return state or RobotState(t, np.array([nan, nan]), nan, nan, nan)

    def _headless(self, t: float, moment: Moment) -> RobotState | None:
        assert moment.start is not None
        if not moment.start.marks:
            return None
        mark = moment.start.marks[-1]
        xx, xy, yy = mark.covariance
        arm = 0.5 * sum(a * a for a in self.options.lever_arm_m)
        adrift = (self.options.free_speed_mps * (t - mark.t)) ** 2
        covariance = np.diag([arm + adrift, arm + adrift, _UNTURNED, 1.0, 1.0])
        covariance[:2, :2] += ((xx, xy), (xy, yy))
        uv = self.floor.pixel((mark.seen.real, mark.seen.imag))
        return RobotState(t, uv, nan, nan, nan, 0.0, covariance, moment.seen_t)

    @property
    def ready(self) -> bool:
        """Whether position and heading were both known at the newest datum."""
        moment = self._history.settle()
        return moment is not None and moment.belief is not None

    @property
    def searching(self) -> bool:
        """Whether the robot is seen but its heading is unknown: gentle driving, with `sent` told, finds it."""
        moment = self._history.settle()
        return moment is not None and moment.start is not None and bool(moment.start.marks)

    @property
    def trouble(self) -> str:
        """What is missing and what to do, in one line; empty where the filter is ready."""
        if self.ready:
            return ""
        if self.searching:
            return "the heading is unknown: drive gently forward until the image shows it"
        return "the robot has not been seen: bring its mark into view"

    @property
    def seen_t(self) -> float:
        """Time of the newest sighting that was taken and agreed [s]; minus infinity before any."""
        moment = self._history.settle()
        return -inf if moment is None else moment.seen_t

    @property
    def scales(self) -> tuple[float, float]:
        """True speed over the vehicle's own, and true turn rate over its own; (1, 1) before anything is known."""
        moment = self._history.settle()
        if moment is None:
            return 1.0, 1.0
        belief, start = moment.belief, moment.start
        mean = belief.mean if belief is not None else start.mean if start is not None else ()
        return (1 + mean[5], 1 + mean[6]) if mean else (1.0, 1.0)

    @property
    def jumps(self) -> int:
        """`StateCounts.jumps` alone, for those who ask at every tick."""
        moment = self._history.settle()
        return 0 if moment is None else moment.tally.jumps

    @property
    def counts(self) -> StateCounts:
        """What was refused, and how often it began anew."""
        moment = self._history.settle()
        tally = Tally() if moment is None else moment.tally
        return StateCounts(
            tally.sightings,
            tally.readings,
            self._unusable,
            self._late,
            self._early,
            tally.jumps,
            tally.losses,
        )


def _state(floor: Floor, t: float, belief: Gaussian, seen_t: float) -> RobotState | None:
    """The belief as controllers read it; None where the axle is not on ground that the camera sees."""
    x, y, theta, v, omega, *_ = belief.mean
    u, v_image = floor.pixel_of(x, y)
    if not isfinite(u + v_image):
        return None
    P, turned = belief.covariance[:5, :5], remainder(theta, 2 * pi)
    covariance, lateral = 0.5 * (P + P.T), belief.mean[LATERAL]
    return RobotState(t, np.array((u, v_image)), turned, v, omega, lateral, covariance, seen_t)

"""A simulated vehicle that is driven by velocity commands: late, lagging, slipping, within its own limits.

It is the truth that control is judged against, and shares no formula with it: it takes commands, moves along exact
arcs, and knows where it has been.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np

from airground.control.command import STOP, VelocityCommand
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly
from airground.sim.vehicle_drives import VehicleKind, drive_train, rounded
from airground.sim.vehicle_history import History, SlowNoise
from airground.sim.vehicle_options import PlantOptions

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["VehiclePlant"]

STEP_S = 0.004
TINY_S = 1e-9  # times closer than this are one


class VehiclePlant:
    """A vehicle on the ground of a simulated camera; its position is that of the axle it turns about.

    Parameters
    ----------
    start_m : (2,) array_like [m]
        Ground position at the start.
    theta : float [rad]
        Heading there, in the frame's own sense.
    kind : str
        unicycle, differential, ackermann or omni.
    options : PlantOptions, optional
        Its nature; the defaults where not given.
    rng : Generator, optional
        Of the slip; needed where there is any.
    start_s : float [s]
        Time at which it stands there, at rest.

    Raises
    ------
    InputError
        If the start is not finite, the kind is not known, or slip has nowhere to come from.
    """

    def __init__(
        self,
        start_m: ArrayLike,
        theta: float,
        kind: VehicleKind = "unicycle",
        options: PlantOptions | None = None,
        *,
        rng: np.random.Generator | None = None,
        start_s: float = 0.0,
    ) -> None:
        self.kind: VehicleKind = kind
        self.options = options = options or PlantOptions()
        xy = readonly(start_m, (2,), "start_m")
        if not (np.isfinite(theta) and np.isfinite(start_s)):
            raise InputError(f"theta and start_s must be finite, not {theta} and {start_s}")
        slips = options.slip > 0 or options.turn_slip > 0
        if slips and rng is None:
            raise InputError("a vehicle that slips needs rng")
        # One generator each, so that a draw of one does not shift the other.
        self._slips = (
            tuple(SlowNoise(one, options.slip_s, start_s) for one in rng.spawn(2))
            if slips and rng is not None
            else ()
        )
        self._drive = drive_train(kind, options)
        self._history = History(float(start_s), xy, float(theta))
        self._now = float(start_s)
        self._sent_t = -inf
        self._told: VelocityCommand = STOP
        self._heard_t = -inf
        self._coming: list[tuple[float, VelocityCommand]] = []

    @property
    def now(self) -> float:
        """Time to which it has been driven [s]."""
        return self._now

    @property
    def xy(self) -> FloatArray:
        """(2,) [m]. True ground position now."""
        return np.array(self._history.rows[-1, 1:3])

    @property
    def theta(self) -> float:
        """True heading now [rad]; does not wrap."""
        return float(self._history.rows[-1, 3])

    @property
    def v(self) -> float:
        """True speed along the heading now [m/s], over the ground."""
        return self._moving()[0]

    @property
    def omega(self) -> float:
        """True rate of the heading now [rad/s]."""
        return self._moving()[1]

    @property
    def lateral(self) -> float:
        """True speed along the heading plus 90 degrees now [m/s]."""
        return self._moving()[2]

    def command(self, t: float, command: VelocityCommand) -> None:
        """Send a command; it takes effect `latency_s` later and holds until the next, or until the watchdog.

        Parameters
        ----------
        t : float [s]
            When it is sent: not before the last one, and early enough to take effect from now on.
        command : VelocityCommand
            What to do. A vehicle that does not drive sideways takes no sideways speed.

        Raises
        ------
        InputError
            If the command is not finite, asks for what the vehicle has no wheels for, or comes too late.
        """
        o = self.options
        if not command.finite:
            raise InputError(f"a command must be finite, not {command}")
        if command.lateral != 0 and self.kind != "omni":
            raise InputError(f"a vehicle of kind {self.kind} cannot drive sideways: {command}")
        if not (t >= self._sent_t and t + o.latency_s >= self._now - TINY_S and t < inf):
            raise InputError(
                f"a command sent at {t} s is too late: the last was sent at {self._sent_t} s "
                f"and the vehicle has been driven to {self._now} s"
            )
        self._sent_t = t
        if _inside(t, o.deaf_s):
            return
        told = VelocityCommand(
            rounded(command.v, o.speed_quantum_mps),
            rounded(command.omega, o.turn_quantum_radps),
            rounded(command.lateral, o.speed_quantum_mps),
        )
        self._coming.append((t + o.latency_s, told))

    def advance(self, t: float) -> None:
        """Drive on to a time.

        Parameters
        ----------
        t : float [s]
            Not before now.

        Raises
        ------
        InputError
            If it is.
        """
        if not self._now - TINY_S <= t < inf:
            raise InputError(f"a vehicle at {self._now} s cannot be driven to {t} s")
        ends: list[float] = []
        motion: list[tuple[float, ...]] = []
        now = self._now
        while t - now > TINY_S:
            while self._coming and self._coming[0][0] <= now + TINY_S:
                self._heard_t, self._told = self._coming.pop(0)
            silent_t = self._heard_t + self.options.watchdog_s
            silent = now >= silent_t - TINY_S
            event = self._coming[0][0] if self._coming else inf
            if not silent:
                event = min(event, silent_t)
            end = min(t, event, now + STEP_S)
            self._drive.step(STOP if silent else self._told, end - now)
            motion.append(self._over_ground((now + end) / 2))
            ends.append(end)
            now = end
        if ends:
            self._history.drive(ends, motion)
        self._now = now

    def pose(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where it was: a `PoseOfTime`, to render it by.

        Parameters
        ----------
        t : (N,) array [s]
            Times up to now; before the start it stands there.

        Returns
        -------
        xy : (N, 2) array [m]
            True positions.
        theta : (N,) array [rad]
            True headings; they do not wrap.

        Raises
        ------
        InputError
            If a time lies in the future or is NaN.
        """
        return self._history.at(self._past(t))[:2]

    def motion(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How it moved, and how its wheels did.

        Parameters
        ----------
        t : (N,) array [s]
            Times up to now; before the start all is at rest.

        Returns
        -------
        ground : (N, 3) array [m/s, rad/s, m/s]
            True speed, turn rate and sideways speed.
        wheels : (N, 3) array [m/s, rad/s, m/s]
            The same, as perfect encoders would tell: without slip, and turning where it is blocked.

        Raises
        ------
        InputError
            If a time lies in the future or is NaN.
        """
        both = self._history.at(self._past(t))[2]
        return both[:, :3], both[:, 3:]

    def _past(self, t: FloatArray) -> FloatArray:
        t = np.asarray(t, dtype=np.float64)
        if not bool((t <= self._now + TINY_S).all()):
            raise InputError(
                f"the vehicle has been driven to {self._now} s, not beyond: advance it first"
            )
        return np.minimum(t, self._now)

    def _moving(self) -> tuple[float, float, float]:
        rows = self._history.rows
        v, omega, lateral = rows[-2, 4:7] if len(rows) > 1 else (0.0, 0.0, 0.0)
        return float(v), float(omega), float(lateral)

    def _over_ground(self, t: float) -> tuple[float, ...]:
        """Motion of the vehicle and of its wheels, from what the drive train does now."""
        o, drive = self.options, self._drive
        grip, turn_grip = 1.0, 1.0
        if self._slips:
            grip -= o.slip * self._slips[0].at(t)
            turn_grip -= o.turn_slip * self._slips[1].at(t)
        wheels = (drive.v, drive.omega, drive.lateral)
        if _inside(t, o.blocked_s):
            return (0.0, 0.0, 0.0, *wheels)
        v = drive.v * o.speed_scale * grip
        omega = drive.omega * o.turn_scale * turn_grip + v * o.pull_per_m
        lateral = drive.lateral * o.speed_scale * grip - o.side_slip_s * v * omega
        return (v, omega, lateral, *wheels)


def _inside(t: float, span: tuple[float, float] | None) -> bool:
    return span is not None and span[0] <= t < span[1]

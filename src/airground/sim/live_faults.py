"""What can go wrong in the embedded world: switched on and off while it runs, by tests and by a curious operator."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import inf, isfinite
from threading import Lock
from typing import TYPE_CHECKING, Any

from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["MOST_LATE_S", "CameraFaults", "FaultState", "Faults", "RobotFaults"]

MOST_LATE_S = 8.0
"""Pictures are not later than this [s]: nobody remembers longer what they show."""


@dataclass(frozen=True, slots=True)
class CameraFaults:
    """What is wrong with the camera now."""

    frozen: bool = False
    """It sends one and the same picture, to the last bit; times and numbers go on."""

    gone: bool = False
    """Nothing comes, and what was on its way is lost. When it is back, a new segment begins."""

    late_s: float = 0.0
    """Pictures come so much later than usual, stamped as usual: one can tell [s]."""

    stamped_late: bool = False
    """Late pictures are stamped when they come: one cannot tell."""


@dataclass(frozen=True, slots=True)
class RobotFaults:
    """What is wrong with a robot now."""

    link_gone: bool = False
    """Commands do not reach it, and nothing is heard of it. By itself it stops."""

    covered: bool = False
    """Its tag is covered by a cloth."""

    blocked: bool = False
    """It has run into something: it stands, while its wheels turn."""

    motor_off: bool = False
    """Neither it nor its wheels turn; it is heard, and hears."""

    runaway: bool = False
    """It goes on doing what it did, whatever it is told."""

    compass_stuck: bool = False
    """Its heading reads the same for ever; speed and turn rate are right."""

    seen_off_m: tuple[float, float] = (0.0, 0.0)
    """It is seen so far from where it is, along x and y [m]: a false sighting."""


@dataclass(frozen=True, slots=True)
class FaultState:
    """All that is wrong at one time."""

    camera: CameraFaults
    """Of the camera."""

    robots: dict[str, RobotFaults]
    """By name; not to be written to."""

    swapped: tuple[str, str] | None = None
    """Two robots each of which is seen in the other's place."""

    def seen_as(self, name: str) -> str:
        """Tell in whose place a robot is seen.

        Parameters
        ----------
        name : str
            Of the robot.

        Returns
        -------
        name : str
            Its own, unless it is swapped.
        """
        if self.swapped is None or name not in self.swapped:
            return name
        return self.swapped[1] if name == self.swapped[0] else self.swapped[0]


class Faults:
    """The switches. Each takes effect from the time on to which the world has been advanced; any thread may switch.

    Parameters
    ----------
    robots : iterable of str
        Names.
    """

    def __init__(self, robots: Iterable[str]) -> None:
        self._lock = Lock()
        self._pushes: list[tuple[str, tuple[float, float, float]]] = []
        self.state = FaultState(CameraFaults(), {name: RobotFaults() for name in robots})
        """What is wrong now: replaced as a whole."""

    def camera(self, **switches: Any) -> None:
        """Switch faults of the camera; the others stay as they are.

        Parameters
        ----------
        **switches : bool or float
            Fields of `CameraFaults`.

        Raises
        ------
        InputError
            If there is no such fault, or its value is wrong.
        """
        _check(CameraFaults, switches)
        with self._lock:
            camera = replace(self.state.camera, **switches)
            self.state = replace(self.state, camera=camera)

    def robot(self, name: str, **switches: Any) -> None:
        """Switch faults of a robot; the others stay as they are.

        Parameters
        ----------
        name : str
            Of the robot.
        **switches : bool or (float, float)
            Fields of `RobotFaults`.

        Raises
        ------
        InputError
            If there is no such robot or fault, or its value is wrong.
        """
        self._known(name)
        _check(RobotFaults, switches)
        with self._lock:
            robots = dict(self.state.robots)
            robots[name] = replace(robots[name], **switches)
            self.state = replace(self.state, robots=robots)

    def swap(self, one: str, other: str) -> None:
        """Let each of two robots be seen in the other's place, until `clear` or another swap.

        Parameters
        ----------
        one, other : str
            Their names.

        Raises
        ------
        InputError
            If they are not two robots.
        """
        self._known(one)
        self._known(other)
        if one == other:
            raise InputError(f"it takes two robots to swap, not {one!r} twice")
        with self._lock:
            self.state = replace(self.state, swapped=(one, other))

    def push(
        self, name: str, ahead_m: float = 0.0, left_m: float = 0.0, turn_rad: float = 0.0
    ) -> None:
        """Push a robot, within a fifth of a second; its wheels skid and do not feel it.

        Parameters
        ----------
        name : str
            Of the robot.
        ahead_m, left_m : float [m]
            How far, along its own axes.
        turn_rad : float [rad]
            How far it is turned.

        Raises
        ------
        InputError
            If there is no such robot, or a push is not finite.
        """
        self._known(name)
        if not all(map(isfinite, (ahead_m, left_m, turn_rad))):
            raise InputError(f"a push must be finite, not {ahead_m}, {left_m} m, {turn_rad} rad")
        with self._lock:
            self._pushes.append((name, (ahead_m, left_m, turn_rad)))

    def clear(self) -> None:
        """Let all be well again."""
        with self._lock:
            robots = {name: RobotFaults() for name in self.state.robots}
            self.state = FaultState(CameraFaults(), robots)

    def take_pushes(self) -> list[tuple[str, tuple[float, float, float]]]:
        """Give the pushes that nobody has carried out yet: for the world.

        Returns
        -------
        pushes : list of (str, (float, float, float))
            Name; ahead, left [m], turn [rad].
        """
        with self._lock:
            pushes, self._pushes = self._pushes, []
        return pushes

    def _known(self, name: str) -> None:
        if name not in self.state.robots:
            raise InputError(f"no robot is called {name!r}; there are {sorted(self.state.robots)}")


def _check(kind: type[CameraFaults | RobotFaults], switches: dict[str, Any]) -> None:
    known = {one.name for one in fields(kind)}
    for name, value in switches.items():
        if name not in known:
            raise InputError(f"there is no fault {name!r}; there are {', '.join(sorted(known))}")
        if name == "late_s":
            if not (isinstance(value, int | float) and 0 <= value <= MOST_LATE_S):
                raise InputError(f"late_s must be 0 to {MOST_LATE_S:g}, not {value!r}")
        elif name == "seen_off_m":
            if len(value) != 2 or not all(abs(part) < inf for part in value):
                raise InputError(f"seen_off_m must be two numbers, not {value!r}")
        elif not isinstance(value, bool):
            raise InputError(f"{name} must be true or false, not {value!r}")

"""What a console, or whoever else looks at a running session, is given of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.calibration import Calibration
    from airground.control import Limits
    from airground.session.orders import Order
    from airground.session.tick import SessionTick
    from airground.vision.frame import ImageArray

__all__ = ["RobotInfo", "SessionHandle", "ShownImage", "SiteView"]


@dataclass(frozen=True, slots=True)
class RobotInfo:
    """What does not change about a robot."""

    name: str
    """What it is called."""

    kind: str
    """unicycle, differential, ackermann or omni."""

    radius_m: float
    """Of the disc that holds it [m]."""

    limits: Limits
    """What it may do."""


@dataclass(frozen=True, slots=True)
class SiteView:
    """What does not change about a session."""

    name: str
    """Of the site."""

    robots: tuple[RobotInfo, ...]
    """Ours."""

    control_hz: float
    """Commands a second."""

    wanted_sigma: float
    """Relative deviation of ground velocities at which a calibration is good enough."""


@dataclass(frozen=True, slots=True, eq=False)
class ShownImage:
    """The newest picture."""

    image: ImageArray
    """(H, W, 3) blue, green, red; read-only."""

    index: int
    """Number of the frame."""

    t: float
    """When it was taken, as the camera stamps it [s]."""

    arrived_s: float
    """When it was in memory [s]."""


class SessionHandle(Protocol):
    """A running session, from outside; safe to use from any thread."""

    @property
    def site(self) -> SiteView:
        """What does not change about it."""
        ...

    @property
    def calibration(self) -> Calibration | None:
        """The one in force; `CalibrationView.revision` tells of changes."""
        ...

    @property
    def recording(self) -> str:
        """File that is being recorded to; empty for none."""
        ...

    def now(self) -> float:
        """Time of the session [s].

        Returns
        -------
        t : float [s]
            Since it began.
        """
        ...

    def submit(self, client: str, order: Order) -> None:
        """Hand in an order; never waits.

        Parameters
        ----------
        client : str
            Who asks.
        order : Order
            What for.
        """
        ...

    def listen(self, listener: Callable[[SessionTick], None]) -> Callable[[], None]:
        """Be told of every step, in the loop's own thread: a listener only stores what it gets.

        Parameters
        ----------
        listener : callable
            Is given each tick.

        Returns
        -------
        stop : callable
            Ends that.
        """
        ...

    def image(self) -> ShownImage | None:
        """Give the newest picture.

        Returns
        -------
        image : ShownImage or None
            None before the first.
        """
        ...

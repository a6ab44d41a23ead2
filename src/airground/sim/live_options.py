"""What the embedded live world is made of: robots, cart, camera, and how late and how well all of it is known."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, pi

from airground.errors import InputError
from airground.sim.vehicle_drives import VehicleKind
from airground.sim.vehicle_odometry import OdometryNoise
from airground.sim.vehicle_options import PlantOptions

__all__ = ["FAMILY", "MOST_ROBOTS", "EmbeddedOptions", "RobotPlace", "robot_places"]

FAMILY = "4x4_50"
"""Of all tags in the embedded world."""

CART_TAG = 9
EXPOSED_S = 0.005


@dataclass(frozen=True, slots=True)
class RobotPlace:
    """A robot of ours: what it is called, what it carries, and where it stands at first."""

    name: str
    """Its colour."""

    tag: int
    """Number of its tag."""

    colour: tuple[float, float, float]
    """Of its hull: blue, green, red; 0 to 255."""

    start_m: tuple[float, float]
    """Of its axle [m]."""

    heading_rad: float
    """Counter-clockwise from x [rad]."""


PLACES = (
    RobotPlace("red", 0, (50.0, 50.0, 200.0), (-0.9, 3.6), pi / 4),
    RobotPlace("blue", 1, (190.0, 120.0, 40.0), (0.9, 4.3), 3 * pi / 4),
    RobotPlace("green", 2, (70.0, 165.0, 60.0), (-1.0, 5.0), 0.0),
    RobotPlace("yellow", 3, (40.0, 190.0, 225.0), (0.9, 2.9), pi),
    RobotPlace("white", 4, (225.0, 225.0, 225.0), (2.2, 4.9), pi),
    RobotPlace("black", 5, (55.0, 52.0, 50.0), (-2.0, 4.2), 0.0),
)

MOST_ROBOTS = len(PLACES)
"""So many have a place to start from."""


def _plant() -> PlantOptions:
    return PlantOptions(slip=0.02, turn_slip=0.02)


@dataclass(frozen=True, slots=True)
class EmbeddedOptions:
    """The embedded world, as it is when nothing is wrong; what may go wrong is in `Faults`."""

    robots: int = 2
    """Of ours: red, blue, green, yellow, white, black, with tags 0, 1, 2, ... of `FAMILY`."""

    cart: bool = True
    """Whether somebody else's vehicle drives round behind them, with tag 9."""

    camera_hz: float = 20.0
    """Pictures per second."""

    latency_s: float = 0.06
    """From a picture's exposure to its stamp, and to its arrival [s]: what drives is not told."""

    jitter_s: float = 0.0
    """Mean of what arrivals are late on top by chance [s], exponential; stamps do not show it."""

    sigma_px: float = 0.3
    """Noise of sightings where nothing is rendered [px]."""

    kind: VehicleKind = "differential"
    """What the robots drive like."""

    plant: PlantOptions = field(default_factory=_plant)
    """Nature of the robots."""

    odometry: OdometryNoise = field(default_factory=OdometryNoise)
    """How well and how late they know their own motion."""

    def __post_init__(self) -> None:
        if not 1 <= self.robots <= MOST_ROBOTS:
            raise InputError(
                f"robots must be 1 to {MOST_ROBOTS} in the embedded world, not {self.robots}"
            )
        if not 0 < self.camera_hz <= 240:
            raise InputError(f"camera_hz must be above 0 and at most 240, not {self.camera_hz}")
        for name in ("jitter_s", "sigma_px"):
            if not 0 <= getattr(self, name) < inf:
                raise InputError(f"{name} must be 0 or more, not {getattr(self, name)}")
        if not EXPOSED_S <= self.latency_s <= 2:
            raise InputError(
                f"latency_s must be {EXPOSED_S:g} to 2, not {self.latency_s}: "
                "no picture comes before it has been exposed"
            )


def robot_places(options: EmbeddedOptions) -> tuple[RobotPlace, ...]:
    """Name the robots there are.

    Parameters
    ----------
    options : EmbeddedOptions
        Says how many.

    Returns
    -------
    places : tuple of RobotPlace
        In the order of their tags.
    """
    return PLACES[: options.robots]

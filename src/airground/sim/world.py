"""The embedded world: a floor, a camera that looks down on it, a robot and a cart."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

from airground.sim.camera import SimCamera

__all__ = ["FigureEight", "Transit", "World", "demo_world"]


@dataclass(frozen=True, slots=True)
class FigureEight:
    """A closed path with turns both ways, lying along x: it comes to many headings, all over its box."""

    centre_m: tuple[float, float]
    """Of the box [m]."""

    half_size_m: tuple[float, float]
    """Half the extent in x and y [m]."""

    speed_mps: float = 0.3
    """Of the robot along it [m/s]."""


@dataclass(frozen=True, slots=True)
class Transit:
    """Something else that drives straight through the view."""

    target: str
    """Its name in the tracks."""

    start_m: tuple[float, float]
    """Ground position at `start_s` [m]."""

    heading_rad: float
    """Counter-clockwise from x [rad]."""

    speed_mps: float
    """Its true speed [m/s]."""

    start_s: float
    """When it sets off [s]."""


@dataclass(frozen=True, slots=True)
class World:
    """What there is; how it is measured stands in `calibration_drive`."""

    focal_length_px: float
    """Of the fixed camera [px]."""

    tilt_rad: float
    """Angle of its optical axis from straight down [rad]."""

    roll_rad: float
    """Turn of "up" in its image, from -v towards +u [rad]."""

    heading_rad: float
    """Where it looks on the ground, counter-clockwise from x [rad]."""

    height_m: float
    """Of its centre above the ground [m]."""

    image_size_px: tuple[int, int]
    """Width and height of its image [px]."""

    floor: str
    """Name of the floor's picture: checked, concrete, ..."""

    robot: str
    """The robot's name in tracks and motion."""

    path: FigureEight
    """The robot's calibration drive."""

    cart: Transit
    """A third party, seen but never read."""

    @property
    def camera(self) -> SimCamera:
        """The fixed camera, above the ground's origin."""
        return SimCamera.looking_down(
            focal_length_px=self.focal_length_px,
            tilt_rad=self.tilt_rad,
            roll_rad=self.roll_rad,
            heading_rad=self.heading_rad,
            height_m=self.height_m,
            image_size_px=self.image_size_px,
        )


def demo_world() -> World:
    """The world of `airground demo`: 1280x720, camera 3 m above a floor, tilted by 55 degrees.

    Returns
    -------
    world : World
        Always the same.
    """
    return World(
        focal_length_px=900.0,
        tilt_rad=radians(55),
        roll_rad=radians(4),
        heading_rad=radians(90),
        height_m=3.0,
        image_size_px=(1280, 720),
        floor="warehouse",
        robot="robot",
        path=FigureEight(centre_m=(0.0, 4.1), half_size_m=(2.0, 1.5)),
        cart=Transit(
            "cart", start_m=(-6.0, 5.6), heading_rad=radians(-5), speed_mps=0.5, start_s=34.0
        ),
    )

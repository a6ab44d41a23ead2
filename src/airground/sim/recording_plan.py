"""Which camera, and which drive under it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from airground.errors import InputError
from airground.sim.camera import SimCamera
from airground.sim.route_drive import RouteDrive, lap_time, place_route, speed_for
from airground.sim.routes import route

__all__ = ["RecordingPlan"]


@dataclass(frozen=True, slots=True)
class RecordingPlan:
    """Camera and drive. Of speed and duration one may be left out: the laps then give it."""

    drive: str = "figure_eight"
    """One of `airground.sim.routes.DRIVES`."""

    tilt_deg: float = 35.0
    """Angle of the camera's optical axis from straight down [deg]."""

    duration_s: float | None = 40.0
    """Of the tracks [s]."""

    speed_mps: float | None = None
    """Of the robots [m/s]."""

    laps: int = 1
    """How often the route is driven, round and round or there and back; not used where speed and duration are given."""

    share: float = 0.8
    """Of the image's width and height that the drive may take, around the middle."""

    corner_radius: float = 0.0
    """Of rounded corners, in units of a shape of about 1.6 by 1; 0 to stop and turn on the spot."""

    ramp_s: float = 0.5
    """Time to reach the speed from rest, and to brake [s]; 0 for a step."""

    turn_rate_radps: float = 1.5
    """Of turns on the spot [rad/s]; may be infinite."""

    turned_deg: float = 15.0
    """Turn of the shape from the image's right, counter-clockwise on the ground [deg]."""

    robots: int = 1
    """On the same route, each an equal share of the drive ahead of the one before."""

    reading: Literal["speed", "distance", "xy_dot"] = "speed"
    """What a reading holds: heading and speed, heading and odometer, or a ground velocity."""

    focal_length_px: float = 1000.0
    """Of the camera [px]."""

    height_m: float = 5.0
    """Of the camera above the ground [m]."""

    roll_deg: float = 3.0
    """Turn of "up" in the image, from -v towards +u [deg]."""

    heading_deg: float = 70.0
    """Where the camera looks on the ground, counter-clockwise from x [deg]."""

    image_size_px: tuple[int, int] = (1280, 720)
    """Width and height [px]."""

    def __post_init__(self) -> None:
        if self.robots < 1 or self.laps < 1:
            raise InputError("robots and laps must be 1 or more")
        if self.duration_s is not None and not self.duration_s > 0:
            raise InputError(f"duration_s must be positive, not {self.duration_s}")
        if self.reading not in ("speed", "distance", "xy_dot"):
            raise InputError(f"reading must be speed, distance or xy_dot, not {self.reading!r}")

    def camera(self) -> SimCamera:
        """Give the camera, above the ground's origin.

        Returns
        -------
        camera : SimCamera
            The truth, without its lens.
        """
        return SimCamera.looking_down(
            focal_length_px=self.focal_length_px,
            tilt_rad=np.radians(self.tilt_deg),
            roll_rad=np.radians(self.roll_deg),
            heading_rad=np.radians(self.heading_deg),
            height_m=self.height_m,
            image_size_px=self.image_size_px,
        )

    def route_drive(self, camera: SimCamera, rng: np.random.Generator) -> tuple[RouteDrive, float]:
        """Give the drive of the first robot, long enough for the one furthest ahead of it.

        Parameters
        ----------
        camera : SimCamera
            That sees it.
        rng : Generator
            Where random turns come from.

        Returns
        -------
        drive : RouteDrive
            On visible ground.
        duration_s : float [s]
            How long the drive is watched.

        Raises
        ------
        InputError
            If neither speed nor duration is given, or the duration is too short for the stops.
        """
        shape = route(self.drive, radius=self.corner_radius, rng=rng).turned(
            np.radians(self.heading_deg - 90.0 + self.turned_deg)
        )
        place, scale = place_route(camera, shape.outline(), self.share)
        start = (float(place[0]), float(place[1]))
        ramp, rate = self.ramp_s, self.turn_rate_radps
        laps, count = shape.repeated(self.laps), self.laps
        if self.speed_mps is not None:
            speed = self.speed_mps
        elif self.duration_s is not None:
            speed = speed_for(laps, scale, self.duration_s, ramp, rate)
        else:
            raise InputError("give speed_mps or duration_s or both")
        duration = self.duration_s or lap_time(laps, scale, speed, ramp, rate)
        if self.robots > 1 or self.speed_mps is not None:
            # A lap without its ramps is shorter than any lap, so this is never too few.
            once = lap_time(shape, scale, speed, 0.0, rate)
            count = max(int(np.ceil(duration * (2 - 1 / self.robots) / once)), count)
        if self.duration_s is None and self.robots == 1:
            count = self.laps  # to stand at the end
        return RouteDrive(shape.repeated(count), start, scale, speed, ramp, rate), duration

"""A scene: ground, bodies, light, and the camera with its lens, shutter and sensor; and the truth about its image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.body import Body
from airground.sim.camera import SimCamera
from airground.sim.ground_texture import Ground
from airground.sim.lens import Lens
from airground.sim.scene_camera import Pinhole
from airground.sim.scene_truth import BodyTruth, scene_truth

__all__ = ["CameraOfTime", "Scene", "Sun"]

CameraOfTime = Callable[[float], Pinhole]
"""From a time [s] to where the camera is then."""


@dataclass(frozen=True, slots=True)
class Sun:
    """Where the light comes from."""

    azimuth_rad: float = 0.7
    """Where shadows point on the ground, counter-clockwise from x [rad]."""

    elevation_rad: float = 1.0
    """Of the sun above the horizon [rad]; a shadow is as long as the body is high over its tangent."""

    shadow: float = 0.45
    """Share of the light missing in a shadow; 0 for none."""

    softness: float = 0.06
    """Width of a shadow's edge over the height of what casts it."""

    def __post_init__(self) -> None:
        if not (
            0 < self.elevation_rad <= np.pi / 2 and 0 <= self.shadow < 1 and self.softness >= 0
        ):
            raise InputError(
                "the sun's elevation must be in 0..pi/2, shadow in 0..1, softness >= 0"
            )

    @property
    def slant(self) -> FloatArray:
        """(2,). How far on the ground a shadow is from a point, over the point's height."""
        reach = 1 / np.tan(self.elevation_rad)
        return np.array([reach * np.cos(self.azimuth_rad), reach * np.sin(self.azimuth_rad)])


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """All that a picture depends on, apart from the noise's seed.

    The time of a frame is the middle of the exposure of the image's middle row; row v is exposed
    ``readout_s * (v - (H - 1) / 2) / H`` later.
    """

    camera: Pinhole | CameraOfTime
    """Still, or moving with time."""

    ground: Ground
    """What is below."""

    bodies: tuple[Body, ...] = ()
    """What stands and drives on it."""

    lens: Lens | None = None
    """None is a perfect one."""

    sun: Sun = Sun()
    """The light."""

    exposure_s: float = 0.0
    """How long a pixel collects light [s]; what moves meanwhile is blurred."""

    readout_s: float = 0.0
    """From the first row's exposure to the last one's [s]; 0 for a global shutter."""

    noise: float = 2.0
    """Standard deviation of the sensor's noise [grey levels]."""

    shot_noise: float = 0.0
    """What photons add to it in white [grey levels]; less in the dark."""

    brightness: float = 1.0
    """What all light is multiplied by."""

    vignetting: float = 0.0
    """Share of the light missing on the ground in the corners; only for a still camera."""

    def __post_init__(self) -> None:
        limits = (self.exposure_s, self.readout_s, self.noise, self.shot_noise, self.brightness)
        if not all(isfinite(value) and value >= 0 for value in limits):
            raise InputError("times, noise and brightness must be finite and not negative")
        if not 0 <= self.vignetting < 1:
            raise InputError(f"vignetting must be in 0..1, not {self.vignetting}")
        names = [body.name for body in self.bodies]
        if len(set(names)) != len(names):
            raise InputError(f"two bodies have one name: {', '.join(sorted(names))}")

    @property
    def still(self) -> bool:
        """Whether the camera stands still."""
        return isinstance(self.camera, Pinhole)

    @property
    def image_size_px(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.camera_at(0.0).image_size_px

    def camera_at(self, t: float) -> Pinhole:
        """Where the camera is.

        Parameters
        ----------
        t : float [s]
            When.

        Returns
        -------
        camera : Pinhole
            Without its lens.
        """
        return self.camera if isinstance(self.camera, Pinhole) else self.camera(t)

    def truth(self, t: float) -> tuple[BodyTruth, ...]:
        """Tell where everything really is in a frame.

        Parameters
        ----------
        t : float [s]
            Time of the frame.

        Returns
        -------
        truths : tuple of BodyTruth
            One for each body, in order, seen or not.
        """
        return scene_truth(self, t)

    def body(self, name: str) -> Body:
        """Find a body.

        Parameters
        ----------
        name : str
            Its name.

        Returns
        -------
        body : Body
            Of that name.

        Raises
        ------
        InputError
            If there is none.
        """
        for body in self.bodies:
            if body.name == name:
                return body
        raise InputError(f"no body is called {name!r}; there are {[b.name for b in self.bodies]}")

    def plane(self, height_m: float = 0.0, t: float = 0.0) -> SimCamera:
        """Give the camera over a plane at a height: what a calibration on marks at that height should find.

        Parameters
        ----------
        height_m : float [m]
            Of the marks above the ground.
        t : float [s]
            When, for a moving camera.

        Returns
        -------
        camera : SimCamera
            Its `image_from_ground` is that of the plane, and `g` its limited homography; without the lens.
        """
        return self.camera_at(t).plane(height_m)

    def image_from_plane(self, height_m: float = 0.0, t: float = 0.0) -> FloatArray:
        """Homography of a plane at a height.

        Parameters
        ----------
        height_m : float [m]
            Above the ground.
        t : float [s]
            When, for a moving camera.

        Returns
        -------
        image_from_plane : (3, 3) array
            px from m; without the lens.
        """
        return self.camera_at(t).image_from_plane(height_m)

    def row_time(self, t: float, v: float) -> float:
        """When the middle of a row's exposure is.

        Parameters
        ----------
        t : float [s]
            Time of the frame.
        v : float [px]
            The row.

        Returns
        -------
        t : float [s]
            Later below the middle of the image.
        """
        height = self.image_size_px[1]
        v = min(max(v, -0.5), height - 0.5)
        return t + self.readout_s * (v - (height - 1) / 2) / height

"""A pinhole camera for points with height: K, R and the centre; the ground's homography is the plane at height 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, numbers, readonly
from airground.sim.camera import SimCamera

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.sim.world import World

__all__ = ["Pinhole"]


@dataclass(frozen=True, slots=True, eq=False)
class Pinhole:
    """Where a camera is and how it looks; square pixels, no lens distortion."""

    focal_length_px: float
    """Focal length [px]."""

    camera_from_world: FloatArray
    """(3, 3). Rotation; its rows are right, down and forward in the world."""

    centre_m: FloatArray
    """(3,) [m]. Centre of projection in the world; z is the height above the ground."""

    image_size_px: tuple[int, int]
    """Width and height [px]; the principal point is in the middle."""

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "camera_from_world", readonly(self.camera_from_world, (3, 3), "rotation"))
        put(self, "centre_m", readonly(self.centre_m, (3,), "centre_m"))
        if not (self.focal_length_px > 0 and min(self.image_size_px) >= 1):
            raise InputError("focal_length_px and image_size_px must be positive")

    @classmethod
    def looking_down(
        cls,
        *,
        focal_length_px: float,
        tilt_rad: float,
        height_m: float,
        image_size_px: tuple[int, int],
        roll_rad: float = 0.0,
        heading_rad: float = 0.0,
        xy_m: tuple[float, float] = (0.0, 0.0),
    ) -> Self:
        """Pinhole camera above the ground; angles as in `SimCamera.looking_down`.

        Parameters
        ----------
        focal_length_px : float [px]
            Focal length.
        tilt_rad : float [rad]
            Angle of the optical axis from straight down.
        height_m : float [m]
            Height of the camera's centre above the ground.
        image_size_px : (int, int) [px]
            Width and height.
        roll_rad : float [rad]
            Turn of "up" in the image, from -v towards +u.
        heading_rad : float [rad]
            Where the camera looks on the ground, counter-clockwise from x; at nadir, where -v points.
        xy_m : (float, float) [m]
            Ground point below it.

        Returns
        -------
        camera : Pinhole
            There.
        """
        sin, cos = np.sin(tilt_rad), np.cos(tilt_rad)
        east, north = np.cos(heading_rad), np.sin(heading_rad)
        forward = np.array([sin * east, sin * north, -cos])
        up = np.array([cos * east, cos * north, sin])
        right = np.array([north, -east, 0.0])
        c, s = np.cos(roll_rad), np.sin(roll_rad)
        R = np.stack([c * right + s * up, s * right - c * up, forward])
        return cls(float(focal_length_px), R, np.array([*xy_m, height_m]), image_size_px)

    @classmethod
    def of_world(cls, world: World) -> Self:
        """Camera of an embedded world.

        Parameters
        ----------
        world : World
            The world.

        Returns
        -------
        camera : Pinhole
            Its `ground` is the world's `camera`.
        """
        return cls.looking_down(
            focal_length_px=world.focal_length_px,
            tilt_rad=world.tilt_rad,
            height_m=world.height_m,
            image_size_px=world.image_size_px,
            roll_rad=world.roll_rad,
            heading_rad=world.heading_rad,
        )

    @property
    def projection(self) -> FloatArray:
        """(3, 4). K (R | -R c): image points, times their depth in metres, of world points."""
        width, height = self.image_size_px
        K = np.array(
            [
                [self.focal_length_px, 0.0, (width - 1) / 2],
                [0.0, self.focal_length_px, (height - 1) / 2],
                [0.0, 0.0, 1.0],
            ]
        )
        R = self.camera_from_world
        return np.asarray(K @ np.column_stack([R, -R @ self.centre_m]))

    def image_from_plane(self, height_m: float = 0.0) -> FloatArray:
        """Homography of a plane parallel to the ground.

        Parameters
        ----------
        height_m : float [m]
            Of the plane above the ground.

        Returns
        -------
        image_from_plane : (3, 3) array
            px from m.
        """
        P = self.projection
        return np.column_stack([P[:, 0], P[:, 1], P[:, 3] + height_m * P[:, 2]])

    def plane(self, height_m: float = 0.0) -> SimCamera:
        """Give the camera as one that knows a single plane: what a calibration on that plane should find.

        Parameters
        ----------
        height_m : float [m]
            Of the plane above the ground.

        Returns
        -------
        camera : SimCamera
            With the plane's homography and its `g`.
        """
        return SimCamera(self.image_from_plane(height_m), self.image_size_px)

    def project(self, xyz: ArrayLike) -> FloatArray:
        """Image points of world points, without a lens.

        Parameters
        ----------
        xyz : (..., 3) array_like [m]
            World points.

        Returns
        -------
        uv : (..., 2) array [px]
            NaN for what is not in front of the camera.
        """
        P = self.projection
        w = numbers(xyz, "xyz") @ P[:, :3].T + P[:, 3]
        return np.asarray(w[..., :2] / np.where(w[..., 2:] > 0, w[..., 2:], np.nan))

"""A camera that plays the truth: the full homography, and nothing of what is estimated (eqs. 1, 4, 5, 6).

Nothing here is shared with `airground.geometry.velocity`, so that a slip there cannot hide in the simulation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["SimCamera"]

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class SimCamera:
    """A camera without lens distortion over the ground plane; the middle of its image shows ground."""

    image_from_ground: FloatArray
    """(3, 3). G of eq. 1, px from m; any scale is taken, the sign is kept with which depth is positive in view."""

    image_size_px: tuple[int, int]
    """Width and height [px]; pixel centres are whole numbers."""

    def __post_init__(self) -> None:
        G = readonly(self.image_from_ground, (3, 3), "image_from_ground")
        width, height = (int(size) for size in self.image_size_px)
        if min(width, height) < 1:
            raise InputError(f"image_size_px must be positive, not {self.image_size_px}")
        middle = np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
        try:
            w = np.linalg.solve(G, middle)  # eq. 2
        except np.linalg.LinAlgError as error:
            raise InputError(
                "image_from_ground is singular: the camera lies in the ground"
            ) from error
        if abs(w[2]) <= 1e-12 * float(np.abs(w).max()):
            raise InputError("the middle of the image lies on the horizon, it must show ground")
        # The ground point w / w[2] has depth 1 / w[2].
        signed = readonly(np.sign(w[2]) * G, (3, 3), "image_from_ground")
        object.__setattr__(self, "image_from_ground", signed)
        object.__setattr__(self, "image_size_px", (width, height))

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
    ) -> Self:
        """Pinhole camera with square pixels above the ground's origin: K (r1 r2 t).

        Parameters
        ----------
        focal_length_px : float [px]
            Focal length.
        tilt_rad : float [rad]
            Angle of the optical axis from straight down, below pi/2.
        height_m : float [m]
            Height of the camera's centre above the ground.
        image_size_px : (int, int) [px]
            Width and height; the principal point is in the middle.
        roll_rad : float [rad]
            Turn of "up" in the image, from -v towards +u.
        heading_rad : float [rad]
            Where the camera looks on the ground, counter-clockwise from x; at nadir, where -v points.

        Returns
        -------
        camera : SimCamera
            Over the point (0, 0) of the ground.

        Raises
        ------
        InputError
            If the focal length or the height is not positive, or the camera does not look down.
        """
        if not (focal_length_px > 0 and height_m > 0 and 0 <= tilt_rad < np.pi / 2):
            raise InputError(
                "focal_length_px and height_m must be positive and tilt_rad in 0..pi/2, "
                f"not {focal_length_px}, {height_m}, {tilt_rad}"
            )
        sin, cos = np.sin(tilt_rad), np.cos(tilt_rad)
        ahead = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0])
        zenith = np.array([0.0, 0.0, 1.0])
        forward = sin * ahead - cos * zenith
        up = cos * ahead + sin * zenith  # in the image, before the roll
        right = np.cross(forward, up)
        c, s = np.cos(roll_rad), np.sin(roll_rad)
        R = np.stack([c * right + s * up, s * right - c * up, forward])  # right, down, forward
        t = -R @ (height_m * zenith)
        width, height = image_size_px
        K = np.array(
            [
                [focal_length_px, 0.0, (width - 1) / 2],
                [0.0, focal_length_px, (height - 1) / 2],
                [0.0, 0.0, 1.0],
            ]
        )
        return cls(K @ np.column_stack([R[:, 0], R[:, 1], t]), image_size_px)

    @property
    def g(self) -> FloatArray:
        """(3, 2). First two columns over the signed cube root of the determinant (eq. 21)."""
        G = self.image_from_ground
        # Expanded by the first row: pixels and metres differ in size, which LU's pivoting would follow.
        determinant = float(
            G[0, 0] * (G[1, 1] * G[2, 2] - G[1, 2] * G[2, 1])
            - G[0, 1] * (G[1, 0] * G[2, 2] - G[1, 2] * G[2, 0])
            + G[0, 2] * (G[1, 0] * G[2, 1] - G[1, 1] * G[2, 0])
        )
        return np.asarray(G[:, :2] / np.cbrt(determinant))

    def project(self, xy: ArrayLike) -> FloatArray:
        """Image points of ground points (eqs. 4 and 5).

        Parameters
        ----------
        xy : (..., 2) array_like [m]
            Ground points.

        Returns
        -------
        uv : (..., 2) array [px]
            Image points, in the image or outside; NaN for what is not in front of the camera.
        """
        w = self._homogeneous_image(xy)
        depth = np.where(w[..., 2:] > 0, w[..., 2:], np.nan)
        return np.asarray(w[..., :2] / depth)

    def project_velocity(self, xy: ArrayLike, xy_dot: ArrayLike) -> FloatArray:
        """Image velocity of what moves on the ground, by the quotient rule (eq. 6).

        Parameters
        ----------
        xy : (..., 2) array_like [m]
            Ground points.
        xy_dot : (..., 2) array_like [m/s]
            Ground velocities.

        Returns
        -------
        uv_dot : (..., 2) array [px/s]
            Image velocities; NaN for what is not in front of the camera.
        """
        w = self._homogeneous_image(xy)
        w_dot = np.asarray(xy_dot, dtype=np.float64) @ self.image_from_ground[:, :2].T
        depth = np.where(w[..., 2:] > 0, w[..., 2:], np.nan)
        return np.asarray((depth * w_dot[..., :2] - w[..., :2] * w_dot[..., 2:]) / depth**2)

    def unproject(self, uv: ArrayLike) -> FloatArray:
        """Ground points seen at image points (eqs. 2 and 3).

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.

        Returns
        -------
        xy : (..., 2) array [m]
            Ground points; NaN on and above the horizon.
        """
        uv = np.asarray(uv, dtype=np.float64)
        H = np.linalg.inv(self.image_from_ground)
        w = uv @ H[:, :2].T + H[:, 2]
        return np.asarray(w[..., :2] / np.where(w[..., 2:] > 0, w[..., 2:], np.nan))

    def visible(self, xy: ArrayLike, margin_px: float = 0.0) -> BoolArray:
        """Tell which ground points are in front of the camera and in the image.

        Parameters
        ----------
        xy : (..., 2) array_like [m]
            Ground points.
        margin_px : float [px]
            Distance to keep from the border of the image.

        Returns
        -------
        visible : (...) array of bool
            True for points that fall onto pixels.
        """
        uv = self.project(xy)
        largest = np.array(self.image_size_px) - 0.5 - margin_px  # the border pixel's outer edge
        inside = (uv >= margin_px - 0.5) & (uv <= largest)  # NaN compares as False
        return np.asarray(inside.all(axis=-1))

    def _homogeneous_image(self, xy: ArrayLike) -> FloatArray:
        xy = np.asarray(xy, dtype=np.float64)
        if xy.ndim == 0 or xy.shape[-1] != 2:
            raise InputError(f"xy must have two entries on its last axis, not shape {xy.shape}")
        return np.asarray(xy @ self.image_from_ground[:, :2].T + self.image_from_ground[:, 2])

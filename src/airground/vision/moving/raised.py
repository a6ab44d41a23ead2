"""Marks above the ground, under a camera that moves: what holds the ground still does not hold a roof still.

With rays r = K^-1 p of the stable camera, its unit normal n towards the ground, lengths in heights of that camera, and
R, T the camera's motion since (Y' = R Y + T), the ground's homography is known up to a scale s::

    K^-1 image_from_stable K = s (R + T n')

Two directions in the plane give s and R, and the normal gives T. The camera is then at C = -R' T, at a height 1 - n.C,
and a mark at height h seen over the ground point Y is at (1 - k) Y + k C with k = h / (1 - n.C): again a homography,
``K ((1 - k) I + k C n') K^-1``, after the ground's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError, UndeterminedError
from airground.geometry.arrays import readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.vision.frame import Frame
    from airground.vision.moving.stabilization import Stabilization
    from airground.vision.moving.stabilizer import Stabilizer

__all__ = ["RaisedStabilizer", "raised"]


def raised(
    stabilization: Stabilization,
    *,
    height_ratio: float,
    normal: ArrayLike,
    focal_length_px: float,
    principal_point: ArrayLike,
) -> Stabilization:
    """Hold still a plane above the ground, the one of the marks.

    Parameters
    ----------
    stabilization : Stabilization
        Of the ground; one without a homography is given back.
    height_ratio : float
        Height of the marks over the height of the camera in the stable frame, both above the ground.
    normal : (3,) array_like
        From the camera straight down to the ground, in the stable frame's right, down and forward: for a camera
        tilted by a from straight down, (0, sin a, cos a).
    focal_length_px : float [px]
        Of a camera with square pixels.
    principal_point : (2,) array_like [px]
        Often the image's middle.

    Returns
    -------
    stabilization : Stabilization
        The same for sightings of such marks. Its covariance takes the camera and the heights as exact.

    Raises
    ------
    InputError
        If the focal length is not positive, the ratio not in 0..1, or the normal zero.
    UndeterminedError
        If the homography cannot come from such a camera: the marks would be above it.
    """
    n = readonly(normal, (3,), "normal")
    centre = readonly(principal_point, (2,), "principal_point")
    if not (focal_length_px > 0 and 0 <= height_ratio < 1 and np.linalg.norm(n) > 0):
        raise InputError(
            "focal_length_px must be positive, height_ratio in 0..1 and normal not zero, not "
            f"{focal_length_px}, {height_ratio}, {n}"
        )
    H = stabilization.stable_from_image
    if H is None:
        return stabilization
    n = n / np.linalg.norm(n)
    f = focal_length_px
    K = np.array([[f, 0.0, centre[0]], [0.0, f, centre[1]], [0.0, 0.0, 1.0]])
    A = np.linalg.solve(K, np.linalg.solve(H, K))
    along = np.linalg.svd(n[None])[2][1:]  # two directions in the plane
    turned = along @ A.T
    s = np.sqrt(np.linalg.norm(turned[0]) * np.linalg.norm(turned[1]))
    s *= np.sign(float(n @ np.linalg.solve(A, n)))  # the ground stays in front
    columns = turned / s
    third = np.cross(columns[0], columns[1]) * np.sign(float(np.cross(along[0], along[1]) @ n))
    U, _, Vt = np.linalg.svd(np.stack([*columns, third]).T @ np.stack([*along, n]))
    R = U @ Vt  # nearest rotation: the homography has noise
    T = A @ n / s - R @ n
    C = -R.T @ T
    height = 1.0 - float(n @ C)
    if not height > height_ratio:
        raise UndeterminedError(
            f"the camera would be at {height:.3g} of its first height, below the marks at "
            f"{height_ratio:.3g}; check normal and focal length"
        )
    k = height_ratio / height
    lift = K @ ((1 - k) * np.eye(3) + k * np.outer(C, n)) @ np.linalg.inv(K)
    return replace(stabilization, stable_from_image=lift @ H)


class RaisedStabilizer:
    """A stabiliser for marks above the ground: holds the ground still, and refers to the plane of the marks.

    Parameters
    ----------
    stabilizer : Stabilizer
        Of the ground.
    height_ratio : float
        As of `raised`.
    normal : (3,) array_like
        As of `raised`.
    focal_length_px : float [px]
        As of `raised`.
    principal_point : (2,) array_like [px]
        As of `raised`.
    """

    def __init__(
        self,
        stabilizer: Stabilizer,
        *,
        height_ratio: float,
        normal: ArrayLike,
        focal_length_px: float,
        principal_point: ArrayLike,
    ) -> None:
        self.ground: Stabilization | None = None
        """Of the last frame's ground."""
        self._stabilizer = stabilizer
        self._height_ratio = height_ratio
        self._normal = normal
        self._focal_length_px = focal_length_px
        self._principal_point = principal_point

    def update(self, frame: Frame, ignore: ArrayLike | None = None) -> Stabilization:
        """Take in the next frame.

        Parameters
        ----------
        frame : Frame
            Later than the one before.
        ignore : (K, 4, 2) array_like [px], optional
            Outlines of what moves or stands out of the ground.

        Returns
        -------
        stabilization : Stabilization
            Of the plane of the marks.

        Raises
        ------
        InputError
            As `raised`, and as the stabiliser.
        UndeterminedError
            If the homography cannot come from such a camera.
        """
        self.ground = self._stabilizer.update(frame, ignore)
        return raised(
            self.ground,
            height_ratio=self._height_ratio,
            normal=self._normal,
            focal_length_px=self._focal_length_px,
            principal_point=self._principal_point,
        )

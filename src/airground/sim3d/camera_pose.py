"""Where a camera is and how it looks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["CameraPose"]


@dataclass(frozen=True, slots=True, eq=False)
class CameraPose:
    """A camera in the world."""

    position: FloatArray
    """(3,) [m]. Centre of projection; z is the height above the floor."""

    world_from_camera: FloatArray
    """(3, 3). Rotation; its columns are the image's right, the image's down and forward, in the world."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", readonly(self.position, (3,), "position"))
        R = readonly(self.world_from_camera, (3, 3), "world_from_camera")
        if not (np.allclose(R @ R.T, np.eye(3), atol=1e-6) and np.linalg.det(R) > 0):
            raise InputError("world_from_camera must be a rotation")
        object.__setattr__(self, "world_from_camera", R)

    @classmethod
    def looking_at(cls, position: ArrayLike, target: ArrayLike, *, roll_rad: float = 0.0) -> Self:
        """Camera at a place that looks at another one.

        Parameters
        ----------
        position : (3,) array_like [m]
            Centre of projection.
        target : (3,) array_like [m]
            What is in the middle of the image.
        roll_rad : float [rad]
            Turn about the optical axis, clockwise as the camera sees it; at 0 the image's up is the world's, and
            the y axis where the camera looks straight down.

        Returns
        -------
        pose : CameraPose
            There.

        Raises
        ------
        InputError
            If the two places are one.
        """
        centre = readonly(position, (3,), "position")
        forward = readonly(target, (3,), "target") - centre
        length = float(np.linalg.norm(forward))
        if not length > 1e-9:
            raise InputError("a camera cannot look at the place where it is")
        forward = forward / length
        right = np.cross(forward, [0.0, 0.0, 1.0])
        if np.linalg.norm(right) < 1e-9:
            right = np.array([1.0, 0.0, 0.0])
        right = right / np.linalg.norm(right)
        down = np.cross(forward, right)
        cos, sin = np.cos(roll_rad), np.sin(roll_rad)
        R = np.column_stack([cos * right + sin * down, cos * down - sin * right, forward])
        return cls(centre, R)

    @property
    def quaternion(self) -> FloatArray:
        """(4,) w, x, y, z of a camera that looks along its -z with y up, as MuJoCo counts."""
        R = self.world_from_camera * np.array([1.0, -1.0, -1.0])
        # The largest of the four is never small: no division by what may be zero.
        squares = (
            np.array(
                [
                    1 + np.trace(R),
                    1 + R[0, 0] - R[1, 1] - R[2, 2],
                    1 - R[0, 0] + R[1, 1] - R[2, 2],
                    1 - R[0, 0] - R[1, 1] + R[2, 2],
                ]
            )
            / 4
        )
        products = {
            (0, 1): R[2, 1] - R[1, 2],
            (0, 2): R[0, 2] - R[2, 0],
            (0, 3): R[1, 0] - R[0, 1],
            (1, 2): R[0, 1] + R[1, 0],
            (1, 3): R[0, 2] + R[2, 0],
            (2, 3): R[1, 2] + R[2, 1],
        }
        k = int(np.argmax(squares))
        largest = float(np.sqrt(squares[k]))
        q = np.array(
            [
                largest if j == k else products[min(j, k), max(j, k)] / (4 * largest)
                for j in range(4)
            ]
        )
        return np.asarray(q / np.linalg.norm(q))

"""What g says about the camera, given square pixels and a principal point.

With K the intrinsic matrix, ``K^-1 g = s (r1 r2)`` with r1, r2 orthonormal: the ground's axes seen from the camera.
That gives two equations for the one unknown focal length f. With (G1 G2) shifted to the principal point and
``h = G1 + i G2`` (complex, entry by entry) they are the two parts of::

    (h_u^2 + h_v^2) + f^2 h_w^2 = 0

which a rotation of the ground frame leaves alone. The height follows from det(G) = 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.errors import InputError, UndeterminedCameraError
from airground.geometry import velocity
from airground.geometry.arrays import LARGEST, FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["PlaneCamera", "camera_from_g"]


@dataclass(frozen=True, slots=True, eq=False)
class PlaneCamera:
    """A pinhole camera with square pixels over the ground."""

    focal_length_px: float
    """Focal length [px]."""

    tilt_rad: float
    """Angle of the optical axis from straight down [rad]: 0 at nadir, pi/2 when it is level."""

    roll_rad: float
    """Turn of "up" in the image, from -v towards +u [rad]; NaN at nadir, where no direction is up."""

    height_m: float
    """Height of the camera's centre above the ground [m]."""

    handedness: Literal["right", "left"]
    """Of the ground frame, seen from above: x, y, up."""

    principal_point_px: FloatArray
    """(2,) [px]. As given."""

    square_pixel_residual: float
    """How badly the two equations for f agree: 0 for square pixels and the right principal point."""

    camera_from_ground: FloatArray
    """(3, 3). Rotation from x, y, up (made right-handed by mirroring y) to right, down, forward."""

    @property
    def tilt_deg(self) -> float:
        """Tilt in degrees."""
        return float(np.degrees(self.tilt_rad))

    @property
    def roll_deg(self) -> float:
        """Roll in degrees."""
        return float(np.degrees(self.roll_rad))


def camera_from_g(
    g: FloatArray,
    principal_point: ArrayLike,
    *,
    focal_length: float | None = None,
    ground_uv: ArrayLike | None = None,
) -> PlaneCamera:
    """Focal length, tilt, roll and height of a camera with square pixels.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography, scaled as in eq. 21.
    principal_point : (2,) array_like [px]
        Where the optical axis meets the image.
    focal_length : float, optional [px]
        If it is known.
    ground_uv : (2,) array_like, optional [px]
        A point of the visible ground; the principal point where not given.

    Returns
    -------
    camera : PlaneCamera
        What g says about the camera.

    Raises
    ------
    UndeterminedCameraError
        If g does not determine a focal length.
    InputError
        If `ground_uv` lies on the horizon, or `focal_length` is not positive.
    """
    centre = readonly(principal_point, (2,), "principal_point")
    seen = centre if ground_uv is None else readonly(ground_uv, (2,), "ground_uv")
    nc = float(velocity.nearness(g, seen))
    if nc == 0.0:
        raise InputError("ground_uv lies on the horizon; name a point of the visible ground")

    shifted = np.array(g)
    shifted[:2] -= centre[:, None] * g[2]  # principal point to (0, 0)
    f = _focal_length(shifted) if focal_length is None else float(focal_length)
    if not 1 / LARGEST < f < LARGEST:
        raise InputError(f"focal_length must be positive and at most {LARGEST:g} px, not {f:g}")

    axes = shifted / np.array([[f], [f], [1.0]])  # K^-1 g = s (r1 r2)
    # H3.c = 1 / (s depth): n.c tells the sign of s, and with it the handedness of the frame.
    size = float(np.sqrt(np.sum(axes**2) / 2))
    r1, r2 = (axes / (np.sign(nc) * size)).T
    # r1, r2 are orthonormal only if pixels are square: nearest rotation. Up is r1 x r2 mirrored for left-handed frames.
    handedness: Literal["right", "left"] = "right" if nc < 0 else "left"
    mirror = 1.0 if handedness == "right" else -1.0
    U, _, Vt = np.linalg.svd(np.column_stack([r1, mirror * r2]), full_matrices=False)
    r1, r2 = (U @ Vt).T
    R = np.column_stack([r1, r2, np.cross(r1, r2)])
    up = R[:, 2]

    h = shifted[:, 0] + 1j * shifted[:, 1]
    left, right = h[0] ** 2 + h[1] ** 2, f**2 * h[2] ** 2
    level = float(np.hypot(up[0], up[1]))
    return PlaneCamera(
        focal_length_px=f,
        tilt_rad=float(np.arctan2(level, -up[2])),
        roll_rad=float(np.arctan2(up[0], -up[1])) if level > 1e-9 else float("nan"),
        height_m=1.0 / (f**2 * size**3),  # det(s K (r1 r2 t)) = s^3 f^2 (r3.t) = 1, |r3.t| = height
        handedness=handedness,
        principal_point_px=centre,
        square_pixel_residual=float(abs(left + right) / float(np.sum(np.abs(h[:2]) ** 2))),
        camera_from_ground=readonly(R, (3, 3), "camera_from_ground"),
    )


def _focal_length(shifted: FloatArray) -> float:
    """Least squares of the two equations for f^2."""
    h = shifted[:, 0] + 1j * shifted[:, 1]
    left, right = h[0] ** 2 + h[1] ** 2, h[2] ** 2
    across = float(np.sum(np.abs(h[:2]) ** 2))
    if abs(left) <= 1e-9 * across:
        raise UndeterminedCameraError(
            "the camera looks straight down: g gives only the ratio of height and focal length; "
            "give the focal length"
        )
    squared = -float(np.real(left * np.conj(right))) / max(float(abs(right) ** 2), 1e-300)
    if not 1 / LARGEST**2 < squared < LARGEST**2:
        raise UndeterminedCameraError(
            "no focal length explains g with square pixels and this principal point; "
            "give the principal point or the focal length"
        )
    return float(np.sqrt(squared))

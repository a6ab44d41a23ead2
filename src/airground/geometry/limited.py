"""The limited homography g and all that follows from it (paper, sections 2 and 2.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry import velocity
from airground.geometry.arrays import (
    LARGEST,
    FloatArray,
    homogeneous,
    points,
    readonly,
    refuse_huge,
)
from airground.geometry.camera import PlaneCamera, camera_from_g
from airground.geometry.homography import Collineation, unit_determinant

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["LimitedHomography"]


@dataclass(frozen=True, slots=True, eq=False)
class LimitedHomography:
    """How motion on the ground and motion in the image belong together, wherever the ground's origin is.

    Its scale is the metric: build it with `from_homography` or an estimator unless the columns are
    already scaled as in eq. 21.
    """

    g: FloatArray
    """(3, 2). First two columns of image_from_ground, px and m, scaled to determinant one (eq. 21)."""

    def __post_init__(self) -> None:
        g = readonly(self.g, (3, 2), "g")
        singular = np.linalg.svd(g / np.maximum(np.abs(g).max(axis=1, keepdims=True), 1e-300))[1]
        if not singular[1] > 1e-12 * singular[0]:
            raise InputError("the columns of g are parallel: no camera sees the ground like that")
        refuse_huge(g, "g")
        if np.abs(g).max() < 1 / LARGEST:
            raise InputError(f"g has no entry above {1 / LARGEST:g}; check the units")
        object.__setattr__(self, "g", g)

    def __repr__(self) -> str:
        return f"LimitedHomography({np.array2string(self.g, separator=', ', prefix=' ' * 18)})"

    @classmethod
    def from_homography(cls, image_from_ground: ArrayLike) -> LimitedHomography:
        """Keep what velocities can see of a full homography (eq. 21).

        Parameters
        ----------
        image_from_ground : (3, 3) array_like
            Homography G of eq. 1, at any scale and sign.

        Returns
        -------
        model : LimitedHomography
            Its first two columns, scaled.

        Raises
        ------
        InputError
            If the matrix is singular, not finite or not 3x3.
        """
        G = readonly(image_from_ground, (3, 3), "image_from_ground")
        return cls(unit_determinant(G)[:, :2])

    # Velocities

    def image_velocity(self, uv: ArrayLike, xy_dot: ArrayLike) -> FloatArray:
        """Velocity in the image of what moves at `xy_dot` on the ground (eq. 15).

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.
        xy_dot : (..., 2) array_like [m/s]
            Ground velocities.

        Returns
        -------
        uv_dot : (..., 2) array [px/s]
            Image velocities; leading axes broadcast.
        """
        return velocity.image_velocity(self.g, uv, xy_dot)

    def ground_velocity(self, uv: ArrayLike, uv_dot: ArrayLike) -> FloatArray:
        """Velocity on the ground of what moves at `uv_dot` in the image: eq. 15, inverted.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.
        uv_dot : (..., 2) array_like [px/s]
            Image velocities.

        Returns
        -------
        xy_dot : (..., 2) array [m/s]
            Ground velocities, NaN on the horizon; leading axes broadcast.
        """
        return velocity.ground_velocity(self.g, uv, uv_dot)

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Derivative of the image point by the ground point (eq. 15).

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.

        Returns
        -------
        J : (..., 2, 2) array [px/m]
            ``uv_dot = J @ xy_dot``.
        """
        return velocity.velocity_jacobian(self.g, uv)

    def jacobian_rate(self, uv: ArrayLike, uv_dot: ArrayLike) -> FloatArray:
        """Rate of the Jacobian along a motion in the image.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.
        uv_dot : (..., 2) array_like [px/s]
            Their velocities.

        Returns
        -------
        J_dot : (..., 2, 2) array [px/m/s]
            ``uv_ddot = J @ xy_ddot + J_dot @ xy_dot``.
        """
        return velocity.velocity_jacobian_rate(self.g, uv, uv_dot)

    def pixels_per_metre(self, uv: ArrayLike) -> FloatArray:
        """Give the smallest and the largest scale over all headings.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.

        Returns
        -------
        scale : (..., 2) array [px/m]
            Singular values of the Jacobian, the smaller first.
        """
        return np.asarray(np.linalg.svd(self.jacobian(uv), compute_uv=False)[..., ::-1])

    # The horizon (section 2.2)

    @property
    def horizon(self) -> FloatArray:
        """(3,) line G1 x G2 in the image: n.c = 0. With det(G) = 1 it is H3 of eq. 14."""
        return velocity.horizon_line(self.g)

    def nearness(self, uv: ArrayLike) -> FloatArray:
        """H3.c: proportional to the inverse depth, zero on the horizon.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.

        Returns
        -------
        nc : (...) array
            On visible ground negative if the ground frame is right-handed, positive if left-handed.
        """
        return velocity.nearness(self.g, uv)

    def same_side(
        self, uv: ArrayLike, ground_uv: ArrayLike
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Tell whether points lie on the same side of the horizon as a point known to be ground.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points to ask about.
        ground_uv : (..., 2) array_like [px]
            Points on the ground, for example those where the robot was seen.

        Returns
        -------
        same : (...) array of bool
            False on and beyond the horizon.
        """
        return np.asarray(self.nearness(uv) * np.sign(self.nearness(ground_uv)) > 0)

    def vanishing_point(self, xy_dot: ArrayLike) -> FloatArray:
        """Image point that motion along `xy_dot` heads for (section 2.2).

        Parameters
        ----------
        xy_dot : (..., 2) array_like [m/s]
            Ground velocities; their lengths only scale the result.

        Returns
        -------
        vp : (..., 3) array
            Homogeneous image points on the horizon.
        """
        return np.asarray(points(xy_dot, "xy_dot") @ self.g.T)

    # The full homography, once an origin is chosen

    def image_from_ground(self, origin_uv: ArrayLike) -> FloatArray:
        """Full homography with the ground's origin at an image point: G3 = c0 / (n.c0).

        Choosing the origin supplies the two degrees of freedom that velocities cannot see.

        Parameters
        ----------
        origin_uv : (2,) array_like [px]
            Image point of the ground's origin.

        Returns
        -------
        G : (3, 3) array
            Homography of eq. 1 with determinant one.

        Raises
        ------
        InputError
            If the point lies on the horizon.
        """
        c0 = homogeneous(readonly(origin_uv, (2,), "origin_uv"))
        nc = float(self.horizon @ c0)
        if abs(nc) <= 1e-12 * float(np.abs(self.horizon * c0).max()):
            raise InputError("origin_uv lies on the horizon; choose a point on the ground")
        return np.column_stack([self.g, c0 / nc])

    def ground_from_image(self, origin_uv: ArrayLike) -> FloatArray:
        """Inverse of `image_from_ground`: rectification to metric ground coordinates.

        Parameters
        ----------
        origin_uv : (2,) array_like [px]
            Image point of the ground's origin.

        Returns
        -------
        H : (3, 3) array
            Homography of eq. 2 with determinant one.
        """
        return np.asarray(np.linalg.inv(self.image_from_ground(origin_uv)))

    def ground_position(self, uv: ArrayLike, origin_uv: ArrayLike) -> FloatArray:
        """Metric ground coordinates of image points.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.
        origin_uv : (2,) array_like [px]
            Image point of the ground's origin; it must be a point of the visible ground.

        Returns
        -------
        xy : (..., 2) array [m]
            Ground points; NaN for what is on or beyond the horizon, which is not ground.
        """
        uv = points(uv, "uv")
        xy = Collineation(self.ground_from_image(origin_uv)).apply(uv)
        return np.asarray(np.where(self.same_side(uv, origin_uv)[..., None], xy, np.nan))

    def image_position(self, xy: ArrayLike, origin_uv: ArrayLike) -> FloatArray:
        """Image points of ground points: the inverse of `ground_position`.

        Parameters
        ----------
        xy : (..., 2) array_like [m]
            Ground points.
        origin_uv : (2,) array_like [px]
            Image point of the ground's origin.

        Returns
        -------
        uv : (..., 2) array [px]
            Image points; NaN for ground behind the camera.
        """
        xy = points(xy, "xy")
        G = self.image_from_ground(origin_uv)
        depth = homogeneous(xy) @ G[2]  # the origin's is 1 / (n.c0); behind, the sign flips
        uv = Collineation(G).apply(xy)
        return np.asarray(np.where((depth * np.sign(G[2, 2]) > 0)[..., None], uv, np.nan))

    # The ground frame's rotation, and the camera

    def rotated(self, angle: float) -> LimitedHomography:
        """Give the same camera with the ground frame turned.

        Parameters
        ----------
        angle : float [rad]
            Heading that the new frame's x axis has in the old frame, counter-clockwise.

        Returns
        -------
        model : LimitedHomography
            ``g`` times a rotation: all images stay as they are.
        """
        cos, sin = np.cos(angle), np.sin(angle)
        return LimitedHomography(self.g @ np.array([[cos, -sin], [sin, cos]]))

    def camera(
        self,
        principal_point: ArrayLike,
        *,
        focal_length: float | None = None,
        ground_uv: ArrayLike | None = None,
    ) -> PlaneCamera:
        """Focal length, tilt, roll and height of a camera with square pixels.

        Parameters
        ----------
        principal_point : (2,) array_like [px]
            Where the optical axis meets the image, often its middle.
        focal_length : float, optional [px]
            If it is known; needed when the camera looks straight down, where g determines only its
            ratio to the height.
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
        return camera_from_g(
            self.g, principal_point, focal_length=focal_length, ground_uv=ground_uv
        )

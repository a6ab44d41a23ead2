"""From image to ground and back at one point, in plain numbers: what controllers ask at each tick.

With g = [A; b], n = G1 x G2 and ``M = A - c b``: ``J = (n.c) M`` and det(M) = n.c, as det(G) = 1. Between two image
points of the ground the displacement is exactly ``M^-1 (goal - c) / (n.goal)``: the direction is that of
``J^-1 (goal - c)``, as collineations keep lines, and the factor (n.c) / (n.goal) makes its length metric. No origin,
no rectified plane.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import nan
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from airground.control.floor import Floor

__all__ = ["ImageLaw"]

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class ImageLaw:
    """Ground vectors of image vectors, for the one who has no time for small arrays."""

    floor: Floor
    """What is known of image and ground; its origin plays no part."""

    _rows: tuple[tuple[float, ...], ...] = field(init=False, repr=False)
    """Rows of g, then the horizon."""

    def __post_init__(self) -> None:
        model = self.floor.model
        rows = (*model.g.tolist(), model.horizon.tolist())
        object.__setattr__(self, "_rows", tuple(map(tuple, rows)))

    def sees(self, u: float, v: float) -> bool:
        """Whether an image point is visible ground.

        Parameters
        ----------
        u, v : float [px]
            Image point.

        Returns
        -------
        sees : bool
            False on and beyond the horizon, and for NaN.
        """
        n0, n1, n2 = self._rows[3]
        return (n0 * u + n1 * v + n2) * self.floor.side > 0

    def displacement(self, u: float, v: float, goal_u: float, goal_v: float) -> Pair:
        """Ground displacement from one image point to another.

        Parameters
        ----------
        u, v : float [px]
            Where from.
        goal_u, goal_v : float [px]
            Where to.

        Returns
        -------
        step : (float, float) [m]
            In the ground frame; NaN if one of them is not visible ground.
        """
        (a, b), (c, d), (e, f), (n0, n1, n2) = self._rows
        nc, ng = n0 * u + n1 * v + n2, n0 * goal_u + n1 * goal_v + n2
        side = self.floor.side
        if not (nc * side > 0 and ng * side > 0):
            return nan, nan
        du, dv, k = goal_u - u, goal_v - v, 1 / (nc * ng)
        return (
            k * ((d - v * f) * du - (b - u * f) * dv),
            k * ((a - u * e) * dv - (c - v * e) * du),
        )

    def to_ground(self, u: float, v: float, u_dot: float, v_dot: float) -> Pair:
        """J^-1 on an image vector.

        Parameters
        ----------
        u, v : float [px]
            Where it is.
        u_dot, v_dot : float [px/s]
            Image velocity, or any other rate.

        Returns
        -------
        xy_dot : (float, float) [m/s]
            Ground velocity; NaN if the point is not visible ground.
        """
        (a, b), (c, d), (e, f), (n0, n1, n2) = self._rows
        nc = n0 * u + n1 * v + n2
        if not nc * self.floor.side > 0:
            return nan, nan
        k = 1 / (nc * nc)
        return (
            k * ((d - v * f) * u_dot - (b - u * f) * v_dot),
            k * ((a - u * e) * v_dot - (c - v * e) * u_dot),
        )

    def to_image(self, u: float, v: float, x_dot: float, y_dot: float) -> Pair:
        """J on a ground vector (eq. 15).

        Parameters
        ----------
        u, v : float [px]
            Where it is.
        x_dot, y_dot : float [m/s]
            Ground velocity.

        Returns
        -------
        uv_dot : (float, float) [px/s]
            Image velocity.
        """
        (a, b), (c, d), (e, f), (n0, n1, n2) = self._rows
        nc = n0 * u + n1 * v + n2
        return (
            nc * ((a - u * e) * x_dot + (b - u * f) * y_dot),
            nc * ((c - v * e) * x_dot + (d - v * f) * y_dot),
        )

    def bend(self, uv: Pair, uv_dot: Pair, xy_dot: Pair) -> Pair:
        """J' w: image acceleration of a ground vector that stays, as the point moves under it.

        Parameters
        ----------
        uv : (float, float) [px]
            Where it is.
        uv_dot : (float, float) [px/s]
            How the point moves.
        xy_dot : (float, float) [m/s]
            The ground vector, not always the one that belongs to this motion.

        Returns
        -------
        uv_ddot : (float, float) [px/s^2]
            ``(n.c') M w - (n.c) c' (b.w)``.
        """
        (u, v), (u_dot, v_dot), (x_dot, y_dot) = uv, uv_dot, xy_dot
        (a, b), (c, d), (e, f), (n0, n1, n2) = self._rows
        nc, rate = n0 * u + n1 * v + n2, n0 * u_dot + n1 * v_dot
        depth = nc * (e * x_dot + f * y_dot)
        return (
            rate * ((a - u * e) * x_dot + (b - u * f) * y_dot) - depth * u_dot,
            rate * ((c - v * e) * x_dot + (d - v * f) * y_dot) - depth * v_dot,
        )

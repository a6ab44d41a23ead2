"""From ground points to pixels, with derivatives: g in normalised pixels, the lens after it.

With T the normalisation of the image, g_T = T g / det(T)^(1/3) has unit determinant again. The ground's origin is under
the normalised image point (0, 0, 1) =: e, so that G3 = e / (n.e), and a ground point P is seen at

    c ~ g_T P + e / n_3,      n = G1 x G2

Derivatives by g act on the first term and through n_3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.linear import normalizer
from airground.geometry.arrays import FloatArray
from airground.geometry.lens import DivisionLens

if TYPE_CHECKING:
    from typing import Self

BEND = 0.15  # k1 of a usual lens, either way, in half diagonals of the image

__all__ = ["Projected", "View", "project", "project_with_derivatives"]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Normalisation of the image: middle, scale, and the lens's centre."""

    middle: FloatArray
    """(2,) [px]. Image point that the ground's origin lies under."""

    scale: float
    """Normalised units per pixel [1/px]."""

    center: FloatArray
    """(2,) [px]. Centre of the lens."""

    @classmethod
    def around(cls, uv: FloatArray, center: FloatArray | None = None) -> Self:
        """Normalise to mean zero and unit spread.

        Parameters
        ----------
        uv : (N, 2) array [px]
            Sightings.
        center : (2,) array, optional [px]
            Centre of the lens; the middle of the sightings' box where not known.

        Returns
        -------
        view : View
            Of those points.
        """
        T = normalizer(uv)
        box = (uv.min(axis=0) + uv.max(axis=0)) / 2
        return cls(-T[:2, 2] / T[0, 0], float(T[0, 0]), box if center is None else center)

    @property
    def usual_bend(self) -> float:
        """How large a lens's k1 usually is, in normalised units."""
        # An image begins at (0, 0): its corners are as far from the middle as that is from there.
        corner = max(float(np.linalg.norm(self.center)), 1 / self.scale)
        return BEND / (corner * self.scale) ** 2

    @property
    def matrix(self) -> FloatArray:
        """(3, 3). T."""
        u, v = self.middle
        s = self.scale
        return np.array([[s, 0.0, -s * u], [0.0, s, -s * v], [0.0, 0.0, 1.0]])

    def to_normal(self, g: FloatArray) -> FloatArray:
        """Limited homography in normalised pixels: g_T from g.

        Parameters
        ----------
        g : (3, 2) array
            Limited homography in pixels.

        Returns
        -------
        g_T : (3, 2) array
            In normalised pixels, with unit determinant.
        """
        return np.asarray(self.matrix @ g / self.scale ** (2 / 3))

    @property
    def px_from_normal(self) -> FloatArray:
        """(6, 6). Takes g_T, row by row, to g."""
        return np.kron(np.linalg.inv(self.matrix) * self.scale ** (2 / 3), np.eye(2))

    def to_px(self, g_T: FloatArray) -> FloatArray:
        """Limited homography in pixels: g from g_T.

        Parameters
        ----------
        g_T : (3, 2) array
            In normalised pixels.

        Returns
        -------
        g : (3, 2) array
            Limited homography in pixels.
        """
        return np.asarray(self.px_from_normal @ g_T.ravel()).reshape(3, 2)

    def lens(self, bend: float) -> DivisionLens | None:
        """Division model in pixels.

        Parameters
        ----------
        bend : float
            k1 in normalised units.

        Returns
        -------
        lens : DivisionLens or None
            None for no distortion.
        """
        return None if bend == 0.0 else DivisionLens(bend * self.scale**2, self.center)


@dataclass(frozen=True, slots=True, eq=False)
class Projected:
    """Where ground points are seen, and how that depends on everything."""

    uv: FloatArray
    """(N, 2) [px]. Image points."""

    by_xy: FloatArray
    """(N, 2, 2) [px/m]. Derivative by the ground point."""

    by_g: FloatArray
    """(N, 2, 6) [px]. Derivative by g_T, row by row."""

    by_bend: FloatArray | None
    """(N, 2) [px]. Derivative by the lens's k1 in normalised units, where asked for."""


def project(view: View, g_T: FloatArray, bend: float, xy: FloatArray) -> FloatArray:
    """See ground points.

    Parameters
    ----------
    view : View
        Normalisation.
    g_T : (3, 2) array
        Limited homography in normalised pixels.
    bend : float
        k1 of the lens in normalised units.
    xy : (N, 2) array [m]
        Ground points.

    Returns
    -------
    uv : (N, 2) array [px]
        NaN for what is behind the camera or beyond the lens's reach.
    """
    uv, _ = _pinhole(view, g_T, xy)
    lens = view.lens(bend)
    return uv if lens is None else lens.distort(uv)


def project_with_derivatives(
    view: View, g_T: FloatArray, bend: float, xy: FloatArray, *, lens_too: bool = False
) -> Projected:
    """See ground points, with derivatives.

    Parameters
    ----------
    view : View
        Normalisation.
    g_T : (3, 2) array
        Limited homography in normalised pixels.
    bend : float
        k1 of the lens in normalised units.
    xy : (N, 2) array [m]
        Ground points.
    lens_too : bool
        Whether to differentiate by the lens.

    Returns
    -------
    projected : Projected
        Points and derivatives.
    """
    uv, w = _pinhole(view, g_T, xy)
    x = (uv - view.middle) * view.scale
    n3 = _third(g_T)
    over = 1 / (w * view.scale)  # also back to pixels
    by_xy = (g_T[None, :2, :] - x[:, :, None] * g_T[2]) * over[:, None, None]
    moved = xy * over[:, None]
    by_g = np.zeros((len(xy), 2, 6))
    by_g[:, 0, 0:2] = moved
    by_g[:, 1, 2:4] = moved
    by_g[:, :, 4:6] = -x[:, :, None] * moved[:, None, :]
    # n_3 = g11 g22 - g21 g12, and it stands in c's third entry as 1 / n_3.
    (a, b), (c, d), _ = g_T
    by_g += (x * (over / n3**2)[:, None])[:, :, None] * np.array([d, -c, -b, a, 0.0, 0.0])
    lens = view.lens(bend)
    by_bend = None
    if lens_too:
        known = lens or DivisionLens(0.0, view.center)
        by_bend = known.distort_by_k1(uv) * view.scale**2
    if lens is not None:
        bent = lens.distort_jacobian(uv)
        by_xy, by_g, uv = bent @ by_xy, bent @ by_g, lens.distort(uv)
    return Projected(uv, by_xy, by_g, by_bend)


def _third(g_T: FloatArray) -> float:
    return float(g_T[0, 0] * g_T[1, 1] - g_T[1, 0] * g_T[0, 1])


def _pinhole(view: View, g_T: FloatArray, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Undistorted pixels, and the third homogeneous entry."""
    n3 = _third(g_T)
    w = xy @ g_T[2] + 1 / n3
    # The origin's own w is 1 / n3; behind the camera its sign flips.
    w = np.where(w * n3 > 0, w, np.nan)
    uv = (xy @ g_T[:2].T) / (w * view.scale)[:, None] + view.middle
    return uv, w

"""How a camera stretches small things, as a function of the place in the image.

A pattern on the ground is seen through A = J R, J the derivative of the image by the ground at that place and R a turn.
``A A^T = J J^T`` does not depend on the turn, and its logarithm is smooth: three polynomials of second degree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.geometry.arrays import FloatArray

__all__ = ["View", "fit_view"]

RIDGE = 0.3
"""Matches whose weight the polynomials' slopes and bends must beat."""

OUTLIER = 0.5
"""Difference of a logarithm beyond which a match is none."""

LEAST_SCATTER = 0.1
ROUNDS = 4


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Logarithm of the stretch over the image."""

    middle: FloatArray
    """(2,) [px]. Where the places are counted from."""

    extent: float
    """What they are divided by [px]."""

    coefficients: FloatArray
    """(6, 3). Of 1, a, b, a^2, a b, b^2 for size, and for two components of the stretch."""

    scatter: float
    """Root mean square of what matches differ by, in one component."""

    def at(self, uv: FloatArray) -> FloatArray:
        """Logarithms that are expected.

        Parameters
        ----------
        uv : (N, 2) array [px]
            Places.

        Returns
        -------
        logs : (N, 3) array
            Size, stretch along u over v, stretch along the diagonals.
        """
        return np.asarray(_monomials(uv, self.middle, self.extent) @ self.coefficients)

    def cost(self, A: FloatArray, uv: FloatArray, relative_sigma: float) -> FloatArray:
        """How unlikely matches are.

        Parameters
        ----------
        A : (N, 2, 2) array
            From pattern to image.
        uv : (N, 2) array [px]
            Where.
        relative_sigma : float [px]
            Noise of a point, over the pattern's size in its own unit.

        Returns
        -------
        cost : (N,) array
            Halves of squared deviations; infinite for flat matches.
        """
        expected = self.at(uv)
        size = np.exp(expected[:, 0] / 2)
        sigma = np.hypot(self.scatter, 4 * relative_sigma / np.maximum(size, 1e-12))
        off = np.sum((_logs(A) - expected) ** 2, axis=1)
        return np.where(np.isfinite(off), 0.5 * off / sigma**2, np.inf)


def fit_view(A: FloatArray, uv: FloatArray) -> View:
    """Fit the stretch of matches, of which some are wrong.

    Parameters
    ----------
    A : (N, 2, 2) array
        From pattern to image.
    uv : (N, 2) array [px]
        Where.

    Returns
    -------
    view : View
        Constant where the matches are all in one place.
    """
    logs = _logs(A)
    good = np.isfinite(logs).all(axis=1)
    logs, uv = logs[good], uv[good]
    middle = uv.mean(axis=0)
    extent = max(float(np.sqrt(np.mean((uv - middle) ** 2))), 1.0)
    X = _monomials(uv, middle, extent)
    start = np.median(logs, axis=0)
    coefficients = np.zeros((6, 3))
    coefficients[0] = start
    prior = RIDGE * np.diag([0.0, 1, 1, 4, 4, 4])
    limit = 4 * OUTLIER  # a steep view differs much over the image
    for _ in range(ROUNDS):
        weight = (np.linalg.norm(logs - X @ coefficients, axis=1) < limit).astype(np.float64)
        if weight.sum() < 6:
            break
        W = X * weight[:, None]
        coefficients = np.linalg.solve(W.T @ X + prior + 1e-9 * np.eye(6), W.T @ logs)
        limit = max(OUTLIER, limit / 2)
    off = np.linalg.norm(logs - X @ coefficients, axis=1)
    near = off[off < OUTLIER]
    scatter = float(np.sqrt(np.mean(near**2) / 3)) if len(near) else OUTLIER
    return View(middle, extent, coefficients, max(scatter, LEAST_SCATTER))


def _logs(A: FloatArray) -> FloatArray:
    """(N, 3). Logarithm of A A^T: half its trace, half the difference of its diagonal, its other entry."""
    M = A @ A.swapaxes(1, 2)
    middle = (M[:, 0, 0] + M[:, 1, 1]) / 2
    d, o = (M[:, 0, 0] - M[:, 1, 1]) / 2, M[:, 0, 1]
    r = np.hypot(d, o)
    with np.errstate(divide="ignore", invalid="ignore"):
        high, low = np.log(middle + r), np.log(middle - r)
        by = np.where(r > 0, (high - low) / 2 / np.where(r > 0, r, 1.0), 0.0)
        return np.column_stack([(high + low) / 2, d * by, o * by])


def _monomials(uv: FloatArray, middle: FloatArray, extent: float) -> FloatArray:
    a, b = np.clip((uv - middle) / extent, -4, 4).T
    return np.column_stack([np.ones_like(a), a, b, a * a, a * b, b * b])

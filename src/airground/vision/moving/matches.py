"""Matched points on their way to a homography: the robust start, the refinement, and what comes out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.geometry.homography import unit_determinant
from airground.vision.moving.fit_types import (
    GATE,
    LEAST,
    BoolArray,
    HomographyFit,
    NoiseScale,
    closeness,
)
from airground.vision.moving.search import search_homography
from airground.vision.moving.small_motion import (
    UNIT_PX,
    apply_homography,
    change_of_basis,
    homography_jacobian,
    move,
    moved_by,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Matches"]

MEDIAN = 1.386  # of chi-square of two degrees of freedom
QUARTER = 0.575  # and what a quarter of it is below
LOOSEST = (
    0.2  # deviation of a term of H beyond which H counts as open, the points' spread being one
)
ROUGH = 4.0  # a start may be so much further off, squared
ROUNDS = 8
STEPS = 6
SETTLED = 1e-7  # of the points' spread
SECOND_SHARE = 0.5  # of the first homography's points: a second one may be the ground as well


class Matches:
    """Matches, and the steps towards their homography.

    Parameters
    ----------
    source : (N, 2) array [px]
        Points in one image.
    target : (N, 2) array [px]
        The same in the other.
    of_source : (N, 2, 2) array [px2]
        Covariances of the source points.
    of_target : (N, 2, 2) array [px2]
        Covariances of the target points.
    prior : NoiseScale
        What is known of the noise beside those.
    """

    def __init__(
        self,
        source: FloatArray,
        target: FloatArray,
        of_source: FloatArray,
        of_target: FloatArray,
        prior: NoiseScale,
    ) -> None:
        self.source, self.target = source, target
        self.of_source, self.of_target = of_source, of_target
        self.prior = prior

    def first(self, starts: Sequence[FloatArray], *, search: bool = True) -> FloatArray | None:
        """A homography that many matches follow closely: a given one if most do, else the best that is found.

        Parameters
        ----------
        starts : sequence of (3, 3) array
            Given ones.
        search : bool
            Whether to search for others.

        Returns
        -------
        H : (3, 3) array or None
            None where nothing is found.
        """
        tight = GATE * self.prior.factor**2
        for H in starts:
            near = int((self.distances(H)[1] < ROUGH * tight).sum())
            if near >= max(2 * LEAST, 0.6 * len(self.source)):
                return H
        found: list[FloatArray | None]
        if not search:
            found = []
        elif len(self.source) == LEAST:
            found = [_through_four(self.source, self.target)]
        else:
            total = self.of_source + self.of_target
            sigma = float(np.sqrt(np.median(np.trace(total, axis1=1, axis2=2)) / 2))
            sigma = max(sigma * self.prior.factor, 1e-3)
            sizes = (3 * sigma,) if np.isinf(self.prior.worth) else (3 * sigma, sigma)
            found = [self._search(size) for size in sizes]
        best = [H for H in (*starts, *found) if H is not None]
        return max(best, key=self._score, default=None)

    def _search(self, threshold_px: float) -> FloatArray | None:
        found = search_homography(self.source, self.target, threshold_px, iterations=5000)
        return None if found is None else found[0]

    def _score(self, H: FloatArray) -> float:
        """How good a homography is for a start."""
        return closeness(self.distances(H)[1] / self.prior.factor**2)

    def distances(self, H: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """How far the matches are from a homography.

        Parameters
        ----------
        H : (3, 3) array
            Target from source.

        Returns
        -------
        r : (N, 2) array [px]
            Residuals.
        d2 : (N,) array
            Their squares over the stated covariances; infinite beyond the horizon.
        W : (N, 2, 2) array [1/px2]
            Inverses of those covariances.
        J : (N, 2, 2) array
            Derivative of the mapped source by the source.
        """
        J = homography_jacobian(H, self.source)
        r = self.target - apply_homography(H, self.source)
        C = self.of_target + J @ self.of_source @ np.swapaxes(J, -1, -2)
        det = C[:, 0, 0] * C[:, 1, 1] - C[:, 0, 1] * C[:, 1, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            W = np.stack([C[:, 1, 1], -C[:, 0, 1], -C[:, 1, 0], C[:, 0, 0]], -1) / det[:, None]
        W = W.reshape(-1, 2, 2)
        d2 = np.einsum("ni,nij,nj->n", r, W, r)
        d2[~np.isfinite(d2)] = np.inf
        return r, d2, W, J

    def refine(self, H: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray] | None:
        """Gauss-Newton over those that agree, and who agrees anew, in turns.

        Parameters
        ----------
        H : (3, 3) array
            A start.

        Returns
        -------
        found : (H, covariance, inliers, unit) or None
            The covariance is in the units of `unit`, and by the stated covariances; None where the normal matrix is
            singular.
        """
        inliers = np.zeros(len(self.source), dtype=bool)
        for k in range(ROUNDS):
            _, d2, _, _ = self.distances(H)
            wide = ROUGH if k == 0 else 1.0
            again = d2 < wide * GATE * self._spread(d2, inliers)
            if again.sum() < LEAST or (again == inliers).all():
                break
            inliers = np.asarray(again, dtype=np.bool_)
            solved = self._solve(H, inliers, _normalizer(self.source[inliers]), 1)
            if solved is None:
                return None
            H = solved
        if inliers.sum() < LEAST:
            return H, np.full((8, 8), np.inf), inliers, np.eye(3)
        unit = _normalizer(self.source[inliers])
        solved = self._solve(H, inliers, unit, STEPS)
        if solved is None:
            return None
        H = solved
        information = self._normal(H, inliers, unit)[0]
        if not np.isfinite(information).all() or np.linalg.cond(information) > 1e13:
            return None
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        return H, covariance, inliers, unit

    def _spread(self, d2: FloatArray, inliers: BoolArray) -> float:
        """Squared factor on the stated deviations, from the middle of the residuals, and from what is known before."""
        low, known = self.prior.factor**2, self.prior.worth
        use = d2[inliers] if inliers.sum() >= 2 * LEAST else np.sort(d2)[: max(LEAST, len(d2) // 2)]
        if np.isinf(known) or len(use) <= LEAST:
            return low
        middle = float(np.median(use)) / (
            MEDIAN if inliers.any() else 0.575
        )  # quarter of chi-square
        told = max(2 * len(use) - 8, 0)
        return (known * low + told * max(middle, 0.04 * low)) / (known + told)

    def _normal(
        self, H: FloatArray, inliers: BoolArray, unit: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        r, _, W, J = self.distances(H)
        A = J[inliers] @ moved_by(self.source[inliers], unit)
        WA = W[inliers] @ A
        information = np.einsum("nij,nik->jk", A, WA)
        return information, np.einsum("nij,ni->j", WA, r[inliers])

    def _solve(
        self, H: FloatArray, inliers: BoolArray, unit: FloatArray, steps: int
    ) -> FloatArray | None:
        for _ in range(steps):
            information, gradient = self._normal(H, inliers, unit)
            try:
                delta = np.asarray(np.linalg.solve(information, gradient), dtype=np.float64)
            except np.linalg.LinAlgError:
                return None
            if not np.isfinite(delta).all():
                return None
            size = float(np.abs(delta).max())
            H = move(H, delta * min(1.0, 0.3 / max(size, 1e-300)), unit)
            if size < SETTLED:
                break
        return H

    def result(
        self, H: FloatArray, covariance: FloatArray, inliers: BoolArray, unit: FloatArray
    ) -> HomographyFit:
        """All that is told about a homography.

        Parameters
        ----------
        H : (3, 3) array
            Target from source.
        covariance : (8, 8) array
            As `refine` gives it.
        inliers : (N,) array of bool
            Matches that agree.
        unit : (3, 3) array
            Takes pixels to the units of the covariance.

        Returns
        -------
        fit : HomographyFit
            With the residuals' factor in its covariance.
        """
        count = int(inliers.sum())
        r, d2, _, _ = self.distances(H)
        chi2 = float(d2[inliers].sum())
        freedom = max(2 * count - 8, 0)
        known = self.prior.worth
        s2 = self.prior.factor**2
        if np.isfinite(known):
            s2 = (known * s2 + chi2) / (known + freedom)
        open_ = not np.isfinite(covariance).all() or (
            s2 * float(np.linalg.eigvalsh(covariance)[-1]) > LOOSEST**2
        )
        if open_:
            return HomographyFit.failed("points in line", len(r))
        # From the points' own units to those of `small_motion`.
        T = change_of_basis(np.diag([1 / UNIT_PX, 1 / UNIT_PX, 1.0]) @ np.linalg.inv(unit))
        rms = float(np.sqrt(np.mean(r[inliers] ** 2)))
        return HomographyFit(
            "ok",
            unit_determinant(H),
            T @ (s2 * covariance) @ T.T,
            inliers,
            rms,
            float(np.sqrt(s2)),
            r,
            d2,
        )

    def second_plane(self, fit: HomographyFit) -> bool:
        """Whether the matches that do not follow follow another homography, nearly as many.

        Parameters
        ----------
        fit : HomographyFit
            The first one.

        Returns
        -------
        second : bool
            There is one.
        """
        rest = ~fit.inliers
        first = int(fit.inliers.sum())
        if rest.sum() < max(2 * LEAST, SECOND_SHARE * first):
            return False
        other = Matches(
            self.source[rest],
            self.target[rest],
            self.of_source[rest],
            self.of_target[rest],
            NoiseScale(fit.scale, np.inf),
        )
        H = other.first(())
        if H is None:
            return False
        near = other.distances(H)[1] < GATE * fit.scale**2
        return bool(near.sum() >= max(2 * LEAST, SECOND_SHARE * first))


def _normalizer(uv: FloatArray) -> FloatArray:
    """Similarity that brings points to mean zero and unit spread: the normal matrix is well conditioned there."""
    middle = uv.mean(axis=0)
    s = 1.0 / max(float(np.sqrt(np.mean((uv - middle) ** 2))), 1e-9)
    return np.array([[s, 0.0, -s * middle[0]], [0.0, s, -s * middle[1]], [0.0, 0.0, 1.0]])


def _through_four(source: FloatArray, target: FloatArray) -> FloatArray | None:
    """The one homography through four matches, by its eight linear equations; None where three are in line."""
    to_source, to_target = _normalizer(source), _normalizer(target)
    x, y = apply_homography(to_source, source), apply_homography(to_target, target)
    A = np.zeros((8, 8))
    A[:4, 0:2], A[:4, 2], A[4:, 3:5], A[4:, 5] = x, 1.0, x, 1.0
    A[:4, 6:], A[4:, 6:] = -x * y[:, :1], -x * y[:, 1:]
    if np.linalg.cond(A) > 1e12:
        return None
    h = np.append(np.linalg.solve(A, y.T.ravel()), 1.0).reshape(3, 3)
    return np.asarray(np.linalg.solve(to_target, h @ to_source))

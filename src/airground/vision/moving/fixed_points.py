"""A moving camera held still by points that somebody else finds and tells apart (section 4.3).

Which of the points are fixed to the ground is not told: surveyed marks may be mixed with vehicles, parked and driving.
The stabiliser keeps a map: the places of the points in the stable frame, with their joint covariance. A frame's
homography is fitted between its points and the map, and the map is then corrected by the frame. With x the places, y
those that the frame alone gives, B the effect of the frame's eight unknowns delta (nothing is known of them before)::

    y = x - B delta + noise,   S = P + R,   C = (B' S^-1 B)^-1,   delta = C B' S^-1 (x - y),
    x += P S^-1 (y - x + B delta),   P -= P (S^-1 - S^-1 B C B' S^-1) P

C is then the covariance of the frame's homography with all that the map does not know, the first frame's noise above
all: that never averages out, as the first frame is what the stable frame is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly
from airground.vision.moving.camera_path import CameraPath
from airground.vision.moving.first_look import FirstLook
from airground.vision.moving.fit_types import (
    GATE,
    LEAST,
    SAFE,
    HomographyFit,
    NoiseScale,
    may_be_chance,
)
from airground.vision.moving.homography import fit_homography
from airground.vision.moving.point_map import IntArray, PointMap
from airground.vision.moving.point_options import PointOptions
from airground.vision.moving.small_motion import (
    apply_homography,
    deviation,
    homography_jacobian,
    move,
    moved_by,
)
from airground.vision.moving.stabilization import Stabilization

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from numpy.typing import ArrayLike

    from airground.geometry.lens import DivisionLens

__all__ = ["PointStabilizer"]

FIRST_LOOK = 4  # times patience: frames over which the standing points are chosen
DECIDED = 0.75  # share that must agree during the first look: who stands is not known yet
VAGUE = 15.0  # deviations of a point: where the homography is less sure, none enters the map
LEAST_FACTOR = 0.5  # errors that stay the same for long look smaller than they are
MEMORY = 1000.0  # residuals that the noise's factor is taken over


@dataclass(frozen=True, slots=True, eq=False)
class _Given:
    """Points of one frame, undistorted."""

    t: float
    """Time [s]."""

    ids: Sequence[Hashable]
    """(N). Names."""

    uv: FloatArray
    """(N, 2) [px]. Positions."""

    R: FloatArray
    """(N, 2, 2) [px2]. Their covariances."""


class PointStabilizer:
    """Homographies to the first frame from points with names.

    Parameters
    ----------
    options : PointOptions, optional
        How points are judged.
    lens : DivisionLens, optional
        Of the camera; points are undistorted first.
    """

    def __init__(
        self, options: PointOptions | None = None, *, lens: DivisionLens | None = None
    ) -> None:
        self.options = options or PointOptions()
        self.lens = lens
        self._map = PointMap(self.options.patience, self.options.largest_map)
        self._path = CameraPath()
        self._first_look = FirstLook(FIRST_LOOK * self.options.patience)
        self._t: float | None = None
        self._scale = NoiseScale(1.0, np.inf if self.options.known_noise else 8.0)

    @property
    def fixed(self) -> tuple[Hashable, ...]:
        """Names of the points that are taken to be fixed to the ground."""
        return self._map.trusted()

    def update(
        self,
        t: float,
        ids: Sequence[Hashable],
        uv: ArrayLike,
        covariance: ArrayLike | None = None,
    ) -> Stabilization:
        """Take the points of the next frame.

        Parameters
        ----------
        t : float [s]
            Time of the frame, later than the last one's.
        ids : sequence of N names
            What tells a point from all others, the same in all frames.
        uv : (N, 2) array_like [px]
            Where the points are.
        covariance : (N, 2, 2) array_like [px2], optional
            Of those positions.

        Returns
        -------
        stabilization : Stabilization
            Of this frame.

        Raises
        ------
        InputError
            If an array has a wrong shape or is not finite, a name comes twice, or the time does not ascend.
        """
        uv, R = self._checked(t, ids, uv, covariance)
        if not len(self._map):
            return self._first(t, ids, uv, R)
        elapsed = t - self._t if self._t is not None else 0.0
        self._t = t
        self._map.wander((self.options.wander_px_per_sqrt_s / self._scale.factor) ** 2 * elapsed)
        rows, at = self._map.find(ids)
        looked = self._first_look.over
        fit = self._search(t, uv[rows], R[rows], at)
        if self._first_look.over and not looked:
            self._map.trust(self._first_look.standing)
            looked = True
        if fit.matrix is None:
            return Stabilization(t, fit.status, points=len(rows), lens=self.lens)
        return self._take(_Given(t, ids, uv, R), fit.matrix, looked)

    def _checked(
        self, t: float, ids: Sequence[Hashable], uv: ArrayLike, covariance: ArrayLike | None
    ) -> tuple[FloatArray, FloatArray]:
        uv = readonly(uv, (len(ids), 2), "uv")
        if len(set(ids)) != len(ids):
            raise InputError("ids: a name comes twice in one frame; each point needs its own")
        if not np.isfinite(t) or (self._t is not None and not t > self._t):
            raise InputError(f"t must ascend: {t} s after {self._t} s")
        if covariance is None:
            R = np.tile(np.eye(2) * self.options.sigma_px**2, (len(uv), 1, 1))
        else:
            R = np.array(readonly(covariance, (len(uv), 2, 2), "covariance"))
            if len(R) and not (np.linalg.eigvalsh(R)[:, 0] > 0).all():
                raise InputError("covariance must be positive definite")
        if self.lens is not None:
            J = self.lens.undistort_jacobian(uv)
            uv, R = self.lens.undistort(uv), J @ R @ np.swapaxes(J, -1, -2)
            if not np.isfinite(uv).all():
                raise InputError("uv: a point lies beyond the lens's limit")
        return uv, R

    def _first(
        self, t: float, ids: Sequence[Hashable], uv: FloatArray, R: FloatArray
    ) -> Stabilization:
        """The first frame is the stable one, if four points and more span it."""
        fit = fit_homography(uv, uv, target_covariance=R, prior=NoiseScale(1.0, np.inf))
        if fit.matrix is None:
            return Stabilization(t, fit.status, points=len(ids), lens=self.lens)
        self._t = t
        self._path.add(t, np.eye(3), uv)
        count = len(ids)
        self._map.add(ids, uv, _on_diagonal(R), np.empty((2 * count, 0)))
        return Stabilization(
            t, "ok", np.eye(3), np.zeros((8, 8)), count, count, 0.0, lens=self.lens
        )

    def _search(self, t: float, uv: FloatArray, R: FloatArray, at: IntArray) -> HomographyFit:
        """By the points that have long been fixed, if they are enough; else by whatever agrees."""
        if not self._first_look.over:
            return self._first_look.fit(self._map, at, uv, R)
        places, P = self._map.x[at], self._map.blocks(at)
        trusted = self._map.standing(at)
        starts = self._path.candidates(t)
        if trusted.sum() >= max(2 * LEAST, self.options.least):
            fit = fit_homography(
                uv[trusted],
                places[trusted],
                source_covariance=R[trusted],
                target_covariance=P[trusted],
                prior=self._scale,
                starts=starts,
                least=self.options.least,
                least_share=0.5,
                parallax=False,
            )
            if fit.matrix is not None:
                return fit
        return fit_homography(
            uv,
            places,
            source_covariance=R,
            target_covariance=P,
            prior=self._scale,
            starts=starts,
            least=self.options.least,
            parallax=False,
        )

    def _take(self, given: _Given, H: FloatArray, looked: bool) -> Stabilization:
        """Frame and map together, by least squares; then the map's own business."""
        t, uv, R = given.t, given.uv, given.R
        rows, at = self._map.find(given.ids)
        trusted = self._map.standing(at)
        standing = at if looked else self._first_look.standing
        for _ in range(2):  # who fits, then again with the better homography
            r, J = self._map.x[at] - apply_homography(H, uv[rows]), homography_jacobian(H, uv[rows])
            seen = J @ R[rows] @ np.swapaxes(J, -1, -2)
            S = self._map.blocks(at) + seen
            d2 = np.einsum("ni,nij,nj->n", r, np.linalg.inv(S), r)
            fits = np.isfinite(d2) & (d2 < GATE * self._scale.factor**2) & np.isin(at, standing)
            if fits.sum() < self.options.least:
                return Stabilization(t, "no agreement", points=len(at), lens=self.lens)
            known = (fits & trusted).sum() >= max(2 * LEAST, self.options.least)
            use = fits & trusted if known else fits
            both = (2 * at[use][:, None] + np.arange(2)).ravel()
            B = (J[use] @ moved_by(uv[rows][use])).reshape(-1, 8)
            joint = self._map.P[np.ix_(both, both)] + _on_diagonal(seen[use])
            SB = np.linalg.solve(joint, B)
            information = B.T @ SB
            if np.linalg.cond(information / np.outer(*[np.sqrt(np.diag(information))] * 2)) > 1e13:
                return Stabilization(t, "points in line", points=len(at), lens=self.lens)
            C = np.linalg.inv(information)
            delta = C @ SB.T @ r[use].ravel()
            H = move(H, delta)
        count = int(use.sum())
        seen_before = int((use | trusted).sum()) if trusted.any() else len(at)
        if may_be_chance(count, seen_before) or (
            count < SAFE and self._path.jumps(t, H, uv[rows][use], self._sigma(R))
        ):  # so few may agree because they move as one
            return Stabilization(t, "no agreement", points=len(at), lens=self.lens)
        if not looked and count < DECIDED * len(at):
            return Stabilization(t, "no agreement", points=len(at), lens=self.lens)
        rest = r[use].ravel() - B @ delta
        weighed = np.linalg.solve(joint, rest)
        self._learn(float(rest @ weighed), 2 * int(use.sum()) - 8)
        gain = self._map.P[:, both]
        cross = gain @ SB @ C  # of the map's error and delta's
        if known:  # else one that moves could bend the map
            self._map.correct(gain, -weighed, np.linalg.inv(joint) - SB @ C @ SB.T)
        self._path.add(t, H, uv[rows][use])
        self._enter(given, H, C, cross)
        if looked:
            self._map.judge(at, fits)
        s2 = self._scale.factor**2
        return Stabilization(
            t,
            "ok",
            H,
            s2 * 0.5 * (C + C.T),
            len(at),
            int(fits.sum()),
            float(np.sqrt(np.mean(rest**2))),
            lens=self.lens,
        )

    def _learn(self, chi2: float, freedom: int) -> None:
        """The common factor on all stated deviations, from the residuals of the last frames."""
        known = self._scale.worth
        if np.isfinite(known) and freedom > 0:
            s2 = (known * self._scale.factor**2 + chi2) / (known + freedom)
            factor = max(float(np.sqrt(s2)), LEAST_FACTOR)
            self._scale = NoiseScale(factor, min(known + freedom, MEMORY))

    def _enter(self, given: _Given, H: FloatArray, C: FloatArray, cross: FloatArray) -> None:
        """Points that the map does not have."""
        ids, uv, R = given.ids, given.uv, given.R
        here = set(self._map.ids)
        new = [k for k, name in enumerate(ids) if name not in here]
        x = apply_homography(H, uv[new])
        radius = 6 * self._sigma(R)
        enter = self._map.may_enter([ids[k] for k in new], x, radius) & np.isfinite(x).all(axis=1)
        spread = np.trace(deviation(H, C, uv[new]), axis1=1, axis2=2)
        enter &= spread < 2 * VAGUE**2 * np.trace(R[new], axis1=1, axis2=2)
        new = [k for k, ok in zip(new, enter, strict=True) if ok]
        if not new:
            return
        J = homography_jacobian(H, uv[new])
        B = (J @ moved_by(uv[new])).reshape(-1, 8)
        own = _on_diagonal(J @ R[new] @ np.swapaxes(J, -1, -2)) + B @ C @ B.T
        self._map.add([ids[k] for k in new], x[enter], own, B @ cross.T)

    def _sigma(self, R: FloatArray) -> float:
        """Deviation of a coordinate of a usual point [px]."""
        variance = np.median(R[:, 0, 0]) + np.median(R[:, 1, 1])
        return self._scale.factor * float(np.sqrt(variance / 2))


def _on_diagonal(blocks: FloatArray) -> FloatArray:
    """(2N, 2N) matrix with the (N, 2, 2) blocks on its diagonal."""
    count = len(blocks)
    matrix = np.zeros((count, 2, count, 2))
    matrix[np.arange(count), :, np.arange(count), :] = blocks
    return matrix.reshape(2 * count, 2 * count)

"""What a detector saw in one frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

__all__ = ["Sightings"]


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """N things seen at one time. A position comes with its covariance, never alone."""

    t: float
    """Time of the frame [s]."""

    uv: FloatArray
    """(N, 2) [px]. Position; (0, 0) is the centre of the top-left pixel, and v points down."""

    covariance: FloatArray
    """(N, 2, 2) [px2]. Of the position."""

    labels: tuple[str, ...] = field(default=())
    """(N). What tells a thing from all others: the number of its tag, its colour; empty where nothing does."""

    angle: FloatArray = field(default_factory=lambda: np.empty(0))
    """(N,) [rad]. Heading in the image, from u towards v (clockwise to the eye); NaN where it is not seen."""

    angle_sigma: FloatArray = field(default_factory=lambda: np.empty(0))
    """(N,) [rad]. Its standard deviation; NaN where it is not seen."""

    score: FloatArray = field(default_factory=lambda: np.empty(0))
    """(N,). Between 0 and 1: how sure the detector is that the thing is there."""

    outline: FloatArray = field(default_factory=lambda: np.empty((0, 4, 2)))
    """(N, 4, 2) [px]. Corners of what it covers in the image, for masks and drawings; NaN where unknown."""

    def __post_init__(self) -> None:
        uv = readonly(self.uv, (None, 2), "uv")
        count = len(uv)
        put = object.__setattr__
        put(self, "uv", uv)
        put(self, "covariance", readonly(self.covariance, (count, 2, 2), "covariance"))
        trace = self.covariance[:, 0, 0] + self.covariance[:, 1, 1]
        determinant = (
            self.covariance[:, 0, 0] * self.covariance[:, 1, 1]
            - self.covariance[:, 0, 1] * self.covariance[:, 1, 0]
        )
        if not ((trace > 0) & (determinant > 0)).all():
            raise InputError("covariance must be positive definite")
        labels = tuple(self.labels) or ("",) * count
        if len(labels) != count:
            raise InputError(f"labels must be {count} names, not {len(labels)}")
        put(self, "labels", labels)
        put(self, "angle", _column(self.angle, (count,), np.nan, "angle"))
        put(self, "angle_sigma", _column(self.angle_sigma, (count,), np.nan, "angle_sigma"))
        put(self, "score", _column(self.score, (count,), 1.0, "score"))
        put(self, "outline", _column(self.outline, (count, 4, 2), np.nan, "outline"))

    def __len__(self) -> int:
        return len(self.uv)

    @classmethod
    def none(cls, t: float) -> Self:
        """Nothing was seen.

        Parameters
        ----------
        t : float [s]
            Time of the frame.

        Returns
        -------
        sightings : Sightings
            Without rows.
        """
        return cls(t, np.empty((0, 2)), np.empty((0, 2, 2)))

    @classmethod
    def round(
        cls,
        t: float,
        uv: ArrayLike,
        sigma_px: ArrayLike,
        *,
        labels: Sequence[str] = (),
        score: ArrayLike | None = None,
    ) -> Self:
        """Positions that are equally uncertain in all directions.

        Parameters
        ----------
        t : float [s]
            Time of the frame.
        uv : (N, 2) array_like [px]
            Positions.
        sigma_px : float or (N,) array_like [px]
            Standard deviation of each coordinate.
        labels : sequence of str
            Names, where there are.
        score : (N,) array_like, optional
            How sure the detector is.

        Returns
        -------
        sightings : Sightings
            With covariances ``sigma_px**2`` times the unit matrix.
        """
        uv = np.asarray(uv, dtype=np.float64).reshape(-1, 2)
        variance = np.broadcast_to(np.asarray(sigma_px, dtype=np.float64) ** 2, len(uv))
        return cls(
            t,
            uv,
            variance[:, None, None] * np.eye(2),
            labels=tuple(labels),
            score=np.empty(0) if score is None else np.asarray(score, dtype=np.float64),
        )

    def take(self, rows: ArrayLike) -> Self:
        """Some of the rows, in the order asked for.

        Parameters
        ----------
        rows : (M,) array_like of int, or (N,) of bool
            Which.

        Returns
        -------
        sightings : Sightings
            Those.
        """
        index = np.asarray(rows)
        index = np.flatnonzero(index) if index.dtype == np.bool_ else index.astype(np.intp)
        return type(self)(
            self.t,
            self.uv[index],
            self.covariance[index],
            tuple(self.labels[k] for k in index),
            self.angle[index],
            self.angle_sigma[index],
            self.score[index],
            self.outline[index],
        )


def _column(value: FloatArray, shape: tuple[int, ...], missing: float, name: str) -> FloatArray:
    """Own read-only copy; what was left out is filled with one value. NaN is allowed, infinity is not."""
    array = np.array(value, dtype=np.float64)
    if array.size == 0:
        array = np.full(shape, missing)
    if array.shape != shape:
        raise InputError(f"{name} must have shape {shape}, not {array.shape}")
    if np.isinf(array).any():
        raise InputError(f"{name} has infinite entries")
    array.flags.writeable = False
    return array

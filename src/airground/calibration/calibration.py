"""A calibration: the estimate, how sure it is, and where it came from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.calibration.observability import Observability, ground_velocity_covariance
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, points, readonly, refuse_huge
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    import os

    from numpy.typing import ArrayLike

__all__ = ["Calibration", "Fit", "Provenance", "TargetFit"]


@dataclass(frozen=True, slots=True)
class Fit:
    """How well the estimate explains the recordings."""

    method: Literal["linear", "trajectory"]
    """Which estimator."""

    rms_px: float
    """Root mean square, per coordinate, of how far from the prediction the targets moved within a window [px]."""

    sightings: int
    """How many sightings the estimate rests on."""

    inlier_fraction: float
    """Share of them that it uses; the linear method uses all."""

    window_s: float | None = None
    """Median time over which velocities were taken [s], if they were."""

    region_px: tuple[float, float, float, float] | None = None
    """Where targets were seen: smallest u and v, largest u and v [px]."""

    def __post_init__(self) -> None:
        if self.region_px is None:
            return
        refuse_huge(self.region_px, "region_px")
        u0, v0, u1, v1 = self.region_px
        if not (u0 < u1 and v0 < v1):
            raise InputError("region_px must be the smallest u and v, then the largest u and v")


@dataclass(frozen=True, slots=True)
class TargetFit:
    """What was found about one target."""

    sightings: int | None
    """How many of its sightings were used, if known."""

    heading_bias_rad: float | None = None
    """What its headings read more than those of the target whose zero the ground frame has; None if not estimated."""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a calibration came from."""

    version: str = ""
    """Version of airground."""

    command: str = ""
    """Command line, if there was one."""

    inputs: tuple[tuple[str, str], ...] = ()
    """Name and SHA-256 of each input file."""

    created: str = ""
    """Time of creation, ISO 8601, UTC."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The metric relation between image and ground, with its uncertainty."""

    model: LimitedHomography
    """The estimate of g."""

    covariance: FloatArray
    """(6, 6). Of g, row by row; all nuisances and the prior on the speed's scale are in it."""

    origin_px: FloatArray
    """(2,) [px]. Image point taken as the ground's origin; it lies on visible ground."""

    fit: Fit
    """How well the estimate explains the recordings."""

    observability: Observability
    """What the motion determined."""

    time_offset_s: float = 0.0
    """To be added to a time of the tracks to get the time of the readings [s]."""

    time_offset_sigma_s: float = 0.0
    """Its standard deviation [s]; 0 where it was given."""

    image_size_px: tuple[int, int] | None = None
    """Width and height of the image [px], where known."""

    targets: dict[str, TargetFit] = field(default_factory=dict)
    """What was found about each target."""

    provenance: Provenance = field(default_factory=Provenance)
    """Where it came from."""

    def __post_init__(self) -> None:
        covariance = readonly(self.covariance, (6, 6), "covariance")
        scale = float(np.sqrt(np.abs(covariance).max()))
        if not np.allclose(covariance, covariance.T, rtol=1e-9, atol=1e-12 * scale**2):
            raise InputError("covariance must be symmetric")
        refuse_huge(covariance, "covariance")
        if not _is_covariance(covariance):
            raise InputError("covariance must have no negative eigenvalue")
        object.__setattr__(self, "covariance", covariance)
        object.__setattr__(self, "origin_px", readonly(self.origin_px, (2,), "origin_px"))
        refuse_huge(self.origin_px, "origin_px")
        if self.image_size_px is not None:
            if not min(self.image_size_px) > 0:
                raise InputError("image_size_px must be positive")
            refuse_huge(self.image_size_px, "image_size_px")
        self.model.image_from_ground(self.origin_px)  # refuses an origin on the horizon

    def is_ground(self, uv: ArrayLike) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Tell ground from what lies on or beyond the horizon.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.

        Returns
        -------
        ground : (...) array of bool
            True where velocities can be measured.
        """
        return self.model.same_side(uv, self.origin_px)

    def ground_velocity(self, uv: ArrayLike, uv_dot: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Ground velocities with the calibration's own uncertainty.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.
        uv_dot : (..., 2) array_like [px/s]
            Image velocities, taken as exact.

        Returns
        -------
        xy_dot : (..., 2) array [m/s]
            NaN on and beyond the horizon.
        covariance : (..., 2, 2) array [m2/s2]
            To first order.
        """
        uv, uv_dot = points(uv, "uv"), points(uv_dot, "uv_dot")
        ground = self.is_ground(uv)[..., None]
        xy_dot = np.where(ground, self.model.ground_velocity(uv, uv_dot), np.nan)
        wide = np.broadcast_to(uv, xy_dot.shape)
        return xy_dot, ground_velocity_covariance(self.model.g, self.covariance, wide, xy_dot)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write ``calibration.json``, whole or not at all.

        Parameters
        ----------
        path : path
            Where to.
        """
        from airground.records.calibration_file import save_calibration

        save_calibration(path, self)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Calibration:
        """Read ``calibration.json``.

        Parameters
        ----------
        path : path
            Where from.

        Returns
        -------
        calibration : Calibration
            The same numbers that were saved, bit for bit.

        Raises
        ------
        FileError
            If the file is not a calibration of a known version.
        """
        from airground.records.calibration_file import load_calibration

        return load_calibration(path)


def _is_covariance(matrix: FloatArray) -> bool:
    """Whether a symmetric matrix has no negative eigenvalue, when each row is taken in its own unit."""
    variance = np.diag(matrix)
    if (variance < 0).any():
        return False
    unit = np.sqrt(np.where(variance > 0, variance, 1.0))
    correlation = matrix / unit[:, None] / unit
    return bool(np.linalg.eigvalsh(correlation)[0] > -1e-9)  # rounding leaves 1e-15

"""A calibration: the estimate, how sure it is, and where it came from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.calibration.lens_uncertainty import joint_covariance, raw_velocity_covariance
from airground.calibration.observability import Observability
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, points, readonly, refuse_huge
from airground.geometry.lens import DivisionLens
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
    """Root mean square residual, per coordinate [px]: of sightings, or (linear) of how far they moved in a window."""

    sightings: int
    """How many sightings the estimate rests on."""

    inlier_fraction: float
    """Share of the sightings that it follows; the linear method uses all."""

    window_s: float | None = None
    """Median time over which velocities were taken [s], if they were."""

    region_px: tuple[float, float, float, float] | None = None
    """Where targets were seen, in the raw image: smallest u and v, largest u and v [px]."""

    nuisances: tuple[str, ...] = ()
    """Names of the unknowns that were estimated beside g."""

    sighting_sigma_px: float | None = None
    """Noise of a sighting, found from the residuals [px]; with `sighting_correlation` in it."""

    speed_sigma_sqrt_s: float | None = None
    """White noise of the speeds, relative, found from the residuals [sqrt(s)]."""

    heading_sigma_rad_sqrt_s: float | None = None
    """White noise of the headings, found from the residuals [rad sqrt(s)]."""

    sighting_correlation: float | None = None
    """How many sightings in a row have one error, so to speak; 1 where their errors are white."""

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

    heading_bias_sigma_rad: float | None = None
    """Standard deviation of the heading bias [rad]."""

    speed_scale: float | None = None
    """What its speeds read over those of the reference; 1 if they agree, None if not estimated."""

    speed_scale_sigma: float | None = None
    """Standard deviation of the speed scale."""

    lever_arm_m: tuple[float, float] | None = None
    """From the point whose motion is read to the one that is seen, forward and left [m]; None if not estimated."""

    lever_arm_sigma_m: tuple[float, float] | None = None
    """Standard deviations of the lever arm [m]."""

    heading_drift_rad_per_sqrt_s: float | None = None
    """Level of a slow drift of its headings, as a random walk [rad/sqrt(s)]; None if not estimated."""

    def __post_init__(self) -> None:
        for name in ("heading_bias_sigma_rad", "speed_scale_sigma", "lever_arm_sigma_m"):
            sigma = getattr(self, name)
            if sigma is not None and not np.min(sigma) >= 0:
                raise InputError(f"{name} must not be negative")


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
    """The estimate of g. With a lens it relates the ground and undistorted pixels."""

    covariance: FloatArray
    """(6, 6). Of g, row by row; all nuisances, k1 too, and the prior on the speed's scale are in it."""

    origin_px: FloatArray
    """(2,) [px]. Point taken as the ground's origin; it lies on visible ground. With a lens, in undistorted pixels."""

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

    lens: DivisionLens | None = None
    """What takes raw pixels to the undistorted ones of `model`; None where they are the same."""

    k1_covariance: FloatArray | None = None
    """(7,). Of the lens's k1 with g, row by row, then k1's own variance; None where k1 is taken as exact."""

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
        if not np.isfinite(self.distort(self.origin_px)).all():
            raise InputError("origin_px lies where the lens shows nothing; give undistorted pixels")
        if self.k1_covariance is not None:
            self._check_k1_covariance(self.k1_covariance)

    def _check_k1_covariance(self, value: ArrayLike) -> None:
        if self.lens is None:
            raise InputError("k1_covariance belongs to a lens, and there is none")
        k1_covariance = readonly(value, (7,), "k1_covariance")
        refuse_huge(k1_covariance, "k1_covariance")
        if not _is_covariance(joint_covariance(self.covariance, k1_covariance)):
            raise InputError("k1_covariance does not go with covariance: negative eigenvalue")
        object.__setattr__(self, "k1_covariance", k1_covariance)

    @property
    def k1_sigma(self) -> float | None:
        """Standard deviation of the lens's k1 [1/px^2]; None where it is taken as exact."""
        return None if self.k1_covariance is None else float(np.sqrt(self.k1_covariance[6]))

    def undistort(self, uv: ArrayLike) -> FloatArray:
        """Give the pixels that `model` is about.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.

        Returns
        -------
        uv_undistorted : (..., 2) array [px]
            The same where there is no lens; NaN beyond its limit.
        """
        uv = points(uv, "uv")
        return uv if self.lens is None else self.lens.undistort(uv)

    def distort(self, uv_undistorted: ArrayLike) -> FloatArray:
        """Give the pixels that the camera shows: the inverse of `undistort`.

        Parameters
        ----------
        uv_undistorted : (..., 2) array_like [px]
            Points of the undistorted image.

        Returns
        -------
        uv : (..., 2) array [px]
            Raw image points; the same where there is no lens, NaN where it shows nothing.
        """
        uv = points(uv_undistorted, "uv_undistorted")
        return uv if self.lens is None else self.lens.distort(uv)

    def undistort_velocity(self, uv: ArrayLike, uv_dot: ArrayLike) -> FloatArray:
        """Give the velocities of the pixels that `model` is about.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.
        uv_dot : (..., 2) array_like [px/s]
            Their velocities.

        Returns
        -------
        uv_dot_undistorted : (..., 2) array [px/s]
            The same where there is no lens; NaN beyond its limit.
        """
        uv_dot = points(uv_dot, "uv_dot")
        return uv_dot if self.lens is None else self.lens.undistort_velocity(uv, uv_dot)

    def is_ground(self, uv: ArrayLike) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Tell ground from what lies on or beyond the horizon.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.

        Returns
        -------
        ground : (...) array of bool
            True where velocities can be measured; False beyond the lens's limit too.
        """
        return self.model.same_side(self.undistort(uv), self.origin_px)

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Derivative of the raw image point by the ground point.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.

        Returns
        -------
        J : (..., 2, 2) array [px/m]
            ``uv_dot = J @ xy_dot``; NaN beyond the lens's limit.
        """
        if self.lens is None:
            return self.model.jacobian(uv)
        c = self.lens.undistort(uv)
        return np.asarray(self.lens.distort_jacobian(c) @ self.model.jacobian(c))

    def ground_velocity(self, uv: ArrayLike, uv_dot: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Ground velocities with the calibration's own uncertainty.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points, as the camera gives them.
        uv_dot : (..., 2) array_like [px/s]
            Their velocities, taken as exact.

        Returns
        -------
        xy_dot : (..., 2) array [m/s]
            NaN on and beyond the horizon, and beyond the lens's limit.
        covariance : (..., 2, 2) array [m2/s2]
            To first order in g and k1.
        """
        uv, uv_dot = points(uv, "uv"), points(uv_dot, "uv_dot")
        ground = self.is_ground(uv)[..., None]
        found = self.model.ground_velocity(self.undistort(uv), self.undistort_velocity(uv, uv_dot))
        xy_dot = np.where(ground, found, np.nan)
        covariance = raw_velocity_covariance(
            self.model.g, self.covariance, self.lens, self.k1_covariance, uv=uv, uv_dot=uv_dot
        )
        return xy_dot, np.where(ground[..., None], covariance, np.nan)

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
    if ((variance := np.diag(matrix)) < 0).any():
        return False
    unit = np.sqrt(np.where(variance > 0, variance, 1.0))
    correlation = matrix / unit[:, None] / unit
    return bool(np.linalg.eigvalsh(correlation)[0] > -1e-9)  # rounding leaves 1e-15

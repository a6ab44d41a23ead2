"""The homography between two images of one plane, from matched points with covariances, and how sure it is.

With H the map from source to target, the residual of a match is ``target - H(source)``; its covariance is that of the
target plus that of the source seen through H (to first order). A robust start finds which matches agree; then all of
those are fitted by Gauss-Newton in coordinates that are centred and scaled, with the analytic Jacobian.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly
from airground.vision.moving.fit_types import LEAST, HomographyFit, NoiseScale
from airground.vision.moving.matches import Matches

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

__all__ = ["fit_homography"]

NARROW = 6.0  # deviations: a strip of points that is not wider says nothing across


def fit_homography(
    source: ArrayLike,
    target: ArrayLike,
    *,
    source_covariance: ArrayLike = 0.0,
    target_covariance: ArrayLike = 1.0,
    prior: NoiseScale | None = None,
    starts: Sequence[FloatArray] = (),
    least: int = LEAST,
    least_share: float = 0.0,
    parallax: bool = True,
    search: bool = True,
) -> HomographyFit:
    """Fit a homography to matched points, some of which may be wrong.

    Parameters
    ----------
    source : (N, 2) array_like [px]
        Points in one image.
    target : (N, 2) array_like [px]
        The same points in the other.
    source_covariance : float or (N, 2, 2) array_like [px2]
        Of the source points; a number stands for that variance in each coordinate.
    target_covariance : float or (N, 2, 2) array_like [px2]
        Of the target points.
    prior : NoiseScale, optional
        What is known of the noise beside those covariances; with four points nothing else can tell.
    starts : sequence of (3, 3) array
        Homographies that may be good to several deviations. The first that most matches follow is taken without a
        search; else the best of them and of what the search found.
    least : int
        So many matches must agree, four or more.
    least_share : float
        So large a share of them must agree, 0 to 1.
    parallax : bool
        Whether to look for a second plane.
    search : bool
        Whether to search where most matches follow none of `starts`; else the best of those is what there is.

    Returns
    -------
    fit : HomographyFit
        With the reason in `status` where there is no answer.

    Raises
    ------
    InputError
        If the arrays are not of those shapes or not finite.
    """
    source = readonly(source, (None, 2), "source")
    count = len(source)
    target = readonly(target, (count, 2), "target")
    of_source = _covariances(source_covariance, count, "source_covariance")
    of_target = _covariances(target_covariance, count, "target_covariance")
    prior = prior or NoiseScale()
    least = max(least, LEAST)
    problem = Matches(source, target, of_source, of_target, prior)
    if count < least:
        return HomographyFit.failed("too few points", count)
    if _in_line(source) or _in_line(target):
        return HomographyFit.failed("points in line", count)
    H = problem.first(starts, search=search)
    found = None if H is None else problem.refine(H)
    agreed = 0 if found is None else int(found[2].sum())
    if found is None or agreed < max(least, least_share * count):
        if _narrow(source, of_source + of_target):
            return HomographyFit.failed("points in line", count)
        few = agreed < least and count < 2 * least
        return HomographyFit.failed("too few points" if few else "no agreement", count)
    fit = problem.result(*found)
    if fit.status == "ok" and parallax and problem.second_plane(fit):
        fit = HomographyFit.failed("parallax", count)
    return fit


def _in_line(uv: FloatArray) -> bool:
    """Whether all points lie in one line, to rounding."""
    values = np.linalg.svd(uv - uv.mean(axis=0), compute_uv=False)
    return bool(values[1] <= 1e-9 * max(values[0], 1e-9))


def _narrow(uv: FloatArray, covariance: FloatArray) -> bool:
    """Whether all points but one lie in one line, to a few deviations."""
    for _ in range(2):
        off = uv - np.median(uv, axis=0)
        _, _, axes = np.linalg.svd(off, full_matrices=False)
        across = np.abs(off @ axes[1] - np.median(off @ axes[1]))
        sigma = float(np.sqrt(np.median(np.trace(covariance, axis1=1, axis2=2)) / 2))
        if np.sqrt(np.mean(across**2)) < NARROW * sigma:
            return True
        keep = np.arange(len(uv)) != int(np.argmax(across))
        uv, covariance = uv[keep], covariance[keep]
    return False


def _covariances(value: ArrayLike, count: int, name: str) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0:
        if not (np.isfinite(array) and array >= 0):
            raise InputError(f"{name} must be a variance [px2], zero or more, not {array}")
        return np.broadcast_to(np.eye(2) * array, (count, 2, 2))
    return readonly(array, (count, 2, 2), name)

"""Calibration under a moving camera of marks above the ground, whose height and the focal length alone are told.

How a mark above the ground moves in a held picture depends on how high the camera is and how it is tilted. Its tilt
comes from the flight itself (`find_level`); its height from the calibration, which is metric: with K^-1 g = s (r1 r2)
and g scaled as in eq. 21, the camera is ``1 / (s^3 f^2)`` above the marks. A wrong height makes a wrong calibration,
which still gives a better height: the two are made to agree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import calibrate
from airground.errors import UndeterminedError
from airground.geometry.arrays import FloatArray
from airground.vision.moving.levelling import find_level
from airground.vision.moving.raised import raised
from airground.vision.moving.stabilization import Stabilization

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from airground.calibration import Calibration, Motion, Tracks
    from airground.geometry import LimitedHomography

__all__ = ["MarksPlane", "MarksView", "apply_each", "calibrate_marks", "height_above"]

AGREE = 1e-3  # relative, of two heights
MOST = 12
LEVEL_RAD = 0.035


@dataclass(frozen=True, slots=True, eq=False)
class MarksView:
    """What is told of camera and marks."""

    mark_height_m: float
    """Of the marks above the ground [m]."""

    focal_length_px: float
    """Of the camera [px]."""

    image_size_px: tuple[int, int]
    """Width and height [px]; the principal point is in the middle."""

    down: FloatArray | None = None
    """(3,). Which way is down in the stable frame's right, down and forward, to about two degrees; the flight alone
    says it where not given."""

    @property
    def principal_point(self) -> FloatArray:
        """(2,) [px]. Middle of the image."""
        width, height = self.image_size_px
        return np.array([(width - 1) / 2, (height - 1) / 2])


@dataclass(frozen=True, slots=True, eq=False)
class MarksPlane:
    """What was found."""

    calibration: Calibration
    """Of the marks' plane in the stable frame."""

    tracks: Tracks
    """Sightings, referred to it."""

    normal: FloatArray
    """(3,). Which way is down."""

    camera_height_m: float
    """Of the camera above the ground in the stable frame [m]."""


def calibrate_marks(
    tracks: Tracks, ground: Mapping[float, FloatArray], motion: Motion, view: MarksView
) -> MarksPlane:
    """Calibrate the plane of marks.

    Parameters
    ----------
    tracks : Tracks
        Sightings, referred to the stable frame as if marks were on the ground.
    ground : mapping of float to (3, 3) array
        Homographies from the image to the stable frame, of the ground, by the times of the sightings.
    motion : Motion
        Readings.
    view : MarksView
        What is told.

    Returns
    -------
    found : MarksPlane
        Calibration and camera agree on it.

    Raises
    ------
    UndeterminedError
        If the drive leaves g undetermined, the camera has moved too little to show its tilt, or no height of it
        agrees.
    """
    H = np.stack([ground[t] for t in tracks.t.tolist()])
    raw = apply_each(np.linalg.inv(H), tracks.uv)
    normal = find_level(
        np.stack(list(ground.values())),
        guess=view.down,
        guess_sigma_rad=LEVEL_RAD,
        focal_length_px=view.focal_length_px,
        principal_point=view.principal_point,
    ).normal
    height = np.inf
    before: tuple[float, float] | None = None
    for _ in range(MOST):
        ratio = view.mark_height_m / height
        lifted = replace(tracks, uv=_lifted(H, raw, ratio, normal, view))
        found = calibrate(
            lifted,
            motion,
            image_size_px=view.image_size_px,
            method="trajectory",
            distortion="none",  # the homographies are those of a camera without a lens
        )
        told = view.mark_height_m + height_above(found.model, view)
        if abs(told - height) < AGREE * told:
            return MarksPlane(found, lifted, normal, told)
        height, before = _next(height, told, before, 1.5 * view.mark_height_m), (height, told)
    raise UndeterminedError(
        f"no height of the camera agrees with the calibration: {height:.2f} m gives {told:.2f} m; check the focal "
        "length and the height of the marks"
    )


def height_above(model: LimitedHomography, view: MarksView) -> float:
    """How high the camera is above the plane that was calibrated.

    Parameters
    ----------
    model : LimitedHomography
        Of it.
    view : MarksView
        The camera.

    Returns
    -------
    height : float [m]
        From the length of the columns of g.
    """
    f, (u, v) = view.focal_length_px, view.principal_point.tolist()
    columns = np.linalg.solve(np.array([[f, 0.0, u], [0.0, f, v], [0.0, 0.0, 1.0]]), model.g)
    s = np.sqrt(np.prod(np.linalg.norm(columns, axis=0)))
    return float(1 / (s**3 * f**2))


def _next(height: float, told: float, before: tuple[float, float] | None, least: float) -> float:
    """Where the two will agree: on the line through the last two trials, or at what was told."""
    if before is None or not np.isfinite(before[0]):
        return max(told, least)
    slope = (told - before[1]) / (height - before[0])
    if not -0.9 < slope < 0.9:
        return max(told, least)
    return max(height + (told - height) / (1 - slope), least)


def _lifted(
    H: FloatArray, raw: FloatArray, ratio: float, normal: FloatArray, view: MarksView
) -> FloatArray:
    """(N, 2) [px]. Sightings in the stable frame, as of marks at a height."""
    lifted = [
        raised(
            Stabilization(0.0, "ok", one, np.eye(8)),
            height_ratio=ratio,
            normal=normal,
            focal_length_px=view.focal_length_px,
            principal_point=view.principal_point,
        ).stable_from_image
        for one in H
    ]
    return apply_each(np.array(lifted, dtype=np.float64), raw)


def apply_each(matrix: NDArray[np.floating], uv: NDArray[np.floating]) -> FloatArray:
    """Map points, each by a homography of its own.

    Parameters
    ----------
    matrix : (..., 3, 3) array
        Homographies, any scale.
    uv : (..., 2) array [px]
        Points.

    Returns
    -------
    mapped : (..., 2) array [px]
        Their images.
    """
    w = np.einsum("...ij,...j->...i", matrix[..., :2], uv) + matrix[..., 2]
    return np.asarray(w[..., :2] / w[..., 2:])

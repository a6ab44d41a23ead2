"""What a calibration says, in words that a person can check: horizon, scale, camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.observability import ground_velocity_covariance
from airground.errors import (
    AirgroundError,
    InputError,
    UndeterminedError,
)
from airground.geometry.arrays import FloatArray
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    from airground.calibration.calibration import Calibration
    from airground.geometry.camera import PlaneCamera

__all__ = ["CameraEstimate", "Inspection", "inspect_calibration", "point_sigma"]

MAX_FOCAL_SIGMA = (
    0.5  # relative; beyond it neither the number nor its first-order deviation says anything
)
GRID = 9  # points along each side at which the scale is given


@dataclass(frozen=True, slots=True, eq=False)
class CameraEstimate:
    """The camera that g implies, with standard deviations from the calibration's covariance."""

    camera: PlaneCamera
    """Focal length, tilt, roll, height, for square pixels."""

    focal_length_sigma_px: float
    """[px]; 0 where the focal length was given."""

    tilt_sigma_rad: float
    """[rad]."""

    roll_sigma_rad: float
    """[rad]."""

    height_sigma_m: float
    """[m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Inspection:
    """What a calibration says."""

    frame_px: tuple[float, float, float, float]
    """Smallest u and v, largest u and v of what is inspected: of the image, or of where targets were seen."""

    horizon: FloatArray
    """(3,). Line a u + b v + c = 0 with a^2 + b^2 = 1 and positive on the ground; at nadir (0, 0, 1)."""

    horizon_in_frame: bool
    """Whether the horizon crosses the frame."""

    uv: FloatArray
    """(N, 2) [px]. A grid of points over the frame, those on the ground."""

    pixels_per_metre: FloatArray
    """(N, 2) [px/m]. Smallest and largest scale over all headings, at each point."""

    relative_sigma: FloatArray
    """(N,). Relative standard deviation of a ground velocity, over all headings, at each point."""

    camera: CameraEstimate | None
    """The camera, if g determines one."""

    camera_problem: str
    """Why there is none; empty where there is."""


def inspect_calibration(
    calibration: Calibration,
    *,
    image_size_px: tuple[int, int] | None = None,
    principal_point_px: tuple[float, float] | None = None,
    focal_length_px: float | None = None,
) -> Inspection:
    """Look at a calibration from all sides.

    Parameters
    ----------
    calibration : Calibration
        What to look at.
    image_size_px : (int, int), optional [px]
        Width and height, if the calibration does not hold them.
    principal_point_px : (float, float), optional [px]
        Where the optical axis meets the image; its middle where not given.
    focal_length_px : float, optional [px]
        If it is known.

    Returns
    -------
    inspection : Inspection
        Numbers to print and to draw.

    Raises
    ------
    UndeterminedError
        If neither the image's size nor the driven region is known.
    InputError
        If there is no ground in the image.
    """
    size = image_size_px or calibration.image_size_px
    if size is not None:
        frame = (-0.5, -0.5, size[0] - 0.5, size[1] - 0.5)  # pixel centres are whole numbers
    elif calibration.fit.region_px is not None:
        frame = calibration.fit.region_px
    else:
        raise UndeterminedError("the calibration holds no image size; give --image-size WxH")
    middle = None if size is None else ((size[0] - 1) / 2, (size[1] - 1) / 2)
    camera, problem = _camera(calibration, principal_point_px or middle, focal_length_px)

    u0, v0, u1, v1 = frame
    grid = np.stack(np.meshgrid(np.linspace(u0, u1, GRID), np.linspace(v0, v1, GRID)), axis=-1)
    uv = grid.reshape(-1, 2)
    uv = uv[calibration.is_ground(uv)]
    if len(uv) == 0:
        raise InputError(
            f"no ground in u {u0:g}..{u1:g}, v {v0:g}..{v1:g}: all of it lies beyond the horizon; "
            "check the image's size"
        )
    corners = np.array([[u0, v0], [u1, v0], [u0, v1], [u1, v1]])
    return Inspection(
        frame_px=frame,
        horizon=_oriented(calibration),
        horizon_in_frame=not bool(calibration.is_ground(corners).all()),
        uv=uv,
        pixels_per_metre=calibration.model.pixels_per_metre(uv),
        relative_sigma=point_sigma(calibration, uv),
        camera=camera,
        camera_problem=problem,
    )


def point_sigma(calibration: Calibration, uv: FloatArray) -> FloatArray:
    """Relative standard deviation of a ground velocity at points, over all headings.

    Parameters
    ----------
    calibration : Calibration
        With its covariance.
    uv : (N, 2) array [px]
        Points on the ground.

    Returns
    -------
    sigma : (N,) array
        Root mean square over the headings.
    """
    unit = np.broadcast_to(np.eye(2)[:, None, :], (2, len(uv), 2))
    each = ground_velocity_covariance(calibration.model.g, calibration.covariance, uv[None], unit)
    return np.asarray(np.sqrt(np.mean(np.trace(each, axis1=-2, axis2=-1), axis=0)))


def _oriented(calibration: Calibration) -> FloatArray:
    n = calibration.model.horizon * np.sign(calibration.model.nearness(calibration.origin_px))
    length = float(np.hypot(n[0], n[1]))
    # A line whose nearest point is a million images away is at infinity for all that pixels can tell.
    return n / length if length > 1e-9 * abs(n[2]) else np.array([0.0, 0.0, 1.0])


def _camera(
    calibration: Calibration, principal: tuple[float, float] | None, focal_length: float | None
) -> tuple[CameraEstimate | None, str]:
    if principal is None:
        return None, "the image's size is not known; give --image-size or --principal-point"

    def camera(g: FloatArray) -> PlaneCamera:
        return LimitedHomography(g).camera(
            principal, focal_length=focal_length, ground_uv=calibration.origin_px
        )

    g = np.array(calibration.model.g)
    try:
        found = camera(g)
        derivative = np.empty((4, 6))
        for k in range(6):
            step = np.zeros(6)
            # A hundredth of the deviation: small enough to be linear, large enough for the digits.
            step[k] = 0.01 * np.sqrt(calibration.covariance[k, k]) or 1e-9 * np.abs(g).max()
            high, low = camera(g + step.reshape(3, 2)), camera(g - step.reshape(3, 2))
            derivative[:, k] = (_numbers(high) - _numbers(low)) / (2 * step[k])
    except AirgroundError as error:
        return None, str(error)
    sigma = np.sqrt(np.einsum("ik,kl,il->i", derivative, calibration.covariance, derivative))
    if sigma[0] > MAX_FOCAL_SIGMA * found.focal_length_px:
        return None, (
            f"g leaves the focal length uncertain by {sigma[0] / found.focal_length_px:.0%}: the camera looks "
            "nearly straight down; give the focal length, or calibrate on a longer drive"
        )
    return CameraEstimate(found, *map(float, sigma)), ""


def _numbers(camera: PlaneCamera) -> FloatArray:
    return np.array([camera.focal_length_px, camera.tilt_rad, camera.roll_rad, camera.height_m])

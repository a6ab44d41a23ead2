"""What a calibration says, in words that a person can check: horizon, scale, camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.lens_uncertainty import raw_relative_sigma
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

__all__ = ["CameraEstimate", "Inspection", "LensBend", "inspect_calibration", "point_sigma"]

MAX_FOCAL_SIGMA = (
    0.5  # relative; beyond it neither the number nor its first-order deviation says anything
)
GRID = 9  # points along each side at which the scale is given
HORIZON_POINTS = 1201  # along the whole horizon; half of them within half a frame of its middle


@dataclass(frozen=True, slots=True, eq=False)
class LensBend:
    """How far the lens moves points: from where the camera shows them to where a pinhole would, outwards positive."""

    k1: float
    """Of the division model [1/px^2]; negative for a barrel."""

    k1_sigma: float | None
    """Its standard deviation [1/px^2]; None where it was taken as exact."""

    center_px: FloatArray
    """(2,) [px]. The point that stays."""

    frame_px: float
    """At the corner of the frame where it is most [px]; NaN where the lens is not modelled out to there."""

    frame_sigma_px: float
    """Its standard deviation, from that of k1 [px]."""

    region_px: float | None
    """At the corner of the driven region where it is most [px]; None where that region is not known."""


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
    """(3,). Line a u + b v + c = 0 with a^2 + b^2 = 1 and positive on the ground; at nadir (0, 0, 1).

    With a lens it is a line of the undistorted image.
    """

    horizon_uv: FloatArray
    """(M, 2) [px]. Points along the horizon as the camera shows it, bent by the lens; none at nadir."""

    horizon_in_frame: bool
    """Whether the horizon crosses the frame."""

    uv: FloatArray
    """(N, 2) [px]. A grid of points over the frame, those on the ground; raw, as are all pixels here but `horizon`."""

    pixels_per_metre: FloatArray
    """(N, 2) [px/m]. Smallest and largest scale over all headings, at each point."""

    relative_sigma: FloatArray
    """(N,). Relative standard deviation of a ground velocity, over all headings, at each point."""

    camera: CameraEstimate | None
    """The camera, if g determines one: the pinhole that would take the undistorted image."""

    camera_problem: str
    """Why there is none; empty where there is."""

    lens: LensBend | None = None
    """What the lens does; None where there is none."""


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
        Where the optical axis meets the image; where not given, the lens's centre, or else the image's middle.
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
    if principal_point_px is not None:
        u, v = calibration.undistort(principal_point_px)
        middle = (float(u), float(v))
    elif calibration.lens is not None:  # lenses are turned round the optical axis
        middle = (float(calibration.lens.center[0]), float(calibration.lens.center[1]))
    camera, problem = _camera(calibration, middle, focal_length_px)

    u0, v0, u1, v1 = frame
    grid = np.stack(np.meshgrid(np.linspace(u0, u1, GRID), np.linspace(v0, v1, GRID)), axis=-1)
    uv = grid.reshape(-1, 2)
    uv = uv[calibration.is_ground(uv)]
    if len(uv) == 0:
        raise InputError(
            f"no ground in u {u0:g}..{u1:g}, v {v0:g}..{v1:g}: all of it lies beyond the horizon; "
            "check the image's size"
        )
    horizon = _oriented(calibration)
    curve = _horizon_curve(calibration, horizon, frame)
    inside = ((curve >= [u0, v0]) & (curve <= [u1, v1])).all(axis=1)
    # A horizon that cuts off a corner may do so between two points of the curve.
    seen = calibration.undistort(_corners(frame))
    beyond = ~calibration.model.same_side(seen, calibration.origin_px) & np.isfinite(seen).all(-1)
    return Inspection(
        frame_px=frame,
        horizon=horizon,
        horizon_uv=curve,
        horizon_in_frame=bool(inside.any() or beyond.any()),
        uv=uv,
        pixels_per_metre=np.asarray(
            np.linalg.svd(calibration.jacobian(uv), compute_uv=False)[..., ::-1]
        ),
        relative_sigma=point_sigma(calibration, uv),
        camera=camera,
        camera_problem=problem,
        lens=_bend(calibration, frame),
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
    c = calibration
    return raw_relative_sigma(c.model.g, c.covariance, c.lens, c.k1_covariance, uv=uv)


def _corners(frame: tuple[float, float, float, float]) -> FloatArray:
    u0, v0, u1, v1 = frame
    return np.array([[u0, v0], [u1, v0], [u0, v1], [u1, v1]])


def _bend(calibration: Calibration, frame: tuple[float, float, float, float]) -> LensBend | None:
    """Outward shifts; they grow with the radius, so that a corner of a rectangle has the largest."""
    lens, region = calibration.lens, calibration.fit.region_px
    if lens is None:
        return None

    def most(rectangle: tuple[float, float, float, float]) -> tuple[FloatArray, float]:
        uv = _corners(rectangle)
        radius = np.linalg.norm(uv - lens.center, axis=1)
        far = uv[np.argmax(radius)]
        return far, float(np.linalg.norm(lens.undistort(far) - lens.center) - radius.max())

    corner, shift = most(frame)
    rate = float(np.linalg.norm(lens.undistort_by_k1(corner)))
    return LensBend(
        k1=lens.k1,
        k1_sigma=calibration.k1_sigma,
        center_px=lens.center,
        frame_px=shift,
        frame_sigma_px=rate * (calibration.k1_sigma or 0.0),
        region_px=None if region is None else most(region)[1],
    )


def _horizon_curve(
    calibration: Calibration, horizon: FloatArray, frame: tuple[float, float, float, float]
) -> FloatArray:
    """Points along the horizon, dense where it is nearest to the frame's middle, in raw pixels."""
    a, b, c = horizon
    if a == b == 0.0:
        return np.empty((0, 2))
    low, high = np.array(frame[:2]), np.array(frame[2:])
    middle = (low + high) / 2 if calibration.lens is None else calibration.lens.center
    foot = middle - (a * middle[0] + b * middle[1] + c) * np.array([a, b])
    angle = np.linspace(-np.pi / 2, np.pi / 2, HORIZON_POINTS + 2)[1:-1]
    along = float(np.linalg.norm(high - low)) / 2 * np.tan(angle)
    curve = calibration.distort(foot + along[:, None] * np.array([-b, a]))
    return curve[np.isfinite(curve).all(axis=1)]


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
    if not np.isfinite(principal).all():
        return None, "the principal point lies beyond what the lens's model reaches"

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

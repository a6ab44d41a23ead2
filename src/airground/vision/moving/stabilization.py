"""What a stabiliser says of one frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from airground.errors import InputError, UndeterminedError
from airground.geometry.arrays import FloatArray, points, readonly
from airground.geometry.homography import unit_determinant
from airground.geometry.lens import DivisionLens
from airground.vision.moving.small_motion import (
    apply_homography,
    deviation,
    homography_jacobian,
)
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["Stabilization", "StabilizationStatus", "rate_between"]

StabilizationStatus = Literal[
    "ok", "too few points", "points in line", "parallax", "no agreement", "blurred", "lost"
]
"""Whether the ground was found again in a frame, and if not, why.

- ok: it was;
- too few points: fewer than four fixed points are in view, or the ground has too little texture;
- points in line: those that are lie nearly in one line;
- parallax: two planes explain about as many points each;
- no agreement: no homography explains enough of the points;
- blurred: the image is so much less sharp than the others that nothing can be followed;
- lost: the view is not known from any key frame; it may come back.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Stabilization:
    """How one frame lies to the stable frame, which is the first frame's image; or that this is not known."""

    t: float
    """Time of the frame [s]."""

    status: StabilizationStatus
    """`"ok"`, or why there is no homography."""

    stable_from_image: FloatArray | None = None
    """(3, 3). Determinant one; from undistorted to undistorted pixels where there is a lens. None unless ok."""

    covariance: FloatArray | None = None
    """(8, 8). Of the small motion of the image before it (`airground.vision.moving.small_motion`). None unless ok."""

    points: int = 0
    """How many points could be matched."""

    inliers: int = 0
    """How many of them agree."""

    rms_px: float = float("nan")
    """Root mean square residual of those, per coordinate [px]."""

    key_frame: int = 0
    """Index of the earlier frame that this one was compared with."""

    note: str = ""
    """What a user should know and the status does not say."""

    lens: DivisionLens | None = None
    """The camera's lens, if it was given: raw pixels are undistorted with it first."""

    def __post_init__(self) -> None:
        if self.status not in get_args(StabilizationStatus):
            raise InputError(
                f"status must be one of {', '.join(get_args(StabilizationStatus))}, "
                f"not {self.status}"
            )
        if (self.stable_from_image is not None) != self.ok or (self.covariance is not None) != (
            self.ok
        ):
            raise InputError("stable_from_image and covariance belong to status ok, and only to it")
        if self.stable_from_image is not None and self.covariance is not None:
            H = unit_determinant(readonly(self.stable_from_image, (3, 3), "stable_from_image"))
            object.__setattr__(self, "stable_from_image", readonly(H, (3, 3), "stable_from_image"))
            object.__setattr__(self, "covariance", readonly(self.covariance, (8, 8), "covariance"))

    @property
    def ok(self) -> bool:
        """Whether there is a homography."""
        return self.status == "ok"

    def refer(self, sightings: Sightings) -> Sightings:
        """Where the things seen in this frame lie in the stable frame.

        Parameters
        ----------
        sightings : Sightings
            Of this frame, in raw pixels.

        Returns
        -------
        sightings : Sightings
            In the stable frame. Covariances hold the homography's own, which all things of a frame share.

        Raises
        ------
        UndeterminedError
            If this frame has no homography.
        InputError
            If the times differ, or a position lies where the lens or the homography ends.
        """
        H, covariance = self._known()
        if sightings.t != self.t:
            raise InputError(
                f"sightings of t = {sightings.t} s do not belong to the frame of t = {self.t} s"
            )
        uv, J = self._flatten(H, sightings.uv)
        mapped = apply_homography(H, uv)
        if not np.isfinite(mapped).all():
            raise InputError(
                "a sighting lies beyond the lens's limit or on the homography's horizon"
            )
        spread = J @ sightings.covariance @ np.swapaxes(J, -1, -2)
        spread += deviation(H, covariance, uv)
        angle, angle_sigma = _turn(J, sightings.angle, sightings.angle_sigma)
        outline, _ = self._flatten(H, sightings.outline.reshape(-1, 2))
        outline = apply_homography(H, outline).reshape(-1, 4, 2)
        outline[~np.isfinite(outline)] = np.nan
        return replace(
            sightings,
            uv=mapped,
            covariance=0.5 * (spread + np.swapaxes(spread, -1, -2)),
            angle=angle,
            angle_sigma=angle_sigma,
            outline=outline,
        )

    def refer_velocity(self, uv: ArrayLike, uv_dot: ArrayLike, rate: ArrayLike) -> FloatArray:
        """Velocity in the stable frame of what moves in the image of a camera that moves too.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Positions in this frame, raw.
        uv_dot : (..., 2) array_like [px/s]
            Velocities in the image, raw.
        rate : (3, 3) array_like [1/s]
            Derivative of `stable_from_image` by time; `rate_between` gives it from two frames.

        Returns
        -------
        uv_dot : (..., 2) array [px/s]
            What a camera that stands where the first frame was taken would see; zero for what stands.

        Raises
        ------
        UndeterminedError
            If this frame has no homography.
        """
        H, _ = self._known()
        H_dot = readonly(rate, (3, 3), "rate")
        flat, J = self._flatten(H, points(uv, "uv"))
        w = flat @ H[:, :2].T + H[:, 2]
        w_dot = flat @ H_dot[:, :2].T + H_dot[:, 2]
        camera = (w_dot[..., :2] - w[..., :2] / w[..., 2:] * w_dot[..., 2:]) / w[..., 2:]
        own = np.einsum("...ij,...j->...i", J, points(uv_dot, "uv_dot"))
        return np.asarray(own + camera)

    def point_covariance(self, uv: ArrayLike) -> FloatArray:
        """Covariance that this homography alone gives to points of the image once they are referred.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Points of this frame, raw.

        Returns
        -------
        covariance : (..., 2, 2) array [px2]
            In the stable frame.

        Raises
        ------
        UndeterminedError
            If this frame has no homography.
        """
        H, covariance = self._known()
        flat, _ = self._flatten(H, points(uv, "uv"))
        return deviation(H, covariance, flat)

    def _known(self) -> tuple[FloatArray, FloatArray]:
        if self.stable_from_image is None or self.covariance is None:
            raise UndeterminedError(
                f"the frame of t = {self.t} s has no homography to the stable frame "
                f"({self.status}); leave it out"
            )
        return self.stable_from_image, self.covariance

    def _flatten(self, H: FloatArray, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Undistorted points, and the derivative of the stable point by the raw one."""
        if self.lens is None:
            return uv, homography_jacobian(H, uv)
        flat = self.lens.undistort(uv)
        return flat, homography_jacobian(H, flat) @ self.lens.undistort_jacobian(uv)


def rate_between(earlier: Stabilization, later: Stabilization) -> FloatArray:
    """Derivative of `stable_from_image` by time, half way between two frames.

    Parameters
    ----------
    earlier : Stabilization
        Of one frame.
    later : Stabilization
        Of a later one.

    Returns
    -------
    rate : (3, 3) array [1/s]
        Difference over time.

    Raises
    ------
    UndeterminedError
        If one of the two has no homography.
    InputError
        If the second is not later.
    """
    if earlier.stable_from_image is None or later.stable_from_image is None:
        bad = earlier if earlier.stable_from_image is None else later
        raise UndeterminedError(f"the frame of t = {bad.t} s has no homography ({bad.status})")
    if not later.t > earlier.t:
        raise InputError(f"the second frame must be the later one: {earlier.t} s, then {later.t} s")
    step = later.stable_from_image - earlier.stable_from_image
    return np.asarray(step / (later.t - earlier.t))


def _turn(J: FloatArray, angle: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Headings seen through the derivative of a map."""
    ahead = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    turned = np.einsum("nij,nj->ni", J, ahead)
    stretch = np.abs(np.linalg.det(J)) / np.sum(turned**2, axis=-1)
    return np.arctan2(turned[:, 1], turned[:, 0]), sigma * stretch

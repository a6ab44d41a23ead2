"""Which way is down, from how the ground's picture changes while the camera moves.

With A = K^-1 image_from_stable K = s (R + T n'), two directions in the ground's plane are turned and not bent: their
images under A / s are as long as each other and at right angles. A wrong normal n breaks that by the error of n times
the way T that the camera went, in heights; so a camera that has moved knows n, and one that only turned learns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import least_squares  # type: ignore[import-untyped,unused-ignore]

from airground.errors import InputError, UndeterminedError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["Level", "find_level"]

MOST = 400  # homographies that are used: more of them are alike
LEAST = 8
TILTS = np.radians([0.0, 20.0, 40.0, 60.0])  # tried where nothing is known
ASIDE = (-0.3, 0.3)
WIDE_RAD = 2.0
UNSURE_RAD = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """Which way is down."""

    normal: FloatArray
    """(3,). From the camera straight down to the ground, in the stable frame's right, down and forward; unit length."""

    sigma_rad: float
    """Standard deviation of its direction, in the worse of both ways [rad]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", readonly(self.normal, (3,), "normal"))


def find_level(
    stable_from_image: ArrayLike,
    *,
    guess: ArrayLike | None = None,
    guess_sigma_rad: float = 0.035,
    focal_length_px: float,
    principal_point: ArrayLike,
    noise_px: float = 0.1,
) -> Level:
    """Find the ground's normal from a flight.

    Parameters
    ----------
    stable_from_image : (N, 3, 3) array_like
        Of the ground, eight pictures or more.
    guess : (3,) array_like, optional
        What the normal is taken to be, from the gimbal for one; searched for where not given.
    guess_sigma_rad : float [rad]
        How well that is known, about each axis; not used without.
    focal_length_px : float [px]
        Of a camera with square pixels.
    principal_point : (2,) array_like [px]
        Often the image's middle.
    noise_px : float [px]
        How far a homography is off, as the stabiliser states it.

    Returns
    -------
    level : Level
        At least as sure as the guess, if there was one.

    Raises
    ------
    InputError
        If an argument has another shape, or is not positive, or the guess is zero.
    UndeterminedError
        If there are too few homographies, or no normal near the guess fits them, or without a guess the camera has
        moved too little to show it.
    """
    H = readonly(stable_from_image, (None, 3, 3), "stable_from_image")
    centre = readonly(principal_point, (2,), "principal_point")
    if not (focal_length_px > 0 and guess_sigma_rad > 0 and noise_px > 0):
        raise InputError(
            "focal_length_px, guess_sigma_rad and noise_px must be positive, not "
            f"{focal_length_px}, {guess_sigma_rad} and {noise_px}"
        )
    if len(H) < LEAST:
        raise UndeterminedError(f"{len(H)} pictures could be placed; a level needs {LEAST}")
    f = focal_length_px
    K = np.array([[f, 0.0, centre[0]], [0.0, f, centre[1]], [0.0, 0.0, 1.0]])
    A = np.linalg.inv(K) @ np.linalg.inv(H[:: -(-len(H) // MOST)]) @ K
    # Errors of pictures near in time hang together: a second's worth of them counts as one.
    noise = noise_px / f * np.sqrt(max(1.0, len(A) / 30))
    if guess is not None:
        n0 = readonly(guess, (3,), "guess")
        if not np.linalg.norm(n0) > 0:
            raise InputError("guess must not be zero")
        one = _fit(A, n0, guess_sigma_rad, noise)
        if one.off_rad > 4 * guess_sigma_rad:
            raise UndeterminedError(
                f"the flight's pictures fit no level near the one given ({np.degrees(one.off_rad):.1f} degrees off); "
                "check the focal length and the camera's tilt"
            )
        return one.level
    tried = [
        _fit(A, np.array([x, np.sin(a), np.cos(a)]), WIDE_RAD, noise) for a in TILTS for x in ASIDE
    ]
    best = min(tried, key=lambda one: one.cost)
    if best.level.sigma_rad > UNSURE_RAD:
        raise UndeterminedError(
            f"the camera moved too little to show its tilt, which is known to {np.degrees(best.level.sigma_rad):.1f} "
            "degrees only; say which way is down"
        )
    return best.level


class _Fitted(NamedTuple):
    """A local solution."""

    level: Level
    off_rad: float  # from where it began
    cost: float


def _fit(A: FloatArray, start: FloatArray, sigma_rad: float, noise: float) -> _Fitted:
    n0 = start / np.linalg.norm(start)
    across = np.linalg.svd(n0[None])[2][1:]  # two directions to tilt it in

    def residuals(tilt: FloatArray) -> FloatArray:
        bent = _bent(A, n0 + tilt @ across, across)
        return np.concatenate([bent.ravel() / noise, tilt / sigma_rad])

    found = least_squares(residuals, np.zeros(2), loss="soft_l1", x_scale=min(sigma_rad, 0.1))
    normal = n0 + found.x @ across
    spread = np.linalg.inv(found.jac.T @ found.jac)
    level = Level(normal / np.linalg.norm(normal), float(np.sqrt(np.linalg.eigvalsh(spread)[-1])))
    return _Fitted(level, float(np.hypot(*found.x)), float(found.cost))


def _bent(A: FloatArray, n: FloatArray, across: FloatArray) -> FloatArray:
    """(N, 2). How much longer one of two directions becomes than the other, and how far they leave the right angle."""
    n = n / np.linalg.norm(n)
    first = across[0] - (across[0] @ n) * n  # changes smoothly with n
    first = first / np.linalg.norm(first)
    turned = np.stack([first, np.cross(n, first)]) @ np.swapaxes(A, 1, 2)  # (N, 2, 3)
    first, second = turned[:, 0], turned[:, 1]
    length = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
    right = np.sum(first * second, axis=1) / (length[0] * length[1])
    return np.stack([np.log(length[0] / length[1]), right], axis=1)

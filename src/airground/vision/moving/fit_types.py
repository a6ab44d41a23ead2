"""What a fit of a homography says, and when agreement of points means something."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray

__all__ = [
    "BoolArray",
    "FitStatus",
    "HomographyFit",
    "NoiseScale",
    "closeness",
    "may_be_chance",
]

BoolArray = NDArray[np.bool_]

FitStatus = Literal["ok", "too few points", "points in line", "parallax", "no agreement"]
"""Why there is a homography, or none.

- too few points: fewer than four, or fewer than were asked for, can be matched;
- points in line: those that agree lie so nearly in one line (but for one, it may be) that they leave H open;
- parallax: two homographies explain about as many points each: there are two planes, or a crowd that moves as one;
- no agreement: there is no homography that enough of the points follow.
"""

LEAST = 4
GATE = 9.21  # chi-square of two degrees of freedom, 99 %
CLOSEST = 0.1  # squared deviations; what follows more closely than this does so by chance
SAFE = 8  # so many do not agree by chance
TELLING = 6  # one wrong point among so many can be told
ALL_BUT = 0.6  # share of the points that must agree where they are fewer than SAFE


@dataclass(frozen=True, slots=True)
class NoiseScale:
    """What is known before about noise: a factor on the stated deviations, and what that knowledge is worth."""

    factor: float = 1.0
    """True deviation over stated deviation."""

    worth: float = 8.0
    """As many residuals as this would tell the same; infinite if the stated covariances are to be taken as they are."""


@dataclass(frozen=True, slots=True, eq=False)
class HomographyFit:
    """A homography and how sure it is, or why there is none."""

    status: FitStatus
    """`"ok"`, or the reason why `matrix` is None."""

    matrix: FloatArray | None
    """(3, 3). Target from source, determinant one."""

    covariance: FloatArray | None
    """(8, 8). Of the small motion before it (`airground.vision.moving.small_motion`)."""

    inliers: BoolArray
    """(N,). Matches that it follows."""

    rms_px: float
    """Root mean square residual of those, per coordinate, in the target [px]; NaN where there is none."""

    scale: float
    """Their true deviation over the stated one, as far as the residuals tell."""

    residuals: FloatArray
    """(N, 2) [px]. Target less mapped source, of all matches; NaN where there is no homography."""

    d2: FloatArray
    """(N,). Squared residuals over the stated covariances; infinite where there is no homography."""

    @classmethod
    def failed(cls, status: FitStatus, count: int) -> Self:
        """No homography.

        Parameters
        ----------
        status : str
            Why.
        count : int
            Of how many matches.

        Returns
        -------
        fit : HomographyFit
            Without a matrix.
        """
        return cls(
            status,
            None,
            None,
            np.zeros(count, dtype=np.bool_),
            np.nan,
            np.nan,
            np.full((count, 2), np.nan),
            np.full(count, np.inf),
        )


def may_be_chance(agreed: int, count: int) -> bool:
    """Whether the agreement of few points proves nothing: any four of five points have a homography.

    Parameters
    ----------
    agreed : int
        Points that agree.
    count : int
        Of how many.

    Returns
    -------
    chance : bool
        False where all agree; with fewer than six, only then.
    """
    if agreed == count or agreed >= SAFE:
        return False
    return agreed < TELLING or agreed < ALL_BUT * count


def closeness(d2: FloatArray) -> float:
    """How many points follow, and how closely: the noise may be less than stated, and what moves follows loosely.

    Parameters
    ----------
    d2 : (N,) array
        Squared residuals over their covariances.

    Returns
    -------
    score : float
        Zero where none follows.
    """
    return float(np.log(GATE / np.clip(d2, CLOSEST, GATE)).sum())

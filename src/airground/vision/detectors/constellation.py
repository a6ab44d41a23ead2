"""Vehicles as patterns of points: LEDs, reflectors or markers of which one looks like the other.

Over a vehicle's own size a camera's view of the ground is affine, and how it stretches depends on the place alone. So
three points place a pattern, what it is stretched by must be what it is stretched by there (`view`), and all further
points must be where they are then expected. Patterns are `(forward, left)` and seen from above: never mirrored.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError, UndeterminedError
from airground.geometry.arrays import FloatArray, readonly
from airground.vision.detectors.constellation_match import match_pattern, placing
from airground.vision.detectors.constellation_pattern import Constellation, view_of
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.vision.detectors.protocol import Detector
    from airground.vision.frame import Frame

__all__ = [
    "Constellation",
    "ConstellationDetector",
    "constellation_sightings",
    "find_constellations",
]

LEARNED_FRAMES = 200
"""From which a detector learns its pattern, or its view."""


class ConstellationDetector:
    """Vehicles from a detector of points.

    Where no pattern is given, it is learned from the first frames, and nothing is found until then. Where one is given
    without a view, the view is learned on the way.

    Parameters
    ----------
    points : Detector
        Finds the points; only their positions and covariances are used.
    pattern : Constellation, optional
        What to look for.
    """

    def __init__(self, points: Detector, pattern: Constellation | None = None) -> None:
        self.points = points
        self.pattern = pattern
        self._seen: list[FloatArray] = []

    def detect(self, frame: Frame) -> Sightings:
        """Find vehicles in a frame.

        Parameters
        ----------
        frame : Frame
            The next frame.

        Returns
        -------
        sightings : Sightings
            One for each pattern that was found.
        """
        seen = self.points.detect(frame)
        if self.pattern is None or self.pattern.view is None:
            self._seen.append(seen.uv)
            if len(self._seen) % LEARNED_FRAMES == 0:
                self._learn()
        if self.pattern is None:
            return Sightings.none(seen.t)
        return find_constellations(seen, self.pattern)

    def _learn(self) -> None:
        try:
            if self.pattern is None:
                self.pattern = Constellation.learned(self._seen)
            else:
                view = view_of(self.pattern, self._seen)
                self.pattern = Constellation(self.pattern.points, self.pattern.always, view)
        except UndeterminedError:
            pass  # nothing moved yet
        if len(self._seen) > 10 * LEARNED_FRAMES:
            self._seen = self._seen[::2]


def find_constellations(seen: Sightings, pattern: Constellation) -> Sightings:
    """Find vehicles among points.

    Parameters
    ----------
    seen : Sightings
        Points.
    pattern : Constellation
        What to look for.

    Returns
    -------
    sightings : Sightings
        One for each pattern, at its origin; what it covers is the box around its points.
    """
    if len(seen) < 3:
        return Sightings.none(seen.t)
    sigma = float(np.sqrt(np.median(np.trace(seen.covariance, axis1=1, axis2=2)) / 2))
    match = match_pattern(seen.uv, pattern, sigma)
    count = len(match.b)
    if count == 0:
        return Sightings.none(seen.t)
    covariance, angle, angle_sigma = np.empty((count, 2, 2)), np.empty(count), np.empty(count)
    headless = pattern.ambiguous
    for k in range(count):
        rows = placing(match.which[k], pattern)
        X = np.column_stack([np.ones(len(rows)), pattern.points[rows]])
        own = np.linalg.inv(X.T @ X)
        noise = seen.covariance[match.which[k, rows]].mean(axis=0)
        covariance[k] = own[0, 0] * noise
        ahead = match.A[k][:, 0]
        across = np.array([-ahead[1], ahead[0]]) / np.linalg.norm(ahead)
        angle[k] = np.nan if headless else np.arctan2(ahead[1], ahead[0])
        spread = np.sqrt(own[1, 1] * across @ noise @ across) / np.linalg.norm(ahead)
        angle_sigma[k] = np.nan if headless else spread
    low, high = pattern.points.min(axis=0), pattern.points.max(axis=0)
    box = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    outline = match.b[:, None] + box @ match.A.swapaxes(1, 2)
    score = np.exp(-np.maximum(match.cost, 0.0) / 4)
    return Sightings(
        seen.t, match.b, covariance, (), angle, angle_sigma, np.clip(score, 0.0, 1.0), outline
    )


def constellation_sightings(
    t: FloatArray,
    frames: Sequence[FloatArray],
    pattern: Constellation | None = None,
    *,
    sigma_px: float = 0.3,
) -> list[Sightings]:
    """Find vehicles in a recording of points.

    Parameters
    ----------
    t : (N,) array [s]
        Times of the frames.
    frames : sequence of (P, 2) array [px]
        Points of each frame, in any order.
    pattern : Constellation, optional
        What to look for; learned from the recording where not given.
    sigma_px : float [px]
        Standard deviation of a point's coordinates.

    Returns
    -------
    sightings : list of Sightings
        Of each frame.

    Raises
    ------
    InputError
        If there are not as many times as frames, or the noise is not positive.
    UndeterminedError
        If no pattern was given and no points move rigidly together.
    """
    if len(t) != len(frames):
        raise InputError(f"there must be one time for each of {len(frames)} frames, not {len(t)}")
    if not 0 < sigma_px < np.inf:
        raise InputError(f"sigma_px must be positive, not {sigma_px}")
    frames = [readonly(uv, (None, 2), "frames") for uv in frames]
    if pattern is None:
        pattern = Constellation.learned(frames)
    elif pattern.view is None:
        pattern = Constellation(pattern.points, pattern.always, view_of(pattern, frames))
    return [
        find_constellations(Sightings.round(float(time), uv, sigma_px), pattern)
        for time, uv in zip(t, frames, strict=True)
    ]

"""All key frames together: which of them a frame is compared with, when one is added, and how a lost view is found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.geometry.homography import unit_determinant
from airground.vision.moving.features import describe, find_corners, match
from airground.vision.moving.key_frames import (
    Demands,
    KeyFrame,
    Registration,
    register,
    shared_view,
)
from airground.vision.moving.pose_graph import Link, PoseGraph, chain
from airground.vision.moving.search import search_homography
from airground.vision.moving.small_motion import compose_covariance, invert_covariance, relative

if TYPE_CHECKING:
    from airground.vision.frame import ImageArray
    from airground.vision.moving.stabilizer import StabilizerOptions

__all__ = ["Atlas", "Located", "View"]

ENOUGH = 0.45  # share of the view that a key frame must show to be compared with
TIES = 0.3  # and to be tied to a new one
MOST_TIES = 3
TRIES = 2  # key frames that are compared with in one frame
LOOKUPS = 3  # key frames whose descriptors are compared in one frame
LOOKUP_PX = 4.0
LEAST_MATCHES = 12
FADED = 0.4  # share of its features below which a key frame has changed too much
WAIT = 15  # frames after which a key frame that failed is tried again
WIDEST_PX = 5.0  # deviation anywhere in the image beyond which a homography is no answer


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A frame as it is worked on."""

    index: int
    """Of the frame."""

    image: ImageArray
    """(H, W). Grey."""

    mask: ImageArray
    """(H, W). Zero where there is no ground."""


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """A frame that was found in the atlas."""

    key: int
    """Number of the key frame that it was compared with."""

    registration: Registration
    """That comparison."""

    stable_from_image: FloatArray
    """(3, 3). As the atlas was then."""


class Atlas:
    """Key frames and their links.

    Parameters
    ----------
    options : StabilizerOptions
        How the ground is followed.
    view : View
        The first frame, which is the stable frame.
    points : (N, 2) array [px], optional
        Its features, where they are given.
    """

    def __init__(self, options: StabilizerOptions, view: View, points: FloatArray | None) -> None:
        self.options = options
        self.tried = 0
        self._given = points is not None
        self._graph = PoseGraph()
        self._keys: dict[int, KeyFrame] = {0: self._make(view, points)}
        self._used: dict[int, int] = {0: 0}
        self._failed: dict[int, int] = {}
        self._current = 0
        self._next = 1
        self._clock = 0
        self._lookup = 0
        self._scale = 1.0
        self._faded = 0

    def indices(self) -> tuple[int, ...]:
        """Indices of the frames that are kept.

        Returns
        -------
        indices : tuple of int
            The stable one first.
        """
        return tuple(self._keys[k].index for k in sorted(self._keys))

    def index(self, key: int) -> int:
        """Index of the frame that a key frame was.

        Parameters
        ----------
        key : int
            Number of the key frame.

        Returns
        -------
        index : int
            As the camera counts.
        """
        return self._keys[key].index

    def features(self) -> FloatArray:
        """Features of the stable frame.

        Returns
        -------
        uv : (N, 2) array [px]
            Corners.
        """
        return self._keys[0].uv

    def pose(self, found: Located) -> tuple[FloatArray, FloatArray]:
        """Homography of a frame that was found.

        Parameters
        ----------
        found : Located
            Where.

        Returns
        -------
        stable_from_image : (3, 3) array
            By the atlas as it is now.
        covariance : (8, 8) array
            Of the comparison and of the key frame together.
        """
        matrix = found.registration.fit.matrix
        assert matrix is not None
        covariance = compose_covariance(
            self._graph.covariance[found.key], found.registration.covariance, matrix
        )
        return unit_determinant(self._graph.matrix[found.key] @ matrix), covariance

    def locate(self, view: View, guess: FloatArray | None) -> Located | None:
        """Find a frame.

        Parameters
        ----------
        view : View
            The frame.
        guess : (3, 3) array or None
            Stable from image, roughly, if known.

        Returns
        -------
        found : Located or None
            None where no key frame shows enough of the same.
        """
        self._clock += 1
        self.tried = 0
        found = None if guess is None else self._near(view, guess)
        return self._anywhere(view) if found is None else found

    def grow(self, view: View, found: Located) -> None:
        """Make the frame a key frame if no other shows enough of what it shows, and close loops.

        Parameters
        ----------
        view : View
            The frame.
        found : Located
            Where it is.
        """
        fit = found.registration.fit
        faded = fit.inliers.sum() < FADED * found.registration.asked
        self._faded = self._faded + 1 if faded else 0
        shares = self._shares(view, found.stable_from_image)
        if max(shares.values()) >= self.options.renew_below and self._faded < 3:
            return
        key = self._make(view, None)
        if len(key.uv) < 2 * self.options.least or found.registration.covariance.size == 0:
            return
        number, self._next, self._faded = self._next, self._next + 1, 0
        assert fit.matrix is not None
        self._keys[number] = key
        self._used[number] = self._clock
        self._graph.add(number, Link(found.key, number, fit.matrix, found.registration.covariance))
        others = [k for k in shares if k != found.key and shares[k] >= TIES]
        for other in sorted(others, key=self._spread)[:MOST_TIES]:
            self._tie(view, number, other)
        self._forget(number)

    def _make(self, view: View, points: FloatArray | None) -> KeyFrame:
        options = self.options
        uv = points
        if uv is None:
            uv = find_corners(
                view.image, view.mask, cell_px=options.cell_px, per_cell=options.per_cell
            )
        return KeyFrame(view.index, view.image, uv, describe(view.image, view.mask))

    def _register(
        self, view: View, key: int, key_from_image: FloatArray, levels: int = 1
    ) -> Registration | None:
        least = 4 if self._given else self.options.least
        result = register(
            self._keys[key],
            view.image,
            view.mask,
            key_from_image,
            levels=levels,
            demands=Demands(least, self.options.least_share, self._scale),
        )
        fit = result.fit
        self.tried = max(self.tried, len(fit.inliers))
        if fit.matrix is None:
            return None
        return result

    def _near(self, view: View, guess: FloatArray) -> Located | None:
        """Compare with the surest key frame that shows enough, then with the one that shows most."""
        shares = self._shares(view, guess)
        rested = [k for k in shares if self._clock - self._failed.get(k, -WAIT) >= WAIT]
        enough = [k for k in rested if shares[k] >= ENOUGH]
        order = sorted(enough, key=self._spread)[:1]
        order += [k for k in sorted(shares, key=lambda k: -shares[k]) if k not in order]
        for key in order[:TRIES]:
            key_from_image = relative(self._graph.matrix[key], guess)
            result = self._register(view, key, key_from_image)
            if result is None:
                self._failed[key] = self._clock
                continue
            return self._take(view, key, result)
        return None

    def _anywhere(self, view: View) -> Located | None:
        """Know the view again by descriptors: the key frames in turn, the last one and the stable one first."""
        here = describe(view.image, view.mask)
        recent = sorted(self._keys, key=lambda k: (-self._used[k], k))
        rest = [k for k in recent[1:] if k != 0]
        turn = rest[self._lookup :] + rest[: self._lookup]
        order = list(dict.fromkeys([recent[0], 0, *turn]))[:LOOKUPS]
        self._lookup = (self._lookup + LOOKUPS - 2) % max(len(rest), 1)
        for key in order:
            uv, there = match(here, self._keys[key].descriptors)
            if len(uv) < LEAST_MATCHES:
                continue
            seen = search_homography(uv, there, LOOKUP_PX)
            if seen is None or seen[1] < LEAST_MATCHES:
                continue
            result = self._register(view, key, seen[0], levels=2)
            if result is not None:
                return self._take(view, key, result)
        return None

    def _take(self, view: View, key: int, result: Registration) -> Located:
        matrix = result.fit.matrix
        assert matrix is not None
        # One blurred frame says little of the next.
        self._scale = 0.9 * self._scale + 0.1 * min(result.fit.scale, 2 * self._scale)
        found = Located(key, result, unit_determinant(self._graph.matrix[key] @ matrix))
        last, self._current = self._current, key
        self._used[key] = self._clock
        if last != key and last in self._keys and not self._graph.linked(last, key):
            shares = self._shares(view, found.stable_from_image)
            if shares[last] >= TIES:
                self._tie_by(view, found, last)
        return found

    def _tie(self, view: View, number: int, other: int) -> None:
        """Tie a new key frame, whose image this is, to another."""
        guess = relative(self._graph.matrix[other], self._graph.matrix[number])
        result = self._register(view, other, guess, levels=2)
        if result is not None and result.fit.matrix is not None:
            self._graph.close(Link(other, number, result.fit.matrix, result.covariance))

    def _tie_by(self, view: View, found: Located, other: int) -> None:
        """Tie two key frames by a frame that shows both."""
        guess = relative(self._graph.matrix[other], found.stable_from_image)
        result = self._register(view, other, guess, levels=2)
        one = found.registration.fit.matrix
        if result is None or result.fit.matrix is None or one is None:
            return
        back = Link(
            -1,
            found.key,
            relative(one, np.eye(3)),
            invert_covariance(one, found.registration.covariance),
        )
        there = Link(other, -1, result.fit.matrix, result.covariance)
        self._graph.close(chain(there, back))

    def _shares(self, view: View, stable_from_image: FloatArray) -> dict[int, float]:
        height, width = view.image.shape
        return {
            k: shared_view(relative(self._graph.matrix[k], stable_from_image), (width, height))
            for k in self._keys
        }

    def _spread(self, key: int) -> tuple[float, int]:
        """How sure a key frame's place is; the older one where that is equal."""
        return float(np.trace(self._graph.covariance[key])), key

    def _forget(self, newest: int) -> None:
        if len(self._keys) <= self.options.most_key_frames:
            return
        idle = [k for k in self._keys if k not in (0, newest, self._current)]
        key = min(idle, key=lambda k: (self._used[k], k))
        self._graph.drop(key)
        del self._keys[key], self._used[key]
        self._failed.pop(key, None)

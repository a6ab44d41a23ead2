"""Tags in an image that nothing is known about yet: OpenCV finds and decodes them, roughly placed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.vision.detectors.tag_families import TagFamily
    from airground.vision.detectors.tag_parts import Part
    from airground.vision.frame import ImageArray

    Window = tuple[int, int, int, int]

__all__ = ["Candidate", "TagSearch", "grey_part"]

SMALL_PX = 32.0  # side of a tag that may deserve a closer look
LEAST_STEP = 12.0  # grey levels, across its border
MOST_LOOKS = 12  # in one search
ENLARGE = 4
LARGE_PX = 45.0  # side from which a tag is looked for in the image of half the size, too
PART_LOOKS = 1  # in one search of a part: OpenCV takes some 3 ms to find that a square is no 36h11

# Windows of the local threshold [px]: from, to, step. One must be wider than the black of a tag.
SMALL_WINDOWS = (5, 21, 16)
LARGE_WINDOWS = (27, 27, 4)
PART_WINDOWS = (5, 5, 4)


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A tag that was decoded, its corners good to a pixel or two."""

    family: TagFamily
    """Whose it is."""

    number: int
    """Which of the family."""

    corners: FloatArray
    """(4, 2) [px]. Top left, top right, bottom right, bottom left as printed."""


class TagSearch:
    """Finds tags by OpenCV's detector.

    Parameters
    ----------
    families : tuple of TagFamily
        What to look for.
    least_side_px : float
        Quadrilaterals smaller than this are passed over [px].
    """

    def __init__(self, families: tuple[TagFamily, ...], least_side_px: float) -> None:
        self._families = families
        self._least_side_px = least_side_px
        self._parameters = cv2.aruco.DetectorParameters()
        self._parameters.minDistanceToBorder = 1
        self._detector = cv2.aruco.ArucoDetector(families[0].dictionary, self._parameters)
        if len(families) > 1:
            self._detector.setDictionaries([family.dictionary for family in families])

    def find(
        self, image: ImageArray, window: tuple[int, int, int, int] | None = None
    ) -> list[Candidate]:
        """Find and decode tags.

        Parameters
        ----------
        image : (H, W) or (H, W, 3) array
            The image.
        window : tuple of int, optional
            Left, top, right, bottom [px], the last two excluded: look only there.

        Returns
        -------
        candidates : list of Candidate
            False ones are among them: random texture decodes now and then.
        """
        return self._find(image, window or (0, 0, image.shape[1], image.shape[0]), MOST_LOOKS)

    def glance(self, image: ImageArray, window: Window) -> list[Candidate]:
        """Find and decode tags in a hurry: few small quadrilaterals get a closer look.

        Parameters
        ----------
        image : (H, W) or (H, W, 3) array
            The image.
        window : tuple of int
            As for `find`.

        Returns
        -------
        candidates : list of Candidate
            As of `find`.
        """
        return self._find(image, window, PART_LOOKS)

    def _find(self, image: ImageArray, window: Window, looks: int) -> list[Candidate]:
        left, top, right, bottom = window
        if min(right - left, bottom - top) < 2 * self._least_side_px:
            return []
        part = grey_part(image, (left, top, right, bottom))
        found, rejected = self._decode(part, self._least_side_px, SMALL_WINDOWS)
        found += self._closer_look(part, rejected, looks)
        if min(part.shape) > 2 * LARGE_PX:
            found += self._from_afar(part, found)
        return [Candidate(family, number, quad + (left, top)) for family, number, quad in found]

    def find_part(
        self, image: ImageArray, part: Part, *, known: Sequence[FloatArray] = (), turn: int = 0
    ) -> list[Candidate]:
        """Find and decode tags in a part of an image; all parts together are about as good as `find`.

        Parameters
        ----------
        image : (H, W) or (H, W, 3) array
            The image; only the part is turned to grey.
        part : Part
            From `tag_parts.parts_of`.
        known : sequence of (4, 2) array [px]
            Corners of tags that need no closer look.
        turn : int
            How often the part was searched before: of many small quadrilaterals other ones get a closer look each time.

        Returns
        -------
        candidates : list of Candidate
            As of `find`.
        """
        left, top, right, bottom = part.window
        grey = grey_part(image, part.window)
        scale = part.scale
        if scale > 1:
            size = ((right - left) // scale, (bottom - top) // scale)
            grey = np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
            found, _ = self._decode(grey, LARGE_PX / 2, PART_WINDOWS)
        else:
            # Noise makes ten thousands of specks in the local threshold: most of the time went there.
            smooth = np.asarray(cv2.GaussianBlur(grey, (3, 3), 0), dtype=np.uint8)
            found, rejected = self._decode(smooth, self._least_side_px, PART_WINDOWS)
            rejected = _elsewhere(rejected, [corners - (left, top) for corners in known])
            found += self._closer_look(grey, rejected, PART_LOOKS, turn * PART_LOOKS)
        return [
            Candidate(family, number, (quad + 0.5) * scale - 0.5 + (left, top))
            for family, number, quad in found
        ]

    def _decode(
        self, part: ImageArray, least_side_px: float, windows: tuple[int, int, int]
    ) -> tuple[list[tuple[TagFamily, int, FloatArray]], list[FloatArray]]:
        """Tags, and quadrilaterals that are none."""
        parameters = self._parameters
        # OpenCV takes the smallest perimeter as a share of the larger side of the image.
        parameters.minMarkerPerimeterRate = 4.0 * least_side_px / max(part.shape)
        parameters.adaptiveThreshWinSizeMin, parameters.adaptiveThreshWinSizeMax = windows[:2]
        parameters.adaptiveThreshWinSizeStep = windows[2]
        self._detector.setDetectorParameters(parameters)
        which: object = None
        if len(self._families) == 1:
            quads, ids, others = self._detector.detectMarkers(part)
        else:
            quads, ids, others, which = self._detector.detectMarkersMultiDict(part)
        rejected = [np.asarray(quad, dtype=np.float64).reshape(4, 2) for quad in others]
        if ids is None:  # type: ignore[unreachable, unused-ignore]  # which it is where there are none
            return [], rejected  # type: ignore[unreachable, unused-ignore]
        numbers = np.asarray(ids).ravel().tolist()
        kinds = [0] * len(numbers) if which is None else np.asarray(which).ravel().tolist()
        found = []
        for quad, number, kind in zip(quads, numbers, kinds, strict=True):
            inner = np.asarray(quad, dtype=np.float64).reshape(4, 2)
            # The contour runs along the centres of the outermost dark pixels: half a pixel inside.
            out = inner - inner.mean(axis=0)
            out /= np.maximum(np.abs(out).max(axis=1, keepdims=True), 1e-9)
            found.append((self._families[int(kind)], int(number), inner + 0.5 * out))
        return found, rejected

    def _closer_look(
        self,
        part: ImageArray,
        rejected: list[FloatArray],
        most: int = MOST_LOOKS,
        first: int = 0,
    ) -> list[tuple[TagFamily, int, FloatArray]]:
        """Small quadrilaterals enlarged: their cells have too few pixels to be read as they are."""
        if not rejected:
            return []
        quads = np.array(rejected)
        middle = quads.mean(axis=1, keepdims=True)
        sides = np.hypot(*(quads - np.roll(quads, 1, axis=1)).transpose(2, 0, 1)).mean(axis=1)
        edges = (quads + np.roll(quads, 1, axis=1)) / 2
        limit = np.array(part.shape[::-1]) - 1
        inside = np.clip(np.rint(middle + 0.9 * (edges - middle)), 0, limit).astype(np.intp)
        outside = np.clip(np.rint(middle + 1.25 * (edges - middle)), 0, limit).astype(np.intp)
        bright, dark = part[outside[..., 1], outside[..., 0]], part[inside[..., 1], inside[..., 0]]
        step = bright.astype(np.int16) - dark
        # Dark within white, or the white sheet that the tag is printed on.
        step = np.abs(step.mean(axis=1))
        rows = np.flatnonzero((sides < SMALL_PX) & (step > LEAST_STEP))
        found: list[tuple[TagFamily, int, FloatArray]] = []
        rows = rows[np.argsort(-step[rows], kind="stable")]
        if len(rows) > most:
            rows = np.roll(rows, -first)[:most]
        for row in rows:
            pad = 0.6 * sides[row] + 2.0
            low = np.clip(np.floor(quads[row].min(axis=0) - pad), 0, None).astype(int)
            high = np.ceil(quads[row].max(axis=0) + pad).astype(int) + 1
            window = part[low[1] : high[1], low[0] : high[0]]
            large = cv2.resize(window, None, fx=ENLARGE, fy=ENLARGE, interpolation=cv2.INTER_CUBIC)
            near = np.asarray(large, dtype=np.uint8)
            least = 0.2 * max(near.shape)  # the tag fills nearly half of the window
            for family, number, quad in self._decode(near, least, SMALL_WINDOWS)[0]:
                # Pixel u of the window is centred on pixel ENLARGE * (u + 0.5) - 0.5 of the enlarged one.
                found.append((family, number, (quad + 0.5) / ENLARGE - 0.5 + low))
        return found

    def _from_afar(
        self, part: ImageArray, known: list[tuple[TagFamily, int, FloatArray]]
    ) -> list[tuple[TagFamily, int, FloatArray]]:
        """Large tags, whose black areas are wider than the windows above; at half the size that is cheap."""
        small = cv2.resize(part, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        found = []
        seen = [(family, number, quad.mean(axis=0)) for family, number, quad in known]
        far = np.asarray(small, dtype=np.uint8)
        for family, number, quad in self._decode(far, LARGE_PX / 2, LARGE_WINDOWS)[0]:
            corners = (quad + 0.5) * 2.0 - 0.5
            middle = corners.mean(axis=0)
            if not any(
                (family, number) == (f, n) and np.hypot(*(middle - m)) < LARGE_PX / 4
                for f, n, m in seen
            ):
                found.append((family, number, corners))
        return found


def grey_part(image: ImageArray, window: tuple[int, int, int, int]) -> ImageArray:
    """Brightness of a part of an image.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        Grey, or blue, green, red.
    window : tuple of int
        Left, top, right, bottom [px], the last two excluded.

    Returns
    -------
    grey : (h, w) array
        In one piece.
    """
    left, top, right, bottom = window
    part = image[top:bottom, left:right]
    if part.ndim == 3 and part.size:
        return np.asarray(cv2.cvtColor(part, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    return np.ascontiguousarray(part)


def _elsewhere(quads: list[FloatArray], known: Sequence[FloatArray]) -> list[FloatArray]:
    """Quadrilaterals that lie in none of some others: the cells of a tag are none."""
    if not quads or not len(known):
        return quads
    hulls = [np.asarray(corners, dtype=np.float32).reshape(-1, 1, 2) for corners in known]
    middles = [tuple(quad.mean(axis=0).tolist()) for quad in quads]
    return [
        quad
        for quad, middle in zip(quads, middles, strict=True)
        if not any(cv2.pointPolygonTest(hull, middle, measureDist=False) >= 0 for hull in hulls)
    ]

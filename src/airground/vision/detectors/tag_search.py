"""Tags in an image that nothing is known about yet: OpenCV finds and decodes them, roughly placed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.vision.detectors.tag_families import TagFamily
    from airground.vision.frame import ImageArray

__all__ = ["Candidate", "TagSearch"]

SMALL_PX = 32.0  # side of a tag that may deserve a closer look
LEAST_STEP = 12.0  # grey levels, across its border
MOST_LOOKS = 12  # in one search
ENLARGE = 4
LARGE_PX = 45.0  # side from which a tag is looked for in the image of half the size, too
OVERLAP_PX = 96  # of the parts of an image: a tag of LARGE_PX lies within one whatever its turn
LEAST_PART_PX = 160  # side of a part without its overlap

# Windows of the local threshold [px]: from, to, step. One must be wider than the black of a tag.
SMALL_WINDOWS = (5, 21, 16)
LARGE_WINDOWS = (27, 27, 4)


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
        self, grey: ImageArray, window: tuple[int, int, int, int] | None = None
    ) -> list[Candidate]:
        """Find and decode tags.

        Parameters
        ----------
        grey : (H, W) array
            The image.
        window : tuple of int, optional
            Left, top, right, bottom [px], the last two excluded: look only there.

        Returns
        -------
        candidates : list of Candidate
            False ones are among them: random texture decodes now and then.
        """
        left, top, right, bottom = window or (0, 0, grey.shape[1], grey.shape[0])
        part = np.ascontiguousarray(grey[top:bottom, left:right])
        if min(part.shape) < 2 * self._least_side_px:
            return []
        found, rejected = self._decode(part, self._least_side_px, SMALL_WINDOWS)
        found += self._closer_look(part, rejected)
        if min(part.shape) > 2 * LARGE_PX:
            found += self._from_afar(part, found)
        return [Candidate(family, number, quad + (left, top)) for family, number, quad in found]

    def parts(self, shape: tuple[int, ...], most: int) -> int:
        """How many parts `find_part` makes of an image.

        Parameters
        ----------
        shape : tuple of int
            Of the image: height and width.
        most : int
            No more than so many.

        Returns
        -------
        count : int
            1 where the image is too small to be worth a division.
        """
        tiles = _tiles(shape, most - 1)
        return len(tiles) + 1 if len(tiles) > 1 else 1

    def find_part(self, grey: ImageArray, which: int, most: int) -> list[Candidate]:
        """Find and decode tags in a part of an image; all parts together are about as good as `find`.

        The last part is the whole image at half the size, for large tags; the others are windows that overlap, on
        other sides the second time round, so that no place is at an edge twice.

        Parameters
        ----------
        grey : (H, W) array
            The image.
        which : int
            From 0 to twice `parts`; then they come again.
        most : int
            As for `parts`.

        Returns
        -------
        candidates : list of Candidate
            As of `find`.
        """
        count = self.parts(grey.shape, most)
        if count == 1:
            return self.find(grey)
        again, which = divmod(which, count)
        if which == count - 1:
            return [Candidate(*found) for found in self._from_afar(grey, [])]
        left, top, right, bottom = _tiles(grey.shape, most - 1, before=bool(again % 2))[which]
        part = np.ascontiguousarray(grey[top:bottom, left:right])
        found, rejected = self._decode(part, self._least_side_px, SMALL_WINDOWS)
        found += self._closer_look(part, rejected)
        return [Candidate(family, number, quad + (left, top)) for family, number, quad in found]

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
        self, part: ImageArray, rejected: list[FloatArray]
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
        for row in rows[np.argsort(-step[rows], kind="stable")][:MOST_LOOKS]:
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


@lru_cache(maxsize=8)  # asked for in every frame
def _tiles(
    shape: tuple[int, ...], most: int, *, before: bool = False
) -> tuple[tuple[int, int, int, int], ...]:
    """Windows of about one size that cover an image; of all grids of so many the one with the smallest windows.

    They overlap to the right and downwards, or, if `before`, to the left and upwards.
    """
    height, width = shape[:2]
    grids = [
        (columns, rows)
        for columns in range(1, max(min(most, width // LEAST_PART_PX), 1) + 1)
        for rows in range(1, max(min(most // columns, height // LEAST_PART_PX), 1) + 1)
    ]
    columns, rows = min(
        grids, key=lambda grid: (width / grid[0] + OVERLAP_PX) * (height / grid[1] + OVERLAP_PX)
    )
    u = np.linspace(0, width, columns + 1).astype(int).tolist()
    v = np.linspace(0, height, rows + 1).astype(int).tolist()
    less, more = (OVERLAP_PX, 0) if before else (0, OVERLAP_PX)
    return tuple(
        (
            max(left - less, 0),
            max(top - less, 0),
            min(right + more, width),
            min(bottom + more, height),
        )
        for top, bottom in pairwise(v)
        for left, right in pairwise(u)
    )

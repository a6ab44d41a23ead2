"""Things that move before a still camera.

A position is the centre of the area that a thing covers in the image, without its shadow; or, for cameras that look
along the ground, its foot: the middle of the lower side of the box around it. Things that stop stay in view. Two that
touch are one. What the border of the image cuts is left out, as its centre is not seen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

import cv2
import numpy as np

from airground.errors import InputError
from airground.vision.detectors.background import SAMPLES, Background
from airground.vision.detectors.regions import Region, components, region_of
from airground.vision.detectors.shadows import is_ghost, without_shadow
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    from airground.vision.frame import Frame, ImageArray

__all__ = ["MovingDetector"]

Place = Literal["centroid", "foot"]

MOST_CHANGED = 0.35  # of the image: the light changed, or the camera moved
HUSH_FRAMES = 3  # after that, before a new background is begun
MARGIN_PX = 4
SHADOW_PX = 0.3  # where a thing ends and its shadow begins is not sharp
FLOOR_SHARE = 0.002  # of a thing's size: how well its outline is that of the thing


class MovingDetector:
    """Finds what differs from the background.

    During the warm-up nothing is given. A sudden change of light, or of the camera's place, begins a new warm-up.

    Parameters
    ----------
    least_size_px : float
        Smallest diameter [px].
    most_size_px : float
        Largest diameter [px].
    warm_up_frames : int
        Frames from which the background is first learned; 9 or more. What stays in place for half of them is taken for
        background.
    at : str
        Where a thing is: its ``centroid`` or its ``foot``.
    """

    def __init__(
        self,
        *,
        least_size_px: float = 6.0,
        most_size_px: float = 400.0,
        warm_up_frames: int = 27,
        at: Place = "centroid",
    ) -> None:
        if not 2 <= least_size_px <= most_size_px:
            raise InputError(
                f"sizes must be 2 or more and in order, not {least_size_px} and {most_size_px}"
            )
        if warm_up_frames < SAMPLES:
            raise InputError(f"warm_up_frames must be {SAMPLES} or more, not {warm_up_frames}")
        if at not in get_args(Place):
            raise InputError(f"at must be one of {', '.join(get_args(Place))}, not {at!r}")
        # A mask loses some of a small thing's rim.
        self._least_px2 = 0.5 * np.pi / 4 * least_size_px**2
        self._most_px2 = np.pi / 4 * most_size_px**2
        self._warm_up_frames = warm_up_frames
        self._at = at
        self._background: Background | None = None
        self._hush = 0
        self._frames = 0
        self._images: list[ImageArray] = []
        self._shown: list[NDArray[np.uint8]] = []

    def learn(self, frames: Iterable[Frame]) -> None:
        """Learn the background before the first frame, as a file allows.

        Parameters
        ----------
        frames : iterable of Frame
            Nine or more, best spread over the whole file; fewer teach nothing.
        """
        images = [_smooth(frame.image) for frame in frames]
        if len(images) < SAMPLES:
            return
        pick = np.linspace(0, len(images) - 1, SAMPLES).astype(int)
        valid = np.full(images[0].shape[:2], 255, dtype=np.uint8)
        self._background = Background([images[i] for i in pick], valid)

    def detect(self, frame: Frame, valid: ArrayLike | None = None) -> Sightings:
        """Find what moved into the picture.

        Parameters
        ----------
        frame : Frame
            The next frame.
        valid : (H, W) array_like of bool, optional
            Where the image shows something; the rest is ignored, as the empty border of a stabilised image.

        Returns
        -------
        sightings : Sightings
            From the top down, without labels and headings; none during the warm-up.
        """
        image = _smooth(frame.image)
        shown = _shown(valid, image.shape[:2])
        if self._background is None:
            self._warm_up(image, shown)
            return Sightings.none(frame.t)
        background = self._background
        if background.image.shape != image.shape:
            raise InputError(
                f"frame {frame.index} has shape {image.shape}, expected {background.image.shape} as before"
            )
        shown_known = np.asarray(cv2.bitwise_and(shown, background.known), dtype=np.uint8)
        levelled = self._levelled(image, shown_known)
        difference = background.difference(levelled)
        mask = np.asarray(cv2.compare(difference, background.step, cv2.CMP_GT), dtype=np.uint8)
        mask = np.asarray(cv2.bitwise_and(mask, shown_known), dtype=np.uint8)
        if cv2.countNonZero(mask) > MOST_CHANGED * max(cv2.countNonZero(shown_known), 1):
            self._hush += 1
            if self._hush >= HUSH_FRAMES:
                self._background = None
                self._forget()
            return Sightings.none(frame.t)
        self._hush = 0
        mask = _cleaned(mask)
        found = self._regions(levelled, difference, mask, shown)
        covered = cv2.dilate(mask, np.ones((5, 5), dtype=np.uint8))
        background.follow(levelled, np.asarray(covered, dtype=np.uint8), shown)
        if not found:
            return Sightings.none(frame.t)
        return Sightings(
            frame.t,
            np.array([region.uv for region in found]),
            np.array([region.covariance for region in found]),
            outline=np.array([region.outline for region in found]),
        )

    def _forget(self) -> None:
        self._images, self._shown = [], []
        self._frames = self._hush = 0

    def _warm_up(self, image: ImageArray, shown: NDArray[np.uint8]) -> None:
        """Keep nine frames spread over the warm-up; then make the background of them."""
        due = len(self._images) * (self._warm_up_frames - 1) / (SAMPLES - 1)
        if self._images and self._images[0].shape != image.shape:
            self._forget()
        if self._frames >= np.floor(due):
            self._images.append(image)
            self._shown.append(shown)
        self._frames += 1
        if len(self._images) == SAMPLES:
            known = self._shown[0]
            for other in self._shown[1:]:
                known = np.asarray(cv2.bitwise_and(known, other), dtype=np.uint8)
            self._background = Background(self._images, known)
            self._forget()

    def _levelled(self, image: ImageArray, shown: NDArray[np.uint8]) -> ImageArray:
        """The image as bright as the background: cameras change their exposure."""
        assert self._background is not None
        pick = shown[4::8, 4::8] > 0
        now = image[4::8, 4::8][pick].astype(np.float64).reshape(-1)
        before = self._background.image[4::8, 4::8][pick].astype(np.float64).reshape(-1)
        fair = (now > 20) & (now < 245) & (before > 20) & (before < 245)
        if fair.sum() < 100:
            return image
        gain = float(np.median(before[fair] / now[fair]))
        if abs(gain - 1.0) < 0.004 or not 0.5 < gain < 2.0:
            return image
        return np.asarray(cv2.convertScaleAbs(image, alpha=gain), dtype=np.uint8)

    def _regions(
        self,
        image: ImageArray,
        difference: ImageArray,
        mask: NDArray[np.uint8],
        shown: NDArray[np.uint8],
    ) -> list[Region]:
        assert self._background is not None
        background = self._background
        height, width = mask.shape
        found = []
        for rows, columns, patch in components(mask, self._least_px2, self._most_px2):
            top, left = max(rows.start - MARGIN_PX, 0), max(columns.start - MARGIN_PX, 0)
            bottom, right = min(rows.stop + MARGIN_PX, height), min(columns.stop + MARGIN_PX, width)
            box = slice(top, bottom), slice(left, right)
            inside = np.zeros((bottom - top, right - left), dtype=bool)
            inside[
                rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
            ] = patch
            cut = rows.start <= 1 or columns.start <= 1
            cut = cut or rows.stop >= height - 1 or columns.stop >= width - 1
            near = cv2.dilate(inside.astype(np.uint8), np.ones((5, 5), dtype=np.uint8)) > 0
            if cut or not shown[box][near].all():
                continue
            if is_ghost(image[box], background.image[box], inside):
                background.replace(image, _where(mask.shape, box, near))
                continue
            thing = without_shadow(image[box], background.image[box], inside)
            if thing.sum() < self._least_px2:
                continue
            region = _measure(thing, inside, difference[box], background.step[box], (left, top))
            if region is not None:
                found.append(self._placed(region, thing, left, top))
        return found

    def _placed(self, region: Region, thing: NDArray[np.bool_], left: int, top: int) -> Region:
        if self._at == "centroid":
            return region
        rows, columns = np.nonzero(thing)
        foot = np.array([left + (columns.min() + columns.max()) / 2.0, top + rows.max() + 0.5])
        # The sides of a box are single pixels, not means over many.
        covariance = region.covariance + np.diag([0.25, 0.5])
        return Region(
            foot, covariance, np.nan, np.nan, region.half_axes_px, region.outline, region.area_px2
        )


def _measure(
    thing: NDArray[np.bool_],
    patch: NDArray[np.bool_],
    difference: ImageArray,
    step: NDArray[np.uint8],
    corner: tuple[int, int],
) -> Region | None:
    """Position with soft borders: half-way between what the thing differs by inside and nothing."""
    kernel = np.ones((3, 3), dtype=np.uint8)
    inside = thing.astype(np.uint8)
    core = cv2.erode(inside, kernel) > 0
    near = cv2.dilate(inside, kernel) > 0
    values = difference[core if core.any() else thing]
    typical = float(np.median(values))
    noise = float(np.median(step)) / 5.0
    share = np.clip((difference.astype(np.float64) - noise) / max(typical - noise, 1.0), 0.0, 1.0)
    share[core] = 1.0
    share[~near] = 0.0
    share[patch & ~thing] = 0.0  # its shadow
    # A thing of many greys has parts that hardly differ from the ground: its border is less sure.
    low, high = np.percentile(values[:: 1 + len(values) // 500], [20, 80])
    uneven = float(high - low) / max(typical, 1.0)
    edge = 0.15 + 0.5 * min(noise / max(typical, 1.0), 1.0) + 0.3 * min(uneven, 1.0)
    region = region_of(share, *corner, 0.0, edge)
    if region is None:
        return None
    floor = (FLOOR_SHARE * 2.0 * region.half_axes_px[0]) ** 2
    if patch.sum() > thing.sum():
        floor += SHADOW_PX**2
    return Region(
        region.uv,
        region.covariance + floor * np.eye(2),
        np.nan,
        np.nan,
        region.half_axes_px,
        region.outline,
        region.area_px2,
    )


def _smooth(image: ImageArray) -> ImageArray:
    return np.asarray(cv2.GaussianBlur(image, (3, 3), 0), dtype=np.uint8)


def _cleaned(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Without single pixels; gaps within a thing closed."""
    small = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    large = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (7, 7))
    mask = np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, small), dtype=np.uint8)
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, large), dtype=np.uint8)


def _shown(valid: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    if valid is None:
        return np.full(shape, 255, dtype=np.uint8)
    array = np.asarray(valid)
    if array.shape != shape:
        raise InputError(f"valid must have the frame's shape {shape}, not {array.shape}")
    shown = np.where(array != 0, 255, 0).astype(np.uint8)
    # Smoothing mixes the border in.
    return np.asarray(
        cv2.erode(shown, np.ones((3, 3), dtype=np.uint8), borderValue=255), dtype=np.uint8
    )


def _where(
    shape: tuple[int, ...], box: tuple[slice, slice], part: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    where = np.zeros(shape, dtype=np.uint8)
    where[box][part] = 255
    return where

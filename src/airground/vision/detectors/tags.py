"""AprilTag and ArUco tags: who, where to a few hundredths of a pixel, and which way up.

A tag's position is the image of its centre: where its diagonals meet, not the mean of its corners. Its heading is the
direction in the image from there to the middle of its top edge, as `TagFamily.pattern` (and OpenCV) prints it; the
AprilTag library's own frame is turned by half a turn against that.

Tags seen in the frame before are not searched for: their patterns are fitted where they ought to be by now, which also
tells whether they are there. Those that are not are looked for nearby, then everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.vision.detectors.images import grey_of
from airground.vision.detectors.tag_families import APRILTAG, ARUCO, families_named
from airground.vision.detectors.tag_fit import TagFit, fit_tags
from airground.vision.detectors.tag_model import CORNERS
from airground.vision.detectors.tag_search import Candidate, TagSearch
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from airground.vision.detectors.tag_families import TagFamily
    from airground.vision.frame import Frame, ImageArray

__all__ = ["TagDetector", "detect_family"]

FLOOR_PX = 0.005  # a printed tag is no plane, a lens no homography
ALIASING_PX = 0.015  # what an image that is sharper than its pixels adds to that
SHARP_PX, SOFT_PX = 0.3, 0.5  # blurs between which it does; a pixel alone blurs by 0.29
LEAST_CONTRAST = 8.0  # grey levels
SURE = 0.97  # correlation of a tag under ordinary noise


@dataclass(frozen=True, slots=True, eq=False)
class _Tag:
    """A tag in the newest frame."""

    family: TagFamily
    """Whose it is."""

    number: int
    """Which."""

    fit: TagFit
    """Where."""

    corners: FloatArray
    """(4, 2) [px]."""

    velocity: FloatArray
    """(4, 2) [px/s]. Of the corners."""


class TagDetector:
    """Finds tags of one family or several.

    A label is the tag's number, such as "7"; with several families it begins with the family's name: "4x4:7". Where two
    tags of one number are in view, both are given.

    Parameters
    ----------
    families : sequence of str
        Names as in `APRILTAG` and `ARUCO`.
    least_side_px : float
        Smaller tags are not looked for [px].
    least_correlation : float
        Between the image and the printed pattern; what is below is not a tag.
    rescan_frames : int
        Within how many frames the whole frame is searched once for new tags while others are in view, a part in each,
        so that no frame takes much longer than the others; 1 is all of it in every frame.
    """

    def __init__(
        self,
        families: Sequence[str] = ("36h11",),
        *,
        least_side_px: float = 8.0,
        least_correlation: float = 0.8,
        rescan_frames: int = 15,
    ) -> None:
        if rescan_frames < 1:
            raise InputError(f"rescan_frames must be 1 or more, not {rescan_frames}")
        if not 0 < least_correlation < 1:
            raise InputError(f"least_correlation must lie between 0 and 1, not {least_correlation}")
        if not least_side_px > 0:
            raise InputError(f"least_side_px must be positive, not {least_side_px}")
        self.families = families_named(families)
        self._search = TagSearch(self.families, least_side_px)
        self._least_side_px = least_side_px
        self._least_correlation = least_correlation
        self._rescan = rescan_frames
        self._known: list[_Tag] = []
        self._t = -np.inf
        self._segment = 0
        self._since_scan = 0
        self._wait = rescan_frames
        self._part = 0

    def detect(self, frame: Frame) -> Sightings:
        """Find the tags in a frame.

        Parameters
        ----------
        frame : Frame
            The next frame.

        Returns
        -------
        sightings : Sightings
            With labels, headings and outlines, ordered by family and number.
        """
        if frame.segment != self._segment or not frame.t > self._t:
            self._known = []
        grey = grey_of(frame)
        dt = frame.t - self._t if self._known else 0.0
        tags = self._follow(grey, dt)
        self._since_scan += 1
        if len(tags) < len(self._known):
            self._wait = 1  # something was lost: search now, then ever less often
        new = [
            found for found in self._look(grey, not tags) if not any(_same(found, t) for t in tags)
        ]
        if new:
            tags = _distinct(tags + self._accept(grey, new, dt), self._least_side_px)
        tags.sort(key=lambda tag: (self.families.index(tag.family), tag.number, *tag.corners[0]))
        self._known, self._t, self._segment = tags, frame.t, frame.segment
        return self._sightings(frame.t, tags)

    def _look(self, grey: ImageArray, blind: bool) -> list[Candidate]:
        """Candidates from the whole frame where nothing is known or something was lost, else from a part of it."""
        count = self._search.parts(grey.shape, self._rescan)
        if blind or (self._since_scan >= self._wait and (count == 1 or self._wait < self._rescan)):
            self._since_scan = 0
            self._wait = min(2 * self._wait, self._rescan)
            return self._search.find(grey)
        if count == 1 or self._wait < self._rescan:
            return []
        self._part = (self._part + 1) % (2 * count)
        return self._search.find_part(grey, self._part, self._rescan)

    def _follow(self, grey: ImageArray, dt: float) -> list[_Tag]:
        """Known tags where they ought to be, or else nearby."""
        expected = [
            Candidate(tag.family, tag.number, tag.corners + dt * tag.velocity)
            for tag in self._known
        ]
        fits = self._fit(grey, expected, [tag.fit.blur_px for tag in self._known])
        tags: list[_Tag] = []
        for old, candidate, fit in zip(self._known, expected, fits, strict=True):
            if fit is not None and _near(fit, candidate.corners, old.family.cells):
                tags.append(_tag(candidate, fit, [old], dt))
                continue
            nearby = [
                found
                for found in self._search.find(grey, _window(candidate.corners, grey.shape))
                if (found.family, found.number) == (old.family, old.number)
            ]
            tags += self._accept(grey, nearby, dt)
        return _distinct(tags, self._least_side_px)

    def _accept(self, grey: ImageArray, candidates: list[Candidate], dt: float) -> list[_Tag]:
        fits = self._fit(grey, candidates, [])
        return [
            _tag(candidate, fit, self._known, dt)
            for candidate, fit in zip(candidates, fits, strict=True)
            if fit is not None
            and fit.code_correlation >= self._least_correlation  # a border alone is no tag
            and _near(fit, candidate.corners, candidate.family.cells, cells=2.0)
        ]

    def _fit(
        self,
        grey: ImageArray,
        candidates: list[Candidate],
        blurs: Sequence[tuple[float, float]],
    ) -> list[TagFit | None]:
        fits: list[TagFit | None] = [None] * len(candidates)
        for cells in sorted({candidate.family.cells for candidate in candidates}):
            rows = [i for i, found in enumerate(candidates) if found.family.cells == cells]
            found = fit_tags(
                grey,
                [candidates[i].corners for i in rows],
                [candidates[i].family.pattern(candidates[i].number) for i in rows],
                [blurs[i] for i in rows] if blurs else (),
            )
            for i, fit in zip(rows, found, strict=True):
                if (
                    fit is not None
                    and fit.correlation >= self._least_correlation
                    and fit.contrast >= LEAST_CONTRAST
                ):
                    fits[i] = fit
        return fits

    def _sightings(self, t: float, tags: list[_Tag]) -> Sightings:
        if not tags:
            return Sightings.none(t)
        several = len(self.families) > 1
        places = [_place(tag.fit) for tag in tags]
        return Sightings(
            t,
            np.array([uv for uv, _, _, _ in places]),
            np.array([covariance for _, covariance, _, _ in places]),
            tuple(
                f"{tag.family.name}:{tag.number}" if several else str(tag.number) for tag in tags
            ),
            np.array([angle for _, _, angle, _ in places]),
            np.array([sigma for _, _, _, sigma in places]),
            np.array([min(1.0, tag.fit.correlation / SURE) for tag in tags]),
            np.array([tag.corners for tag in tags]),
        )


def detect_family(frames: Iterable[Frame], names: Sequence[str] = (*APRILTAG, *ARUCO)) -> list[str]:
    """Families whose tags are in some frames.

    Parameters
    ----------
    frames : iterable of Frame
        A few frames; they need not follow each other closely.
    names : sequence of str
        Which families to try.

    Returns
    -------
    names : list of str
        Those found, the one with most sightings first. One that was seen in a single frame counts only where that frame
        was the only one.
    """
    families = families_named(names)
    detector = TagDetector(names, rescan_frames=1)
    seen: dict[str, set[int]] = {}
    total: dict[str, int] = {}
    count = 0
    for count, frame in enumerate(frames, start=1):
        for label in detector.detect(frame).labels:
            name = label.split(":")[0] if len(families) > 1 else families[0].name
            seen.setdefault(name, set()).add(count)
            total[name] = total.get(name, 0) + 1
    enough = [name for name in total if len(seen[name]) >= min(2, count)]
    return sorted(enough, key=lambda name: (-total[name], name))


def _tag(candidate: Candidate, fit: TagFit, known: list[_Tag], dt: float) -> _Tag:
    """With the velocity from the nearest tag of the same number in the frame before."""
    corners, _ = fit.points(CORNERS)
    before = [
        old.corners
        for old in known
        if (old.family, old.number) == (candidate.family, candidate.number)
    ]
    velocity = np.zeros((4, 2))
    if before and dt > 0:
        distances = [float(np.abs(corners - old).sum()) for old in before]
        velocity = (corners - before[int(np.argmin(distances))]) / dt
    return _Tag(candidate.family, candidate.number, fit, corners, velocity)


def _place(fit: TagFit) -> tuple[FloatArray, FloatArray, float, float]:
    """Centre, its covariance, heading and its standard deviation."""
    uv, J = fit.points(np.array([[0.0, 0.0], [0.0, -1.0]]))
    covariance = J[0] @ fit.covariance @ J[0].T
    sharp = float(np.clip((SOFT_PX - min(fit.blur_px)) / (SOFT_PX - SHARP_PX), 0.0, 1.0))
    floor = FLOOR_PX**2 + (sharp * ALIASING_PX) ** 2
    covariance = 0.5 * (covariance + covariance.T) + floor * np.eye(2)
    arm = uv[1] - uv[0]
    length = float(np.hypot(*arm))
    across = np.array([-arm[1], arm[0]]) / length**2 @ (J[1] - J[0])
    variance = float(across @ fit.covariance @ across) + 2.0 * floor / length**2
    return uv[0], covariance, float(np.arctan2(arm[1], arm[0])), float(np.sqrt(variance))


def _near(fit: TagFit, corners: FloatArray, size: int, *, cells: float = 1.0) -> bool:
    """Whether a fit stayed where it began: one that slipped by a cell or more is no sighting."""
    moved = fit.points(CORNERS)[0] - corners
    side = float(np.hypot(*(corners - np.roll(corners, 1, axis=0)).T).mean())
    reach = max(cells * side / size, 3.0)
    return bool((np.hypot(*moved.T) < reach).all())


def _same(candidate: Candidate, tag: _Tag) -> bool:
    """Whether a candidate is a tag that was just followed."""
    apart = float(np.hypot(*(candidate.corners - tag.corners).T).max())
    side = float(np.hypot(*(tag.corners[1] - tag.corners[0])))
    same = (candidate.family, candidate.number) == (tag.family, tag.number)
    return same and apart < max(3.0, side / tag.family.cells)


def _window(corners: FloatArray, shape: tuple[int, ...]) -> tuple[int, int, int, int]:
    low, high = corners.min(axis=0), corners.max(axis=0)
    pad = float((high - low).max()) + 12.0
    left, top = np.clip(low - pad, 0, [shape[1], shape[0]]).astype(int)
    right, bottom = np.clip(high + pad, 0, [shape[1], shape[0]]).astype(int)
    return int(left), int(top), int(right), int(bottom)


def _distinct(tags: list[_Tag], least_side_px: float) -> list[_Tag]:
    """One tag at one place: the one that fits best; the first of equals."""
    kept: list[_Tag] = []
    for tag in sorted(tags, key=lambda tag: -tag.fit.correlation):
        centre = tag.corners.mean(axis=0)
        side = float(np.hypot(*(tag.corners - np.roll(tag.corners, 1, axis=0)).T).min())
        reach = 0.5 * max(side, least_side_px)
        if all(np.hypot(*(centre - other.corners.mean(axis=0))) > reach for other in kept):
            kept.append(tag)
    return kept

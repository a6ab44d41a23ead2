"""AprilTag and ArUco tags: who, where to a few hundredths of a pixel, and which way up.

A tag's position is the image of its centre: where its diagonals meet, not the mean of its corners. Its heading is the
direction in the image from there to the middle of its top edge, as `TagFamily.pattern` (and OpenCV) prints it; the
AprilTag library's own frame is turned by half a turn against that.

Tags seen in the frame before are not searched for: their patterns are fitted where they ought to be by now, which also
tells whether they are there. Those that are not are looked for nearby, for a second. For new ones the image is searched
part by part, all of it within half a second, so that no frame takes much longer than the others; only where no tag is
known the whole image is searched at once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, homogeneous
from airground.vision.detectors.tag_families import APRILTAG, ARUCO, families_named
from airground.vision.detectors.tag_model import CORNERS, homographies
from airground.vision.detectors.tag_parts import parts_of
from airground.vision.detectors.tag_places import PlacedTag, distinct, place_tags
from airground.vision.detectors.tag_search import Candidate, TagSearch
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from airground.vision.frame import Frame, ImageArray

__all__ = ["TagDetector", "detect_family"]

SURE = 0.97  # correlation of a tag under ordinary noise
RESCAN_S = 0.5  # in which the whole image is searched for new tags
PARTS = 10  # of an image: one in each frame at 20 Hz
ROUGH_PX = 8.0  # OpenCV's corners of large tags are better than that; a box may be taken for a tag beside it
LOST_S = 1.0  # a tag that is not there any more is looked for nearby as long
MOST_WINDOW_PX = 320  # side of what is searched for it


@dataclass(frozen=True, slots=True, eq=False)
class _Lost:
    """A tag that was there a while ago."""

    tag: PlacedTag
    """As it was."""

    t: float
    """When it was seen last [s]."""


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
    rescan_frames : int, optional
        Within how many frames the whole image is searched once for new tags while others are in view, a part in each;
        1 is all of it in every frame. If not given, as many frames as come within half a second.
    """

    def __init__(
        self,
        families: Sequence[str] = ("36h11",),
        *,
        least_side_px: float = 8.0,
        least_correlation: float = 0.8,
        rescan_frames: int | None = None,
    ) -> None:
        if rescan_frames is not None and rescan_frames < 1:
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
        self._known: list[PlacedTag] = []
        self._lost: list[_Lost] = []
        self._t = -np.inf
        self._segment = 0
        self._due = 0.0
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
            self._known, self._lost = [], []
        image = frame.image
        dt = frame.t - self._t if self._known else 0.0
        tags = self._follow(image, dt)
        if self._known and not tags:
            self._lost = []  # all of them: the camera moved, or is covered
        candidates = self._look(image, tags, dt) if tags else self._search.find(image)
        candidates += self._look_nearby(image, frame.t)
        new = [found for found in candidates if not any(_same(found, tag) for tag in tags)]
        if new:
            tags = distinct(tags + self._accept(image, new), self._least_side_px)
        tags.sort(key=lambda tag: (self.families.index(tag.family), tag.number, *tag.corners[0]))
        self._remember(tags, frame.t)
        tags = _moving(tags, self._known, dt)
        self._known, self._t, self._segment = tags, frame.t, frame.segment
        return self._sightings(frame.t, tags)

    def _look(self, image: ImageArray, tags: list[PlacedTag], dt: float) -> list[Candidate]:
        """Candidates from the parts of the image whose turn it is."""
        sets = parts_of(image.shape, PARTS if self._rescan is None else self._rescan)
        count = max(len(sets), 1)
        self._due += count * (dt / RESCAN_S if self._rescan is None else 1.0 / self._rescan)
        self._due = min(self._due, float(count))
        found: list[Candidate] = []
        known = [tag.corners for tag in tags]
        while self._due > 0.9:  # the times of frames are not quite even
            self._due -= 1.0
            if not sets:
                found += self._search.find(image)
                continue
            turn, which = divmod(self._part, count)
            self._part += 1
            sets = parts_of(image.shape, count, before=bool(turn % 2))
            for part in sets[which]:
                found += self._search.find_part(image, part, known=known, turn=turn)
        return found

    def _follow(self, image: ImageArray, dt: float) -> list[PlacedTag]:
        """Known tags where they ought to be, or else nearby."""
        if not self._known:
            return []
        ahead = np.array([tag.ahead(dt) for tag in self._known])
        placed = place_tags(
            image,
            [(tag.family, tag.number) for tag in self._known],
            ahead,
            [tag.blur_px for tag in self._known],
            least_correlation=self._least_correlation,
        )
        tags: list[PlacedTag] = []
        for old, tag, H in zip(self._known, placed, ahead, strict=True):
            if tag is not None and tag.stayed(1.0):
                tags.append(tag)
                continue
            q = homogeneous(CORNERS) @ H.T
            nearby = [
                found
                for found in self._search.find(image, _window(q[:, :2] / q[:, 2:], image.shape))
                if (found.family, found.number) == (old.family, old.number)
            ]
            tags += self._accept(image, nearby)
        return distinct(tags, self._least_side_px)

    def _accept(self, image: ImageArray, candidates: list[Candidate]) -> list[PlacedTag]:
        if not candidates:
            return []
        placed = place_tags(
            image,
            [(found.family, found.number) for found in candidates],
            homographies(np.array([found.corners for found in candidates])),
            least_correlation=self._least_correlation,
        )
        return [
            tag
            for tag in placed
            if tag is not None
            and tag.code_correlation >= self._least_correlation  # a border alone is no tag
            and tag.stayed(2.0, ROUGH_PX)
        ]

    def _look_nearby(self, image: ImageArray, t: float) -> list[Candidate]:
        """Candidates from where one of the tags that were lost should be, in turn."""
        if not self._lost:
            return []
        lost = self._lost.pop(0)
        self._lost.append(lost)
        ago = t - lost.t
        uv = lost.tag.ahead(ago)[:2, 2]
        reach = float(np.abs(uv - lost.tag.uv).max()) if ago < LOST_S else 0.0
        window = _window(lost.tag.corners, image.shape, reach)
        return self._search.find(image, window)

    def _remember(self, tags: list[PlacedTag], t: float) -> None:
        """Keep in mind which tags are not there any more."""
        if not self._lost and len(tags) >= len(self._known):
            return
        here = {(tag.family, tag.number) for tag in tags}
        fresh = [_Lost(tag, self._t) for tag in self._known]
        self._lost = [
            lost
            for lost in (*self._lost, *fresh)
            if (lost.tag.family, lost.tag.number) not in here and t - lost.t <= LOST_S
        ]

    def _sightings(self, t: float, tags: list[PlacedTag]) -> Sightings:
        if not tags:
            return Sightings.none(t)
        several = len(self.families) > 1
        return Sightings(
            t,
            np.array([tag.uv for tag in tags]),
            np.array([tag.covariance for tag in tags]),
            tuple(
                f"{tag.family.name}:{tag.number}" if several else str(tag.number) for tag in tags
            ),
            np.array([tag.angle for tag in tags]),
            np.array([tag.angle_sigma for tag in tags]),
            np.array([min(1.0, tag.correlation / SURE) for tag in tags]),
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


def _moving(tags: list[PlacedTag], known: list[PlacedTag], dt: float) -> list[PlacedTag]:
    """With their motion since the frame before, each from the nearest tag of the same number."""
    if dt <= 0 or not tags:
        return tags
    pairs = []
    for tag in tags:
        same = [old for old in known if (old.family, old.number) == (tag.family, tag.number)]
        if len(same) > 1:
            same.sort(key=lambda old: float(np.abs(tag.corners - old.corners).sum()))
        pairs.append((same or [tag])[0].image_from_tag)
    step = np.linalg.inv(np.array(pairs)) @ np.array([tag.image_from_tag for tag in tags])
    drift = (step / step[:, 2:, 2:] - np.eye(3)) / dt
    return [replace(tag, drift=each) for tag, each in zip(tags, drift, strict=True)]


def _same(candidate: Candidate, tag: PlacedTag) -> bool:
    """Whether a candidate is a tag that was just followed."""
    apart = float(np.hypot(*(candidate.corners - tag.corners).T).max())
    side = float(np.hypot(*(tag.corners[1] - tag.corners[0])))
    same = (candidate.family, candidate.number) == (tag.family, tag.number)
    return same and apart < max(3.0, side / tag.family.cells)


def _window(
    corners: FloatArray, shape: tuple[int, ...], reach: float = 0.0
) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of where a tag may be."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float((high - low).max())
    pad = size + 12.0
    pad += min(reach, max(0.0, (MOST_WINDOW_PX - size) / 2 - pad))
    left, top = np.clip(low - pad, 0, [shape[1], shape[0]]).astype(int)
    right, bottom = np.clip(high + pad, 0, [shape[1], shape[0]]).astype(int)
    return int(left), int(top), int(right), int(bottom)

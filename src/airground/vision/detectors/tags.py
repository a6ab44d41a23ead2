"""AprilTag and ArUco tags: who, where to a few hundredths of a pixel, and which way up.

A tag's position is the image of its centre: where its diagonals meet, not the mean of its corners. Its heading is the
direction in the image from there to the middle of its top edge, as `TagFamily.pattern` (and OpenCV) prints it; the
AprilTag library's own frame is turned by half a turn against that.

Tags seen in the frame before are not searched for: their patterns are fitted where they ought to be by now, which also
tells whether they are there. Those that are not are looked for nearby, for a second. For new ones the image is searched
part by part, all of it within half a second, so that no frame takes much longer than the others; only where no tag is
known the whole image is searched at once. Who is in a hurry lets the detector answer before that search, and gives it
the time for it afterwards (`follow`, `look_around`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import homogeneous
from airground.vision.detectors.tag_families import APRILTAG, ARUCO, families_named
from airground.vision.detectors.tag_fit import ITERATIONS
from airground.vision.detectors.tag_memory import (
    LostTag,
    PendingFrame,
    all_ahead,
    is_same,
    pixels_in,
    window_around,
    with_motion,
)
from airground.vision.detectors.tag_model import CORNERS, homographies
from airground.vision.detectors.tag_parts import parts_of
from airground.vision.detectors.tag_places import PlacedTag, distinct, place_tags
from airground.vision.detectors.tag_search import Candidate, TagSearch
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from airground.vision.detectors.tag_memory import Window
    from airground.vision.frame import Frame, ImageArray


__all__ = ["TagDetector", "detect_family"]

SURE = 0.97  # correlation of a tag under ordinary noise
RESCAN_S = 0.5  # in which the whole image is searched for new tags
PARTS = 10  # of an image: one in each frame at 20 Hz
ROUGH_PX = 8.0  # OpenCV's corners of large tags are better than that; a box may be taken for a tag beside it
LOST_S = 1.0  # a tag that is not there any more is looked for nearby as long
HASTY_STEPS = (
    4  # of a fit before the answer: one is usual, and who is half covered never gets there
)
HASTY_PIXELS = (
    160**2
)  # what may be searched for a known tag before the answer; that takes a millisecond


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
        self._lost: list[LostTag] = []
        self._t = -np.inf
        self._segment = 0
        self._due = 0.0
        self._part = 0
        self._pending: PendingFrame | None = None

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
        dt = self._begin(frame)
        tags, missed = self._follow(frame.image, dt)
        for window, old in missed:
            tags += self._accept(frame.image, _alike(self._search.find(frame.image, window), old))
        return self._complete(frame, distinct(tags, self._least_side_px), dt)

    def follow(self, frame: Frame) -> Sightings:
        """Find in a frame the tags that were there in the one before; where there are none, find all.

        Parameters
        ----------
        frame : Frame
            The next frame; its image is kept until `look_around`.

        Returns
        -------
        sightings : Sightings
            As of `detect`.
        """
        dt = self._begin(frame)
        tags, missed = self._follow(frame.image, dt, HASTY_STEPS)
        if missed and pixels_in(missed[0][0]) <= HASTY_PIXELS:
            window, old = missed[0]
            again = _alike(self._search.glance(frame.image, window), old)
            tags += self._accept(frame.image, again, HASTY_STEPS)
            missed = missed[1:] if again else missed
        tags = distinct(tags, self._least_side_px)
        if not tags:
            return self._complete(frame, tags, dt)
        self._pending = PendingFrame(frame, dt, tuple(window for window, _ in missed))
        return self._keep(frame, tags, dt)

    def look_around(self) -> None:
        """Search the frame of the last `follow` for other tags; the next one finds these as well."""
        pending, self._pending = self._pending, None
        if pending is None:
            return
        image, t = pending.frame.image, pending.frame.t
        candidates = self._look(image, self._known, pending.dt)
        for window in pending.missed:
            candidates += self._search.find(image, window)
        if not pending.missed:
            candidates += self._look_nearby(image, t)
        self._known = self._with_new(image, self._known, candidates)
        self._remember(self._known, t)

    def _begin(self, frame: Frame) -> float:
        """Time since the frame before that tags are known of [s]."""
        if frame.segment != self._segment or not frame.t > self._t:
            self._known, self._lost = [], []
        self._pending = None
        return frame.t - self._t if self._known else 0.0

    def _complete(self, frame: Frame, tags: list[PlacedTag], dt: float) -> Sightings:
        """Search for other tags than those that were followed."""
        image = frame.image
        if self._known and not tags:
            self._lost = []  # all of them: the camera moved, or is covered
        candidates = self._look(image, tags, dt) if tags else self._search.find(image)
        candidates += self._look_nearby(image, frame.t)
        return self._keep(frame, self._with_new(image, tags, candidates), dt)

    def _with_new(
        self, image: ImageArray, tags: list[PlacedTag], candidates: list[Candidate]
    ) -> list[PlacedTag]:
        """Tags, and those candidates that are others."""
        new = [found for found in candidates if not any(is_same(found, tag) for tag in tags)]
        if new:
            tags = distinct(tags + self._accept(image, new), self._least_side_px)
        return tags

    def _keep(self, frame: Frame, tags: list[PlacedTag], dt: float) -> Sightings:
        """Take tags for those of a frame."""
        tags = sorted(
            tags, key=lambda tag: (self.families.index(tag.family), tag.number, *tag.corners[0])
        )
        self._remember(tags, frame.t)
        tags = with_motion(tags, self._known, dt)
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

    def _follow(
        self, image: ImageArray, dt: float, most: int = ITERATIONS
    ) -> tuple[list[PlacedTag], list[tuple[Window, PlacedTag]]]:
        """Known tags where they ought to be; and where to look for the others, and which these are."""
        if not self._known:
            return [], []
        ahead = all_ahead(self._known, dt)
        placed = place_tags(
            image,
            [(tag.family, tag.number) for tag in self._known],
            ahead,
            [tag.blur_px for tag in self._known],
            least_correlation=self._least_correlation,
            most=most,
        )
        tags: list[PlacedTag] = []
        missed: list[tuple[Window, PlacedTag]] = []
        for old, tag, H in zip(self._known, placed, ahead, strict=True):
            if tag is not None and tag.stayed(1.0):
                tags.append(tag)
                continue
            q = homogeneous(CORNERS) @ H.T
            missed.append((window_around(q[:, :2] / q[:, 2:], image.shape), old))
        return tags, missed

    def _accept(
        self, image: ImageArray, candidates: list[Candidate], most: int = ITERATIONS
    ) -> list[PlacedTag]:
        if not candidates:
            return []
        placed = place_tags(
            image,
            [(found.family, found.number) for found in candidates],
            homographies(np.array([found.corners for found in candidates])),
            least_correlation=self._least_correlation,
            most=most,
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
        window = window_around(lost.tag.corners, image.shape, reach)
        return self._search.find(image, window)

    def _remember(self, tags: list[PlacedTag], t: float) -> None:
        """Keep in mind which tags are not there any more."""
        if not self._lost and len(tags) >= len(self._known):
            return
        here = {(tag.family, tag.number) for tag in tags}
        fresh = [LostTag(tag, self._t) for tag in self._known]
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


def _alike(found: list[Candidate], tag: PlacedTag) -> list[Candidate]:
    """Those that may be some tag."""
    return [one for one in found if (one.family, one.number) == (tag.family, tag.number)]

"""Tags where there are tags, otherwise what moves."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from airground.errors import InputError
from airground.vision.detectors.moving import MovingDetector
from airground.vision.detectors.protocol import PromptDetector
from airground.vision.detectors.tag_families import APRILTAG, ARUCO
from airground.vision.detectors.tags import TagDetector, detect_family
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from airground.vision.detectors.protocol import Detector
    from airground.vision.frame import Frame

__all__ = ["AutoDetector"]

PROBE_FRAMES = 30


class AutoDetector:
    """Decides on the first frames what to look for.

    A file can be read twice: `choose` looks at some of its frames, and `detect` then begins at the first one, so that
    nothing is lost. A live camera cannot: tags are given from the first frame in which some are seen, as this is when
    their family is known; without tags nothing is given before the choice falls on moving things.

    Parameters
    ----------
    families : sequence of str
        Tag families to try.
    probe_frames : int
        How many frames to look for tags before the choice falls on moving things.
    otherwise_moving : bool
        Whether it does; otherwise the search for tags goes on.
    """

    def __init__(
        self,
        families: Sequence[str] = (*APRILTAG, *ARUCO),
        *,
        probe_frames: int = PROBE_FRAMES,
        otherwise_moving: bool = True,
    ) -> None:
        if probe_frames < 1:
            raise InputError(f"probe_frames must be 1 or more, not {probe_frames}")
        self._families = tuple(families)
        self._probe_frames = probe_frames
        self._otherwise_moving = otherwise_moving
        self._probe = TagDetector(self._families, rescan_frames=1)
        self._waiting = MovingDetector() if otherwise_moving else None
        self._seen = 0
        self.chosen: Detector | None = None

    def choose(self, frames: Iterable[Frame]) -> Detector:
        """Decide on frames of a file that will be read again.

        Parameters
        ----------
        frames : iterable of Frame
            From anywhere in it, in order of time; the first `probe_frames` of them are looked at.

        Returns
        -------
        detector : Detector
            The choice, which `detect` uses from now on. It has no memory of these frames but the background.
        """
        looked = list(islice(frames, self._probe_frames))
        names = detect_family(looked, self._families)
        if names:
            self.chosen = TagDetector(names)
        elif self._otherwise_moving:
            moving = MovingDetector()
            moving.learn(looked)
            self.chosen = moving
        else:
            self.chosen = TagDetector(self._families)
        return self.chosen

    def detect(self, frame: Frame) -> Sightings:
        """Find what the choice finds.

        Parameters
        ----------
        frame : Frame
            The next frame.

        Returns
        -------
        sightings : Sightings
            None before the choice.
        """
        if self.chosen is not None:
            return self.chosen.detect(frame)
        self._seen += 1
        if len(self._probe.detect(frame)):
            names = detect_family([frame], self._families)
            if names:
                self.chosen = TagDetector(names)
                return self.chosen.detect(frame)
        if self._waiting is not None:
            self._waiting.detect(frame)  # learns the background meanwhile
            if self._seen >= self._probe_frames:
                self.chosen = self._waiting
        return Sightings.none(frame.t)

    def follow(self, frame: Frame) -> Sightings:
        """Find at once what the choice knows from frames before.

        Parameters
        ----------
        frame : Frame
            The next frame.

        Returns
        -------
        sightings : Sightings
            As of `detect`, before the choice and where the choice cannot do otherwise.
        """
        chosen = self.chosen
        return chosen.follow(frame) if isinstance(chosen, PromptDetector) else self.detect(frame)

    def look_around(self) -> None:
        """Let the choice search the last frame for more."""
        if isinstance(self.chosen, PromptDetector):
            self.chosen.look_around()

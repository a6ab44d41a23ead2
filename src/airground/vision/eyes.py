"""One frame after the other: hold the ground still, detect, track. Knows no clock and no file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from airground.vision.detectors.protocol import PromptDetector
from airground.vision.sightings import Sightings
from airground.vision.still_view import StillView

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.vision.detectors.protocol import Detector
    from airground.vision.frame import Frame
    from airground.vision.moving import RaisedStabilizer, Stabilization, Stabilizer
    from airground.vision.tracker import Tracker, TrackerState

__all__ = ["Eyes", "Look", "Looks"]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """All that was made of one frame."""

    frame: Frame
    """What the camera saw."""

    seen: Sightings
    """What the detector saw, in the image; of a detector that works on stabilised images, in the stable frame."""

    stabilization: Stabilization | None
    """How the frame lies to the stable frame; None for a camera that stands."""

    sightings: Sightings
    """The same in the stable frame; none where the frame has no place in it."""

    state: TrackerState
    """What the tracker believes after it."""

    @property
    def image_from_stable(self) -> FloatArray | None:
        """(3, 3). From the stable frame to this image; None for a camera that stands, or is lost."""
        if self.stabilization is None or self.stabilization.stable_from_image is None:
            return None
        return np.asarray(np.linalg.inv(self.stabilization.stable_from_image))

    @property
    def lost(self) -> bool:
        """Whether a moving camera does not know where it looks."""
        return self.stabilization is not None and not self.stabilization.ok


class Looks(Protocol):
    """Whatever looks at one frame after the other: `Eyes`, here or in another process."""

    def look(self, frame: Frame) -> Look:
        """Take in the next frame.

        Parameters
        ----------
        frame : Frame
            Later than the one before.

        Returns
        -------
        look : Look
            What was made of it.
        """
        ...


class Eyes:
    """Detector, tracker and, where the camera moves, stabiliser, as one step for each frame.

    Parameters
    ----------
    detector : Detector
        Finds things in frames.
    tracker : Tracker
        Tells who is who.
    stabilizer : Stabilizer or RaisedStabilizer, optional
        Holds the ground still, or the marks' plane. What the detector saw in the frame before is masked out for it.
    """

    def __init__(
        self,
        detector: Detector,
        tracker: Tracker,
        stabilizer: Stabilizer | RaisedStabilizer | None = None,
    ) -> None:
        self._detector = detector
        self._prompt = detector if isinstance(detector, PromptDetector) else None
        self._tracker = tracker
        self._stabilizer = stabilizer
        self._still = StillView(detector) if stabilizer is not None else None
        self._covered: FloatArray = np.empty((0, 4, 2))
        self._segment: int | None = None

    def look(self, frame: Frame, *, at_once: bool = False) -> Look:
        """Take in the next frame.

        Parameters
        ----------
        frame : Frame
            Later than the one before; after the camera came back, at any time.
        at_once : bool
            Whether to answer before new things were searched for, where the detector can do that. `look_around` must
            follow; what that finds is seen in the next frame.

        Returns
        -------
        look : Look
            What was made of it.

        Raises
        ------
        InputError
            If the frame is not later than the one before, or of another size.
        """
        if self._segment not in (None, frame.segment):
            self._tracker.restart()  # times before and after need not be comparable
        self._segment = frame.segment
        if self._stabilizer is None or self._still is None:
            seen = self._detect(frame, at_once=at_once)
            return Look(frame, seen, None, seen, self._tracker.update(seen))
        stabilization = self._stabilizer.update(frame, self._covered)
        if self._still.needed:
            # Without its place the frame tells such a detector nothing.
            seen = sightings = self._still.detect(frame, stabilization)
            self._covered = self._still.outlines(seen, stabilization)
        else:
            seen = self._detect(frame, at_once=at_once)
            self._covered = seen.outline[np.isfinite(seen.outline).all(axis=(1, 2))]
            sightings = stabilization.refer(seen) if stabilization.ok else Sightings.none(frame.t)
        return Look(frame, seen, stabilization, sightings, self._tracker.update(sightings))

    def look_around(self) -> None:
        """Search the last frame for new things, if that was put off."""
        if self._prompt is not None:
            self._prompt.look_around()

    def _detect(self, frame: Frame, *, at_once: bool) -> Sightings:
        if at_once and self._prompt is not None:
            return self._prompt.follow(frame)
        return self._detector.detect(frame)

"""What every detector is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from airground.vision.frame import Frame
    from airground.vision.sightings import Sightings

__all__ = ["Detector"]


@runtime_checkable
class Detector(Protocol):
    """Finds things in frames. Frames come in order of time; what a detector remembers between them is its own."""

    def detect(self, frame: Frame) -> Sightings:
        """Find what is in a frame.

        Parameters
        ----------
        frame : Frame
            The next frame.

        Returns
        -------
        sightings : Sightings
            At the frame's time, in any order; none where nothing was found.
        """
        ...

"""What every detector is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from airground.vision.frame import Frame
    from airground.vision.sightings import Sightings

__all__ = ["Detector", "PromptDetector"]


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


@runtime_checkable
class PromptDetector(Detector, Protocol):
    """Can answer before it has looked everywhere, for who is in a hurry: `follow`, then `look_around` while idle."""

    def follow(self, frame: Frame) -> Sightings:
        """Find in a frame what is known from those before; where that is nothing, as `detect`.

        Parameters
        ----------
        frame : Frame
            The next frame; its image must stay as it is until `look_around`.

        Returns
        -------
        sightings : Sightings
            As of `detect`.
        """
        ...

    def look_around(self) -> None:
        """Search the frame of the last `follow` for more, which is known from then on."""
        ...

"""What a live session asks of a camera; `vision.sources.LiveSource` is one, the embedded world has another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from airground.vision.frame import Frame
    from airground.vision.sources import SourceHealth

__all__ = ["LiveCamera"]


class LiveCamera(Protocol):
    """Gives the newest frame."""

    @property
    def name(self) -> str:
        """What it reads, without passwords."""
        ...

    @property
    def health(self) -> SourceHealth:
        """What it has met so far."""
        ...

    def read(self, timeout_s: float | None = None) -> Frame | None:
        """Wait for a frame that was not read before.

        Parameters
        ----------
        timeout_s : float, optional [s]
            For how long.

        Returns
        -------
        frame : Frame or None
            The newest; None where none came in time.

        Raises
        ------
        UnreachableError
            If nothing has come for too long; reading again is allowed.
        """
        ...

    def close(self) -> None:
        """Let go of it."""
        ...

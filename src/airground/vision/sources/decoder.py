"""What files and streams are decoded with: one interface over OpenCV and PyAV."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from airground.vision.frame import Clock, ImageArray

__all__ = ["Decoder", "OpeningError", "Picture"]


class Picture(NamedTuple):
    """One decoded picture."""

    image: ImageArray
    """(H, W, 3) blue, green, red."""

    stamp_s: float | None
    """[s]. Its time as the file, stream or driver tells it, from any zero; None where it tells none."""

    number: int
    """Counted from zero; pictures that could not be decoded are counted too."""


class OpeningError(Exception):
    """A file or stream cannot be opened.

    Parameters
    ----------
    reason : str
        Why, in one line.
    final : bool
        Trying again would not help, as with a wrong password.
    """

    def __init__(self, reason: str, *, final: bool = False) -> None:
        super().__init__(reason)
        self.reason = reason
        self.final = final


class Decoder(Protocol):
    """An open file or stream."""

    stamped: Clock
    """Which clock its stamps are of."""

    rate_hz: float | None
    """Frame rate that the file or stream states."""

    frame_count: int | None
    """About how many frames there are."""

    duration_s: float | None
    """[s]. How long it says to be."""

    absolute: bool
    """Stamps are those in the file, not counted from its start."""

    corrupt: int
    """Pictures that could not be decoded so far."""

    def read(self) -> Picture | None:
        """Decode the next picture.

        Returns
        -------
        picture : Picture or None
            None at the end of a file, or where a stream has ended, broken or said nothing for too long.
        """
        ...

    def close(self) -> None:
        """Let go of it; calling it again does nothing."""
        ...

"""What sources that are read at the caller's own pace have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Self

from airground.vision.sources.tally import Tally

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator
    from types import TracebackType

    from airground.vision.frame import Clock, Frame
    from airground.vision.sources.protocol import SourceHealth, SourceState

__all__ = ["PulledSource"]


class PulledSource(ABC):
    """Frames are made when they are asked for; none is dropped.

    Parameters
    ----------
    name : str
        What it reads.
    clock : Clock
        Clock of its frames.
    frame_count : int, optional
        About how many there are.
    """

    def __init__(self, name: str, clock: Clock, frame_count: int | None = None) -> None:
        self.name = name
        self.clock = clock
        self.frame_count = frame_count
        self._tally = Tally()
        self._state: SourceState = "opening"
        self._given = self._give()

    @property
    def health(self) -> SourceHealth:
        """What the source has met so far."""
        return self._tally.health(self._state, corrupt=self._corrupt())

    def close(self) -> None:
        """Let go of the file; calling it again does nothing."""
        self._given.close()
        self._state = "ended"

    @abstractmethod
    def _frames(self) -> Iterator[Frame]:
        """All frames, in order."""

    def _corrupt(self) -> int:
        return 0

    def _give(self) -> Generator[Frame]:
        for frame in self._frames():
            self._state = "live"
            self._tally.add("frames")
            yield frame
        self._state = "ended"

    def __iter__(self) -> Iterator[Frame]:
        return self._given

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

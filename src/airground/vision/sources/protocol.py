"""What every source of frames is, and what it says about its own health."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, Self, runtime_checkable

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType

    from airground.vision.frame import Clock, Frame

__all__ = ["FrameSource", "SourceHealth", "SourceState"]

SourceState = Literal["opening", "live", "lost", "ended"]
"""Where a source stands.

- opening: no frame has come yet;
- live: frames come;
- lost: a camera or stream gives nothing at present; the source tries again;
- ended: the file is at its end, or the source was closed.
"""


@dataclass(frozen=True, slots=True)
class SourceHealth:
    """What a source has met so far. A snapshot: it does not change by itself."""

    state: SourceState = "opening"
    """Where the source stands."""

    frames: int = 0
    """Frames that were handed out."""

    dropped: int = 0
    """Frames of a live source that nobody asked for in time: a newer one took their place."""

    late: int = 0
    """Frames of a live source that came at least a quarter of a second later than usual."""

    corrupt: int = 0
    """Pictures that could not be decoded, or only with damage; they are left out."""

    repeated: int = 0
    """Pictures whose time was missing or did not come after the time before; they are left out."""

    reconnects: int = 0
    """How often a live source came back."""

    frozen_s: float = 0.0
    """[s]. For how long a live source has been sending one and the same picture, to the last bit."""

    notes: tuple[str, ...] = ()
    """What a user should know, one line each."""


@runtime_checkable
class FrameSource(Protocol):
    """Frames in order of time. A context manager that gives its frames once; iterating again goes on."""

    @property
    def name(self) -> str:
        """What it reads, without passwords."""
        ...

    @property
    def clock(self) -> Clock:
        """Clock of its frames."""
        ...

    @property
    def frame_count(self) -> int | None:
        """About how many frames there are; None where nobody knows."""
        ...

    @property
    def health(self) -> SourceHealth:
        """What the source has met so far."""
        ...

    def __iter__(self) -> Iterator[Frame]: ...

    def close(self) -> None:
        """Let go of the file or camera; calling it again does nothing."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

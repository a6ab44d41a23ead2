"""Frames that a program makes: the embedded world, or a camera of one's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from airground.errors import InputError
from airground.vision.frame import Frame
from airground.vision.sources.base import PulledSource

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from airground.vision.frame import Clock, ImageArray

__all__ = ["GeneratedSource"]


class GeneratedSource(PulledSource):
    """Frames from an iterable of times and images, made as they are asked for.

    Parameters
    ----------
    frames : iterable of (float, array)
        Times [s], ascending, and images.
    name : str
        What to call it.
    clock : Clock
        Clock of the times.
    frame_count : int, optional
        How many there will be.
    """

    def __init__(
        self,
        frames: Iterable[tuple[float, ImageArray]],
        name: str = "generated",
        *,
        clock: Clock = "world",
        frame_count: int | None = None,
    ) -> None:
        self._images = frames
        super().__init__(name, clock, frame_count)

    def _frames(self) -> Iterator[Frame]:
        last = None
        for index, (t, image) in enumerate(self._images):
            if last is not None and not t > last:
                raise InputError(f"{self.name}: times must ascend, but {t} s comes after {last} s")
            last = t
            yield Frame(image, t, self.clock, index)

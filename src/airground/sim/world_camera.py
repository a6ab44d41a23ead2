"""The embedded world's camera as a source of frames, like a file or a real camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from airground.errors import InputError
from airground.sim.renderer import Renderer
from airground.vision.frame import Clock, Frame
from airground.vision.sources.protocol import SourceHealth

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType

    from airground.sim.scene import Scene

__all__ = ["WorldCamera"]


class WorldCamera:
    """Gives the frames of a scene, in order of time, once. Meets `airground.vision.sources.protocol.FrameSource`.

    Parameters
    ----------
    scene : Scene
        What it looks at.
    rate_hz : float [Hz]
        Frames per second.
    duration_s : float [s]
        How long; frame k is taken at ``start_s + k / rate_hz``.
    seed : int
        Of the sensor's noise, and of which frames are lost or late.
    start_s : float [s]
        Time of the first frame.
    dropped : float
        Share of the frames that are lost; their numbers are missing.
    late : float
        Share of the frames that come in late; their times are right all the same.
    late_s : float [s]
        How late those are, at most.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        rate_hz: float = 30.0,
        duration_s: float = 60.0,
        seed: int = 0,
        start_s: float = 0.0,
        dropped: float = 0.0,
        late: float = 0.0,
        late_s: float = 0.2,
    ) -> None:
        if not (rate_hz > 0 and duration_s > 0 and np.isfinite(rate_hz * duration_s)):
            raise InputError(
                f"rate_hz and duration_s must be positive, not {rate_hz}, {duration_s}"
            )
        if not (0 <= dropped < 1 and 0 <= late <= 1 and late_s >= 0):
            raise InputError("dropped and late are shares from 0 to 1, late_s is not negative")
        self.scene = scene
        self.rate_hz = rate_hz
        self._renderer = Renderer(scene, seed)
        count = int(np.floor(duration_s * rate_hz + 1e-9)) + 1
        rng = np.random.default_rng([seed, 0xD0])
        self._kept = np.flatnonzero(rng.random(count) >= dropped)
        self._late = np.where(rng.random(count) < late, late_s * rng.random(count), 0.0)
        self._tells_lateness = late > 0
        self._t = start_s + np.arange(count) / rate_hz
        self._next = 0
        self._closed = False

    @property
    def name(self) -> str:
        """What it is."""
        return "embedded world"

    @property
    def clock(self) -> Clock:
        """The world's own."""
        return "world"

    @property
    def frame_count(self) -> int:
        """How many frames it gives in all."""
        return len(self._kept)

    @property
    def times(self) -> tuple[float, ...]:
        """Times of those frames [s]."""
        return tuple(self._t[self._kept].tolist())

    @property
    def health(self) -> SourceHealth:
        """Frames given and lost so far."""
        given = self._kept[: self._next]
        ended = self._closed or self._next == len(self._kept)
        reached = int(given[-1]) + 1 if len(given) else 0
        return SourceHealth(
            state="ended" if ended else "live" if self._next else "opening",
            frames=self._next,
            dropped=reached - len(given),
            late=int((self._late[given] >= 0.25).sum()),
        )

    def __iter__(self) -> Iterator[Frame]:
        while not self._closed and self._next < len(self._kept):
            index = int(self._kept[self._next])
            self._next += 1
            yield self.frame(index)

    def frame(self, index: int) -> Frame:
        """Take one frame, whatever was taken before.

        Parameters
        ----------
        index : int
            Its number; those that are lost can be asked for too.

        Returns
        -------
        frame : Frame
            The same as in the sequence, to the last bit.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        if not 0 <= index < len(self._t):
            raise InputError(f"frames have numbers 0 to {len(self._t) - 1}, not {index}")
        t = float(self._t[index])
        late = float(self._late[index]) if self._tells_lateness else None
        return Frame(self._renderer.image(t, index), t, "world", index, late_s=late)

    def close(self) -> None:
        """End the sequence."""
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

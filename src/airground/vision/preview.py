"""A video of what the tracker believes, at a steady rate whatever that of the camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from airground.vision.video_writer import VideoWriter

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from airground.vision.eyes import Look
    from airground.vision.frame import ImageArray
    from airground.vision.overlay import Overlay

__all__ = ["Preview"]

FIRST = 12  # frames that tell the rate
SLOWEST_HZ, FASTEST_HZ, USUAL_HZ = 1.0, 60.0, 30.0
LONGEST_S = 5.0  # a longer gap between frames is not shown in full length


class Preview:
    """Draws each look and writes it; the video takes as long as what it shows.

    A frame is shown until the next one comes; frames that come faster than the video's rate are left out.

    Parameters
    ----------
    path : Path
        Video to write; the suffix says how.
    overlay : Overlay
        Draws.
    """

    def __init__(self, path: Path, overlay: Overlay) -> None:
        self._path = path
        self._overlay = overlay
        self._first: list[tuple[float, ImageArray]] = []
        self._writer: VideoWriter | None = None
        self._rate = USUAL_HZ
        self._shown = 0
        self._skipped_s = 0.0
        self._start = 0.0
        self._last: tuple[float, ImageArray] | None = None

    def add(self, look: Look) -> None:
        """Draw a frame.

        Parameters
        ----------
        look : Look
            What was made of the next frame.
        """
        status = ""
        if look.stabilization is not None:
            known = look.stabilization
            status = f"held by {known.inliers} points" if known.ok else f"NOT HELD: {known.status}"
        image = self._overlay.draw(
            look.frame,
            () if look.lost else look.state.tracks,
            image_from_stable=look.image_from_stable,
            status=status,
            alarm=look.lost,
            ground=not look.lost,
        )
        if self._writer is None:
            self._first.append((look.frame.t, image))
            if len(self._first) == FIRST:
                self._open()
        else:
            self._show(look.frame.t, image)

    def close(self) -> None:
        """Write what is left. A preview without frames leaves no video."""
        if self._writer is None and self._first:
            self._open()
        if self._writer is not None:
            if self._last is not None:
                self._writer.write(self._last[1])
            self._writer.close()
            self._writer = None
        self._first, self._last = [], None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _open(self) -> None:
        """Set the rate, and write the frames that told it."""
        t = np.array([time for time, _ in self._first])
        if len(t) > 1:
            self._rate = float(np.clip(1 / np.median(np.diff(t)), SLOWEST_HZ, FASTEST_HZ))
        height, width = self._first[0][1].shape[:2]
        self._writer = VideoWriter(self._path, size_px=(width, height), rate_hz=self._rate)
        self._writer.__enter__()
        self._start = float(t[0])
        for time, image in self._first:
            self._show(time, image)
        self._first = []

    def _show(self, t: float, image: ImageArray) -> None:
        """Repeat the frame before until this one's time has come."""
        assert self._writer is not None
        if self._last is not None:
            before, shown = self._last
            self._skipped_s += max(t - before - LONGEST_S, 0.0)
            due = round((t - self._start - self._skipped_s) * self._rate)
            for _ in range(due - self._shown):
                self._writer.write(shown)
            self._shown = max(due, self._shown)
        self._last = (t, image)

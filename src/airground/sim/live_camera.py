"""The embedded world's camera as a live source of frames: drawn by a thread of its own, the newest wins."""

from __future__ import annotations

import atexit
from math import inf
from threading import Condition, Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Self

import numpy as np

from airground.errors import InputError, UnreachableError
from airground.vision.sources.protocol import SourceHealth, SourceState

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType

    from airground.sim.live_clockwork import Clockwork
    from airground.sim.live_pictures import Picture
    from airground.vision.frame import Clock, Frame, ImageArray

__all__ = ["EmbeddedCamera"]

AHEAD_S = (
    0.03  # drawn while a real one would be on its way, and the one before it has been looked at
)
SHUT_S = 0.004  # when a picture's last row has been exposed
LONGEST_WAIT_S = 0.1
CLOSING_S = 1.0  # the floor may be being painted
EXIT_S = 30.0


class EmbeddedCamera:
    """Frames of the embedded world, with the reading interface of `vision.sources.LiveSource`.

    Parameters
    ----------
    clockwork : Clockwork
        The world, and what lets it run.
    patience_s : float [s]
        For how long there may be no frame before reading raises; an attribute too, that may be changed.
    stall_s : float [s]
        For how long there may be no frame before the state is "lost".
    """

    frame_count: int | None = None
    name = "embedded"
    clock: Clock = "world"

    def __init__(
        self,
        clockwork: Clockwork,
        *,
        patience_s: float = 10.0,
        stall_s: float = 1.0,
    ) -> None:
        self.patience_s = patience_s
        self._clockwork = clockwork
        self._stall_s = stall_s
        self._changed = Condition()
        self._closing = Event()
        self._thread = Thread(target=self._run, name="embedded camera", daemon=True)
        self._newest: Frame | None = None
        self._bug: Exception | None = None
        self._trace: TracebackType | None = None
        self._frames = self._dropped = self._late = self._reconnects = 0
        self._segment = 0
        self._came_s: float | None = None
        self._fresh_s = self._since_s = monotonic()
        self._image: ImageArray | None = None

    @property
    def health(self) -> SourceHealth:
        """What the camera has met so far."""
        with self._changed:
            came_s, now_s = self._came_s, monotonic()
            state: SourceState = "live"
            if self._closing.is_set():
                state = "ended"
            elif came_s is None:
                state = "opening"
            elif now_s - came_s > self._stall_s:
                state = "lost"
            return SourceHealth(
                state,
                frames=self._frames,
                dropped=self._dropped,
                late=self._late,
                reconnects=self._reconnects,
                frozen_s=0.0 if came_s is None else came_s - self._fresh_s,
            )

    def start(self) -> Self:
        """Begin to draw, without waiting for a frame.

        Returns
        -------
        self : EmbeddedCamera
            The same.
        """
        if self._thread.ident is None and not self._closing.is_set():
            self._since_s = inf  # nobody loses patience while the floor is being painted
            self._thread.start()
        return self

    def read(self, timeout_s: float | None = None) -> Frame | None:
        """Wait for a frame that was not read before.

        Parameters
        ----------
        timeout_s : float, optional [s]
            For how long; zero only looks, None waits until the camera is closed or given up.

        Returns
        -------
        frame : Frame or None
            The newest; None where none came in time, or the camera is closed.

        Raises
        ------
        UnreachableError
            If nothing has come for `patience_s`. Reading again is allowed.
        """
        end_s = None if timeout_s is None else monotonic() + timeout_s
        with self._changed:
            while self._newest is None and not self._closing.is_set():
                if self._bug is not None:
                    raise self._bug.with_traceback(self._trace)  # not longer by every raise
                now_s = monotonic()
                patient_s = (self._came_s or self._since_s) + self.patience_s
                if now_s >= patient_s:
                    silent_s = now_s - (self._came_s or self._since_s)
                    raise UnreachableError(
                        f"lost the embedded camera: nothing for {silent_s:.0f} s; "
                        "let its faults be cleared"
                    )
                if end_s is not None and now_s >= end_s:
                    return None
                until_s = patient_s if end_s is None else min(end_s, patient_s)
                self._changed.wait(None if until_s == inf else until_s - now_s)
            frame, self._newest = self._newest, None
            self._frames += frame is not None
        return frame

    def close(self) -> None:
        """Draw no more; calling it again does nothing."""
        self._closing.set()
        with self._changed:
            self._newest = None
            self._changed.notify_all()
        if self._thread.ident is not None:
            self._thread.join(CLOSING_S)
            if self._thread.is_alive():
                # A thread that comes back from a library while Python ends would abort the process.
                atexit.register(self._thread.join, EXIT_S)

    def _run(self) -> None:
        try:
            self._keep_drawing()
        except Exception as error:  # raised where somebody reads
            with self._changed:
                self._bug, self._trace = error, error.__traceback__
                self._changed.notify_all()

    def _keep_drawing(self) -> None:
        world = self._clockwork.world
        # Paints the floor, which takes a second; at a time that needs nobody to have driven on.
        world.renderer.clean(world.now - 1.0)
        self._since_s = monotonic()
        with self._changed:
            self._changed.notify_all()
        drawn = -1
        while not self._closing.is_set():
            now, coming, next_s = self._clockwork.coming()
            fresh = [(max(p.arrives_s - AHEAD_S, p.exposed_s + SHUT_S), p) for p in coming]
            fresh = [(begin_s, picture) for begin_s, picture in fresh if picture.index > drawn]
            ready = [picture for begin_s, picture in fresh if begin_s <= now]
            if not ready:
                wait_s = min(
                    [LONGEST_WAIT_S, next_s - now, *(begin_s - now for begin_s, _ in fresh)]
                )
                self._closing.wait(max(wait_s, 0.001))
                continue
            picture = ready[-1]
            drawn = picture.index
            try:
                frame = world.draw(picture)
            except InputError:  # the computer slept, and nobody remembers
                continue
            # A wait may end a hair too early, and what has not arrived cannot be handed out.
            while (left_s := picture.arrives_s - self._clockwork.clock()) > 0:
                if self._closing.wait(left_s):
                    return
            if self._clockwork.arrived(picture):
                self._publish(frame, picture, len(ready) - 1)

    def _publish(self, frame: Frame, picture: Picture, passed: int) -> None:
        frozen = self._image is not None and _same(self._image, frame.image)
        now_s = monotonic()
        with self._changed:
            if self._closing.is_set():
                return
            self._image = frame.image
            self._came_s = now_s
            if not frozen:
                self._fresh_s = now_s
            self._reconnects += picture.segment > self._segment
            self._segment = picture.segment
            self._late += (frame.late_s or 0.0) > 0.25
            self._dropped += passed + (self._newest is not None)
            self._newest = frame
            self._changed.notify_all()

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.read()) is not None:
            yield frame

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _same(one: ImageArray, other: ImageArray) -> bool:
    """To the last bit; most pictures differ in their first row already."""
    return np.array_equal(one[0], other[0]) and np.array_equal(one, other)

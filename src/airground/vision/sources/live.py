"""Live cameras and streams: always the newest picture, through losses and returns."""

from __future__ import annotations

import atexit
from threading import Condition, Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Self

import numpy as np

from airground.errors import UnreachableError
from airground.vision.frame import Frame
from airground.vision.sources.decoder import OpeningError
from airground.vision.sources.stream_clock import StreamClock
from airground.vision.sources.tally import Tally

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType

    from airground.vision.frame import Clock, ImageArray
    from airground.vision.sources.decoder import Decoder, Picture
    from airground.vision.sources.protocol import SourceHealth, SourceState

__all__ = ["LiveSource"]

LATE_S = 0.25

# Waits between attempts grow from one to the other, so that a camera that starts is not hammered.
FIRST_WAIT_S, LONGEST_WAIT_S = 0.2, 3.0

CLOSING_S = 1.0
EXIT_S = 10.0  # beyond the longest that a library may take


class LiveSource:
    """Frames of a camera or stream, read by a thread that keeps only the newest.

    A frame that nobody has asked for when the next one comes is dropped; gaps in `Frame.index` tell. When the source
    goes away, the thread tries again and again, and `Frame.segment` grows when it is back. Its memory does not grow.

    Parameters
    ----------
    name : str
        What to call it; without password.
    connect : callable
        Opens the source; raises `OpeningError`.
    patience_s : float [s]
        For how long there may be no frame before reading raises; an attribute too, that may be changed.
    stall_s : float [s]
        For how long there may be no frame before the state is "lost".
    rate_hz : float, optional
        Frame rate that replaces the source's times.
    check : str
        What the user should look at when it cannot be reached.
    """

    frame_count: int | None = None

    def __init__(
        self,
        name: str,
        connect: Callable[[], Decoder],
        *,
        patience_s: float = 10.0,
        stall_s: float = 3.0,
        rate_hz: float | None = None,
        check: str = "check that it is on, that its address is right, and that this computer is in its network",
    ) -> None:
        self.name = name
        self._connect = connect
        self.patience_s = patience_s
        self._stall_s = stall_s
        self._rate_hz = rate_hz
        self._check = check
        self._tally = Tally()
        self._times = StreamClock()
        self._changed = Condition()
        self._closing = Event()
        self._thread = Thread(target=self._run, name=f"frames of {name}", daemon=True)
        self._newest: Frame | None = None
        self._clock: Clock = "arrival" if rate_hz is None else "rate"
        self._reason = "it does not answer"
        self._refused = False
        self._bug: Exception | None = None
        self._trace: TracebackType | None = None
        self._alive = False
        self._came_s: float | None = None  # when the newest picture came
        self._since_s = 0.0  # when the wait for a first picture began
        self._image: ImageArray | None = None
        self._frozen_since_s = 0.0
        self._corrupt = 0  # of the connection that is open
        self._base = 0  # pictures of the connections before

    @property
    def clock(self) -> Clock:
        """Clock of its frames: "arrival" until the first one has come."""
        return self._clock

    @property
    def health(self) -> SourceHealth:
        """What the source has met so far."""
        with self._changed:
            frozen_s = 0.0 if self._came_s is None else self._came_s - self._frozen_since_s
            return self._tally.health(self._state(), corrupt=self._corrupt, frozen_s=frozen_s)

    @property
    def running(self) -> bool:
        """Whether its thread is at work."""
        return self._thread.is_alive()

    def start(self) -> Self:
        """Begin to read, without waiting for a frame.

        Returns
        -------
        self : LiveSource
            The same.
        """
        self._since_s = monotonic()
        self._thread.start()
        return self

    def wait(self) -> Self:
        """Wait for the first frame, which stays to be read.

        Returns
        -------
        self : LiveSource
            The same.

        Raises
        ------
        UnreachableError
            If none comes in time.
        """
        with self._changed:
            self._wait(None)
        return self

    def read(self, timeout_s: float | None = None) -> Frame | None:
        """Wait for a frame that was not read before.

        Parameters
        ----------
        timeout_s : float, optional [s]
            For how long; zero only looks, None waits until the source is closed or given up.

        Returns
        -------
        frame : Frame or None
            The newest; None where none came in time, or the source is closed.

        Raises
        ------
        UnreachableError
            If nothing has come for `patience_s`, or the source refuses us. Reading again is allowed: the thread goes on
            trying until the source is closed.
        """
        with self._changed:
            self._wait(timeout_s)
            frame, self._newest = self._newest, None
        if frame is not None:
            self._tally.add("frames")
        return frame

    def close(self) -> None:
        """Stop reading; calling it again does nothing.

        A thread that hangs in a library is waited for no longer than a second; it ends by itself at the library's
        own time limit.
        """
        self._closing.set()
        with self._changed:
            self._newest = None
            self._changed.notify_all()
        if self._thread.ident is not None:
            self._thread.join(CLOSING_S)
            if self._thread.is_alive():
                # A thread that comes back from a library while Python ends would abort the process.
                atexit.register(self._thread.join, EXIT_S)

    def _state(self) -> SourceState:
        if self._closing.is_set():
            return "ended"
        if self._came_s is None:
            return "opening"
        return "live" if monotonic() - self._came_s <= self._stall_s and self._alive else "lost"

    def _wait(self, timeout_s: float | None) -> None:
        end_s = None if timeout_s is None else monotonic() + timeout_s
        while self._newest is None and not self._closing.is_set():
            if self._bug is not None:
                raise self._bug.with_traceback(self._trace)  # not longer by every raise
            now_s = monotonic()
            patient_s = (self._came_s or self._since_s) + self.patience_s
            if (self._refused and self._came_s is None) or now_s >= patient_s:
                raise UnreachableError(self._complaint())
            if end_s is not None and now_s >= end_s:
                return
            self._changed.wait((patient_s if end_s is None else min(end_s, patient_s)) - now_s)

    def _complaint(self) -> str:
        if self._came_s is None:
            what_to_do = "" if self._refused else f"; {self._check}"
            return f"cannot reach {self.name}: {self._reason}{what_to_do}"
        return f"lost {self.name}: nothing for {monotonic() - self._came_s:.0f} s ({self._reason}); {self._check}"

    def _run(self) -> None:
        try:
            self._keep_reading()
        except Exception as error:  # raised where somebody reads
            with self._changed:
                self._bug, self._trace = error, error.__traceback__
                self._changed.notify_all()

    def _keep_reading(self) -> None:
        wait_s = FIRST_WAIT_S
        while not self._closing.is_set():
            try:
                decoder = self._connect()
            except OpeningError as error:
                with self._changed:
                    self._reason = error.reason
                    self._refused = error.final
                    self._changed.notify_all()
            else:
                if self._read_all(decoder):
                    wait_s = FIRST_WAIT_S
            self._closing.wait(wait_s)
            wait_s = min(2 * wait_s, LONGEST_WAIT_S)

    def _read_all(self, decoder: Decoder) -> bool:
        """Read until the source goes away; whether anything came."""
        count, before_s = 0, None
        self._times.reconnected()
        try:
            while not self._closing.is_set():
                picture = decoder.read()
                now_s = monotonic()
                # A stalled stream may give up one more picture, which the parser held back for the next.
                if picture is None or (before_s and now_s - before_s > self._stall_s):
                    break
                before_s = now_s
                self._take(picture, now_s, decoder)
                count = picture.number + 1
        finally:
            decoder.close()
            with self._changed:
                self._tally.add("corrupt", decoder.corrupt)
                self._corrupt = 0
                self._base += count
                self._alive = False
                self._reason = "it stopped sending"
                self._changed.notify_all()
        return count > 0

    def _take(self, picture: Picture, arrival: float, decoder: Decoder) -> None:
        settled = self._times.settled
        time = self._times.take(picture.stamp_s, arrival, decoder.stamped)
        frozen = self._image is not None and np.array_equal(self._image, picture.image)
        self._image = picture.image
        with self._changed:
            if self._closing.is_set():
                return
            if not self._alive and self._came_s is not None:
                self._tally.add("reconnects")
                self._tally.note(f"came back after {arrival - self._came_s:.1f} s")
            self._alive = True
            if not frozen:
                self._frozen_since_s = arrival
            self._came_s = arrival
            self._corrupt = decoder.corrupt
            if time is None:
                if settled and self._times.settled:  # not the first of a segment
                    self._tally.add("repeated")
                return
            index = self._base + picture.number
            t = time.t
            self._clock = time.clock
            if self._rate_hz is not None:
                t, self._clock = index / self._rate_hz, "rate"
            if time.late_s is not None and time.late_s > LATE_S:
                self._tally.add("late")
            if self._newest is not None:
                self._tally.add("dropped")
            self._newest = Frame(picture.image, t, self._clock, index, time.segment, time.late_s)
            self._changed.notify_all()

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.read()) is not None:
            yield frame

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

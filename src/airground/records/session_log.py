"""The log of a session: one MCAP file, written beside the control loop and never in its way."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any, Self

from airground._version import __version__
from airground.errors import FileError
from airground.records import session_log_topics as topics
from airground.records.access import StrPath, file_error
from airground.records.foxglove import (
    Level,
    Marks,
    camera_calibration,
    compressed_image,
    image_annotations,
    log_message,
    pose_in_frame,
)
from airground.records.session_log_file import SessionFile
from airground.records.session_log_queue import LogQueue, Waiting
from airground.records.session_log_text import exact_json
from airground.records.session_log_topics import FORMAT, SCHEMAS, TOPICS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from types import TracebackType

__all__ = ["SessionLog"]

QUEUE_BYTES = 32 << 20  # 8 s of images at 4 MB/s: a slow disk may think for a while
CHUNK_BYTES = 512 << 10
FLUSH_S = 0.4  # what a killed process loses at most
SYNC_S = 5.0  # what a power cut loses at most, about
CLOSE_S = 10.0


class SessionLog:
    """Writes the log of a session. Its methods never wait for the disk, and never raise for it.

    What was handed over is in the system's hands within half a second, and stays if the process is killed. When the
    disk does not keep up, images, marks and poses are left out and counted in `dropped`, steps never. When it cannot
    take the steps either, or is full, the recording ends, `trouble` says why, and the session goes on; the file can be
    read up to there. Use it from one thread, and as a context manager or with `close`.

    Parameters
    ----------
    path : path-like
        Where to; a file that is there is not overwritten.
    header : dict
        What a reader must know first: site, options, seed, robots. Kept exactly.
    note : callable, optional
        Told in one line, from the writing thread, when the recording ends by itself.
    start_unix_ns : int, optional [ns]
        Wall clock at session time 0; now where not given.
    queue_bytes : int
        How much may wait for the disk.

    Raises
    ------
    FileError
        If the file cannot be made, or is there already.
    InputError
        If the header has no place in JSON.
    """

    def __init__(
        self,
        path: StrPath,
        header: Mapping[str, Any],
        *,
        note: Callable[[str], None] | None = None,
        start_unix_ns: int | None = None,
        queue_bytes: int = QUEUE_BYTES,
    ) -> None:
        self.path = os.fspath(path)
        self._start_ns = time.time_ns() if start_unix_ns is None else start_unix_ns
        self._note = note
        self._queue = LogQueue(queue_bytes)
        self._dropped = 0
        self._trouble = ""
        self._closed = False
        self._last_t = 0.0
        own = {"format": FORMAT, "version": __version__, "start_unix_ns": self._start_ns}
        text = exact_json({**header, **own})
        try:
            self._file = SessionFile(self.path)
        except FileExistsError as error:
            raise FileError(self.path, "is there already; choose another name") from error
        except (OSError, ValueError) as error:  # ValueError: a NUL in the name
            raise file_error(self.path, error, "write") from error
        try:
            self._declare()
            self._file.add(self._channels[topics.HEADER], self._start_ns, text)
            self._file.flush()
            self._file.sync()
            _sync_folder(self.path)
        except OSError as error:
            self._file.abandon()
            raise file_error(self.path, error, "write") from error
        self._thread = Thread(target=self._run, name="session log", daemon=True)
        self._thread.start()

    @property
    def trouble(self) -> str:
        """Why the recording has ended by itself, in one line; empty while it runs."""
        return self._trouble

    @property
    def dropped(self) -> int:
        """How many images, marks and poses were left out, as the disk did not keep up."""
        return self._dropped

    def step(
        self,
        t: float,
        number: int,
        inputs: Sequence[Mapping[str, Any]],
        outputs: Mapping[str, Any],
    ) -> None:
        """Log a step: what a replay is fed, and what it is compared with.

        Parameters
        ----------
        t : float [s]
            Session clock.
        number : int
            Of the step.
        inputs : sequence of dict
            In order. Each has its `kind`; frames and readings as `session_recording` describes them.
        outputs : dict
            What was decided.

        Raises
        ------
        InputError
            If something has no place in JSON: a mistake of the program.
        """
        document = {"t": t, "number": number, "inputs": inputs, "outputs": outputs}
        self._put(topics.STEPS, t, exact_json(document))

    def image(self, t: float, jpeg: bytes) -> None:
        """Log an image.

        Parameters
        ----------
        t : float [s]
            When it was taken, by the session clock.
        jpeg : bytes
            The image, compressed.
        """
        self._put(topics.IMAGE, t, jpeg, dispensable=True)

    def annotations(self, t: float, marks: Marks) -> None:
        """Log what is drawn over an image.

        Parameters
        ----------
        t : float [s]
            Time of the image.
        marks : Marks
            `seen_marks` makes them of a logged frame.
        """
        message = image_annotations(self._ns(t), marks)
        self._put(topics.ANNOTATIONS, t, exact_json(message), dispensable=True)

    def pose(self, t: float, robot: str, x_m: float, y_m: float, heading_rad: float) -> None:
        """Log where a robot is on the ground.

        Parameters
        ----------
        t : float [s]
            Session clock.
        robot : str
            Its name.
        x_m, y_m : float [m]
            Where it is.
        heading_rad : float [rad]
            Where it looks.
        """
        message = pose_in_frame(self._ns(t), x_m, y_m, heading_rad)
        self._put(topics.POSE.format(robot), t, exact_json(message), dispensable=True)

    def event(self, t: float, level: Level, line: str, robot: str = "") -> None:
        """Log that something happened.

        Parameters
        ----------
        t : float [s]
            Session clock.
        level : {"info", "warning", "error"}
            How bad it is.
        line : str
            What.
        robot : str
            Whom it is about; empty for none.
        """
        message = log_message(self._ns(t), level, line, robot or "session")
        self._put(topics.EVENTS, t, exact_json(message))

    def calibration(self, t: float, document: Mapping[str, Any]) -> None:
        """Log a calibration that is in force from now on.

        Parameters
        ----------
        t : float [s]
            Session clock.
        document : dict
            The object of a calibration.json (`calibration_document`).

        Raises
        ------
        InputError
            If something has no place in JSON.
        """
        self._put(topics.CALIBRATION, t, exact_json({"t": t, "calibration": document}))
        message = camera_calibration(self._ns(t), document)
        if message is not None:
            self._put(topics.CAMERA_INFO, t, exact_json(message))

    def close(self) -> None:
        """Write what waits and the index, and close the file; again does nothing."""
        if self._closed:
            return
        self._closed = True
        self._queue.close()
        self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            self._end(f"the disk has not answered for {CLOSE_S:.0f} s")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _ns(self, t: float) -> int:
        return max(self._start_ns + round(t * 1e9), 0)

    def _put(self, topic: str, t: float, data: bytes, *, dispensable: bool = False) -> None:
        if self._closed or self._trouble:
            return
        self._last_t = max(t, self._last_t)
        taken = self._queue.put(Waiting(topic, self._ns(t), data), dispensable=dispensable)
        if not taken and dispensable:
            self._dropped += 1
        elif not taken:
            self._end("the disk does not keep up")
            self._queue.close()

    def _end(self, why: str) -> None:
        if self._trouble:
            return
        self._trouble = (
            f"{self.path}: {why}; the recording ended at {self._last_t:.1f} s, the session goes on"
        )
        if self._note is not None:
            self._note(self._trouble)

    # What follows runs in the writing thread.

    def _declare(self) -> None:
        self._schemas = {
            name: self._file.add_schema(name, exact_json(shape)) for name, shape in SCHEMAS.items()
        }
        self._channels = {
            topic: self._file.add_channel(topic, self._schemas[name])
            for topic, name in TOPICS.items()
        }

    def _run(self) -> None:
        try:
            self._write_all()
        except OSError as error:
            self._end(file_error(self.path, error, "write").problem)
        except Exception as error:  # a mistake of ours must not pass for a good recording
            self._end(f"{type(error).__name__}: {error}")
        self._queue.close()
        try:
            if self._trouble:
                ns = self._ns(self._last_t)
                last = log_message(ns, "error", self._trouble, "session")
                self._file.add(self._channels[topics.EVENTS], ns, exact_json(last))
            self._file.finish()
        except OSError as error:
            self._end(file_error(self.path, error, "write").problem)

    def _write_all(self) -> None:
        closed = False
        flush_at = sync_at = time.monotonic()
        while not closed:
            waiting, closed = self._queue.take(FLUSH_S / 2)
            for one in waiting:
                data = one.data
                if one.topic == topics.IMAGE:
                    data = compressed_image(one.ns, data)
                if self._file.pending + len(data) > CHUNK_BYTES:
                    self._file.flush()
                self._file.add(self._channel(one.topic), one.ns, data)
                self._queue.written(one)
            now = time.monotonic()
            if now >= flush_at:
                self._file.flush()
                flush_at = now + FLUSH_S / 2
            if now >= sync_at:
                self._file.sync()
                sync_at = now + SYNC_S

    def _channel(self, topic: str) -> int:
        number = self._channels.get(topic)
        if number is None:
            number = self._file.add_channel(topic, self._schemas[topics.POSE_SCHEMA])
            self._channels[topic] = number
        return number


def _sync_folder(path: str) -> None:
    """See to it that the file's name outlives a power cut, where the system can."""
    with suppress(OSError):
        fd = os.open(Path(path).absolute().parent, os.O_RDONLY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)

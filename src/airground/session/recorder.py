"""Everything of a session into one file, beside the loop and never in its way."""

from __future__ import annotations

from collections import deque
from concurrent.futures import ThreadPoolExecutor
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from airground.control import Floor
from airground.records.calibration_file import calibration_document
from airground.records.foxglove import seen_marks
from airground.records.session_log import SessionLog
from airground.session.coding import input_document, options_document
from airground.vision.jpeg import encode_jpeg

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from airground.calibration import Calibration
    from airground.geometry.arrays import FloatArray
    from airground.session.handle import ShownImage
    from airground.session.inputs import Input
    from airground.session.options import SessionOptions
    from airground.session.tick import SessionTick

__all__ = ["Images", "Recorder", "outputs_document"]

Images = Literal["none", "some", "all"]
"""Which pictures are kept: none, some in a second, or all."""

POSE_EVERY = 5  # steps
WAITING = (
    8  # coded pictures; more are dropped, as a loop that does not take them has other troubles
)


class Recorder:
    """Writes a session's log.

    Parameters
    ----------
    path : Path
        Where to; a file that is there is not overwritten.
    options : SessionOptions
        Of the session.
    calibration : Calibration or None
        What it began with.
    images : {"none", "some", "all"}
        Which pictures are kept.
    image_hz : float
        How many a second, where some.
    note : callable, optional
        Told in one line when the recording ends by itself.

    Raises
    ------
    FileError
        If the file cannot be made.
    """

    def __init__(
        self,
        path: Path,
        options: SessionOptions,
        calibration: Calibration | None,
        *,
        images: Images = "some",
        image_hz: float = 2.0,
        note: Callable[[str], None] | None = None,
    ) -> None:
        header: dict[str, Any] = {
            "site": options.name,
            "options": options_document(options),
            "robots": [{"name": robot.name, "track": robot.track} for robot in options.robots],
            "calibration": None if calibration is None else calibration_document(calibration),
        }
        self.path = str(path)
        self._log = SessionLog(path, header, note=note)
        self._images: Images = images
        self._image_hz = image_hz
        self._coded: deque[tuple[float, bytes]] = deque(maxlen=WAITING)
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="session pictures")
        self._busy = False
        self._due_s = -1e9
        self._floor: Floor | None = None
        self._undistort: Callable[[FloatArray], FloatArray] = np.asarray

    @property
    def trouble(self) -> str:
        """Why the recording has ended by itself, in one line; empty while it runs."""
        return self._log.trouble

    def picture(self, shown: ShownImage) -> None:
        """Keep a picture, if it is one of those to be kept; coded by another thread.

        Parameters
        ----------
        shown : ShownImage
            The newest.
        """
        if self._images == "none" or self._busy:
            return
        if self._images == "some" and shown.arrived_s < self._due_s:
            return
        self._due_s = shown.arrived_s + 1 / self._image_hz
        self._busy = True
        self._pool.submit(self._code, shown)

    def step(
        self, inputs: Sequence[Input], tick: SessionTick, calibration: Calibration | None = None
    ) -> None:
        """Keep a step; from the loop's thread only.

        Parameters
        ----------
        inputs : sequence of Input
            What the session was told.
        tick : SessionTick
            What it decided.
        calibration : Calibration, optional
            The one in force, where it is new.
        """
        documents = [input_document(one) for one in inputs]
        self._log.step(tick.t, tick.number, documents, outputs_document(tick))
        for document in documents:
            if document["kind"] == "seen":
                self._log.annotations(document["t"], seen_marks(document))
        if calibration is not None:
            self._floor = Floor(calibration.model, calibration.origin_px)
            self._undistort = calibration.undistort
        self._poses(tick)
        for event in tick.events:
            self._log.event(event.t, event.level, event.line, event.robot)
        if calibration is not None:
            self._log.calibration(tick.t, calibration_document(calibration))
        while self._coded:
            self._log.image(*self._coded.popleft())

    def _poses(self, tick: SessionTick) -> None:
        if self._floor is None or tick.number % POSE_EVERY:
            return
        for view in tick.robots:
            if view.uv is None or view.heading_rad is None:
                continue
            x, y = self._floor.position(self._undistort(np.array(view.uv))).tolist()
            if isfinite(x + y):
                self._log.pose(tick.t, view.name, x, y, view.heading_rad)

    def close(self) -> None:
        """Write what waits, and close the file; again does nothing."""
        self._pool.shutdown(wait=True, cancel_futures=True)
        while self._coded:
            self._log.image(*self._coded.popleft())
        self._log.close()

    def _code(self, shown: ShownImage) -> None:
        try:
            self._coded.append((shown.t, encode_jpeg(shown.image).data))
        finally:
            self._busy = False


def outputs_document(tick: SessionTick) -> dict[str, Any]:
    """Give what a step decided: what goes into the log, and what a replay is compared in.

    Parameters
    ----------
    tick : SessionTick
        Of the step.

    Returns
    -------
    document : dict
        Commands as sent, mode, and how each robot was believed to be.
    """
    return {
        "mode": tick.mode,
        "commands": {
            name: {"v": c.v, "omega": c.omega, "lateral": c.lateral}
            for name, c in tick.commands.items()
        },
        "robots": {
            view.name: {
                "uv": view.uv,
                "heading_rad": view.heading_rad,
                "speed_mps": view.speed_mps,
                "task": view.task,
                "stop": view.stop,
            }
            for view in tick.robots
        },
        "calibration": tick.calibration.revision,
        "refused": [list(one) for one in tick.refused],
        "jobs": [job.number for job in tick.jobs],
    }

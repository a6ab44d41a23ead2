"""What is new in a step of the session, compared with what was told before."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from airground.console.ground_message import NO_GROUND, ground_document
from airground.console.messages import fences_document, path_document, plain, state_document
from airground.errors import AirgroundError

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import ThreadPoolExecutor

    from airground.session.handle import SessionHandle
    from airground.session.tick import PathView, SessionTick

__all__ = ["News"]

CALIBRATION_S = 0.25  # the course of a calibration drive is told no more often than this


class News:
    """Publishes what has changed. Belongs to the event loop's thread.

    Parameters
    ----------
    handle : SessionHandle
        The session.
    pool : ThreadPoolExecutor
        Where grids are worked out.
    publish : callable
        Takes a key and plain data.
    """

    def __init__(
        self,
        handle: SessionHandle,
        pool: ThreadPoolExecutor,
        publish: Callable[[str, Any], None],
    ) -> None:
        self._handle = handle
        self._pool = pool
        self._publish = publish
        self._recording: str | None = None
        self._paths: dict[str, PathView] = {}
        self._fences: int | None = None
        self._view: dict[str, Any] = {}
        self._viewed_s = 0.0
        self._ground: dict[str, Any] = NO_GROUND
        self._ground_of: tuple[int, tuple[int, int] | None] | None = None

    def tell(self, tick: SessionTick, now: float, *, anybody: bool) -> None:
        """Publish what is new.

        Parameters
        ----------
        tick : SessionTick
            The newest.
        now : float [s]
            Any clock that does not go back.
        anybody : bool
            Whether somebody listens: if not, what changes with every step is left out.
        """
        if anybody:
            self._publish("state", state_document(tick, self._handle.now()))
        if (recording := self._handle.recording) != self._recording:
            self._recording = recording
            self._publish("recording", {"file": recording})
        if tick.fences_revision != self._fences:
            self._fences = tick.fences_revision
            self._publish("fences", fences_document(tick))
        self._tell_paths(tick)
        self._tell_calibration(tick, now)

    def _tell_paths(self, tick: SessionTick) -> None:
        paths = {path.robot: path for path in tick.paths}
        for robot in [robot for robot in self._paths if robot not in paths]:
            del self._paths[robot]
            self._publish(f"path/{robot}", None)
        for robot, path in paths.items():
            if self._paths.get(robot) is not path:
                self._paths[robot] = path
                self._publish(f"path/{robot}", path_document(path))

    def _tell_calibration(self, tick: SessionTick, now: float) -> None:
        view: dict[str, Any] = plain(tick.calibration)
        calibration = self._handle.calibration
        size = tick.camera.size_px or (calibration.image_size_px if calibration else None)
        view["image_size_px"] = None if size is None else list(size)
        subject = (tick.calibration.revision, size)
        if subject != self._ground_of:
            self._ground, self._ground_of = NO_GROUND, subject
            if calibration is not None and size is not None:
                loop = asyncio.get_running_loop()
                future = loop.run_in_executor(self._pool, ground_document, calibration, size)
                future.add_done_callback(lambda done: self._take_ground(subject, done))
        elif view == self._view or (
            now - self._viewed_s < CALIBRATION_S
            and all(view[key] == self._view[key] for key in ("status", "phase", "leg_to_px"))
        ):
            return
        self._view, self._viewed_s = view, now
        self._publish("calibration", view | self._ground)

    def _take_ground(self, subject: object, done: asyncio.Future[dict[str, Any]]) -> None:
        if done.cancelled() or subject != self._ground_of:
            return  # another has come meanwhile
        error = done.exception()
        if error is not None:
            if not isinstance(error, AirgroundError):
                raise error
            return  # nothing of it can be drawn
        self._ground = done.result()
        self._publish("calibration", self._view | self._ground)

"""A session that runs: threads for the camera and for slow work, and the loop that robots are told from."""

from __future__ import annotations

import sys
import time
import traceback
from dataclasses import replace
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Self

from airground.errors import AirgroundError, UnreachableError
from airground.robots.watchdog import Watchdog
from airground.session.clock import SessionClock
from airground.session.handle import RobotInfo, ShownImage, SiteView
from airground.session.inbox import Inbox
from airground.session.inputs import CameraNews, Heard, Ordered, Seen
from airground.session.orders import Stop
from airground.session.stages import Stages
from airground.session.vision_stage import VisionStage
from airground.session.workers import Workers

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import TracebackType

    from airground.calibration import Calibration
    from airground.control.command import VelocityCommand
    from airground.robots import Robot
    from airground.session.inputs import Input
    from airground.session.live_camera import LiveCamera
    from airground.session.orders import Order
    from airground.session.recorder import Recorder
    from airground.session.session import Session
    from airground.session.tick import SessionTick
    from airground.vision.eyes import Looks

__all__ = ["LiveSession"]

WATCHDOG_S = 0.5  # robots are stopped past the loop if it hangs for so long; most have such a watchdog of their own
SEND_S = 0.05
READ_S = 0.1
NEWS_S = 0.25
# Python hands the interpreter from thread to thread: the loop must not wait 5 ms for it
SWITCH_S = 0.0005


class LiveSession:
    """Runs a `Session` on a clock: a `SessionHandle`, and a context manager.

    Commands go out at least `SessionOptions.control_hz` times a second, whatever the camera does; a frame or a STOP
    that comes in between is acted on at once.

    Parameters
    ----------
    session : Session
        The core; belongs to this from now on.
    camera : LiveCamera
        Where frames come from; closed at the end.
    eyes : Looks
        Fresh.
    robots : mapping of str to Robot
        By the names in the session's options; stopped and closed at the end.
    clock : SessionClock, optional
        Of the session; a new one where not given.
    recorder : Recorder, optional
        Is given every step, and every picture; closed at the end.
    note : callable, optional
        Told when the loop hangs, and when it is back, a line each.
    """

    def __init__(
        self,
        session: Session,
        camera: LiveCamera,
        eyes: Looks,
        robots: Mapping[str, Robot],
        *,
        clock: SessionClock | None = None,
        recorder: Recorder | None = None,
        note: Callable[[str], None] | None = None,
    ) -> None:
        self.clock = clock or SessionClock()
        self.stages = Stages()
        self.failed: str = ""
        """Why it ended by itself, in one line; empty while it runs."""
        self.late_steps = 0
        """Steps that began more than a period late."""
        self._session = session
        self._camera = camera
        self._stage = VisionStage(eyes, self.clock)
        self._robots = dict(robots)
        self._recorder = recorder
        self._recorded = -1  # revision of the calibration that the recording has
        self._inbox = Inbox()
        self._sending = Lock()
        self._closing = Event()
        self._closed = False
        self._listeners: list[Callable[[SessionTick], None]] = []
        self._shown: ShownImage | None = None
        self._workers = Workers(self._inbox.put)
        self._watchdog = Watchdog(list(self._robots.values()), WATCHDOG_S, tell=note)
        self._threads = [
            Thread(target=self._watch, name="session camera", daemon=True),
            Thread(target=self._run, name="session loop", daemon=True),
        ]
        self._switch_s = sys.getswitchinterval()

    # What a console is given

    @property
    def site(self) -> SiteView:
        """What does not change about it."""
        options = self._session.options
        return SiteView(
            options.name,
            tuple(RobotInfo(r.name, r.kind, r.radius_m, r.limits) for r in options.robots),
            options.control_hz,
            options.wanted_sigma,
        )

    @property
    def calibration(self) -> Calibration | None:
        """The one in force."""
        return self._session.calibration

    @property
    def recording(self) -> str:
        """File that is being recorded to; empty for none."""
        return "" if self._recorder is None else self._recorder.path

    @property
    def running(self) -> bool:
        """Whether its loop is at work."""
        return self._threads[1].is_alive() and not self.failed

    def now(self) -> float:
        """Time of the session [s].

        Returns
        -------
        t : float [s]
            Since it began.
        """
        return self.clock()

    def submit(self, client: str, order: Order) -> None:
        """Hand in an order; never waits.

        On a STOP all robots are told to stand before this returns, whatever the loop is doing. What the loop has
        decided without knowing of it is not sent any more; from its next step on it tells them to stand itself.

        Parameters
        ----------
        client : str
            Who asks.
        order : Order
            What for.
        """
        self._inbox.put(Ordered(client, order))
        if isinstance(order, Stop):
            free = self._sending.acquire(timeout=SEND_S)  # a driver that hangs holds it
            for robot in self._robots.values():
                robot.stop()
            if free:
                self._sending.release()

    def listen(self, listener: Callable[[SessionTick], None]) -> Callable[[], None]:
        """Be told of every step, in the loop's own thread: a listener only stores what it gets.

        Parameters
        ----------
        listener : callable
            Is given each tick.

        Returns
        -------
        stop : callable
            Ends that.
        """
        self._listeners = [*self._listeners, listener]

        def stop() -> None:
            self._listeners = [one for one in self._listeners if one is not listener]

        return stop

    def image(self) -> ShownImage | None:
        """Give the newest picture.

        Returns
        -------
        image : ShownImage or None
            None before the first.
        """
        return self._shown

    # Begin and end

    def start(self) -> Self:
        """Begin.

        Returns
        -------
        self : LiveSession
            The same.
        """
        self._switch_s = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH_S)
        self._watchdog.start()
        for thread in self._threads:
            thread.start()
        return self

    def close(self) -> None:
        """Stop all robots, and let go of everything; calling it again does nothing."""
        if self._closed:  # one that ended by itself has let go of nothing yet
            return
        self._closed = True
        self._closing.set()
        for thread in self._threads:
            if thread.ident is not None:
                thread.join(2.0)
        self._watchdog.close()
        for robot in self._robots.values():
            robot.close()
        self._camera.close()
        self._workers.close()
        if self._recorder is not None:
            self._recorder.close()
        sys.setswitchinterval(self._switch_s)

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    # The camera's thread

    def _watch(self) -> None:
        told, told_t = CameraNews("opening"), -1.0
        while not self._closing.is_set():
            news = self._look()
            now = self.clock()
            if (news.state, news.line) != (told.state, told.line) or (
                news != told and now - told_t > NEWS_S
            ):
                self._inbox.put(news)
                told, told_t = news, now

    def _look(self) -> CameraNews:
        """Wait for a frame and look at it; how the camera stands."""
        try:
            frame = self._camera.read(READ_S)
            if frame is not None:
                arrived = self.clock()
                if frame.clock == "arrival":
                    arrived = min(arrived, frame.t - self.clock.began_s)
                seen, look = self._stage.look(frame, arrived)
                self.stages.add("vision", self.clock() - arrived)
                self._shown = ShownImage(look.frame.image, seen.index, seen.t, arrived)
                self._inbox.put(seen)
                if self._recorder is not None:
                    self._recorder.picture(self._shown)
        except UnreachableError as error:
            self._closing.wait(0.2)
            return CameraNews("lost", str(error))
        except AirgroundError as error:  # a frame of another size, a detector that failed
            self._closing.wait(READ_S)  # it may be so every time
            return CameraNews("lost", f"a picture cannot be used: {error}")
        except Exception as error:
            self._fail(error)
            return CameraNews("ended", "a bug of ours, see the terminal")
        health = self._camera.health
        return CameraNews(health.state, "", round(health.frozen_s, 1))

    # The loop's thread

    def _run(self) -> None:
        try:
            self._loop()
        except Exception as error:
            self._fail(error)
        finally:
            for robot in self._robots.values():
                robot.stop()

    def _loop(self) -> None:
        period = self._session.options.period_s
        due = self.clock()
        while not self._closing.is_set():
            urgent = self._inbox.wait(due - self.clock())
            now = self.clock()
            if now < due and not urgent:
                continue
            if now > due + period:
                self.late_steps += 1
            due = now + period
            self._step(now)

    def _step(self, t: float) -> None:
        inputs: list[Input] = self._inbox.take()
        for name, robot in self._robots.items():
            readings = robot.read()
            if readings:
                inputs.append(Heard(name, tuple(readings)))
        seen = [one for one in inputs if isinstance(one, Seen)]
        began = time.perf_counter()

        def send(commands: dict[str, VelocityCommand]) -> None:
            self.stages.add("decide", time.perf_counter() - began)
            with self._sending:
                if not self._inbox.stop_waits:  # else all have just been told to stand
                    for name, command in commands.items():
                        self._robots[name].send(command)
            self._watchdog.feed()
            if seen:
                self.stages.add("frame_to_command", self.clock() - seen[-1].arrived_s)

        tick = self._session.step(t, inputs, send)
        self.stages.add("step", time.perf_counter() - began)
        for job in tick.jobs:
            self._workers.give(job)
        tick = replace(tick, stages_ms=self.stages.summary())
        if self._recorder is not None:
            revision = tick.calibration.revision
            fresh = self._session.calibration if revision != self._recorded else None
            self._recorded = revision
            self._recorder.step(inputs, tick, fresh)
        for listener in self._listeners:
            listener(tick)

    def _fail(self, error: BaseException) -> None:
        """Stop everything: what we do not understand must not drive."""
        self.failed = f"{type(error).__name__}: {error}"
        traceback.print_exception(error)
        self._closing.set()
        for robot in self._robots.values():
            robot.stop()

"""The core of the live system: what came in goes in, what goes to the robots comes out. Knows no clock and no thread.

    session = Session(options)
    tick = session.step(t, inputs)      # at a fixed rate; send tick.commands, work on tick.jobs

Whatever it does follows from the inputs and their times alone, so a recording of these replays to the same commands.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from airground.errors import AirgroundError
from airground.session.calibrating import CalibrationDrive
from airground.session.camera_watch import CameraWatch
from airground.session.desk import Desk
from airground.session.dispatch import Dispatch
from airground.session.fleet import Fleet
from airground.session.ground import Ground, fenced
from airground.session.inputs import CameraNews, Finished, Heard, Ordered, Seen
from airground.session.member import Member
from airground.session.operator_watch import OperatorWatch
from airground.session.others import Others
from airground.session.steering import Steering
from airground.session.tick import CalibrationView, SessionEvent, SessionTick

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from airground.calibration import Calibration
    from airground.control import ImagePath
    from airground.control.command import VelocityCommand
    from airground.control.separation.fence import Fence
    from airground.session.inputs import Input
    from airground.session.options import SessionOptions
    from airground.session.orders import Calibrate, SetFences
    from airground.session.tick import Mode, PathView

__all__ = ["Session"]


class Session:
    """Robots, a camera and an operator, as one state machine.

    Parameters
    ----------
    options : SessionOptions
        Robots, rates and bounds.
    calibration : Calibration, optional
        What is known of the camera already.
    """

    def __init__(self, options: SessionOptions, calibration: Calibration | None = None) -> None:
        self.options = options
        self.members = {one.name: Member(one) for one in options.robots}
        self.camera = CameraWatch()
        self.operator = OperatorWatch(options.bounds.operator_s)
        self.desk = Desk()
        self.calibration: Calibration | None = None
        self.fleet: Fleet | None = None
        self.drive: CalibrationDrive | None = None
        self.paths: dict[str, tuple[ImagePath | None, PathView]] = {}
        self.fences = (options.stay_inside, options.keep_out)
        self.fences_revision = 0
        self.fences_trouble = ""
        self.t = 0.0
        self._dispatch = Dispatch(self)
        self._steering = Steering(self)
        self._others = Others()
        self._events: list[SessionEvent] = []
        self._refused: list[tuple[str, str]] = []
        self._revision = 0
        self._number = 0
        if calibration is not None:
            self.take_calibration(calibration, fresh=False)

    # What comes in

    def step(
        self,
        t: float,
        inputs: Sequence[Input],
        send: Callable[[dict[str, VelocityCommand]], None] | None = None,
    ) -> SessionTick:
        """Take what came in since the last step, and decide.

        Parameters
        ----------
        t : float [s]
            Now, on the session's clock.
        inputs : sequence of Input
            In the order in which they arrived.
        send : callable, optional
            Is given the commands as soon as they are decided, before all is put together that a person is told.

        Returns
        -------
        tick : SessionTick
            What goes to the robots, and what happened.
        """
        self.t = t
        for one in inputs:
            self._take(one)
        if self.operator.silent(t):
            self._leave(f"{self.operator.client} is not heard any more: all robots stand")
        for level, line in self.camera.changes(t, self.offset_s):
            self.say(line, level)
        commands, views = self._steering.decide(self._others.tracks)
        if send is not None:
            send(commands)
        robots = views()
        self._number += 1
        tick = SessionTick(
            t=t,
            number=self._number,
            mode=self.mode,
            why=self.operator.why,
            stop_heard=self.operator.stop_heard,
            commands=commands,
            robots=tuple(robots),
            others=self._others.views(self.calibration),
            camera=self.camera.view(t, self.offset_s),
            calibration=self._calibration_view(),
            paths=tuple(view for _, view in self.paths.values()),
            fences=self.fences,
            fences_revision=self.fences_revision,
            events=tuple(self._events),
            jobs=self.desk.collect(),
            refused=tuple(self._refused),
        )
        self._events.clear()
        self._refused.clear()
        return tick

    @property
    def mode(self) -> Mode:
        """What the whole is doing."""
        if self.operator.stopped:
            return "stopped"
        if self.drive is not None:
            return "calibrating"
        if self.fleet is not None and any(
            one.controller is not None and not self.fleet.arrived[name]
            for name, one in self.fleet.errands.items()
        ):
            return "driving"
        return "idle"

    @property
    def offset_s(self) -> float:
        """To be added to the camera's stamps for the session's clock [s], as far as it is known."""
        return 0.0 if self.calibration is None else self.calibration.time_offset_s

    def say(self, line: str, level: str = "info", robot: str = "") -> None:
        """Let a person and the log know.

        Parameters
        ----------
        line : str
            One line.
        level : {"info", "warning", "error"}
            How bad.
        robot : str
            Which it is about.
        """
        self._events.append(SessionEvent(self.t, level, line, robot))  # type: ignore[arg-type]

    def refuse(self, client: str, why: str) -> None:
        """Let somebody know that what he asked for is not done.

        Parameters
        ----------
        client : str
            Who.
        why : str
            In one line.
        """
        self._refused.append((client, why))

    def _take(self, one: Input) -> None:
        if isinstance(one, Seen):
            self._see(one)
        elif isinstance(one, Heard):
            self._hear(one)
        elif isinstance(one, Ordered):
            self._dispatch.take(one)
        elif isinstance(one, Finished):
            self.desk.take(one)
        elif isinstance(one, CameraNews):
            self.camera.hear(one)

    def _see(self, seen: Seen) -> None:
        self.camera.see(seen)
        tracks = list(seen.tracks.tracks)
        ours = []
        frozen = self.camera.frozen
        for name, member in self.members.items():
            uv = member.see(seen, tracks)
            if member.track is not None:
                ours.append(member.track.serial)
            if uv is None or frozen:
                continue
            if self.drive is not None:
                self.drive.see(name, seen.t, uv)
            if self.fleet is not None:
                self.fleet.see(name, seen.t, uv, member.seen_covariance(seen))
        self._others.see(tracks, ours)

    def _hear(self, heard: Heard) -> None:
        member = self.members.get(heard.robot)
        if member is None or not heard.readings:
            return
        member.hear(self.t, heard.readings)
        if self.drive is not None:
            self.drive.hear(heard.robot, heard.readings)
        if self.fleet is not None:
            self.fleet.hear(heard.robot, heard.readings)

    # What follows from it

    def stop(self, why: str) -> None:
        """Stop all robots until somebody releases them; what was under way is forgotten.

        Parameters
        ----------
        why : str
            In one line.
        """
        if not self.operator.stopped:
            self.say(why, "warning")
        self.operator.press(why)
        self.rest_all()
        if self.drive is not None:
            self.drive.pause()

    def rest_all(self) -> None:
        """Forget what robots were to do."""
        if self.fleet is not None:
            for name in self.members:
                self.fleet.rest(name)
        self.desk.cancel("way")

    def _leave(self, line: str) -> None:
        self.operator.leave()
        self.rest_all()
        if self.drive is not None:
            self.drive.pause()
        self.say(line, "warning")

    def leave(self, client: str) -> None:
        """Take it that who was at the controls is gone.

        Parameters
        ----------
        client : str
            Who; nothing happens if it is somebody else.
        """
        if client == self.operator.client:
            self._leave(f"{client} left the controls: all robots stand")

    def release(self) -> None:
        """Let go of STOP, and of stops that wait for a person."""
        self.operator.release()
        if self.fleet is not None:
            for name in self.members:
                self.fleet.pilot(name).release()
        if self.drive is not None:
            self.drive.release()
        self.say("released; nothing moves until it is asked for")

    def take_calibration(self, calibration: Calibration, *, fresh: bool) -> None:
        """Steer with a calibration from now on.

        Parameters
        ----------
        calibration : Calibration
            In force from now on.
        fresh : bool
            Whether it was made in this session.
        """
        self.calibration = calibration
        self._revision += 1
        size = self.camera.size_px or calibration.image_size_px
        ground = Ground.of(calibration)
        self.fleet = Fleet(ground, self.options, self.members, fresh=fresh, size_px=size)
        self._draw_fences()

    def begin_calibration(self, order: Calibrate) -> None:
        """Begin a calibration drive, or go on with it another way.

        Parameters
        ----------
        order : Calibrate
            How, and with whom.
        """
        self.rest_all()
        if self.drive is None:
            self.drive = CalibrationDrive(self, order)
        else:
            self.drive.resume(order)

    def set_fences(self, order: SetFences) -> None:
        """Hold robots in other bounds.

        Parameters
        ----------
        order : SetFences
            As drawn.
        """
        self.fences = (order.stay_inside, order.keep_out)
        self.fences_revision += 1
        self._draw_fences()

    def _draw_fences(self) -> None:
        self.desk.cancel("fences")
        self.desk.cancel("sketch")
        self.paths.clear()  # they were checked against others
        self.fences_trouble = ""
        if self.fleet is None:
            return
        ground, (inside, outside) = self.fleet.ground, self.fences
        if not inside and not outside:
            self.fleet.set_fence(None)
            return

        def work() -> Fence | None:
            return fenced(ground, inside, outside)

        self.rest_all()  # nobody drives by a fence that is not there yet
        self.desk.give("fences", work, self._fences_drawn)

    def _fences_drawn(self, result: Any) -> None:
        if isinstance(result, AirgroundError):
            self.fences_trouble = f"the fences cannot be used, draw others: {result}"
            self.say(self.fences_trouble, "error")
        elif self.fleet is not None:
            self.fleet.set_fence(result)

    def _calibration_view(self) -> CalibrationView:
        c = self.calibration
        known = CalibrationView(
            status="none" if c is None else "calibrated",
            relative_sigma=None if c is None else c.observability.relative_sigma,
            revision=self._revision,
            wanted_sigma=self.options.wanted_sigma,
        )
        return known if self.drive is None else self.drive.view(known)

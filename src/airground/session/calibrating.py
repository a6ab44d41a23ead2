"""A calibration drive: robots drive legs by themselves, or a person drives them, until the camera is known well enough.

Nothing metric is known of the image meanwhile, so robots drive one at a time, by compass and odometer, behind
`BlindSafety`. The estimate so far, and the next leg, come from work outside the loop.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, pi, remainder
from typing import TYPE_CHECKING

from airground.calibration.guidance_types import Leg
from airground.control.command import STOP
from airground.control.legs import DriveLeg, advise, scripted_leg
from airground.errors import AirgroundError
from airground.session.blind_robot import BlindRobot
from airground.session.drive_estimate import DriveEstimate
from airground.session.live_estimate import LegQuestion, LiveAnswer
from airground.session.views import blind_view

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from airground.calibration import Calibration
    from airground.control.command import VelocityCommand
    from airground.control.pilot import Links
    from airground.geometry.arrays import FloatArray
    from airground.robots import RobotReading
    from airground.session.member import Member
    from airground.session.orders import Calibrate
    from airground.session.session import Session
    from airground.session.tick import CalibrationView, RobotView
    from airground.vision.tracker import Track

__all__ = ["CalibrationDrive"]


class CalibrationDrive:
    """One drive, from `Calibrate` to `EndCalibration`.

    Parameters
    ----------
    session : Session
        Whose.
    order : Calibrate
        How, and with whom.
    """

    def __init__(self, session: Session, order: Calibrate) -> None:
        size = session.camera.size_px
        assert size is not None
        self._session, self._size = session, size
        self.estimate = DriveEstimate(session, size, self._answered)
        self._robots = {
            name: BlindRobot(member, session.options, size)
            for name, member in session.members.items()
        }
        self._leg: Leg | DriveLeg | None = None
        self._advice = ""
        self._guided = self._paused = False
        self._order: tuple[str, ...] = ()
        self._turn = 0
        self.resume(order)

    # What comes in

    def see(self, name: str, t: float, uv: FloatArray) -> None:
        """Take a sighting.

        Parameters
        ----------
        name : str
            Of the robot.
        t : float [s]
            As the camera stamped it.
        uv : (2,) array [px]
            In raw pixels.
        """
        self.estimate.data.see(name, t, uv)

    def hear(self, name: str, readings: tuple[RobotReading, ...]) -> None:
        """Take readings.

        Parameters
        ----------
        name : str
            Of the robot.
        readings : tuple of RobotReading
            Oldest first.
        """
        self.estimate.data.hear(name, readings)

    def resume(self, order: Calibrate) -> None:
        """Go on, perhaps another way; what is known stays.

        Parameters
        ----------
        order : Calibrate
            How, and with whom.
        """
        self._guided, self._paused = order.by == "guided", False
        self._order = order.robots or tuple(self._session.members)
        self._turn %= len(self._order)
        self._forget_leg()
        how = "robots drive by themselves" if self._guided else "driven by hand"
        self._session.say(f"calibration drive: {how}")

    def pause(self) -> None:
        """Let all robots stand; what is known stays."""
        self._paused = True
        self._forget_leg()

    def release(self) -> None:
        """Let go of stops that wait for a person."""
        for robot in self._robots.values():
            robot.memory = robot.memory.released()

    def by_hand(self, member: Member, command: VelocityCommand) -> None:
        """Drive a robot by hand; it takes the drive over from the legs.

        Parameters
        ----------
        member : Member
            Which.
        command : VelocityCommand
            The stick's.
        """
        if self._guided and not self._paused:
            if command == STOP:
                return  # a stick at rest takes nothing away from a robot on its way
            self.pause()
            self._session.say("driven by hand: legs are paused")
        if member.name in self._order:
            self._turn = self._order.index(member.name)
        self._robots[member.name].by_hand(self._session.t, command)

    def end(self, *, keep: bool, client: str) -> None:
        """End the drive.

        Parameters
        ----------
        keep : bool
            Whether its calibration is made and taken over.
        client : str
            Who wants that.
        """
        session = self._session
        self.pause()
        if not keep:
            self._over()
            session.say("calibration drive: discarded")
            return

        def then(result: Calibration | AirgroundError) -> None:
            if isinstance(result, AirgroundError):
                session.refuse(client, f"no calibration yet: {result}")
                return
            self._over()
            session.take_calibration(result, fresh=True)
            sigma, used = result.observability.relative_sigma, result.fit.sightings
            session.say(f"calibrated: speeds are known to {sigma:.1%}, from {used} sightings")

        self.estimate.finish(then)

    def _over(self) -> None:
        self._session.drive = None
        for what in ("estimate", "check", "calibration"):
            self._session.desk.cancel(what)

    # What follows

    def tick(
        self, t: float, links: Mapping[str, Links], others: Sequence[Track]
    ) -> list[RobotView]:
        """Decide what all robots are told.

        Parameters
        ----------
        t : float [s]
            Now.
        links : mapping of str to Links
            When others were last heard.
        others : sequence of Track
            What else is in view.

        Returns
        -------
        views : list of RobotView
            With the commands.
        """
        views = []
        members = self._session.members
        going = self._guided and not self._paused and not self.estimate.solving
        for name, member in members.items():
            robot = self._robots[name]
            tracks = [*(m.track for m in members.values() if m is not member), *others]
            before = robot.memory.latched
            legs = going and name == self._active
            sent, task = robot.step(t, links[name], tracks, legs=legs)
            if legs and task == "leg" and robot.wants_leg:
                self._leg_over(robot)
            if sent.memory.latched - before and not self._session.operator.stopped:
                if task != "none":
                    self._session.stop(f"{name}: {sent.stop.line if sent.stop else 'disobeys'}")
                else:
                    robot.memory = robot.memory.released()  # a person carried it
            line = robot.tick.line if legs and robot.tick is not None else ""
            views.append(blind_view(t, member, task, sent, line))
        self.estimate.ask(t, self._question)
        return views

    def view(self, known: CalibrationView) -> CalibrationView:
        """Say how the drive goes.

        Parameters
        ----------
        known : CalibrationView
            The calibration in force.

        Returns
        -------
        view : CalibrationView
            The same, and the drive.
        """
        estimate, leg = self.estimate, self._leg
        sigma = estimate.sigma if isfinite(estimate.sigma) else None
        phase = "starting" if sigma is None else "good" if estimate.good else "running"
        return replace(
            known,
            phase="solving" if estimate.solving else phase,  # type: ignore[arg-type]
            live_sigma=sigma,
            robot=self._active,
            advice=self._line(),
            leg_from_px=None if leg is None else self._robots[self._active].uv,
            leg_to_px=leg.end_px if isinstance(leg, Leg) else None,
            sightings=0 if estimate.answer is None else estimate.answer.sightings,
        )

    @property
    def _active(self) -> str:
        return self._order[self._turn]

    def _line(self) -> str:
        estimate, tick = self.estimate, self._robots[self._active].tick
        paused = "paused: nothing moves until the drive is gone on with, by itself or by hand"
        bumped = "the camera was moved during the drive: discard it and begin again"
        lines = (
            (estimate.solving, "making the calibration of all that was driven"),
            (estimate.good, "good enough: use it, or drive on to make it better"),
            (estimate.answer is not None and estimate.answer.bumped, bumped),
            (bool(estimate.trouble), estimate.trouble),
            (self._paused and self._guided, paused),
            (self._guided and tick is not None, f"{self._active}: {tick.line if tick else ''}"),
            (True, self._advice or "drive straight along three directions or more, well apart"),
        )
        return next(line for holds, line in lines if holds)

    # Legs

    def _leg_over(self, robot: BlindRobot) -> None:
        """A robot waits: let the next one drive, or give it a leg if one is known; otherwise it waits on."""
        estimate, now = self.estimate, robot.now
        if self._leg is not None:
            self._leg = None
            if estimate.known:
                self._turn = (self._turn + 1) % len(self._order)
            return
        if estimate.known or estimate.good or now is None:
            return  # the estimate's answer brings the next
        if now.uv is None or now.heading_rad is None:
            return
        driver = robot.driver
        self._leg = scripted_leg(
            driver.map,
            now.uv,
            self._size,
            driver.driven,
            heading_rad=now.heading_rad,
            margin_px=self._session.options.border_px,
            others=now.others,
        )
        driver.give(self._leg)

    def _question(self) -> LegQuestion | None:
        robot, estimate = self._robots[self._active], self.estimate
        if not estimate.known or estimate.good or robot.uv is None or self._leg is not None:
            return None
        if self._guided and not robot.wants_leg:
            return None
        return LegQuestion(self._active, robot.uv, robot.driver.options.speed_mps)

    def _answered(self, answer: LiveAnswer) -> None:
        if answer.leg is None:
            return
        robot, member = self._robots[self._active], self._session.members[self._active]
        heading = remainder(answer.leg.heading_rad + self.estimate.bias(self._active), 2 * pi)
        leg = DriveLeg(heading, answer.leg.length_m)
        if not self._guided or self._paused:
            self._advice = advise(
                leg,
                heading_rad=None if member.reading is None else member.reading.heading,
                local_map=robot.driver.map,
                uv=robot.uv,
                driven=robot.driver.driven,
            )
        elif robot.wants_leg:
            self._leg = answer.leg
            robot.driver.give(leg)

    def _forget_leg(self) -> None:
        self._leg = None
        for robot in self._robots.values():
            robot.rest()

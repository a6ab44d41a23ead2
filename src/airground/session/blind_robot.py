"""One robot while the camera is not known: its legs, or a person's hand, behind what keeps it safe without metres."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from airground.control.command import STOP
from airground.control.legs import LegDriveOptions, LegDriver
from airground.control.safety.blind import BlindSafety
from airground.control.safety.blind_types import BlindSituation
from airground.control.safety.types import SafetyMemory
from airground.session.hand import HOLD_S
from airground.session.leg_sight import leg_input

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.control.command import VelocityCommand
    from airground.control.legs import LegInput, LegTick
    from airground.control.pilot import Links
    from airground.control.safety.types import Sent
    from airground.session.member import Member
    from airground.session.options import SessionOptions
    from airground.session.tick import Task
    from airground.vision.tracker import Track

__all__ = ["BlindRobot"]

LEG_MPS, CAREFUL_MPS, BACK_MPS = 0.3, 0.12, 0.15


class BlindRobot:
    """Drives one robot during a calibration drive.

    Parameters
    ----------
    member : Member
        Which.
    options : SessionOptions
        Of the session.
    size_px : (int, int) [px]
        Of the image.
    """

    def __init__(self, member: Member, options: SessionOptions, size_px: tuple[int, int]) -> None:
        limits = member.options.limits
        speed = min(LEG_MPS, limits.speed_mps, member.speed_mps)
        self.driver = LegDriver(
            limits,
            LegDriveOptions(
                speed_mps=speed,
                careful_mps=min(CAREFUL_MPS, speed),
                back_mps=min(BACK_MPS, speed),
                response_s=max(member.options.state.speed_lag_s, 0.05),
            ),
        )
        self.now: LegInput | None = None
        """What was known of it at the last step."""
        self.tick: LegTick | None = None
        """What its driver said then."""
        self.memory = SafetyMemory()
        self._member, self._options, self._size_px = member, options, size_px
        bounds = replace(options.bounds, image_margin_px=options.border_px / 2)
        self._safety = BlindSafety(limits, size_px, bounds)
        self._hand: tuple[float, VelocityCommand] = (-1.0, STOP)

    @property
    def wants_leg(self) -> bool:
        """Whether it stands and waits for a leg."""
        return self.tick is not None and self.tick.wants_leg

    @property
    def uv(self) -> tuple[float, float] | None:
        """Where its mark was seen last [px]."""
        seen = self._member.seen_uv
        return None if seen is None else (float(seen[0]), float(seen[1]))

    def by_hand(self, t: float, command: VelocityCommand) -> None:
        """Drive it by hand.

        Parameters
        ----------
        t : float [s]
            Now.
        command : VelocityCommand
            The stick's; holds for a fraction of a second.
        """
        self._hand = (t + HOLD_S, command)

    def rest(self) -> None:
        """Forget leg and hand."""
        self._hand = (-1.0, STOP)
        self.driver.cancel()

    def step(
        self, t: float, links: Links, tracks: Sequence[Track | None], *, legs: bool
    ) -> tuple[Sent, Task]:
        """Decide what it is told.

        Parameters
        ----------
        t : float [s]
            Now.
        links : Links
            When others were last heard.
        tracks : sequence of Track or None
            What else is in view.
        legs : bool
            Whether it may drive its leg.

        Returns
        -------
        sent : Sent
            What passed.
        task : Task
            What it is doing.
        """
        self.now = now = leg_input(
            t,
            self._member,
            self.driver.map,
            tracks=tracks,
            options=self._options,
            size_px=self._size_px,
            held=not self.memory.going,
        )
        self.tick = self.driver.tick(now)
        command, task = STOP, "none"
        until, stick = self._hand
        if t <= until:
            command, task = stick, "hand"
        elif legs:
            command, task = self.tick.command, "leg"
        step_px = None
        if now.uv is not None and now.heading_rad is not None:
            step_px = self.driver.map.px_per_m(now.uv, now.heading_rad)
        situation = BlindSituation(
            t=t,
            uv=now.uv,
            seen_t=now.seen_t,
            uv_dot=now.uv_dot,
            step_px=step_px,
            speed_mps=now.speed_mps,
            turn_radps=self.driver.gauge.turn_rate if now.turn_radps is None else now.turn_radps,
            frame_t=links.frame_t,
            operator_t=links.operator_t,
            robot_t=links.robot_t,
            stop=links.stop,
        )
        sent = self._safety.check(command, situation, self.memory)
        self.memory = sent.memory
        return sent, task  # type: ignore[return-value]

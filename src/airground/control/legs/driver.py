"""Drives straight legs by compass and odometer, while nothing metric is known of the image.

    wait -> turn -> drive -> settle -> wait          a leg
                      |-> brake -> back -> wait      a leg that would lead out of the image, or into something

    driver = LegDriver(limits)
    tick = driver.tick(LegInput(...))                # at a fixed rate; tick.command passes `BlindSafety`, and is sent
    if tick.wants_leg:
        driver.give(scripted_leg(...))               # or one of `calibration.next_leg`

A mark comes too near to the border, or to something else, where it would come to rest if the robot braked now: the way
is known in metres by the robot's own speed, and in pixels by what a metre was in the image so far.
"""

from __future__ import annotations

from math import degrees, isfinite, pi, remainder
from typing import TYPE_CHECKING

from airground.control.command import STOP, VelocityCommand
from airground.control.drive_laws import wrapped
from airground.control.legs.gauge import Gauge
from airground.control.legs.laws import driving, turning
from airground.control.legs.local_map import LocalMap
from airground.control.legs.look import inside_px, stopping_m, too_near
from airground.control.legs.types import (
    DriveLeg,
    DrivenLeg,
    LegDriveOptions,
    LegInput,
    LegPhase,
    LegTick,
)
from airground.control.safety.limits import limited

if TYPE_CHECKING:
    from airground.control.limits import Limits

__all__ = ["LegDriver"]

REST_MPS, REST_S = 0.03, 0.25  # it stands: below this speed for so long
REST_MOST_S = 1.5  # an odometer that never reads so little
THERE_M = 0.008  # short of a leg's end, what is left to coasting
FURTHER_M = 0.25  # backs out by so much more than it drove, if need be
PINNED_M, PINNED_PX = 0.2, 4.0  # so far by odometer, and not even so far in the image
IDLE_S, IDLE_M = 2.5, 0.02  # told to drive for so long, and not even so far
LARGEST_PX = 1e6  # of a mark that is believed
STEADY_S = 0.15  # it heads there: for so long
DEAD_BAND_S = 1.5  # nearly, for so long: motors that do not turn as little as that
GEARS = 8  # changes of a car's direction in one turn


class LegDriver:
    """Drives one robot. Give it legs when it wants one; it keeps the mark inside the image.

    Parameters
    ----------
    limits : Limits
        Of the robot: with a turn radius it turns on arcs, without reverse it turns round to back out.
    options : LegDriveOptions, optional
        How legs are driven; the defaults where not given.
    """

    def __init__(self, limits: Limits, options: LegDriveOptions | None = None) -> None:
        self.limits = limits
        self.options = options or LegDriveOptions()
        self.map = LocalMap()
        """What the robot's own motion has told of the image."""
        self.gauge = Gauge()
        """Where it heads, and how far it has come."""
        self.driven: tuple[DrivenLeg, ...] = ()
        """Legs so far, parts of legs too."""
        self.leg: DriveLeg | None = None
        """What is being driven; None while it waits."""
        self._phase: LegPhase = "wait"
        self._aborted = False
        self._why = ""
        self._sent = STOP
        self._seen_t = float("nan")
        self._since = 0.0  # when the phase began; NaN until the next tick
        self._good_s = self._near_s = 0.0  # for how long what ends it has held, or nearly
        self._gear, self._gears = 1, 0
        self._goal = 0.0  # heading to turn to
        self._escape = False  # whether it turns round to leave
        self._start = 0.0  # of the leg, by the gauge
        self._start_uv = (0.0, 0.0)
        self._end = 0.0  # of the leg, when it braked

    @property
    def wants_leg(self) -> bool:
        """Whether it stands and waits for a leg."""
        return self._phase == "wait"

    @property
    def driven_m(self) -> float:
        """Of the leg that is being driven [m]."""
        return self.gauge.distance_m - self._start if self._phase in ("drive", "settle") else 0.0

    def give(self, leg: DriveLeg) -> None:
        """Drive a leg from the next tick on; one that is under way is forgotten.

        Parameters
        ----------
        leg : DriveLeg
            What to drive.
        """
        self.leg, self._aborted, self._why = leg, False, ""
        self._escape, self._gear, self._gears = False, 1, 0
        self._goal = leg.heading_rad
        self._enter(float("nan"), "turn")

    def cancel(self) -> None:
        """Come to rest, and forget the leg."""
        self.leg = None
        self._enter(float("nan"), "wait")

    def tick(self, now: LegInput) -> LegTick:
        """Decide what to do now.

        Parameters
        ----------
        now : LegInput
            All that is known.

        Returns
        -------
        tick : LegTick
            A command within the robot's limits, and how things are.
        """
        self._learn(now)
        if now.held:
            self._sent = STOP
        if now.held or not isfinite(self._since):
            self._since = now.t
        missing = self._missing(now)
        phase: LegPhase = self._phase
        if missing:
            asked, line = STOP, missing
            if phase != "wait":
                phase, self._since = "lost", now.t
        else:
            asked, line = self._step(now)
            phase = self._phase
        self._sent = limited(asked, self._sent, now.dt, self.limits) if now.dt > 0 else STOP
        return LegTick(self._sent, phase, self._phase == "wait", line, self._aborted)

    # What is known

    def _learn(self, now: LegInput) -> None:
        self.gauge.take(now)
        seen_t = now.t if now.seen_t is None else now.seen_t
        if now.uv is None or now.uv_dot is None or seen_t == self._seen_t:
            return
        self._seen_t = seen_t
        gauge = self.gauge
        self.map.take(now.uv, now.uv_dot, gauge.heading_rad, gauge.speed, gauge.turn_rate)

    def _missing(self, now: LegInput) -> str:
        """What it waits for; empty where all is there."""
        options, seen_t = self.options, now.t if now.seen_t is None else now.seen_t
        if not self.gauge.known or not self.gauge.age_s <= options.silent_s:
            return "waiting: the robot tells neither heading nor speed"
        if now.uv is None or not (abs(now.uv[0]) < LARGEST_PX and abs(now.uv[1]) < LARGEST_PX):
            return "waiting: its mark is not seen"
        if not now.t - seen_t <= options.lost_s:
            return "waiting: its mark is not seen any more"
        return ""

    def _ahead(self, now: LegInput, gear: int) -> str:
        """What it would come too near to in a direction, if it braked only now."""
        return too_near(
            now,
            self.gauge,
            self.map,
            gear=gear,
            told_mps=self._sent.v * gear,
            limits=self.limits,
            options=self.options,
        )

    # What it does

    def _enter(self, t: float, phase: LegPhase) -> None:
        self._phase, self._since, self._good_s, self._near_s = phase, t, 0.0, 0.0

    def _step(self, now: LegInput) -> tuple[VelocityCommand, str]:
        match self._phase:
            case "turn":
                return self._turn(now)
            case "drive":
                return self._drive(now)
            case "settle" | "brake":
                return self._settle(now)
            case "back":
                return self._back(now)
        return STOP, f"{self._why}; waiting for a leg" if self._why else "waiting for a leg"

    def _turn(self, now: LegInput) -> tuple[VelocityCommand, str]:
        gauge, options = self.gauge, self.options
        car = self.limits.turn_radius_m > 0
        # A car does not stop to turn: what it still turns while it steers back counts.
        more = gauge.turn_rate * options.response_s if car else 0.0
        error = wrapped(self._goal - gauge.heading_rad - more)
        line = f"turning to {_degrees(self._goal)} deg"
        spent = now.t - self._since
        good = abs(error) < options.heading_tolerance_rad and (car or abs(gauge.turn_rate) < 0.1)
        self._good_s = self._good_s + now.dt if good else 0.0
        near = abs(error) < 4 * options.heading_tolerance_rad and abs(gauge.turn_rate) < 0.1
        self._near_s = self._near_s + now.dt if near else 0.0
        if (good and self._good_s >= (0.0 if car else STEADY_S)) or self._near_s > DEAD_BAND_S:
            if self._gear < 0 and abs(gauge.speed) > REST_MPS:
                return STOP, line
            self._begin(now)
            return self._step(now)
        most = 4.0 + 3.0 * pi / options.turn_radps + (20.0 if car else 0.0)
        if spent > most:
            return self._give_up(now, "it does not turn as told")
        if not car:
            return turning(error, 1, self.limits, options), line
        if self._ahead(now, self._gear):
            self._gears += 1
            self._gear = -self._gear
            if self._gears > GEARS or self.limits.reverse_mps == 0:
                return self._give_up(now, "no room to turn")
        return turning(error, self._gear, self.limits, options), line

    def _begin(self, now: LegInput) -> None:
        """Drive, now that it heads there."""
        assert now.uv is not None
        self._gear = 1
        self._start_uv = now.uv
        if self._escape:
            self._end = self.gauge.distance_m
            self._enter(now.t, "back")
        else:
            self._start = self.gauge.distance_m
            self._enter(now.t, "drive")

    def _drive(self, now: LegInput) -> tuple[VelocityCommand, str]:
        leg, gauge = self.leg, self.gauge
        assert leg is not None
        assert now.uv is not None
        gone = gauge.distance_m - self._start
        line = f"driving {max(gone, 0.0):.1f} of {leg.length_m:.1f} m"
        near = self._ahead(now, 1)
        if near:
            return self._abort(now, f"too near to {near}")
        moved = max(abs(now.uv[0] - self._start_uv[0]), abs(now.uv[1] - self._start_uv[1]))
        if gone > PINNED_M and moved < PINNED_PX:
            self._remember(whole=False)
            return self._give_up(now, "the robot drives, but its mark does not move in the image")
        if gone < IDLE_M and now.t - self._since > IDLE_S:
            return self._give_up(now, "it does not drive as told")
        left = leg.length_m - gone - abs(gauge.speed) * self.options.response_s
        if left <= THERE_M:
            self._enter(now.t, "settle")
            return STOP, line
        speed = leg.speed_mps or self.options.speed_mps
        if self.map.px_per_m(now.uv, gauge.heading_rad) is None:
            speed = min(speed, self.options.careful_mps)
        error = wrapped(leg.heading_rad - gauge.heading_rad)
        return driving(left, error, speed, self.limits), line

    def _settle(self, now: LegInput) -> tuple[VelocityCommand, str]:
        """Come to rest: at the end of a leg, or before that."""
        slow = abs(self.gauge.speed) < REST_MPS and self._sent.at_rest
        self._good_s = self._good_s + now.dt if slow else 0.0
        line = f"{self._why}: braking" if self._phase == "brake" else "coming to rest"
        if self._good_s < REST_S and now.t - self._since < REST_MOST_S:
            return STOP, line
        if self._phase == "settle":
            self._remember(whole=True)
            self.leg = None
            self._enter(now.t, "wait")
            return STOP, "at rest"
        self._remember(whole=False)
        self._leave(now)
        return STOP, self._why if self.leg is None else line

    def _abort(self, now: LegInput, why: str) -> tuple[VelocityCommand, str]:
        """Brake, and back out."""
        self._why, self._aborted = why, True
        self._enter(now.t, "brake")
        return STOP, f"{why}: braking"

    def _leave(self, now: LegInput) -> None:
        """Stand, and decide how to leave."""
        assert self.leg is not None
        self._gear = -1
        self._end = self.gauge.distance_m
        if self.limits.reverse_mps > 0:
            self._enter(now.t, "back")
        elif self.limits.turn_radius_m > 0:
            self._give_up(now, f"{self._why}, and it cannot reverse: drive it inwards by hand")
        else:
            self._escape, self._goal = True, self.leg.heading_rad + pi
            self._enter(now.t, "turn")

    def _back(self, now: LegInput) -> tuple[VelocityCommand, str]:
        """Back out the way it came, until well inside."""
        assert self.leg is not None
        assert now.uv is not None
        gauge, options = self.gauge, self.options
        gone, came = abs(gauge.distance_m - self._end), max(self._end - self._start, 0.0)
        line = f"{self._why}: backing out"
        gear = 1 if self._escape else -1
        inside = inside_px(now.uv, now.image_size_px)
        well = now.margin_px + options.inside_share * min(now.image_size_px)
        by_border = self._why.endswith("border")
        clear = inside >= well if by_border else gone >= min(came, FURTHER_M)
        slow = stopping_m(gauge.speed, options.response_s, self.limits)
        if clear or gone + slow >= came + FURTHER_M:
            return self._end_back(now), line
        if self._ahead(now, gear):
            return self._end_back(now), f"{line}, as far as it can"
        if gone < IDLE_M and now.t - self._since > IDLE_S:
            return self._give_up(now, f"{self._why}, and it does not back out as told")
        error = wrapped(self.leg.heading_rad + (pi if self._escape else 0.0) - gauge.heading_rad)
        speed = options.back_mps if gear > 0 else min(options.back_mps, self.limits.reverse_mps)
        return driving(1.0, error, speed, self.limits, gear), line

    def _end_back(self, now: LegInput) -> VelocityCommand:
        self.leg = None
        self._enter(now.t, "wait")
        return STOP

    def _give_up(self, now: LegInput, why: str) -> tuple[VelocityCommand, str]:
        """Stand, and wait for another leg."""
        self._why, self._aborted, self.leg = why, True, None
        self._enter(now.t, "wait")
        return STOP, why

    def _remember(self, *, whole: bool) -> None:
        assert self.leg is not None
        gone = max(self.gauge.distance_m - self._start, 0.0)
        self.driven += (DrivenLeg(self.leg.heading_rad, gone, whole),)


def _degrees(angle: float) -> int:
    return round(degrees(remainder(angle, 2 * pi)))

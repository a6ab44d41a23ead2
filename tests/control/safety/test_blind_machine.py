"""Whatever comes in while there is no calibration: what is sent is within the limits, and causes stop at once.

The judge knows the promises, not the code: it keeps its own account of what went in and came out.
"""

from __future__ import annotations

from math import inf, isfinite, nan
from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from airground.control import STOP, Limits, VelocityCommand
from airground.control.safety.blind import BlindSafety
from airground.control.safety.blind_types import BlindSituation
from airground.control.safety.bounds import SafetyBounds
from airground.control.safety.types import SafetyMemory
from limits_judge import breaches, jumps

LIMITS = Limits(turn_radius_m=0.1, lateral_acceleration_mps2=0.4)
BOUNDS = SafetyBounds(image_margin_px=10.0)
SIZE = (1280, 720)
WILD: list[Any] = [nan, inf, -inf, 0.0, 1e308, -1e308, 1e-320, -7.0]

speeds = st.floats(-1.0, 1.0) | st.sampled_from(WILD)
commands = st.none() | st.builds(VelocityCommand, speeds, speeds, st.just(0.0) | speeds)
ages = st.sampled_from([0.1, 0.1, 0.1, 0.45, 0.6, 1.2, -0.01, -0.3, nan, inf, -inf, None])
numbers = st.sampled_from([0.0, 0.0, 0.3, 640.0, 400.0, 3.0, 716.0, -900.0, nan, inf, 1e308])
pairs = st.none() | st.tuples(numbers, numbers)


def stale(age: float | None, most: float) -> bool:
    return age is not None and not -0.051 < age <= most + 1e-9


class AnythingGoes(RuleBasedStateMachine):
    """Blind safety, and an account of what it was told."""

    def __init__(self) -> None:
        super().__init__()
        self.safety = BlindSafety(LIMITS, SIZE, BOUNDS)
        self.memory = SafetyMemory()
        self.t: float | None = None
        self.before: VelocityCommand = STOP
        self.good = 0
        self.pressed = False

    def tick(
        self, command: VelocityCommand | None, now: BlindSituation, *, must_stop: bool, dt: float
    ) -> None:
        sent = self.safety.check(command, now, self.memory)
        self.pressed = self.pressed or now.stop
        must_stop = must_stop or self.pressed
        self.good = 0 if must_stop else self.good + 1
        assert breaches(sent.command, LIMITS) == []
        assert sent.memory.sent == sent.command
        if must_stop or self.good < BOUNDS.good_ticks or sent.stop is not None:
            assert sent.command == STOP
            assert sent.stop is not None
            assert sent.stop.line
        else:
            assert jumps(self.before, sent.command, dt, LIMITS) == []
            assert sent.asked is not None
            assert sent.memory.going
        self.memory, self.before = sent.memory, sent.command
        if isfinite(now.t):
            self.t = now.t

    @rule(
        command=st.builds(VelocityCommand, st.floats(-1, 1), st.floats(-3, 3)), n=st.integers(1, 9)
    )
    def drive(self, command: VelocityCommand, n: int) -> None:
        """Well-behaved ticks."""
        for _ in range(n):
            first, t = self.t is None, 0.0 if self.t is None else self.t + 0.05
            now = BlindSituation(
                t,
                uv=(640.0, 400.0),
                seen_t=t - 0.1,
                uv_dot=(100 * self.before.v, 0.0),
                step_px=(100.0, 0.0),
                speed_mps=self.before.v,
                turn_radps=self.before.omega,
                robot_t=t,
            )
            self.tick(command, now, must_stop=first, dt=0.05)

    @rule(
        command=commands,
        dt=st.sampled_from([0.05] * 6 + [0.001, 0.2, 0.3, 5.0, 0.0, -0.1, nan, inf]),
        uv=pairs,
        uv_dot=pairs,
        step_px=pairs,
        told=st.tuples(st.none() | speeds, st.none() | speeds),
        heard=st.tuples(ages, ages, ages, ages),
        texts=st.tuples(*[st.sampled_from(["", "", "", "too near"])] * 3),
        stop=st.sampled_from([False] * 9 + [True]),
    )
    def anything(
        self,
        *,
        command: VelocityCommand | None,
        dt: float,
        uv: tuple[float, float] | None,
        uv_dot: tuple[float, float] | None,
        step_px: tuple[float, float] | None,
        told: tuple[float | None, float | None],
        heard: tuple[float | None, ...],
        texts: tuple[str, str, str],
        stop: bool,
    ) -> None:
        """One tick in which all may be wrong."""
        first, t = self.t is None, (self.t or 0.0) + dt
        frame, operator, robot, seen = heard
        now = BlindSituation(
            t,
            uv,
            None if seen is None else t - seen,
            uv_dot,
            step_px,
            *told,
            frame_t=None if frame is None else t - frame,
            operator_t=None if operator is None else t - operator,
            robot_t=None if robot is None else t - robot,
            stop=stop,
            disobeys=texts[0],
            separation=texts[1],
            trouble=texts[2],
        )
        if texts[0] and isfinite(t):
            self.pressed = True  # latched like STOP
        said = [*(uv or ()), *(uv_dot or ()), *(step_px or ()), *(k for k in told if k is not None)]
        bad = [
            first or not 0 < t - (self.t or 0.0) <= BOUNDS.tick_s,
            not isfinite(t),
            any(texts),
            command is None or not command.finite,
            uv is None or seen is None or stale(seen, BOUNDS.track_s),
            not all(map(isfinite, said)),
            stale(frame, BOUNDS.camera_s),
            stale(operator, BOUNDS.operator_s),
            stale(robot, BOUNDS.robot_s),
        ]
        self.tick(command, now, must_stop=any(bad), dt=t - (self.t or 0.0))

    @rule(v=st.floats(0.1, 0.5), n=st.integers(6, 12), back=st.booleans())
    def beside_the_border(self, v: float, n: int, *, back: bool) -> None:
        """Ahead leads out of the image: only backwards is let pass."""
        for _ in range(n):
            first, t = self.t is None, 0.0 if self.t is None else self.t + 0.05
            now = BlindSituation(t, (4.0, 400.0), t - 0.1, step_px=(-300.0, 0.0), robot_t=t)
            command = VelocityCommand(-v if back else v, 0.0)
            self.tick(command, now, must_stop=first, dt=0.05)
            assert self.before.v <= 0.02

    @rule()
    def release(self) -> None:
        """Let go of what is latched."""
        if self.memory.latched:
            self.good = 0
        self.memory = self.memory.released()
        self.pressed = False

    @invariant()
    def what_is_latched_stays(self) -> None:
        if self.pressed:
            assert self.memory.latched
        assert len(self.memory.stops) <= 200


AnythingGoes.TestCase.settings = settings(max_examples=25, stateful_step_count=20)
TestAnythingGoes = AnythingGoes.TestCase

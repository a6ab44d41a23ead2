"""Whatever controllers, links, clocks and people do: what is sent is within the limits, and causes stop at once.

The judge here knows the safety layer's promises, not its code: it keeps its own account of what went in and came out.
"""

from __future__ import annotations

from math import inf, isfinite, nan
from typing import Any

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from airground.control import STOP, Floor, Limits, RobotState, VelocityCommand
from airground.control.safety.bounds import SafetyBounds
from airground.control.safety.layer import SafetyLayer
from airground.control.safety.types import SafetyMemory, Sent, Situation
from airground.control.separation.fence import Fence
from airground.geometry import LimitedHomography
from airground.sim import demo_world
from limits_judge import breaches, jumps

CAMERA = demo_world().camera
FLOOR = Floor(LimitedHomography(CAMERA.g), np.array([640.0, 400.0]))
FENCE = Fence(FLOOR, (np.array([[100.0, 200.0], [1200.0, 200.0], [1200.0, 700.0], [50.0, 700.0]]),))
LIMITS = Limits(turn_radius_m=0.1, lateral_acceleration_mps2=0.4)
BOUNDS = SafetyBounds()
SURE = np.diag([1e-4] * 5)
WILD: list[Any] = [nan, inf, -inf, 0.0, 1e308, -1e308, 1e-320, -7.0]

wild = st.sampled_from(WILD)
speeds = st.floats(-1.0, 1.0) | wild
commands = st.none() | st.builds(VelocityCommand, speeds, speeds, st.just(0.0) | speeds)
heard = st.sampled_from([0.1, 0.1, 0.1, 0.45, 0.6, 1.2, -0.01, -0.3, nan, inf, -inf, None])
ticks = st.sampled_from([0.05] * 6 + [0.001, 0.2, 0.3, 5.0, 0.0, -0.1, nan, inf])
matrices = st.sampled_from([SURE] * 4 + [None, SURE * nan, SURE * 300, -SURE, SURE * 1e308])


LOST = np.diag([1e-4, 1e-4, 3.3, 1.0, 1.0])  # the place is known, the heading is not


class AnythingGoes(RuleBasedStateMachine):
    """A layer, and an account of what it was told."""

    def __init__(self) -> None:
        super().__init__()
        covariance = np.diag((1e-3 * CAMERA.g.ravel()) ** 2)
        self.layer = SafetyLayer(FLOOR, LIMITS, covariance, BOUNDS, FENCE, (1280, 720))
        self.memory = SafetyMemory()
        self.t: float | None = None  # of the last tick with a time
        self.before: VelocityCommand = STOP
        self.good = 0
        self.pressed = False
        self.xy = np.array([0.0, 0.0])
        self.theta = 0.0

    def tick(
        self, command: VelocityCommand | None, now: Situation, *, must_stop: bool, dt: float
    ) -> None:
        sent = self.layer.check(command, now, self.memory)
        self.pressed = self.pressed or now.stop
        must_stop = must_stop or self.pressed
        self.good = 0 if must_stop else self.good + 1
        self.judge(sent, dt, stopped=must_stop or self.good < BOUNDS.good_ticks)
        self.memory = sent.memory
        self.before = sent.command
        if isfinite(now.t):
            self.t = now.t

    def judge(self, sent: Sent, dt: float, *, stopped: bool) -> None:
        assert breaches(sent.command, LIMITS) == []
        assert sent.memory.sent == sent.command
        if stopped or sent.stop is not None:
            assert sent.command == STOP
            assert sent.stop is not None
            assert sent.stop.line
        else:
            assert jumps(self.before, sent.command, dt, LIMITS) == []
            assert sent.asked is not None
            assert sent.memory.going

    @rule(
        command=st.builds(VelocityCommand, st.floats(-1, 1), st.floats(-3, 3)), n=st.integers(1, 9)
    )
    def drive(self, command: VelocityCommand, n: int) -> None:
        """Well-behaved ticks; the robot does what it is told."""
        for _ in range(n):
            t = 0.0 if self.t is None else self.t + 0.05
            first = self.t is None
            turn = self.before.omega * 0.05
            middle = self.theta + turn / 2
            self.xy = self.xy + 0.05 * self.before.v * np.array([np.cos(middle), np.sin(middle)])
            self.theta += turn
            state = RobotState(
                t,
                FLOOR.pixel(self.xy),
                self.theta,
                self.before.v,
                self.before.omega,
                covariance=SURE,
                seen_t=t - 0.1,
            )
            self.tick(command, Situation(t, state), must_stop=first, dt=0.05)

    @rule(
        command=commands,
        dt=ticks,
        uv=st.tuples(*[st.sampled_from([640.0, 400.0, 3.0, 719.0, -900.0, nan, 1e308])] * 2),
        numbers=st.tuples(*[st.sampled_from([0.0, 0.0, 0.0, 0.3, nan, inf, 1e308])] * 4),
        matrix=matrices,
        ages=st.tuples(heard, heard, heard, heard),
        texts=st.tuples(*[st.sampled_from(["", "", "", "too near"])] * 2),
        stop=st.sampled_from([False] * 9 + [True]),
        known=st.sampled_from([True] * 9 + [False]),
    )
    def anything(
        self,
        *,
        command: VelocityCommand | None,
        dt: float,
        uv: tuple[float, float],
        numbers: tuple[float, float, float, float],
        matrix: Any,
        ages: tuple[float | None, ...],
        texts: tuple[str, str],
        stop: bool,
        known: bool,
    ) -> None:
        """One tick in which all may be wrong."""
        first, t = self.t is None, (self.t or 0.0) + dt
        frame, operator, robot, seen = ages
        theta, v, omega, late = numbers
        state = (
            RobotState(
                t + late,
                np.array(uv),
                theta,
                v,
                omega,
                covariance=matrix,
                seen_t=-inf if seen is None else t - seen,
            )
            if known
            else None
        )
        now = Situation(
            t,
            state,
            frame_t=None if frame is None else t - frame,
            operator_t=None if operator is None else t - operator,
            robot_t=None if robot is None else t - robot,
            stop=stop,
            separation=texts[0],
            trouble=texts[1],
        )
        bad = [
            first or not 0 < t - (self.t or 0.0) <= BOUNDS.tick_s,
            not isfinite(t),
            any(texts),
            command is None or not command.finite,
            state is None or seen is None or not -0.051 < t - (t - seen) <= BOUNDS.track_s + 1e-9,
            not all(map(isfinite, (*uv, *numbers))),
            matrix is None or not np.isfinite(matrix).all() or not 0 < matrix[0, 0] < 0.02,
            not (0 <= uv[0] <= 1280 and 0 <= uv[1] <= 720),
        ]
        for age, most in ((frame, BOUNDS.camera_s), (operator, BOUNDS.operator_s), (robot, 0.5)):
            bad.append(age is not None and not -0.051 < age <= most + 1e-9)
        self.tick(command, now, must_stop=any(bad), dt=t - (self.t or 0.0))

    @rule(command=commands, n=st.integers(1, 7))
    def search(self, command: VelocityCommand | None, n: int) -> None:
        """The heading is unknown: straight on and slow, from rest, or not at all."""
        for _ in range(n):
            first, t = self.t is None, 0.0 if self.t is None else self.t + 0.05
            where = FLOOR.pixel(self.xy)
            state = RobotState(t, where, nan, nan, nan, covariance=LOST, seen_t=t - 0.1)
            fast = abs(self.before.v) > BOUNDS.search_mps or self.before.omega != 0
            nothing = command is None or not command.finite
            self.tick(
                command,
                Situation(t, state, searching=True),
                must_stop=first or fast or nothing,
                dt=0.05,
            )
            assert abs(self.before.v) <= BOUNDS.search_mps
            assert self.before.omega == self.before.lateral == 0

    @rule()
    def release(self) -> None:
        """Let go of what is latched."""
        if self.memory.latched:
            self.good = 0
        self.memory = self.memory.released()
        self.pressed = False

    @invariant()
    def remembers_every_kind(self) -> None:
        assert len(self.memory.stops) <= 200
        assert {s.reason for s in self.memory.stops} <= set(self.memory.counts)


AnythingGoes.TestCase.settings = settings(max_examples=25, stateful_step_count=20)
TestAnythingGoes = AnythingGoes.TestCase

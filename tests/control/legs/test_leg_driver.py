"""The state machine by itself: a robot that does at once what it is told, in an image where a metre is 200 px."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, hypot, inf, isfinite, nan, pi, radians, sin
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.control import STOP, Limits
from airground.control.legs import DriveLeg, LegDriveOptions, LegDriver, LegInput, LegTick
from airground.errors import InputError
from limits_judge import breaches, jumps

DT = 0.02
SIZE = (1280, 720)
SCALE = 200.0  # px/m; v points down, headings count counter-clockwise


@dataclass(slots=True)
class Table:
    """The robot, seen from above."""

    driver: LegDriver
    uv: tuple[float, float] = (640.0, 360.0)
    theta: float = 0.0
    t: float = 0.0
    ticks: list[LegTick] = field(default_factory=list)
    way: list[tuple[float, float]] = field(default_factory=list)
    blocked: bool = False

    def step(self, **changed: Any) -> LegTick:
        last = self.ticks[-1].command if self.ticks else STOP
        self.theta += last.omega * DT
        v = 0.0 if self.blocked else last.v
        du, dv = SCALE * v * cos(self.theta), -SCALE * v * sin(self.theta)
        self.uv = (self.uv[0] + du * DT, self.uv[1] + dv * DT)
        self.t += DT
        now = LegInput(self.t, DT, SIZE, self.theta, last.v, self.t, uv=self.uv, uv_dot=(du, dv))
        self.ticks.append(self.driver.tick(replace(now, **changed)))
        self.way.append(self.uv)
        return self.ticks[-1]

    def drive(self, leg: DriveLeg, most_s: float = 60.0, **changed: Any) -> LegTick:
        self.driver.give(leg)
        for _ in range(round(most_s / DT)):
            if self.step(**changed).wants_leg:
                break
        return self.ticks[-1]

    def phases(self) -> list[str]:
        names = [tick.phase for tick in self.ticks]
        return [b for a, b in zip(["", *names], names, strict=False) if a != b]

    def inside_px(self) -> float:
        return min(min(u, SIZE[0] - 1 - u, v, SIZE[1] - 1 - v) for u, v in self.way)


def table(limits: Limits | None = None, **where: Any) -> Table:
    return Table(LegDriver(limits or Limits()), **where)


def moved_m(one: Table) -> float:
    (a, b), (c, d) = one.way[0], one.way[-1]
    return hypot(c - a, d - b) / SCALE


def test_drives_a_leg_and_asks_for_the_next() -> None:
    one = table()
    assert one.step().wants_leg
    last = one.drive(DriveLeg(radians(60), 0.8))
    assert one.phases() == ["wait", "turn", "drive", "settle", "wait"]
    assert moved_m(one) == pytest.approx(0.8, abs=0.02)
    assert one.theta == pytest.approx(radians(60), abs=radians(2))
    assert not last.aborted
    assert last.wants_leg
    (driven,) = one.driver.driven
    assert driven.whole
    assert driven.length_m == pytest.approx(0.8, abs=0.02)


def test_commands_are_within_the_limits_and_change_smoothly() -> None:
    limits = Limits(speed_mps=0.4)
    one = table(limits)
    one.drive(DriveLeg(radians(-130), 1.0))
    one.drive(DriveLeg(radians(100), 3.0))  # too far: it backs out
    before = STOP
    for tick in one.ticks:
        assert breaches(tick.command, limits) == []
        assert jumps(before, tick.command, DT, limits) == []
        before = tick.command


def test_the_first_metres_are_slow_until_it_is_known_how_far_they_go_in_the_image() -> None:
    one = Table(LegDriver(Limits(), LegDriveOptions(careful_mps=0.05)))
    one.drive(DriveLeg(0.0, 0.6))
    speeds = [tick.command.v for tick in one.ticks if tick.phase == "drive"]
    assert max(speeds[:30]) <= 0.05
    assert max(speeds) == pytest.approx(LegDriveOptions().speed_mps)
    one.drive(DriveLeg(0.0, 0.6, 0.2))
    assert max(tick.command.v for tick in one.ticks[-60:]) <= 0.2


def test_a_leg_out_of_the_image_is_given_up_and_backed_out_of() -> None:
    one = table(uv=(1000.0, 360.0))
    last = one.drive(DriveLeg(0.0, 3.0))
    assert one.phases() == ["turn", "drive", "brake", "back", "wait"]
    assert last.aborted
    assert "border" in last.line
    assert one.inside_px() > 40
    assert one.uv[0] < 1279 - 40 - 0.08 * 720 + 10
    assert not one.driver.driven[-1].whole
    assert one.theta == pytest.approx(0.0, abs=0.02)
    # The next leg begins without the old one's trouble.
    assert not one.drive(DriveLeg(pi, 0.5)).aborted


def test_without_reverse_it_turns_round_to_come_back() -> None:
    one = table(Limits(reverse_mps=0.0), uv=(1000.0, 360.0))
    last = one.drive(DriveLeg(0.0, 3.0))
    assert one.phases() == ["turn", "drive", "brake", "turn", "back", "wait"]
    assert last.aborted
    assert one.inside_px() > 40
    assert all(tick.command.v >= 0 for tick in one.ticks)
    assert cos(one.theta) == pytest.approx(-1, abs=0.01)


def test_a_car_that_cannot_reverse_asks_for_a_person() -> None:
    one = table(Limits(reverse_mps=0.0, turn_radius_m=0.5), uv=(1000.0, 360.0))
    last = one.drive(DriveLeg(0.0, 3.0))
    assert last.aborted
    assert "by hand" in last.line
    assert last.command == STOP


def test_a_car_turns_on_an_arc() -> None:
    limits = Limits(turn_radius_m=0.5)
    one = table(limits)
    last = one.drive(DriveLeg(radians(90), 0.5))
    assert not last.aborted
    turn = [tick.command for tick in one.ticks if tick.phase == "turn"]
    assert all(abs(c.omega) <= abs(c.v) / 0.5 + 1e-9 for c in turn)
    assert one.theta == pytest.approx(radians(90), abs=radians(2))


def test_a_car_with_no_room_for_its_arc_goes_to_and_fro() -> None:
    one = table(Limits(turn_radius_m=0.8), uv=(1150.0, 360.0))
    last = one.drive(DriveLeg(radians(120), 0.4))
    turn = [tick.command.v for tick in one.ticks if tick.phase == "turn"]
    assert min(turn) < 0 < max(turn)
    assert not last.aborted
    assert one.inside_px() > 40


def test_something_in_the_way_is_not_touched() -> None:
    other = (900.0, 360.0, 80.0)
    one = table()
    last = one.drive(DriveLeg(0.0, 3.0), others=(other,))
    assert last.aborted
    assert "something else" in last.line
    assert min(hypot(u - other[0], v - other[1]) for u, v in one.way) > 80
    # What lies behind does not matter, nor what it leaves.
    one = table()
    assert not one.drive(DriveLeg(0.0, 0.5), others=((500.0, 360.0, 200.0),)).aborted


def test_it_stands_while_its_mark_is_not_seen_and_goes_on_after() -> None:
    one = table()
    one.driver.give(DriveLeg(0.0, 0.8))
    for _ in range(100):
        one.step()
    assert one.ticks[-1].command.v > 0
    for missing in ({"uv": None}, {"seen_t": one.t - 1.0}, {"uv": (nan, 3.0)}):
        for _ in range(40):
            one.step(**missing)
        assert one.ticks[-1].phase == "lost"
        assert one.ticks[-1].command == STOP
        assert "mark" in one.ticks[-1].line
    while not one.step().wants_leg:
        pass
    assert moved_m(one) == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize("silent", [{"heading_rad": None}, {"speed_mps": nan}, {"reading_t": -1.0}])
def test_it_stands_while_the_robot_tells_nothing(silent: dict[str, Any]) -> None:
    one = table()
    one.driver.give(DriveLeg(0.0, 0.8))
    for _ in range(50):
        one.step()
    for _ in range(60):
        one.step(**silent)
    assert one.ticks[-1].phase == "lost"
    assert one.ticks[-1].command == STOP
    assert "neither" in one.ticks[-1].line


def test_a_mark_that_does_not_move_with_the_robot_is_not_driven_by() -> None:
    one = table()
    last = one.drive(DriveLeg(0.0, 1.0), uv=(640.0, 360.0), uv_dot=(0.0, 0.0))
    assert last.aborted
    assert "mark does not move" in last.line
    assert moved_m(one) < 0.3


def test_a_robot_that_does_not_do_what_it_is_told_is_given_up() -> None:
    one = table()
    assert "does not drive" in one.drive(DriveLeg(0.0, 1.0), speed_mps=0.0).line
    one = table()
    assert "does not turn" in one.drive(DriveLeg(1.0, 1.0), heading_rad=0.0).line
    assert one.ticks[-1].aborted
    assert one.ticks[-1].wants_leg


def test_while_it_is_held_time_does_not_run() -> None:
    one = table()
    one.driver.give(DriveLeg(0.0, 0.5))
    one.step()
    for _ in range(500):
        one.step(held=True, speed_mps=0.0, uv=(640.0, 360.0), uv_dot=(0.0, 0.0))
        assert abs(one.ticks[-1].command.v) <= Limits().acceleration_mps2 * DT + 1e-12
    assert not one.ticks[-1].aborted
    assert not one.drive(DriveLeg(0.0, 0.5)).aborted


def test_cancel_comes_to_rest() -> None:
    one = table()
    one.driver.give(DriveLeg(0.0, 3.0))
    for _ in range(120):
        one.step()
    one.driver.cancel()
    for _ in range(40):
        one.step()
    assert one.ticks[-1].command == STOP
    assert one.ticks[-1].wants_leg
    assert one.driver.leg is None


def test_the_same_inputs_give_the_same_commands() -> None:
    first, second = table(uv=(900.0, 200.0)), table(uv=(900.0, 200.0))
    for one in (first, second):
        one.drive(DriveLeg(1.0, 2.0))
    assert first.ticks == second.ticks


wild = st.sampled_from([nan, inf, -inf, 0.0, 1e308, -3.0, 640.0]) | st.floats(-10, 1500)
pair = st.none() | st.tuples(wild, wild)


@given(
    st.lists(
        st.tuples(wild, wild, st.none() | wild, st.none() | wild, st.none() | wild, pair, pair),
        max_size=6,
    ),
    st.sampled_from([0.0, 0.5]),
)
def test_whatever_it_is_told_its_command_is_finite_and_within_the_limits(
    told: list[tuple[Any, ...]], radius: float
) -> None:
    limits = Limits(turn_radius_m=radius)
    one = table(limits)
    one.driver.give(DriveLeg(0.02, 0.8))
    for _ in range(8):
        one.step()
    for t, dt, heading, speed, read_t, uv, uv_dot in told:
        now = LegInput(t, dt, SIZE, heading, speed, read_t, uv=uv, uv_dot=uv_dot)
        command = one.driver.tick(now).command
        assert isfinite(command.v + command.omega)
        assert breaches(command, limits) == []


def test_wrong_legs_and_options_are_refused() -> None:
    for heading, length, speed in ((nan, 1.0, None), (0.0, 0.0, None), (0.0, 1.0, -1.0)):
        with pytest.raises(InputError, match="must be"):
            DriveLeg(heading, length, speed)
    with pytest.raises(InputError, match="careful_mps"):
        LegDriveOptions(careful_mps=0.0)
    with pytest.raises(InputError, match="latency_s"):
        LegDriveOptions(latency_s=-1.0)

"""Robots that the filter keeps apart, in a simulation of its own."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, inf, nan, pi, sin

import numpy as np
import pytest

from airground.control import STOP, Limits, RobotState, VelocityCommand
from airground.control.separation.filter import SeparationFilter
from airground.control.separation.types import Body, Passerby, Separation
from airground.errors import InputError
from fleets import CAR, DT, FLOOR, SUBSTEPS, body, driven, fenced


def homeward(one: Body, goal: np.ndarray) -> VelocityCommand:
    way = goal - np.array(one.xy)
    distance = hypot(*way)
    if distance < 0.05:
        return STOP
    away = (np.arctan2(way[1], way[0]) - one.theta + pi) % (2 * pi) - pi
    pace = min(one.limits.speed_mps, 0.9 * distance)
    if one.omnidirectional:
        return VelocityCommand(pace * cos(away), 0.0, pace * sin(away))
    least = 0.3 if one.limits.turn_radius_m else 0.0
    return VelocityCommand(pace * max(least, cos(away)), float(np.clip(2 * away, -1.5, 1.5)))


def drive(
    guard: SeparationFilter,
    bodies: list[Body],
    goals: np.ndarray,
    *,
    limit_s: float = 30.0,
    aims: bool = True,
) -> tuple[list[Body], float, float, np.ndarray]:
    """Bodies at the end, least gap of discs, least clearance of middles, and all places."""
    gap, clear, track = inf, inf, []
    i, j = np.triu_indices(len(bodies), 1)
    radius = np.array([one.radius_m for one in bodies])
    for _ in range(round(limit_s / DT)):
        wanted = [homeward(one, goal) for one, goal in zip(bodies, goals, strict=True)]
        known = [tuple(goal.tolist()) for goal in goals] if aims else None
        answer = guard.step(bodies, wanted, DT, aims=known)
        steps = [driven(one, c) for one, c in zip(bodies, answer.commands, strict=True)]
        bodies = [one for one, _ in steps]
        places = np.array([p for _, p in steps]).transpose(1, 0, 2)
        if len(i):
            apart = np.hypot(*(places[:, i] - places[:, j]).transpose(2, 0, 1))
            gap = min(gap, float((apart - radius[i] - radius[j]).min()))
        if guard.fence is not None:
            clear = min(clear, float((guard.fence.clearance(places) - radius).min()))
        track.append(places[-1])
        if all(hypot(*(np.array(b.xy) - g)) < 0.1 for b, g in zip(bodies, goals, strict=True)):
            break
    return bodies, gap, clear, np.array(track)


def arrived(bodies: list[Body], goals: np.ndarray) -> int:
    return sum(hypot(*(np.array(b.xy) - g)) < 0.1 for b, g in zip(bodies, goals, strict=True))


# Whole drives


def crossing(rng: np.random.Generator, count: int) -> tuple[list[Body], np.ndarray]:
    """Robots of all kinds on a circle, each with its goal nearly opposite."""
    angle = 2 * pi * np.arange(count) / count + rng.uniform(-0.15, 0.15, count)
    place = 2.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    goal = -1.9 * np.column_stack([np.cos(angle + 0.1), np.sin(angle + 0.1)])
    bodies = []
    for k, (x, y) in enumerate(place.tolist()):
        theta = float(np.arctan2(-y, -x) + rng.normal(0, 0.5))
        kind = k % 3
        limits = CAR if kind == 1 else Limits()
        bodies.append(body(x, y, theta, limits=limits, omnidirectional=kind == 2))
    return bodies, goal


def test_crossing_robots_neither_touch_nor_cross_the_fence_and_nearly_all_arrive(
    rng: np.random.Generator,
) -> None:
    there = 0
    for scene in range(4):
        bodies, goals = crossing(rng, 6)
        lump = np.array([[-0.3, -0.2], [0.3, -0.2], [0.1, 0.3]]) if scene % 3 == 2 else None
        guard = SeparationFilter(fenced() if lump is None else fenced(lump))
        final, gap, clear, _ = drive(guard, bodies, goals, limit_s=18.0, aims=scene % 2 == 0)
        assert gap > 0.02
        assert clear > 0.02
        there += arrived(final, goals) if lump is None else 0
    assert there >= 0.9 * 6 * 3


def test_two_that_face_each_other_pass_by_the_right() -> None:
    for clockwise in (False, True):
        guard = SeparationFilter(clockwise=clockwise)
        bodies = [body(-1.5, 0.0), body(1.5, 0.0, pi)]
        goals = np.array([[1.5, 0.0], [-1.5, 0.0]])
        final, gap, _, track = drive(guard, bodies, goals, limit_s=15.0, aims=False)
        assert arrived(final, goals) == 2
        assert gap > 0.02
        first = track[:, 0]
        side = first[np.argmax(np.abs(first[:, 1])), 1]
        assert (side > 0) == clockwise  # its right is at -y where headings count from x to y
        turns = np.diff(track[:, 0], axis=0)
        heading = np.unwrap(np.arctan2(turns[:, 1], turns[:, 0])[np.hypot(*turns.T) > 5e-3])
        assert np.abs(np.diff(heading)).sum() < 4.0  # no weaving


def test_without_courtesy_two_that_face_each_other_stand() -> None:
    guard = SeparationFilter(courtesy=None)
    goals = np.array([[1.5, 0.0], [-1.5, 0.0]])
    final, gap, _, _ = drive(guard, [body(-1.5, 0.0), body(1.5, 0.0, pi)], goals, limit_s=8.0)
    assert arrived(final, goals) == 0
    assert gap == pytest.approx(guard.margin_m, abs=0.01)  # and no further apart than they must


def test_brakes_before_a_fence_and_comes_near_it() -> None:
    for settle in (0.0, 0.25):
        guard = SeparationFilter(fenced(), settle_s=settle, reaction_s=0.0)
        goals = np.array([[4.0, 0.3]])
        final, _, clear, _ = drive(guard, [body(0.0, 0.3, v=0.5)], goals, limit_s=12.0)
        assert guard.margin_m - 1e-3 < clear < guard.margin_m + 0.01
        assert abs(final[0].v) < 0.01


def test_a_leader_that_stops_dead_is_not_run_into() -> None:
    guard = SeparationFilter()
    bodies = [body(0.0, 0.0, v=0.5), body(0.9, 0.0, v=0.5)]
    for tick in range(60):
        answer = guard.step(bodies, [VelocityCommand(0.5, 0.0)] * 2, DT)
        bodies = [driven(b, c)[0] for b, c in zip(bodies, answer.commands, strict=True)]
        if tick >= 10:  # its wheels lock
            bodies[1] = replace(bodies[1], v=0.0, xy=(bodies[1].xy[0], 0.0))
            if tick == 10:
                stood = bodies[1].xy
            bodies[1] = replace(bodies[1], xy=stood)
        assert bodies[1].xy[0] - bodies[0].xy[0] > 0.4


def test_noise_within_its_deviation_brings_no_contact(rng: np.random.Generator) -> None:
    bodies, goals = crossing(rng, 6)
    guard = SeparationFilter()
    for _ in range(150):
        seen = [
            replace(b, xy=tuple((np.array(b.xy) + rng.normal(0, 0.02, 2)).tolist()), sigma_m=0.02)
            for b in bodies
        ]
        wanted = [homeward(b, g) for b, g in zip(seen, goals, strict=True)]
        told = guard.step(seen, wanted, DT).commands
        bodies = [driven(b, c)[0] for b, c in zip(bodies, told, strict=True)]
        xy = np.array([b.xy for b in bodies])
        i, j = np.triu_indices(len(xy), 1)
        assert np.hypot(*(xy[i] - xy[j]).T).min() > 0.4


def test_a_passerby_is_not_driven_into() -> None:
    guard = SeparationFilter(courtesy=None)
    one = body(0.0, 0.0, v=0.4)
    stood = False
    for tick in range(120):
        other = Passerby((2.0, -3.0 + 0.6 * tick * DT), (0.0, 0.6), radius_m=0.3)
        answer = guard.step([one], [VelocityCommand(0.4, 0.0)], DT, [other])
        stood = stood or "passer-by 0" in answer.robots[0].reason
        one, places = driven(one, answer.commands[0])
        for k, (x, y) in enumerate(places):
            there = other.xy[1] + 0.6 * DT * (k + 1) / SUBSTEPS
            assert hypot(x - 2.0, y - there) > 0.5
    assert stood
    assert one.xy[0] > 2.5  # and goes on behind it


def test_courtesy_steers_round_a_passerby_that_stands() -> None:
    one, guard = body(0.0, 0.02), SeparationFilter()
    for _ in range(150):
        other = Passerby((1.5, 0.0), radius_m=0.25)
        told = guard.step([one], [homeward(one, np.array([3.0, 0.0]))], DT, [other]).commands
        one, places = driven(one, told[0])
        assert min(hypot(x - 1.5, y) for x, y in places) > 0.45
    assert hypot(one.xy[0] - 3.0, one.xy[1]) < 0.1


# Single steps


def only(answer: Separation) -> tuple[VelocityCommand, str]:
    return answer.robots[0].command, answer.robots[0].reason


def test_who_is_alone_gets_what_it_can_reach_and_no_reason() -> None:
    guard = SeparationFilter(fenced())
    command, reason = only(guard.step([body(0, 0, v=0.3)], [VelocityCommand(0.32, 0.2)], DT))
    assert command == VelocityCommand(0.32, 0.2)
    assert reason == ""
    command, reason = only(guard.step([body(0, 0, v=0.3)], [VelocityCommand(9.0, -9.0)], DT))
    assert command.v == pytest.approx(0.35)
    assert command.omega == pytest.approx(-0.4)
    assert reason == ""


def test_a_stop_stays_a_stop_and_nan_is_one() -> None:
    guard = SeparationFilter()
    bodies = [body(0, 0, v=0.5), body(3.0, 0, pi, v=0.5)]
    for told in (STOP, VelocityCommand(nan, 0.0)):
        answer = guard.step(bodies, [told, told], DT)
        assert [c.v for c in answer.commands] == pytest.approx([0.42, 0.42])


def test_a_lost_robot_stops_all() -> None:
    guard = SeparationFilter()
    bodies = [body(0, 0, v=0.5), body(nan, 0, v=0.2), body(9, 9, v=nan)]
    answer = guard.step(bodies, [VelocityCommand(0.5, 0.0)] * 3, DT)
    assert [c.v for c in answer.commands] == pytest.approx([0.42, 0.12, 0.0])
    assert "robot 1" in answer.trouble
    assert all("robot 1" in one.reason for one in answer.robots)
    assert np.isnan(answer.clearance_m)
    gone = Passerby((nan, 0.0))
    assert "passer-by 0" in guard.step(bodies[:1], [STOP], DT, [gone]).trouble


def test_who_is_too_near_may_only_move_away() -> None:
    guard = SeparationFilter(courtesy=None)
    bodies = [body(0, 0), body(0.35, 0, 0.0)]
    ahead, back = VelocityCommand(0.05, 0.0), VelocityCommand(-0.05, 0.0)
    answer = guard.step(bodies, [ahead, ahead], DT)
    assert answer.commands[0].v == pytest.approx(0.0, abs=1e-4)
    assert answer.commands[1].v == pytest.approx(0.05)
    assert answer.robots[0].reason == "may only move away from robot 1"
    assert answer.clearance_m == pytest.approx(-0.05)
    assert guard.step(bodies, [back, ahead], DT).commands[0].v == pytest.approx(-0.05)


@pytest.mark.parametrize("place", [(2.7, 0.0), (0.0, 0.0)])
def test_who_is_where_it_may_not_be_may_only_come_back(place: tuple[float, float]) -> None:
    lump = [[-0.2, -0.5], [1.0, -0.5], [1.0, 0.5], [-0.2, 0.5]]
    guard = SeparationFilter(fenced(lump), courtesy=None)
    further = 0.05 if place[0] > 2 else -0.05
    out = guard.step([body(*place)], [VelocityCommand(abs(further), 0.0)], DT)
    back = guard.step([body(*place)], [VelocityCommand(-abs(further), 0.0)], DT)
    if further < 0:  # in the obstacle, whose nearest side is behind
        out, back = back, out
        out, back = back, out
    assert out.commands[0].v == pytest.approx(0.0, abs=1e-4)
    assert abs(back.commands[0].v) == pytest.approx(0.05)
    assert "may only move away" in out.robots[0].reason
    assert out.clearance_m < 0


def test_wrong_input_is_refused() -> None:
    guard = SeparationFilter()
    with pytest.raises(InputError, match="1 robots but 0 commands"):
        guard.step([body(0, 0)], [], DT)
    with pytest.raises(InputError, match="1 robots but 2 aims"):
        guard.step([body(0, 0)], [STOP], DT, aims=[None, None])
    for dt in (0.0, nan, -1.0):
        with pytest.raises(InputError, match="dt"):
            guard.step([body(0, 0)], [STOP], dt)
    with pytest.raises(InputError, match="margin_m"):
        SeparationFilter(margin_m=-1.0)
    with pytest.raises(InputError, match="radius_m"):
        body(0, 0, radius_m=0.0)
    with pytest.raises(InputError, match="sigma_m"):
        Passerby((0, 0), sigma_m=nan)
    assert guard.step([], [], DT).robots == ()


def test_a_body_is_built_from_what_is_seen() -> None:
    uv = FLOOR.pixel([0.5, -0.3])
    covariance = np.diag([0.01, 0.04, 0.1, 0.1, 0.1])
    state = RobotState(0.0, uv, 0.3, 0.2, 0.1, covariance=covariance)
    one = Body.seen(FLOOR, state, radius_m=0.3, limits=CAR)
    assert one.xy == pytest.approx((0.5, -0.3))
    assert (one.theta, one.v, one.omega, one.radius_m) == (0.3, 0.2, 0.1, 0.3)
    assert one.sigma_m == pytest.approx(0.2)
    beyond = Body.seen(FLOOR, replace(state, uv=np.array([0.0, -1e5])), radius_m=0.3, limits=CAR)
    assert np.isnan(beyond.xy[0])
    unsure = replace(state, covariance=np.full((5, 5), nan))
    assert np.isnan(Body.seen(FLOOR, unsure, radius_m=0.3, limits=CAR).xy[0])

"""Robots that the filter keeps apart, in a simulation of its own; its program against another solver."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, inf, nan, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely  # type: ignore[import-untyped]
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import minimize  # type: ignore[import-untyped]

from airground.control import STOP, Floor, Limits, RobotState, VelocityCommand
from airground.control.fence import Fence
from airground.control.separation import SeparationFilter
from airground.control.separation_qp import nearest
from airground.control.separation_reach import Motion, braked, fleet, reachable, stop_after
from airground.control.separation_rows import Pairs, Segments, certain, gather, segment_gap
from airground.control.separation_types import Body, Passerby, Separation
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import SimCamera

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

DT = 0.1
SUBSTEPS = 8
CAR = Limits(turn_radius_m=0.4)
CAMERA = SimCamera.looking_down(
    focal_length_px=900.0, tilt_rad=0.4, height_m=12.0, image_size_px=(1280, 960)
)
MIDDLE = np.array([640.0, 480.0])
FLOOR = Floor(LimitedHomography(CAMERA.g), MIDDLE)


def fenced(*obstacles: ArrayLike, half: float = 2.5) -> Fence:
    square = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return Fence(FLOOR, (FLOOR.pixel(square),), tuple(FLOOR.pixel(one) for one in obstacles))


def body(x: float, y: float, theta: float = 0.0, v: float = 0.0, **other: object) -> Body:
    return replace(Body((x, y), theta, v, radius_m=0.2), **other)  # type: ignore[arg-type]


def driven(one: Body, told: VelocityCommand) -> tuple[Body, list[tuple[float, float]]]:
    """A robot after a step in which it comes to its command at its limits; its places meanwhile."""
    h, m = DT / SUBSTEPS, one.limits
    (x, y), theta, v, omega, lateral = one.xy, one.theta, one.v, one.omega, one.lateral
    places = []
    for _ in range(SUBSTEPS):
        off, across = told.v - v, told.lateral - lateral
        faster = hypot(told.v, told.lateral) > hypot(v, lateral)
        most = (m.acceleration_mps2 if faster else m.deceleration_mps2) * h
        share = min(1.0, most / max(hypot(off, across), 1e-12))
        v, lateral = v + share * off, lateral + share * across
        turn = m.turn_acceleration_radps2 * h
        omega += min(max(told.omega - omega, -turn), turn)
        theta += omega * h
        x += (v * cos(theta) - lateral * sin(theta)) * h
        y += (v * sin(theta) + lateral * cos(theta)) * h
        places.append((x, y))
    return replace(one, xy=(x, y), theta=theta, v=v, omega=omega, lateral=lateral), places


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
    for scene in range(6):
        bodies, goals = crossing(rng, 6)
        lump = np.array([[-0.3, -0.2], [0.3, -0.2], [0.1, 0.3]]) if scene % 3 == 2 else None
        guard = SeparationFilter(fenced() if lump is None else fenced(lump))
        final, gap, clear, _ = drive(guard, bodies, goals, limit_s=18.0, aims=scene % 2 == 0)
        assert gap > 0.02
        assert clear > 0.02
        there += arrived(final, goals) if lump is None else 0
    assert there >= 0.9 * 6 * 4


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


# The parts

KINDS = [Limits(), CAR, Limits(reverse_mps=0.0, turn_radius_m=0.2)]


@st.composite
def moving(draw: st.DrawFn) -> Body:
    limits = draw(st.sampled_from(KINDS))
    omni = draw(st.booleans()) and limits.turn_radius_m == 0
    v = round(draw(st.floats(-limits.reverse_mps, 0.5)), 6)  # no subnormal numbers: shapely warns
    most = min(1.5, 1.0 / max(abs(v), 0.1))
    most = min(most, abs(v) / limits.turn_radius_m) if limits.turn_radius_m else most
    omega = round(draw(st.floats(-1.0, 1.0)), 6) * most
    lateral = round(draw(st.floats(-0.3, 0.3)), 6) if omni else 0.0
    x, y = (round(draw(st.floats(-1, 1)), 6) for _ in range(2))
    theta = round(draw(st.floats(-3, 3)), 6)
    return Body((x, y), theta, v, omega, lateral, 0.2, 0.0, limits, omni)


@given(st.lists(moving(), min_size=2, max_size=5), st.integers(0, 2**32 - 1))
def test_commands_are_within_limits(bodies: list[Body], seed: int) -> None:
    rng = np.random.default_rng(seed)
    wanted = [VelocityCommand(*row) for row in rng.uniform(-2, 2, (len(bodies), 3)).tolist()]
    for b, c in zip(bodies, SeparationFilter().step(bodies, wanted, DT).commands, strict=True):
        m, slip = b.limits, 1e-7
        old, new = hypot(b.v, b.lateral), hypot(c.v, c.lateral)
        assert c.finite
        assert new <= max(m.speed_mps, old) + slip
        if not b.omnidirectional:
            assert c.lateral == 0
            assert c.v >= -m.reverse_mps - slip
            assert c.v * b.v >= 0
        change = hypot(c.v - b.v, c.lateral - b.lateral)
        assert change <= max(m.acceleration_mps2, m.deceleration_mps2) * DT + slip
        assert new - old <= m.acceleration_mps2 * DT + slip
        if m.turn_radius_m:
            assert abs(c.omega) * m.turn_radius_m <= new + slip
        else:
            assert abs(c.omega - b.omega) <= m.turn_acceleration_radps2 * DT + slip
            calmer = max(abs(b.omega) - m.turn_acceleration_radps2 * DT, 0.0)
            most = min(m.turn_rate_radps, m.lateral_acceleration_mps2 / max(new, 1e-9))
            assert abs(c.omega) <= max(most, calmer) + slip


@given(moving())
def test_who_brakes_stays_in_the_ground_it_was_given(one: Body) -> None:
    robots = fleet([one])
    given_now = stop_after(robots, robots.motion, 0.0, 0.05)
    ground = shapely.LineString([(p.real, p.imag) for p in (given_now.start[0], given_now.end[0])])
    wide = float(given_now.wide[0]) + 2e-3  # half a substep of rounding
    for together in (True, False):  # or each wheel for itself
        now = one
        for _ in range(8):
            share = max(
                0.0, 1 - now.limits.deceleration_mps2 * DT / max(hypot(now.v, now.lateral), 1e-9)
            )
            v, lateral = share * now.v, share * now.lateral
            if not together:
                lose = now.limits.deceleration_mps2 * DT
                v = np.sign(now.v) * max(abs(now.v) - lose, 0.0)
                lateral = np.sign(now.lateral) * max(abs(now.lateral) - lose, 0.0)
            now, places = driven(now, VelocityCommand(v, 0.0, lateral))
            points = shapely.points(places)
            assert (shapely.distance(ground, points) <= wide).all()


@given(st.integers(0, 2**32 - 1))
def test_gaps_of_segments_are_those_of_shapely(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = rng.normal(size=(4, 20)) + 1j * rng.normal(size=(4, 20))
    ends[1, :5] = ends[0, :5]  # points
    ends[3, 3:8] = ends[2, 3:8]
    gap, normal = segment_gap(*ends)
    lines = shapely.linestrings(np.stack([ends.real, ends.imag], axis=-1).swapaxes(0, 1)[:, :2])
    others = shapely.linestrings(np.stack([ends.real, ends.imag], axis=-1).swapaxes(0, 1)[:, 2:])
    assert_allclose(gap, shapely.distance(lines, others), atol=1e-9)
    assert_allclose(np.abs(normal), 1.0)
    apart = gap > 1e-6  # the normal separates them by the gap
    along = (np.conj(normal) * ends).real
    between = along[2:].min(axis=0) - along[:2].max(axis=0)
    assert_allclose(between[apart], gap[apart], atol=1e-9)


def slsqp(
    wanted: np.ndarray, lower: np.ndarray, upper: np.ndarray, rows: np.ndarray, bounds: np.ndarray
) -> np.ndarray:
    found = minimize(
        lambda x: ((x - wanted) ** 2).sum(),
        np.clip(np.zeros_like(wanted), lower, upper),
        jac=lambda x: 2 * (x - wanted),
        bounds=list(zip(lower, upper, strict=True)),
        constraints=[{"type": "ineq", "fun": lambda x: bounds - rows @ x, "jac": lambda _: -rows}],
        method="SLSQP",
        options={"ftol": 1e-13, "maxiter": 300},
    )
    assert found.status in (0, 8)  # 8: no better step can be found
    assert (rows @ found.x < bounds + 1e-9).all()
    return np.asarray(found.x)


def test_the_program_is_solved_as_by_another_solver(rng: np.random.Generator) -> None:
    for _ in range(20):
        wanted, rows = rng.normal(size=6), rng.normal(size=(8, 6))
        bounds = rng.uniform(0.05, 0.5, 8)
        box = np.full(6, 0.8)
        want = slsqp(wanted, -box, box, rows, bounds)
        ours = nearest(wanted, -box, box, rows, bounds)
        assert ours is not None
        assert_allclose(ours, want, atol=1e-5)
    assert nearest(np.zeros(1), -np.ones(1), np.ones(1), np.ones((1, 1)), -2 * np.ones(1)) is None
    soft = nearest(  # (x - 1)^2 + (x - 0.5)^2 / s, by hand
        np.ones(1), np.zeros(1), np.ones(1), np.ones((1, 1)), np.full(1, 0.5), softness=0.1
    )
    assert soft is not None
    assert_allclose(soft, (1 + 0.5 / 0.1) / (1 + 1 / 0.1), atol=1e-6)


def crowd(rng: np.random.Generator) -> list[Body]:
    return [
        body(
            0.55 * k + rng.normal(0, 0.03),
            0.55 * m + rng.normal(0, 0.03),
            rng.uniform(-pi, pi),
            0.3,
        )
        for k in range(3)
        for m in range(2)
    ]


def test_the_change_is_the_least_that_another_solver_finds(rng: np.random.Generator) -> None:
    changed = 0
    for _ in range(10):
        robots = fleet(crowd(rng))
        i, j = np.triu_indices(6, 1)
        full = Motion(np.full(6, 0.5 + 0j), rng.uniform(-1, 1, 6))
        target, brake = reachable(robots, full, DT), braked(robots, DT)
        none, nowhere = np.empty(0, dtype=np.intp), np.empty(0, dtype=np.complex128)
        nobody = Segments(none, nowhere, nowhere, np.empty(0), none)
        base = stop_after(robots, brake, DT, 0.05)
        rows = gather(base, Pairs(i, j, np.full(15, 0.43)), nobody)
        options: dict[str, Any] = {"dt": DT, "reaction_s": 0.05, "gamma": 0.4}
        ours, tight, solved = certain(robots, brake, target, rows, **options)
        theirs, _, _ = certain(robots, brake, target, rows, **options, solve=slsqp)
        assert solved
        assert_allclose(ours.drive, theirs.drive, atol=1e-5)
        assert_allclose(ours.turn, theirs.turn, atol=1e-4)
        changed += int(tight.sum())
        failed, _, solved = certain(robots, brake, target, rows, **options, solve=lambda *_: None)
        assert solved == (not tight.any())
        concerned = np.union1d(i[tight], j[tight])
        assert_allclose(failed.drive[concerned], brake.drive[concerned])
        others = np.setdiff1d(np.arange(6), concerned)
        assert_allclose(failed.drive[others], target.drive[others])
    assert changed > 20

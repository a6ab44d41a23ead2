"""Limits, ground to stop in and the least change, each against another way to know it."""

from __future__ import annotations

from math import hypot, pi
from typing import Any

import numpy as np
import shapely  # type: ignore[import-untyped]
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import nnls  # type: ignore[import-untyped]

from airground.control import Limits, VelocityCommand
from airground.control.separation.filter import SeparationFilter
from airground.control.separation.qp import nearest
from airground.control.separation.reach import Motion, braked, fleet, reachable, stop_after
from airground.control.separation.rows import (
    Pairs,
    Segments,
    certain,
    gather,
    point_gap,
    segment_gap,
)
from airground.control.separation.types import Body
from fleets import CAR, DT, body, driven

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


@given(st.integers(0, 2**32 - 1))
def test_a_point_is_a_segment_without_length(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, c, d = rng.normal(size=(3, 12)) + 1j * rng.normal(size=(3, 12))
    d[:3] = c[:3]
    p[2:5] = (c[2:5] + 2 * d[2:5]) / 3  # on the segment
    for ours, theirs in zip(point_gap(p, c, d), segment_gap(p, p, c, d), strict=True):
        assert_allclose(ours, theirs, atol=1e-9)


def by_nnls(
    wanted: np.ndarray, lower: np.ndarray, upper: np.ndarray, rows: np.ndarray, bounds: np.ndarray
) -> np.ndarray:
    """The same program by Lawson and Hanson's least distance programming (Solving Least Squares Problems, ch. 23)."""
    unit = np.eye(len(wanted))
    G = -np.vstack([rows, unit, -unit])
    h = -(np.concatenate([bounds, upper, -lower]) + G @ wanted)
    E = np.vstack([G.T, h])
    f = np.zeros(len(E))
    f[-1] = 1.0
    u, _ = nnls(E, f)
    r = E @ u - f
    return np.asarray(wanted - r[:-1] / r[-1])


def test_the_program_is_solved_as_by_another_solver(rng: np.random.Generator) -> None:
    for _ in range(20):
        wanted, rows = rng.normal(size=6), rng.normal(size=(8, 6))
        bounds = rng.uniform(0.05, 0.5, 8)
        box = np.full(6, 0.8)
        want = by_nnls(wanted, -box, box, rows, bounds)
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
        theirs, _, _ = certain(robots, brake, target, rows, **options, solve=by_nnls)
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


def test_a_program_without_rows_is_its_box() -> None:
    found = nearest(np.array([2.0, 0.3]), np.zeros(2), np.ones(2), np.empty((0, 2)), np.empty(0))
    assert found is not None
    assert_allclose(found, [1.0, 0.3])

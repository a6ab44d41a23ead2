"""Residuals are zero at the truth, and every column of the Jacobian is a difference of residuals."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration.trajectory.rows import (
    LEAST_PART,
    odometry_rows,
    residuals,
    sighting_rows,
)
from airground.calibration.trajectory.state import Free, Layout, Robot, State
from arcs import Drive, arcs_under, drive
from scenes import scene

if TYPE_CHECKING:
    from scenes import Array

ALL = Free(offset=True, lens=True, turn=(0, 1), lever=(0, 1), slip=True, drift=True)


def full_drive(
    *, handedness: str = "right", reading: str = "speed", k1: float = -0.03, lever: bool = True
) -> Drive:
    """Two robots with every nuisance at once, free of noise."""
    camera = scene(tilt_deg=45.0, heading_deg=20.0, handedness=handedness, frame_heading_deg=-70.0)
    levers = ((0.3, -0.2), (-0.5, 0.4)) if lever else ((0.0, 0.0), (0.0, 0.0))
    arcs = arcs_under(camera, 2, turn=(0.3, -2.0), scale=(0.04, -0.06), lever=levers)
    return drive(camera, arcs, count=7, offset=0.21, k1=k1, reading=reading, reading_hz=100.0)


def moved(state: State, layout: Layout, number: int, change: Array, free: Free) -> State:
    """Add to the local unknowns of one robot, sighting by sighting, and then to its global ones."""
    robot = state.robots[number]
    local, border = np.split(change, [len(robot.xy) * free.width])
    local = local.reshape(len(robot.xy), free.width)
    own = dict(zip(layout.columns(number), border, strict=True))

    def at(place: int | None) -> float:
        return 0.0 if place is None else float(own[place])

    lever = layout.lever(number)
    new = Robot(
        xy=robot.xy + local[:, :2],
        drift=robot.drift + (local[:, 2] if free.drift else 0.0),
        slip=robot.slip + (local[:, free.width - 1] if free.slip else 0.0),
        turn=robot.turn + at(layout.turn(number)),
        scale=robot.scale + at(layout.own(number)),
        lever=(
            robot.lever[0] + at(lever),
            robot.lever[1] + at(None if lever is None else lever + 1),
        ),
    )
    robots = list(state.robots)
    robots[number] = new
    return State(
        g=state.g + np.array([own[k] for k in range(6)]).reshape(3, 2),
        offset=state.offset + at(layout.offset),
        robots=tuple(robots),
        bend=state.bend + at(layout.bend),
    )


def differences(
    case: Drive, state: State, free: Free, number: int
) -> tuple[Array, Array, Array, Array]:
    """(2 N, X), (2 L, X) by central differences, and both residuals."""
    layout, chain = Layout(free, len(case.chains)), case.chains[number]
    size = len(chain) * free.width + len(layout.columns(number))

    def at(change: Array) -> tuple[Array, Array]:
        s = moved(state, layout, number, change, free)
        r = residuals(case.view, chain, chain.odometry(s.offset), s, s.robots[number])
        return r.sighting.ravel(), r.odometry.ravel()

    h = 1e-5
    columns = [
        [(a - b) / (2 * h) for a, b in zip(at(h * e), at(-h * e), strict=True)]
        for e in np.eye(size)
    ]
    seen, driven = (np.stack([c[k] for c in columns], axis=1) for k in (0, 1))
    return seen, driven, *at(np.zeros(size))


def dense(case: Drive, state: State, free: Free, number: int) -> tuple[Array, Array, Array, Array]:
    """The same from the rows, put where they belong one by one."""
    layout, chain = Layout(free, len(case.chains)), case.chains[number]
    odometry, robot = chain.odometry(state.offset), state.robots[number]
    seen = sighting_rows(case.view, chain, odometry, state, robot, layout=layout, number=number)
    driven = odometry_rows(chain, odometry, robot, layout=layout, number=number)
    width, count = free.width, len(chain)
    border = len(layout.columns(number))
    J = np.zeros((2 * count, count * width + border))
    K = np.zeros((2 * len(driven.first), count * width + border))
    for k in range(count):
        J[2 * k : 2 * k + 2, width * k : width * (k + 1)] = -seen.local[k]  # of a prediction
        J[2 * k : 2 * k + 2, count * width :] = -seen.border[k]
    for row, first in enumerate(driven.first):
        K[2 * row : 2 * row + 2, width * first : width * (first + 1)] += driven.start[row]
        K[2 * row : 2 * row + 2, width * (first + 1) : width * (first + 1) + 2] += driven.end[row]
        K[2 * row : 2 * row + 2, count * width :] = driven.border[row]
    return J, K, seen.residual.ravel(), driven.residual.ravel()


def off_truth(case: Drive, rng: np.random.Generator, size: float = 0.02) -> State:
    """Every unknown a little off, and drift and slip that are not zero."""
    robots = tuple(
        Robot(
            xy=r.xy + rng.normal(0.0, size, r.xy.shape),
            drift=rng.normal(0.0, size, len(r.xy)),
            slip=rng.normal(0.0, size, len(r.xy)),
            turn=r.turn + rng.normal(0.0, size),
            scale=r.scale + rng.normal(0.0, size),
            lever=(r.lever[0] + size, r.lever[1] - size),
        )
        for r in case.truth.robots
    )
    g = case.truth.g * (1 + rng.normal(0.0, size, (3, 2)))
    return replace(case.truth, g=g, robots=robots, bend=case.truth.bend * 0.9)


@pytest.mark.parametrize("handedness", ["right", "left"])
@pytest.mark.parametrize("reading", ["speed", "xy_dot"])
def test_residuals_are_zero_at_the_truth(handedness: str, reading: str) -> None:
    case = full_drive(handedness=handedness, reading=reading)
    for chain, robot in zip(case.chains, case.truth.robots, strict=True):
        odometry = chain.odometry(case.truth.offset)
        found = residuals(case.view, chain, odometry, case.truth, robot)
        # Readings 0.01 s apart, and lines between them.
        assert_allclose(found.sighting, 0.0, atol=2e-3)  # px
        assert_allclose(found.odometry, 0.0, atol=2e-5)


@pytest.mark.parametrize("handedness", ["right", "left"])
@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize(
    "free",
    [
        ALL,
        replace(ALL, drift=False),
        replace(ALL, slip=False),
        Free(offset=False, turn=(1,)),
        Free(offset=False, lens=True, lever=(0,), drift=True),
    ],
    ids=["all", "no drift", "no slip", "few", "some"],
)
def test_every_column_is_a_difference(
    handedness: str, number: int, free: Free, rng: np.random.Generator
) -> None:
    case = full_drive(handedness=handedness)
    state = off_truth(case, rng)
    seen, driven, z, o = differences(case, state, free, number)
    J, K, residual, increment = dense(case, state, free, number)
    assert_allclose(residual, z, rtol=1e-12)
    assert_allclose(increment, o, rtol=1e-9, atol=1e-12)
    size = np.abs(seen).max(axis=0) + 1e-3
    assert_allclose(J / size, seen / size, atol=1e-6)
    layout = Layout(free, 2)
    keep = np.ones(K.shape[1], dtype=bool)
    if layout.offset is not None:  # see the next test
        keep[len(case.chains[number]) * free.width + layout.offset] = False
    size = np.abs(driven).max(axis=0) + 1e-3
    assert_allclose((K / size)[:, keep], (driven / size)[:, keep], atol=1e-6)


@pytest.mark.parametrize("reading", ["speed", "xy_dot"])
def test_the_offset_s_column_is_exact_where_residuals_are_zero(reading: str) -> None:
    """It holds the direction of the increment and the scale of its noise, which multiply the residual."""
    case = full_drive(reading=reading)
    free = Free(offset=True, turn=(0, 1), lever=(0, 1))
    place = 2 * len(case.chains[0]) + 6
    for number in (0, 1):
        seen, driven, _, o = differences(case, case.truth, free, number)
        J, K, _, _ = dense(case, case.truth, free, number)
        assert np.abs(o).max() < 2e-5
        # Where no heading is read, the turn rate is a slope over neighbours, which moves the lever's end only.
        atol = 1e-6 if reading == "speed" else 0.02
        assert_allclose(J[:, place], seen[:, place], atol=atol * np.abs(seen[:, place]).max())
        assert np.abs(driven[:, place]).max() > 0.05
        assert_allclose(K[:, place], driven[:, place], atol=1e-4)


def test_spreads_divide_sightings_alone(rng: np.random.Generator) -> None:
    case = full_drive()
    state, spread = off_truth(case, rng), rng.uniform(0.5, 2.0, 7)
    wide = replace(case, chains=tuple(replace(c, spread=spread) for c in case.chains))
    J, K, z, o = dense(case, state, ALL, 0)
    J_wide, K_wide, z_wide, o_wide = dense(wide, state, ALL, 0)
    each = np.repeat(spread, 2)
    assert_allclose(z_wide, z / each)
    assert_allclose(J_wide, J / each[:, None])
    assert_allclose(K_wide, K)
    assert_allclose(o_wide, o)


def test_increments_are_along_and_across_in_units_of_their_noise(rng: np.random.Generator) -> None:
    """By a loop over the formula at the top of rows.py, with complex numbers for the plane."""
    case = full_drive()
    state, lag = off_truth(case, rng), (0.05, 0.72)
    chain = replace(case.chains[1], shared=lag)
    chain = chain.take([0, 1, 2, 4, 5, 6])
    chain = replace(chain, link=np.array([True, True, False, True, True]))
    robot = state.robots[1]
    robot = replace(
        robot, xy=np.delete(robot.xy, 3, axis=0), drift=robot.drift[:6], slip=robot.slip[:6]
    )
    odometry = chain.odometry(state.offset)
    found = residuals(case.view, chain, odometry, state, robot).odometry
    wanted = []
    for k in (0, 1, 3, 4):
        d = complex(*(odometry.xy[k + 1] - odometry.xy[k]))
        p = complex(*(robot.xy[k + 1] - robot.xy[k]))
        read = np.exp(-robot.scale - robot.slip[k] - 1j * (robot.turn + robot.drift[k])) * p
        r = (read - d) * np.conj(d) / abs(d)
        tau, power = chain.t[k + 1] - chain.t[k], odometry.power[k + 1] - odometry.power[k]
        part = [max(1 - share / tau, LEAST_PART) for share in lag]
        wanted.append([r.real / np.sqrt(power * part[0]), r.imag / np.sqrt(power * part[1])])
    assert LEAST_PART in part  # the floor is met
    assert_allclose(found, wanted, rtol=1e-9)


def test_a_robot_that_stands_has_residuals_too() -> None:
    case = full_drive()
    chain = case.chains[0]
    still = replace(
        chain,
        path=replace(
            chain.path, xy=0 * chain.path.xy, start=0 * chain.path.start, end=0 * chain.path.end
        ),
    )
    robot = case.truth.robots[0]
    found = residuals(case.view, still, still.odometry(0.0), case.truth, robot).odometry
    assert np.isfinite(found).all()
    assert (np.linalg.norm(found, axis=1) > 0.1).all()  # it did move

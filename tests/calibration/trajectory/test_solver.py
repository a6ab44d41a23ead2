"""The solver, against SciPy's dense least squares on the same cost, and against its own cost's differences."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import least_squares  # type: ignore[import-untyped,unused-ignore]

from airground.calibration.trajectory.chain import chains
from airground.calibration.trajectory.problem import (
    Problem,
    cost,
    prior_information,
    processes,
    robust_weight,
)
from airground.calibration.trajectory.solver import Solution, invert, refine
from airground.calibration.trajectory.state import Free, Noise, Priors, Robot, State
from airground.errors import UnobservableMotionError
from arcs import Drive, arcs_under, drive, pixels
from scenes import generators, scene

if TYPE_CHECKING:
    from scenes import Array

NOISE = Noise(pixel=1.5, along=0.03, across=0.02, slip=0.03, slip_s=2.0, drift=0.04, drift_s=4.0)
FULL = Free(offset=False, lens=True, turn=(1,), lever=(0, 1), slip=True, drift=True)


def noisy(rng: np.random.Generator, *, count: int = 8, gap: bool = False) -> Drive:
    """Two robots; everything that `FULL` estimates is there."""
    camera = scene(tilt_deg=45.0, heading_deg=20.0)
    arcs = arcs_under(
        camera, 2, turn=(0.0, 0.4), scale=(0.01, -0.01), lever=((0.2, -0.3), (-0.3, 0.1))
    )
    case = drive(camera, arcs, count=count, hz=2.0, k1=-0.02, pixel=1.5, rng=rng)
    m = case.motion
    assert m.heading is not None
    assert m.speed is not None
    motion = replace(
        m,
        heading=m.heading + rng.normal(0.0, 0.05, len(m)),
        speed=m.speed * (1 + rng.normal(0.0, 0.05, len(m))),
    )
    found = chains(case.tracks, motion, 0.0)
    if gap:
        link = np.arange(count - 1) != count // 2
        found = [replace(c, link=link) for c in found]
    return replace(case, motion=motion, chains=tuple(found))


def unpacked(problem: Problem, x: Array) -> State:
    """A state from one long vector, in an order of our own: globals, then robot by robot."""
    free, place = problem.free, 0

    def take(count: int) -> Array:
        nonlocal place
        place += count
        return x[place - count : place]

    g = take(6).reshape(3, 2)
    offset = float(take(1)[0]) if free.offset else problem.offset
    bend = float(take(1)[0]) if free.lens else 0.0
    robots = []
    for k, chain in enumerate(problem.chains):
        n = len(chain)
        scale = float(take(1)[0])
        turn = float(take(1)[0]) if k in free.turn else 0.0
        lever = take(2) if k in free.lever else np.zeros(2)
        xy = take(2 * n).reshape(n, 2)
        drift = take(n) if free.drift else np.zeros(n)
        slip = take(n) if free.slip else np.zeros(n)
        robots.append(Robot(xy, drift, slip, turn, scale, (float(lever[0]), float(lever[1]))))
    return State(g, offset, tuple(robots), bend)


def packed(problem: Problem, state: State) -> Array:
    free = problem.free
    parts: list[object] = [state.g.ravel()]
    parts += [[state.offset]] * free.offset + [[state.bend]] * free.lens
    for k, r in enumerate(state.robots):
        parts += [[r.scale], *([[r.turn]] if k in free.turn else [])]
        parts += [*([r.lever] if k in free.lever else []), r.xy.ravel()]
        parts += [r.drift] * free.drift + [r.slip] * free.slip
    return np.concatenate([np.asarray(p, dtype=np.float64) for p in parts])


def global_rows(problem: Problem) -> list[int]:
    """Where the global unknowns stand in our own order, in the order of `Layout`."""
    free = problem.free
    shared = 6 + free.offset + free.lens
    rows, place = list(range(shared)), shared
    for k, chain in enumerate(problem.chains):
        own = 1 + (k in free.turn) + 2 * (k in free.lever)
        rows += range(place, place + own)
        place += own + len(chain) * (2 + free.drift + free.slip)
    return rows


def residual_vector(problem: Problem, x: Array) -> Array:
    """Everything whose squares the cost sums, by loops and complex numbers."""
    state, noise, priors, free = unpacked(problem, x), problem.noise, problem.priors, problem.free
    rows: list[float] = []
    if free.offset:
        rows.append((state.offset - problem.offset) / priors.offset_s)
    if free.lens:
        rows.append(state.bend / priors.bend)
    for k, (chain, r) in enumerate(zip(problem.chains, state.robots, strict=True)):
        rows.append(r.scale / priors.scale)
        if k in free.lever:
            rows += [v / (priors.lever_s * chain.usual_speed) for v in r.lever]
        odometry = chain.odometry(state.offset)
        ahead = np.exp(1j * (odometry.heading + r.turn + r.drift))
        place = r.xy @ [1, 1j] + complex(*r.lever) * ahead
        seen = pixels(state.g, problem.view, state.bend, np.column_stack([place.real, place.imag]))
        rows += list(((chain.uv - seen) / noise.pixel).ravel())
        for i in np.flatnonzero(chain.link):
            d = complex(*(odometry.xy[i + 1] - odometry.xy[i]))
            p = complex(*(r.xy[i + 1] - r.xy[i]))
            off = np.exp(-r.scale - r.slip[i] - 1j * (r.turn + r.drift[i])) * p - d
            off *= np.conj(d) / abs(d) / np.sqrt(odometry.power[i + 1] - odometry.power[i])
            rows += [off.real / noise.along, off.imag / noise.across]
        for on, value, sigma, memory in (
            (free.drift, r.drift, noise.drift, noise.drift_s),
            (free.slip, r.slip, noise.slip, noise.slip_s),
        ):
            if not on:
                continue
            part = np.concatenate([[0], np.cumsum(~chain.link)])
            away = np.abs(chain.t[:, None] - chain.t) / memory
            cov = sigma**2 * np.exp(-away) * (part[:, None] == part)
            rows += list(np.linalg.solve(np.linalg.cholesky(cov), value))
    return np.array(rows)


def start_of(case: Drive, problem: Problem) -> State:
    """The truth, with zeros for what is not estimated."""
    return unpacked(problem, packed(problem, case.truth))


def sharp(problem: Problem, state: State) -> Solution:
    """It stops at a tenth of a deviation; go on from there."""
    for _ in range(10):
        solution = refine(problem, state, rounds=60)
        state = solution.state
    return solution


@pytest.mark.parametrize(
    ("free", "gap"),
    [
        (FULL, True),
        (Free(offset=False, turn=(1,)), False),
        (Free(offset=False, lens=True, slip=True), True),
    ],
    ids=["full", "few", "slip"],
)
def test_the_minimum_is_scipy_s(free: Free, gap: bool, rng: np.random.Generator) -> None:
    case = noisy(rng, gap=gap, count=6 if free.drift else 8)
    problem = case.problem(free, NOISE, knee=np.inf)
    start = start_of(case, problem)
    found = sharp(problem, start)
    assert found.converged
    x = packed(problem, found.state)
    assert cost(problem, found.state) == pytest.approx(found.cost, rel=1e-6)
    assert np.sum(residual_vector(problem, x) ** 2) == pytest.approx(found.cost, rel=1e-6)
    peer = least_squares(
        lambda y: residual_vector(problem, y),
        packed(problem, start),
        method="lm",
        x_scale="jac",
    )
    assert found.cost == pytest.approx(2 * peer.cost, rel=1e-6)
    dense = np.linalg.inv(peer.jac.T @ peer.jac)
    deviation = np.sqrt(np.diag(dense))
    assert_allclose((x - peer.x) / deviation, 0.0, atol=0.02)
    place = global_rows(problem)
    unit = np.outer(deviation[place], deviation[place])
    # SciPy's Jacobian is a one-sided difference, and at its own minimum.
    assert_allclose(found.covariance / unit, dense[np.ix_(place, place)] / unit, atol=2e-3)


def test_the_offset_s_minimum_is_scipy_s_but_for_what_its_column_leaves_out(
    rng: np.random.Generator,
) -> None:
    """The column holds the increments' directions: exact at residuals of zero, some percent off otherwise."""
    case = noisy(rng)
    problem = case.problem(Free(offset=True, turn=(1,)), NOISE, knee=np.inf)
    found = sharp(problem, start_of(case, problem))
    peer = least_squares(
        lambda y: residual_vector(problem, y),
        packed(problem, start_of(case, problem)),
        method="lm",
        x_scale="jac",
    )
    assert found.cost == pytest.approx(2 * peer.cost, rel=1e-3)
    deviation = np.sqrt(np.diag(np.linalg.inv(peer.jac.T @ peer.jac)))
    assert_allclose((packed(problem, found.state) - peer.x) / deviation, 0.0, atol=0.1)
    place = global_rows(problem)
    assert_allclose(np.sqrt(np.diag(found.covariance)), deviation[place], rtol=0.12)


def differences(problem: Problem, x: Array) -> Array:
    """Gradient of the public cost."""
    h = 1e-6
    return np.array(
        [
            (
                cost(problem, unpacked(problem, x + h * e))
                - cost(problem, unpacked(problem, x - h * e))
            )
            / (2 * h)
            for e in np.eye(len(x))
        ]
    )


def with_gross_errors(case: Drive, rng: np.random.Generator) -> Drive:
    found = []
    for chain in case.chains:
        wrong = rng.random(len(chain)) < 0.15
        uv = chain.uv + wrong[:, None] * rng.uniform(-60, 60, chain.uv.shape)
        found.append(replace(chain, uv=uv))
    return replace(case, chains=tuple(found))


def test_the_robust_cost_s_gradient_is_zero_at_the_solution(rng: np.random.Generator) -> None:
    """Which it can be only if the weights are the derivative of the loss."""
    # Enough good sightings that the minimum is where they are, and not on the way to a camera that fits the others.
    case = with_gross_errors(noisy(rng, count=30), rng)
    problem = case.problem(Free(offset=False, turn=(1,)), NOISE)
    state = start_of(case, problem)
    for _ in range(5):
        state = sharp(problem, state).state  # reweighting comes closer by a constant factor only
    found = refine(problem, state)
    weights = np.concatenate([w for pair in found.weights for w in pair])
    assert 3 <= (weights < 0.9).sum() < len(weights) / 2
    x = packed(problem, found.state)
    J = least_squares(lambda y: residual_vector(problem, y), x, max_nfev=1, x_scale="jac").jac
    deviation = 1 / np.sqrt(np.diag(J.T @ J))  # over which the cost changes by about one
    assert_allclose(differences(problem, x) * deviation, 0.0, atol=0.05)
    begin = packed(problem, start_of(case, problem))
    assert np.abs(differences(problem, begin) * deviation).max() > 1  # and elsewhere it is not


@given(st.floats(0.0, 30.0), st.floats(0.5, 8.0))
def test_the_weight_is_the_slope_of_the_loss(norm: float, knee: float) -> None:
    """Loss of one sighting that is off by `norm` deviations, as `cost` counts it."""
    case = drive(count=3, hz=1.0)
    free = Free(offset=False)
    problem = case.problem(free, Noise(pixel=1.0), knee=knee)

    def loss(off: float) -> float:
        chain = case.chains[0]
        uv = chain.uv.copy()
        uv[1] += np.array([0.6, -0.8]) * off
        wrong = replace(problem, chains=(replace(chain, uv=uv),))
        return cost(wrong, case.truth) - cost(problem, case.truth)

    h = 1e-4
    slope = (loss(norm + h) - loss(norm - h)) / (2 * h)  # by the norm; by its square over 2 norm
    weight = float(robust_weight(np.array([norm]), knee)[0])
    assert slope == pytest.approx(2 * norm * weight, rel=1e-2, abs=5e-3)
    assert weight == (1.0 if norm <= knee else pytest.approx((knee / norm) ** 2))
    infinite = replace(problem, knee=np.inf)
    assert cost(infinite, case.truth) < 1e-3  # no knee, no loss


@settings(max_examples=8)
@given(generators())
def test_no_step_makes_the_cost_rise(rng: np.random.Generator) -> None:
    case = with_gross_errors(noisy(rng, count=8), rng)
    problem = case.problem(FULL, NOISE)
    x = packed(problem, start_of(case, problem))
    size = rng.choice([0.003, 0.02, 0.05])
    state = unpacked(problem, x + rng.normal(0.0, size, len(x)) * np.maximum(np.abs(x), 0.3))
    now = cost(problem, state)
    if not np.isfinite(now):
        return
    for _ in range(6):
        found = refine(problem, state, rounds=1)
        # The last step is so short that it is taken unseen, and its gain not counted.
        new, last = cost(problem, found.state), 1e-3 * (now + 1)
        assert new <= now + last
        assert found.cost == pytest.approx(new, abs=2 * last)
        state, now = found.state, new


def test_from_far_away_full_steps_would_be_too_long(rng: np.random.Generator) -> None:
    """Without halving this start ends in an error or on a hill; with it the truth is found."""
    case = noisy(rng, count=20)
    problem = case.problem(Free(offset=False, turn=(1,)), NOISE, knee=np.inf)
    best = refine(problem, start_of(case, problem))
    far = replace(best.state, g=best.state.g * np.array([[1.6, 1.6], [1.6, 1.6], [0.2, 0.2]]))
    assert cost(problem, far) > 100 * best.cost
    found = refine(problem, far, rounds=60)
    assert found.cost == pytest.approx(best.cost, rel=1e-3)


def test_data_without_noise_are_fitted_and_the_end_is_noticed() -> None:
    case = drive(count=12)
    problem = case.problem(Free(offset=False), Noise())
    off = replace(case.truth, g=case.truth.g * 1.01)
    found = refine(problem, off)
    assert found.converged
    # Wheels and metres can be exchanged, as far as the prior lets them: here it is met exactly.
    assert_allclose(found.state.g, case.truth.g, atol=1e-4)
    assert found.cost < 1e-3


def test_sightings_behind_the_camera_are_an_error(rng: np.random.Generator) -> None:
    case = noisy(rng, count=6)
    problem = case.problem(Free(offset=False), NOISE)
    behind = replace(case.truth, g=case.truth.g * np.array([[1, 1], [1, 1], [-9, -9.0]]))
    assert cost(problem, behind) == np.inf
    with pytest.raises(UnobservableMotionError, match="behind the camera"):
        refine(problem, behind)


def test_no_rounds_only_look(rng: np.random.Generator) -> None:
    case = noisy(rng, count=6)
    problem = case.problem(FULL, NOISE)
    found = refine(problem, start_of(case, problem), rounds=0)
    assert_allclose(found.state.g, case.truth.g)
    assert not found.converged
    assert found.information.shape == (problem.layout.size,) * 2


@given(generators(), st.integers(1, 12))
def test_inverse_of_badly_scaled_matrices(rng: np.random.Generator, size: int) -> None:
    root = rng.normal(size=(size, size + 3))
    inner = root @ root.T + 0.1 * np.eye(size)
    units = 10.0 ** rng.uniform(-9, 9, size)
    found = invert(inner * np.outer(units, units))
    wanted = np.linalg.inv(inner)
    scaled = found * np.outer(units, units)
    assert_allclose(scaled, wanted, atol=1e-9 * np.abs(wanted).max())
    assert (found == found.T).all()


def test_what_nothing_determines_has_a_huge_but_finite_variance() -> None:
    twice = invert(np.array([[1.0, 1.0], [1.0, 1.0]]))  # only the sum is known
    assert np.array([1, 1]) @ twice @ np.array([1, 1]) == pytest.approx(1.0, rel=0.05)
    assert np.array([1, -1]) @ twice @ np.array([1, -1]) > 1e12
    none = invert(np.diag([4.0, 0.0]))
    assert none[0, 0] == pytest.approx(0.25)
    assert 1e12 < none[1, 1] < np.inf
    assert_allclose(none @ np.array([4.0, 0.0]), [1.0, 0.0])


def test_priors_are_squares_about_what_is_known(rng: np.random.Generator) -> None:
    case = noisy(rng, count=4)
    free = replace(FULL, offset=True)
    priors = Priors(offset_s=0.2, scale=0.03, bend=0.4, lever_s=0.7)
    problem = replace(case.problem(free, NOISE, priors=priors), offset=0.1)
    layout, state = problem.layout, replace(case.truth, offset=0.25)
    diagonal, right, value = prior_information(problem, state)
    wanted = {layout.offset: (0.15, 0.2), layout.bend: (state.bend, 0.4)}
    for k, (robot, chain) in enumerate(zip(state.robots, case.chains, strict=True)):
        wanted[layout.own(k)] = (robot.scale, 0.03)
        lever = layout.lever(k)
        assert lever is not None
        for axis in (0, 1):
            wanted[lever + axis] = (robot.lever[axis], 0.7 * chain.usual_speed)
    for place in range(layout.size):
        off, sigma = wanted.get(place, (0.0, np.inf))
        assert diagonal[place] == pytest.approx(sigma**-2)
        assert right[place] == pytest.approx(-off / sigma**2)
    assert value == pytest.approx(sum((off / sigma) ** 2 for off, sigma in wanted.values()))


def test_processes_stand_in_the_order_of_the_local_unknowns() -> None:
    robot = Robot(np.zeros((2, 2)), drift=np.ones(2), slip=np.full(2, 2.0))
    found = processes(Free(drift=True, slip=True), NOISE, robot)
    assert [(float(v[0]), s, m) for v, s, m in found] == [(1.0, 0.04, 4.0), (2.0, 0.03, 2.0)]
    assert len(processes(Free(slip=True), NOISE, robot)) == 1
    assert processes(Free(), NOISE, robot) == []

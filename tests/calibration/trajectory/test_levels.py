"""Noise levels: the likelihood against a dense Gaussian one, the levels against simulated ones."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space  # type: ignore[import-untyped,unused-ignore]

from airground.calibration.trajectory.chain import chains
from airground.calibration.trajectory.levels import WIDTH, Bounds, estimate_levels, likelihood
from airground.calibration.trajectory.problem import Problem
from airground.calibration.trajectory.rows import residuals
from airground.calibration.trajectory.solver import Solution, refine
from airground.calibration.trajectory.state import Free, Noise, Robot, State
from arcs import Drive, arcs_under, drive
from scenes import scene

if TYPE_CHECKING:
    from scenes import Array

NOISE = Noise(pixel=1.5, along=0.03, across=0.02, slip=0.03, slip_s=2.0, drift=0.04, drift_s=4.0)


def driven(rng: np.random.Generator, free: Free, *, count: int = 7) -> tuple[Drive, Problem]:
    camera = scene(tilt_deg=45.0, heading_deg=20.0)
    case = drive(camera, arcs_under(camera, 2), count=count, hz=2.0, pixel=1.5, rng=rng)
    m = case.motion
    assert m.heading is not None
    assert m.speed is not None
    motion = replace(
        m,
        heading=m.heading + rng.normal(0.0, 0.1, len(m)),
        speed=m.speed * (1 + rng.normal(0.0, 0.1, len(m))),
    )
    found = chains(case.tracks, motion, 0.0)
    found[1] = replace(found[1], link=np.arange(count - 1) != 2)
    case = replace(case, chains=tuple(found), motion=motion)
    return case, case.problem(free, NOISE, knee=np.inf)


def dense_likelihood(problem: Problem, state: State, noise: Noise) -> float:
    """-log p of what the flat unknowns (g, positions) leave of the data, all others having their priors.

    No elimination and no information matrix: the data's own covariance, cut to what no flat unknown can explain.
    """
    free, h = problem.free, 1e-6
    counts = [len(c) for c in problem.chains]
    flat = 6 + 2 * sum(counts)
    wander = int(free.drift) + int(free.slip)
    size = flat + int(free.lens) + len(counts) + wander * sum(counts)

    def rows(x: Array) -> Array:
        g, rest = state.g + x[:6].reshape(3, 2), x[6:]
        known = rest[2 * sum(counts) :]
        bend, known = (known[0], known[1:]) if free.lens else (0.0, known)
        scale, known = known[: len(counts)], known[len(counts) :]
        seen, went, place = [], [], 0
        for k, (chain, r) in enumerate(zip(problem.chains, state.robots, strict=True)):
            n = counts[k]
            xy = r.xy + rest[2 * place : 2 * (place + n)].reshape(n, 2)
            drift, slip = r.drift, r.slip
            if free.drift:
                drift, known = drift + known[:n], known[n:]
            if free.slip:
                slip, known = slip + known[:n], known[n:]
            robot = Robot(xy, drift, slip, r.turn, r.scale + scale[k], r.lever)
            now = State(g, state.offset, (robot,), state.bend + bend)
            found = residuals(problem.view, chain, chain.odometry(state.offset), now, robot)
            seen.append(found.sighting.ravel())
            went.append(found.odometry.ravel())
            place += n
        return np.concatenate([*seen, *went])

    J = np.stack([(rows(h * e) - rows(-h * e)) / (2 * h) for e in np.eye(size)], axis=1)
    links = sum(int(c.link.sum()) for c in problem.chains)
    sigma = np.concatenate(
        [np.full(2 * sum(counts), noise.pixel), np.tile([noise.along, noise.across], links)]
    )
    S = np.zeros((size - flat, size - flat))
    value: list[float] = []
    if free.lens:
        S[0, 0] = problem.priors.bend**2
        value.append(state.bend)
    for r in state.robots:
        S[len(value), len(value)] = problem.priors.scale**2
        value.append(r.scale)
    for chain, r in zip(problem.chains, state.robots, strict=True):
        part = np.concatenate([[0], np.cumsum(~chain.link)])
        away, together = np.abs(chain.t[:, None] - chain.t), part[:, None] == part
        for on, x, level, memory in (
            (free.drift, r.drift, noise.drift, noise.drift_s),
            (free.slip, r.slip, noise.slip, noise.slip_s),
        ):
            if on:
                mine = slice(len(value), len(value) + len(x))
                S[mine, mine] = level**2 * np.exp(-away / memory) * together
                value += list(x)
    K = null_space(J[:, :flat].T)
    y = K.T @ (rows(np.zeros(size)) - J[:, flat:] @ np.array(value))
    cov = K.T @ (np.diag(sigma**2) + J[:, flat:] @ S @ J[:, flat:].T) @ K
    return float(y @ np.linalg.solve(cov, y) + np.linalg.slogdet(cov)[1]) / 2


OTHERS = [
    replace(NOISE, pixel=0.4),
    replace(NOISE, along=0.2, across=0.005),
    replace(NOISE, slip=0.1, slip_s=0.7),
    replace(NOISE, drift=0.3, drift_s=9.0),
    Noise(pixel=3.0, along=0.01, across=0.1, slip=0.01, slip_s=5.0, drift=0.01, drift_s=1.0),
]


@pytest.mark.parametrize(
    "free",
    [
        Free(offset=False),
        Free(offset=False, lens=True, slip=True),
        Free(offset=False, drift=True),
        Free(offset=False, lens=True, slip=True, drift=True),
    ],
    ids=["plain", "slip", "drift", "all"],
)
def test_likelihood_is_the_dense_one_up_to_a_constant(free: Free, rng: np.random.Generator) -> None:
    case, problem = driven(rng, free)
    solution = refine(problem, case.truth)
    assert likelihood(problem, solution) == likelihood(problem, solution, NOISE)
    found = [likelihood(problem, solution, n) for n in (NOISE, *OTHERS)]
    wanted = [dense_likelihood(problem, solution.state, n) for n in (NOISE, *OTHERS)]
    assert np.ptp(wanted) > 10
    # A position's tie to nothing but flat unknowns costs the elimination some digits.
    assert_allclose(np.diff(found), np.diff(wanted), rtol=1e-4, atol=1e-3)


def long_drive(rng: np.random.Generator, count: int = 300) -> tuple[Problem, Solution]:
    """White noise of 2 px, and of readings 25 times a second."""
    camera = scene(tilt_deg=45.0, heading_deg=20.0)
    case = drive(camera, count=count, hz=5.0, reading_hz=25.0, pixel=2.0, rng=rng)
    m = case.motion
    assert m.heading is not None
    assert m.speed is not None
    motion = replace(
        m,
        heading=m.heading + rng.normal(0.0, 0.1, len(m)),
        speed=m.speed * (1 + rng.normal(0.0, 0.15, len(m))),
    )
    (chain,) = chains(case.tracks, motion, 0.0)
    case = replace(case, motion=motion, chains=(chain.sharing(motion),))
    problem = case.problem(Free(offset=False), Noise(pixel=0.7, along=0.02, across=0.03))
    return problem, refine(problem, case.truth)


def test_levels_are_recovered(rng: np.random.Generator) -> None:
    problem, solution = long_drive(rng)
    found, refined, value = estimate_levels(
        problem, solution, ("pixel", "along", "across"), Bounds()
    )
    # 600 coordinates, less what 300 positions take: a few percent.
    assert found.noise.pixel == pytest.approx(2.0, rel=0.15)
    assert found.noise.along == pytest.approx(0.15 / np.sqrt(25), rel=0.2)
    assert found.noise.across == pytest.approx(0.1 / np.sqrt(25), rel=0.2)
    assert np.isfinite(value)
    # At the minimum, up to the steps of the search and the prior on the levels.
    least = likelihood(found, refined)
    for name in ("pixel", "along", "across"):
        for factor in (0.7, 1.4):
            level = getattr(found.noise, name) * factor
            start = np.log(getattr(problem.noise, name))
            before = ((np.log(level / factor) - start) / WIDTH[name]) ** 2 / 2
            after = ((np.log(level) - start) / WIDTH[name]) ** 2 / 2
            other = likelihood(found, refined, replace(found.noise, **{name: level}))
            assert other + after > least + before


def test_levels_stay_within_their_bounds(rng: np.random.Generator) -> None:
    problem, solution = long_drive(rng, 80)
    bounds = Bounds(pixel=(0.1, 1.0), across=(0.04, 0.05))
    found, _, _ = estimate_levels(problem, solution, ("pixel", "across"), bounds)
    assert found.noise.pixel == pytest.approx(1.0)
    assert 0.04 * (1 - 1e-9) <= found.noise.across <= 0.05 * (1 + 1e-9)
    assert found.noise.along == problem.noise.along  # not asked for


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_gross_errors_do_not_widen_the_noise(share: float, rng: np.random.Generator) -> None:
    problem, solution = long_drive(rng)
    (chain,) = problem.chains
    wrong = rng.random(len(chain)) < share
    uv = chain.uv + wrong[:, None] * rng.uniform(-200, 200, chain.uv.shape)
    spoilt = replace(problem, chains=(replace(chain, uv=uv),))
    found, _, _ = estimate_levels(
        spoilt, refine(spoilt, solution.state), ("pixel", "along", "across"), Bounds()
    )
    assert found.noise.pixel == pytest.approx(2.0, rel=0.2)

"""Which solver for the separation filter's quadratic programs: DAQP, OSQP and Clarabel on the same ones, recorded.

The programs are those of crossing robots (`benchmarks/separation.py`), with hard rows. Each solver is called as
a filter would call it, set-up included, as rows change at every step. Times are CPU seconds; cost is how much more a
solver's answer costs than the best of the three, broken is the largest violation of a row or bound.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import clarabel  # type: ignore[import-not-found,import-untyped,unused-ignore]
import numpy as np
import osqp  # type: ignore[import-not-found,import-untyped,unused-ignore]
from scipy import sparse  # type: ignore[import-untyped]
from separation import drive, random_scene  # type: ignore[import-not-found]

from airground.control.separation import filter as separation
from airground.control.separation.filter import SeparationFilter
from airground.control.separation.qp import nearest
from airground.control.separation.rows import certain

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

Problem = tuple["FloatArray", "FloatArray", "FloatArray", "FloatArray", "FloatArray"]
SCENES = 4


def main() -> None:
    problems: list[Problem] = []

    def noted(*problem: Any) -> FloatArray | None:
        if len(problem[4]):
            problems.append(problem)
        return nearest(*problem)

    def with_notes(*args: Any, **options: Any) -> Any:
        return certain(*args, **options, solve=noted)

    setattr(separation, "certain", with_notes)  # noqa: B010 - it is not exported
    for seed in range(SCENES):
        scene = random_scene(seed)
        drive(scene, SeparationFilter(scene.fence), seed, 20.0)
    rows = [len(p[4]) for p in problems]
    print(
        f"{len(problems)} programs of {len(problems[0][0])} variables, "
        f"{np.median(rows):.0f} rows in the middle, {max(rows)} at most"
    )
    answers = {name: [_timed(solve, p) for p in problems] for name, solve in SOLVERS.items()}
    best = [min(_cost(p, answers[name][k][0]) for name in SOLVERS) for k, p in enumerate(problems)]
    print(f"{'':10} {'median':>9} {'99 %':>9} {'failed':>7} {'cost':>9} {'broken':>9}")
    for name, found in answers.items():
        took = np.array([seconds for _, seconds in found]) * 1e6
        failed = sum(x is None for x, _ in found)
        pairs = [
            (p, x, b) for p, (x, _), b in zip(problems, found, best, strict=True) if x is not None
        ]
        cost = max(_cost(p, x) - b for p, x, b in pairs)
        broken = max(_broken(p, x) for p, x, _ in pairs)
        print(
            f"{name:10} {np.median(took):6.0f} us {np.percentile(took, 99):6.0f} us {failed:7} "
            f"{cost:9.1e} {broken:9.1e}"
        )


def _timed(solve: Any, problem: Problem) -> tuple[FloatArray | None, float]:
    begun = time.process_time()
    x = solve(*problem)
    return x, time.process_time() - begun


def _cost(problem: Problem, x: FloatArray | None) -> float:
    if x is None or _broken(problem, x) > 1e-4:
        return np.inf
    return float(((x - problem[0]) ** 2).sum())


def _broken(problem: Problem, x: FloatArray) -> float:
    _, lower, upper, rows, bounds = problem
    return float(max((rows @ x - bounds).max(), (x - upper).max(), (lower - x).max(), 0.0))


def _osqp(
    wanted: FloatArray, lower: FloatArray, upper: FloatArray, rows: FloatArray, bounds: FloatArray
) -> FloatArray | None:
    solver = osqp.OSQP()
    count = len(wanted)
    matrix = sparse.csc_matrix(np.vstack([rows, np.eye(count)]))
    solver.setup(
        sparse.eye(count, format="csc"),
        -wanted,
        matrix,
        np.concatenate([np.full(len(bounds), -1e30), lower]),
        np.concatenate([bounds, upper]),
        verbose=False,
        eps_abs=1e-6,
        eps_rel=1e-6,
    )
    result = solver.solve()
    return np.asarray(result.x) if result.info.status == "solved" else None


def _clarabel(
    wanted: FloatArray, lower: FloatArray, upper: FloatArray, rows: FloatArray, bounds: FloatArray
) -> FloatArray | None:
    count = len(wanted)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    matrix = sparse.csc_matrix(np.vstack([rows, np.eye(count), -np.eye(count)]))
    right = np.concatenate([bounds, upper, -lower])
    cones = [clarabel.NonnegativeConeT(len(right))]
    problem = sparse.eye(count, format="csc")
    result = clarabel.DefaultSolver(problem, -wanted, matrix, right, cones, settings).solve()
    return np.asarray(result.x) if str(result.status) == "Solved" else None


SOLVERS = {"DAQP": nearest, "OSQP": _osqp, "Clarabel": _clarabel}

if __name__ == "__main__":
    main()

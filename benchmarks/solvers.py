"""Generic solvers on the cost of `path_cost`, each as well as its Python interface allows.

SciPy's `least_squares` has no sparse direct solver: it takes lsmr, which needs many steps on a long chain. pyceres 2.6
takes one Python function for each residual, and offers no callback to compute all of them at once; GTSAM takes one for
each sighting, while its displacements are factors of its own. Both get derivatives in closed form and in plain floats.
GTSAM 4.3 copies all values for each call of a Python factor, so that its cost grows with the square of the sightings;
"GTSAM, linear" avoids that by linearising outside, without GTSAM's step control.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from benchmarks.path_cost import one_sighting
from scipy.optimize import least_squares  # type: ignore[import-untyped,unused-ignore]

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.path_cost import PathCost

    from airground.geometry import FloatArray

__all__ = ["SOLVERS"]

TOLERANCE = 1e-10
MOST_STEPS = 200


def scipy_differences(cost: PathCost) -> FloatArray:
    """Two-point differences over the Jacobian's known zeros."""
    found = least_squares(
        cost.residual,
        cost.start,
        jac="2-point",
        jac_sparsity=cost.jacobian(cost.start) != 0,
        method="trf",
        tr_solver="lsmr",
        x_scale="jac",
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        max_nfev=MOST_STEPS,
    )
    return np.asarray(found.x)


def scipy_analytic(cost: PathCost) -> FloatArray:
    """Analytic sparse Jacobian."""
    found = least_squares(
        cost.residual,
        cost.start,
        jac=cost.jacobian,
        method="trf",
        tr_solver="lsmr",
        x_scale="jac",
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        max_nfev=MOST_STEPS,
    )
    return np.asarray(found.x)


def ceres(cost: PathCost) -> FloatArray:
    """Ceres, sparse normal equations by Cholesky."""
    pyceres: Any = import_module("pyceres")

    scaled_g, c0 = cost.start[:6].copy(), cost.start[6:8].copy()
    path = np.concatenate([np.zeros((1, 2)), cost.start[8:].reshape(-1, 2)])

    class Sighting(pyceres.CostFunction):  # type: ignore[misc]
        def __init__(self, i: int) -> None:
            super().__init__()
            self.i = i
            self.set_num_residuals(2)
            self.set_parameter_block_sizes([6, 2, 2])

        def Evaluate(self, parameters: Any, residuals: Any, jacobians: Any) -> bool:  # noqa: N802
            a, start, xy = (p.tolist() for p in parameters)
            residuals[:], *derivatives = one_sighting(a, start, xy, cost, self.i)
            if jacobians is not None:
                for target, values in zip(jacobians, derivatives, strict=True):
                    if target is not None:
                        target[:] = values
            return True

    steps, factors = cost.step.tolist(), cost.root.reshape(-1, 4).tolist()

    class Step(pyceres.CostFunction):  # type: ignore[misc]
        def __init__(self, i: int) -> None:
            super().__init__()
            self.i = i
            self.set_num_residuals(2)
            self.set_parameter_block_sizes([2, 2])

        def Evaluate(self, parameters: Any, residuals: Any, jacobians: Any) -> bool:  # noqa: N802
            (x0, y0), (x1, y1) = parameters[0].tolist(), parameters[1].tolist()
            x, y = x1 - x0 - steps[self.i][0], y1 - y0 - steps[self.i][1]
            a, b, c, d = factors[self.i]
            residuals[:] = (a * x + b * y, c * x + d * y)
            if jacobians is not None:
                if jacobians[0] is not None:
                    jacobians[0][:] = (-a, -b, -c, -d)
                if jacobians[1] is not None:
                    jacobians[1][:] = (a, b, c, d)
            return True

    problem = pyceres.Problem()
    functions: list[Any] = []  # Ceres holds no reference
    for i in range(len(path)):
        functions.append(Sighting(i))
        problem.add_residual_block(functions[-1], None, [scaled_g, c0, path[i]])
    for i in range(len(path) - 1):
        functions.append(Step(i))
        problem.add_residual_block(functions[-1], None, [path[i], path[i + 1]])
    problem.set_parameter_block_constant(path[0])
    options = pyceres.SolverOptions()
    options.linear_solver_type = pyceres.LinearSolverType.SPARSE_NORMAL_CHOLESKY
    options.max_num_iterations = MOST_STEPS
    options.function_tolerance = TOLERANCE
    options.parameter_tolerance = TOLERANCE
    options.num_threads = 1
    options.logging_type = pyceres.LoggingType.SILENT
    summary = pyceres.SolverSummary()
    pyceres.solve(options, problem, summary)
    return np.concatenate([scaled_g, c0, path[1:].ravel()])


def gtsam_graph(cost: PathCost) -> FloatArray:
    """GTSAM, Levenberg-Marquardt on a factor graph."""
    gtsam: Any = import_module("gtsam")

    g_key, c0_key = gtsam.symbol("g", 0), gtsam.symbol("c", 0)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    path = np.concatenate([np.zeros((1, 2)), cost.start[8:].reshape(-1, 2)])
    values.insert(g_key, cost.start[:6])
    values.insert(c0_key, cost.start[6:8])
    unit = gtsam.noiseModel.Unit.Create(2)
    for i, xy in enumerate(path):
        values.insert(i, gtsam.Point2(*xy))

    def sighting(i: int) -> Any:
        def error(this: Any, v: Any, jacobians: Any) -> Any:
            keys = this.keys()
            a, c0, xy = v.atVector(keys[0]), v.atVector(keys[1]), v.atPoint2(keys[2])
            residual, by_g, by_c0, by_xy = one_sighting(
                a.tolist(), c0.tolist(), xy.tolist(), cost, i
            )
            if jacobians is not None:
                jacobians[0] = np.array(by_g).reshape(2, 6, order="C")
                jacobians[1] = np.array(by_c0).reshape(2, 2)
                jacobians[2] = np.array(by_xy).reshape(2, 2)
            return np.array(residual)

        return error

    for i in range(len(path)):
        graph.add(gtsam.CustomFactor(unit, [g_key, c0_key, i], sighting(i)))
    for i, (step, root) in enumerate(zip(cost.step, cost.root, strict=True)):
        noise = gtsam.noiseModel.Gaussian.SqrtInformation(root)
        graph.add(gtsam.BetweenFactorPoint2(i, i + 1, gtsam.Point2(*step), noise))
    graph.add(gtsam.NonlinearEqualityPoint2(0, gtsam.Point2(0.0, 0.0)))
    settings = gtsam.LevenbergMarquardtParams.CeresDefaults()
    settings.setMaxIterations(MOST_STEPS)
    settings.setRelativeErrorTol(TOLERANCE)
    settings.setAbsoluteErrorTol(TOLERANCE)
    # The border last: all positions are eliminated first, in the order of time.
    order = gtsam.Ordering()
    for i in range(len(path)):
        order.push_back(i)
    order.push_back(g_key)
    order.push_back(c0_key)
    settings.setOrdering(order)
    found = gtsam.LevenbergMarquardtOptimizer(graph, values, settings).optimize()
    xy = np.array([found.atPoint2(i) for i in range(1, len(path))])
    return np.concatenate([found.atVector(g_key), found.atVector(c0_key), xy.ravel()])


def gtsam_linear(cost: PathCost) -> FloatArray:
    """GTSAM for the linear algebra only: Gauss-Newton by hand, linearised by NumPy for all sightings at once."""
    gtsam: Any = import_module("gtsam")

    count = len(cost.uv)
    order = gtsam.Ordering()
    for key in [*range(1, count), count, count + 1]:  # the border last
        order.push_back(key)
    unit = gtsam.noiseModel.Unit.Create(2)
    x, size = cost.start, np.inf
    for _ in range(MOST_STEPS):
        path = np.concatenate([np.zeros((1, 2)), x[8:].reshape(-1, 2)])
        pixels, on_globals, on_path = cost.sightings(x[:6], x[6:8], path)
        off = np.einsum("nij,nj->ni", cost.root, np.diff(path, axis=0) - cost.step)
        graph = gtsam.GaussianFactorGraph()
        for i in range(count):
            globals_ = (count, on_globals[i, :, :6], count + 1, on_globals[i, :, 6:])
            position = (i, on_path[i]) if i else ()
            graph.add(gtsam.JacobianFactor(*position, *globals_, -pixels[i], unit))
        for i in range(count - 1):
            before = (i, -cost.root[i]) if i else ()
            graph.add(gtsam.JacobianFactor(*before, i + 1, cost.root[i], -off[i], unit))
        step = graph.optimize(order)
        moved = [step.at(key) for key in (count, count + 1, *range(1, count))]
        x = x + np.concatenate(moved)
        last, size = size, float(np.sum(cost.residual(x) ** 2))
        if abs(last - size) <= TOLERANCE * size:
            break
    return np.asarray(x)


SOLVERS: dict[str, Callable[[PathCost], FloatArray]] = {
    "SciPy, differences": scipy_differences,
    "SciPy, analytic": scipy_analytic,
    "pyceres": ceres,
    "GTSAM": gtsam_graph,
    "GTSAM, linear": gtsam_linear,
}

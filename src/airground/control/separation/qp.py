"""Small quadratic programs with a diagonal cost, solved by DAQP."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["nearest"]

_SOFT = 8  # DAQP's mark of a row that may be violated at a cost
_NONE = 1e30


def nearest(
    wanted: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    rows: FloatArray,
    bounds: FloatArray,
    *,
    softness: float | None = None,
) -> NDArray[np.float64] | None:
    """Point nearest to `wanted` in a polytope: min |x - wanted|^2, lower <= x <= upper, rows x <= bounds.

    Parameters
    ----------
    wanted : (K,) array
        Where one would like to be.
    lower, upper : (K,) array
        Box.
    rows : (M, K) array
        Half-spaces.
    bounds : (M,) array
        Their offsets.
    softness : float, optional
        Rows may be violated by s at the cost s^2 / softness; not at all where it is not given. The box always holds.

    Returns
    -------
    x : (K,) array or None
        None where the solver has no answer.
    """
    import daqp  # type: ignore[import-not-found]

    count = len(wanted)
    sense = np.zeros(count + len(bounds), dtype=np.int32)
    settings = {}
    if softness is not None:
        sense[count:] = _SOFT
        settings["rho_soft"] = softness
    x, _, flag, _ = daqp.solve(
        np.eye(count),
        -np.asarray(wanted),
        np.ascontiguousarray(rows),
        np.concatenate([upper, bounds]),
        np.concatenate([lower, np.full(len(bounds), -_NONE)]),
        sense,
        **settings,
    )
    x = np.asarray(x, dtype=np.float64)
    return np.clip(x, lower, upper) if flag > 0 and np.isfinite(x).all() else None

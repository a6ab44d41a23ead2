"""Small quadratic programs with a diagonal cost, solved by DAQP."""

from __future__ import annotations

from math import isfinite
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
    above, below = np.empty(len(sense)), np.empty(len(sense))
    above[:count], above[count:] = upper, bounds
    below[:count], below[count:] = lower, -_NONE
    settings = {}
    if softness is not None:
        sense[count:] = _SOFT
        settings["rho_soft"] = softness
    rows = np.ascontiguousarray(rows)
    x, _, flag, _ = daqp.solve(np.eye(count), -wanted, rows, above, below, sense, **settings)
    if not (flag > 0 and isfinite(sum(x.tolist()))):
        return None
    inside: FloatArray = np.minimum(np.maximum(x, lower), upper)
    return inside

"""The smoothest line that stays within a tube around a drawn one.

With p the points wanted on the ground, q those drawn, J the Jacobians at q [px/m] and m the local scale [px/m], p has
the least ``sum w |J (p - q)|^2 + l^6 sum |m D^3 p|^2``, a banded system. Third differences measure how fast the
curvature changes; l is the length, in steps, of what is smoothed away where all weights w are 1. Weights then grow
where the line leaves the tube, and shrink back where it need not be held (Lawson's iteration), so that in the end only
those places hold it where it touches.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["in_tube", "roughness", "smoothest"]

_THIRD = np.array([-1.0, 3.0, -3.0, 1.0])
_ROUNDS = 12


def smoothest(pulled: FloatArray, metric: FloatArray, rough: FloatArray) -> FloatArray | None:
    """Solve for the line once, with given weights.

    Parameters
    ----------
    pulled : (M, 2) array
        ``metric @ q`` for the points drawn, q.
    metric : (M, 3) array [px^2/m^2]
        Entries xx, xy and yy of ``w J^T J``.
    rough : (4, M) array [px^2/m^2]
        Bands of the third differences, see `roughness`.

    Returns
    -------
    p : (M, 2) array [m], or None
        Points wanted; None where the system is singular in double precision.
    """
    from scipy.linalg.lapack import dpbsv  # type: ignore[import-untyped,unused-ignore]

    count = len(pulled)
    bands = np.zeros((7, count, 2))  # upper form; x and y alternate, so that offset k is 2 k here
    bands[::2] = rough[:, :, None]
    bands[6] += metric[:, ::2]
    bands[5, :, 1] = metric[:, 1]
    _, solved, info = dpbsv(bands.reshape(7, 2 * count), pulled.reshape(-1))
    return np.asarray(solved.reshape(count, 2)) if info == 0 else None


def roughness(stiffness: FloatArray) -> FloatArray:
    """Upper bands of ``D^T diag(stiffness) D`` for third differences D, the diagonal last.

    Parameters
    ----------
    stiffness : (M - 3,) array
        Weight of each third difference.

    Returns
    -------
    bands : (4, M) array
        As LAPACK has them.
    """
    count = len(stiffness) + 3
    bands = np.zeros((4, count))
    for a in range(4):
        for b in range(a, 4):
            bands[3 - b + a, b : count - 3 + b] += _THIRD[a] * _THIRD[b] * stiffness
    return bands


def in_tube(
    q: FloatArray,
    J: FloatArray,
    tolerance: FloatArray,
    floor_weight: FloatArray,
    length: float,
    *,
    closed: bool = False,
    held: dict[int, FloatArray] | None = None,
    window: int = 1,
) -> FloatArray:
    """Find the smoothest line within the tube.

    Parameters
    ----------
    q : (M, 2) array [m]
        Points drawn, on the ground, four or more; of a closed line each once.
    J : (M, 2, 2) array [px/m]
        Jacobians there.
    tolerance : (M,) array [px]
        Half width of the tube.
    floor_weight : (M,) array
        Least weights: where they are small the line may be smoother, within the tube.
    length : float
        What is smoothed away everywhere, in steps.
    closed : bool
        Whether the last point is followed by the first.
    held : dict from int to (2,) array [m], optional
        Points that the line must pass, by index.
    window : int
        Over how many points deviations are averaged before they are compared with the tube, as noise is no deviation.

    Returns
    -------
    p : (M, 2) array [m]
        The line.
    """
    count = len(q)
    overlap = (
        int(30 * length) + 4 if closed else 0
    )  # ends of the unrolled line fade out by exp(-1/2) each l
    take = np.arange(-overlap, count + overlap) % count
    scale = np.sqrt(np.abs(J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]))
    m = scale[take]
    stiffness = length**6 * ((m[:-3] + m[1:-2] + m[2:-1] + m[3:]) / 4) ** 2
    q = q.copy()
    firm = np.zeros(count)
    for k, place in (held or {}).items():
        q[k] = place
        firm[k] = 1e4 * max(1.0, length**6 / 1e3)
    rough = roughness(stiffness)
    metric = np.stack(
        [(J[:, :, a] * J[:, :, b]).sum(axis=1) for a, b in ((0, 0), (0, 1), (1, 1))], 1
    )
    base = np.column_stack(
        [
            metric[:, 0] * q[:, 0] + metric[:, 1] * q[:, 1],
            metric[:, 1] * q[:, 0] + metric[:, 2] * q[:, 1],
        ]
    )
    extra = np.ones(count)
    p = q
    for _ in range(_ROUNDS):
        weight = (floor_weight * extra + firm)[take, None]
        solved = smoothest(weight * base[take], weight * metric[take], rough)
        if solved is None:
            break
        p = solved[overlap : overlap + count]
        off = (J @ (p - q)[:, :, None])[:, :, 0]
        if window > 1:
            off = _averaged(off, window, closed=closed)
        ratio = np.hypot(off[:, 0], off[:, 1]) / tolerance
        if (ratio <= 1.02).all() and (extra.max() == 1.0 or ratio.max() > 0.9):
            break
        extra = np.maximum(extra * np.clip(ratio, 0.5, 30.0) ** 1.5, 1.0)
    return p


def _averaged(values: FloatArray, window: int, *, closed: bool) -> FloatArray:
    """Running mean over an odd number of points."""
    half = min(window // 2, (len(values) - 1) // 2)
    if half < 1:
        return values
    places = np.arange(-half - 1, len(values) + half)
    places = places % len(values) if closed else np.clip(places, 0, len(values) - 1)
    total = np.cumsum(values[places], axis=0)
    width = 2 * half + 1
    return np.asarray((total[width:] - total[:-width]) / width)

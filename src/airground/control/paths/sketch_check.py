"""Whether a path can be driven, and if not where and why, before a robot is released."""

from __future__ import annotations

from math import pi, remainder
from typing import TYPE_CHECKING

import numpy as np

from airground.control.paths.sketch_clean import ground_per_pixel
from airground.control.paths.sketch_undrivable import Undrivable
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from airground.control.limits import Limits
    from airground.control.paths.image_path import ImagePath

    BoolArray = NDArray[np.bool_]

__all__ = ["check_path"]

_ROUNDING = 1.01
"""Curvature may be above its limit by this: it is that of a spline."""

_KINK = 0.2
"""Change of heading [rad] that counts as a turn on the spot."""


def check_path(
    path: ImagePath,
    limits: Limits,
    *,
    image_size_px: tuple[int, int] | None = None,
    coarsest_m_per_px: float = 0.1,
    shortest_m: float = 0.05,
    fence: Callable[[FloatArray], BoolArray] | ArrayLike | None = None,
) -> tuple[Undrivable, ...]:
    """Find all that keeps a path from being driven.

    Parameters
    ----------
    path : ImagePath
        To be driven.
    limits : Limits
        Of the robot that shall.
    image_size_px : (int, int), optional [px]
        Width and height; the path must be in the image.
    coarsest_m_per_px : float [m/px]
        Farther away, where one pixel spans more ground, a robot is not seen well enough to be controlled.
    shortest_m : float [m]
        A path below it is none.
    fence : callable or (K, 2) array_like, optional [px]
        Where the robot may be: a polygon in the image, or a function of (M, 2) image points that says which are inside.

    Returns
    -------
    undrivable : tuple of Undrivable
        Empty where the path can be driven; what of a drawing could not become a path comes first.

    Raises
    ------
    InputError
        If `fence` is no polygon.
    """
    found = list(path.undrivable)
    uv = path.uv

    def tell(kind: str, where: BoolArray, badness: FloatArray, reason: str) -> None:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(np.int8)))
        for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            worst = first + int(np.argmax(badness[first:end]))
            u, v = uv[worst]
            span = (float(path.s[first]), float(path.s[end - 1]))
            text = (
                f"{span[0]:.2f} to {span[1]:.2f} m along the path, near pixel ({u:.0f}, {v:.0f}): "
            )
            text += reason.format(badness[worst])
            found.append(Undrivable(kind, text, first, end - 1, span, uv[worst]))

    if path.length < shortest_m:
        reason = (
            f"the path is {path.length:.3g} m long, less than {shortest_m:g} m; draw a longer one"
        )
        found.append(Undrivable("short", reason, 0, len(path) - 1, (0.0, path.length), uv[0]))
    if limits.turn_radius_m > 0:
        bend = np.abs(path.curvature)
        tell(
            "curvature",
            bend * limits.turn_radius_m > _ROUNDING,
            bend,
            f"it bends more tightly than the robot's smallest radius of {limits.turn_radius_m:g} m; "
            "draw a wider curve",
        )
        found += _kinks(path, limits)
    if path.directions != (1,) * len(path.directions) and limits.reverse_mps == 0:
        for run, first in enumerate((0, *path.breaks)):
            if path.directions[run] < 0:
                span = (float(path.s[first]), path.run_ends[run])
                last = (*path.breaks, len(path))[run] - 1
                reason = (
                    f"{span[0]:.2f} to {span[1]:.2f} m along the path: to be driven in reverse, "
                )
                reason += "which the robot's limits forbid"
                found.append(Undrivable("cusp", reason, first, last, span, uv[first]))
    coarse = ground_per_pixel(path.floor, uv)
    tell(
        "far",
        ~(coarse <= coarsest_m_per_px),
        coarse,
        f"one pixel spans {{:.2g}} m of ground, more than {coarsest_m_per_px:g} m: too far away to control",
    )
    if image_size_px is not None:
        size = np.array(image_size_px, dtype=np.float64)
        out = np.maximum(-0.5 - uv, uv - (size - 0.5)).max(axis=1)
        tell("outside", out > 0, out, "it leaves the image by {:.0f} px")
    if fence is not None:
        inside = np.asarray(fence(uv)) if callable(fence) else _inside(uv, fence)
        tell("fence", ~inside, np.zeros(len(uv)), "it leaves the fence")
    return tuple(found)


def _kinks(path: ImagePath, limits: Limits) -> list[Undrivable]:
    """Cusps where a robot that cannot turn on the spot would have to."""
    found = []
    for run, k in enumerate(path.breaks):
        reverses = path.directions[run] != path.directions[run + 1]
        turn = abs(remainder(path.theta[k] - path.theta[k - 1] + (pi if reverses else 0), 2 * pi))
        if turn > _KINK:
            u, v = path.uv[k]
            s = float(path.s[k])
            reason = (
                f"{s:.2f} m along the path, near pixel ({u:.0f}, {v:.0f}): it needs a turn on the spot "
                f"by {np.degrees(turn):.0f} degrees, and the robot's smallest radius is "
                f"{limits.turn_radius_m:g} m; draw a curve"
            )
            found.append(Undrivable("cusp", reason, k - 1, k, (s, s), path.uv[k]))
    return found


def _inside(uv: FloatArray, polygon: ArrayLike) -> BoolArray:
    """Which points are in a polygon: an odd number of its edges to the right of them."""
    corners = readonly(polygon, (None, 2), "fence")
    if len(corners) < 3:
        raise InputError(f"fence must have three corners or more, not {len(corners)}")
    inside = np.zeros(len(uv), dtype=np.bool_)
    for (u0, v0), (u1, v1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        crosses = (uv[:, 1] < v0) != (uv[:, 1] < v1)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = u0 + (uv[:, 1] - v0) * (u1 - u0) / (v1 - v0)
        inside ^= crosses & (uv[:, 0] < at)
    return inside

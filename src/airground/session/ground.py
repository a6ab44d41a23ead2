"""The ground as robots are sent over it: with a calibration, and what was drawn into the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.control import Floor
from airground.control.separation.fence import Fence

if TYPE_CHECKING:
    from airground.calibration import Calibration
    from airground.geometry.arrays import FloatArray
    from airground.session.options import Polygons

__all__ = ["Ground", "fenced"]

EDGE_PX = 40.0  # a lens bends lines: long edges of polygons get corners so far apart


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """What planning and steering need to know of it."""

    calibration: Calibration
    """Relation of image and ground."""

    floor: Floor
    """The same for control, in undistorted pixels."""

    fence: Fence | None = None
    """Where robots may be; None bounds nothing but the view."""

    @classmethod
    def of(cls, calibration: Calibration) -> Ground:
        """Build it.

        Parameters
        ----------
        calibration : Calibration
            To drive with.

        Returns
        -------
        ground : Ground
            Without a fence.
        """
        return cls(calibration, Floor(calibration.model, calibration.origin_px))


def fenced(ground: Ground, stay_inside: Polygons, keep_out: Polygons) -> Fence | None:
    """Build the fence of what was drawn.

    Parameters
    ----------
    ground : Ground
        Where.
    stay_inside, keep_out : tuple of polygons [px]
        As drawn, in raw pixels.

    Returns
    -------
    fence : Fence or None
        None where nothing was drawn.

    Raises
    ------
    InputError
        If a polygon is none, or is no visible ground.
    """
    if not stay_inside and not keep_out:
        return None
    undistorted = ground.calibration.undistort
    lens = ground.calibration.lens is not None
    return Fence(
        ground.floor,
        stay_inside=tuple(undistorted(_ring(one, lens)) for one in stay_inside),
        keep_out=tuple(undistorted(_ring(one, lens)) for one in keep_out),
    )


def _ring(corners: tuple[tuple[float, float], ...], lens: bool) -> FloatArray:
    ring = np.array(corners, dtype=np.float64)
    if not lens:
        return ring
    parts = []
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        count = max(1, int(np.ceil(np.hypot(*(b - a)) / EDGE_PX)))
        parts.append(a + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (b - a))
    return np.concatenate(parts)

"""All points of all bodies at once: where they, and the shadows of corners, are in the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray
from airground.sim.renderer_views import between

if TYPE_CHECKING:
    from airground.sim.body import Body, Part
    from airground.sim.renderer_views import BodyMotion, View
    from airground.sim.scene import Sun

__all__ = ["Crowd", "Seen", "Sight", "corners"]

ROUNDS = 3  # for the time of a point's row
NEAREST_M = 1e-3  # in front of the camera: what is nearer has no image
NOWHERE = (np.nan, np.nan, np.nan, np.nan)

IntArray = NDArray[np.intp]


def corners(part: Part) -> FloatArray:
    """Corners of a part.

    Parameters
    ----------
    part : Part
        With N corners seen from above.

    Returns
    -------
    xyz : (2 N, 3) array [m]
        Of the underside, then of the roof.
    """
    count = len(part.outline)
    low = np.column_stack([part.outline, np.full(count, part.bottom_m)])
    high = np.column_stack([part.outline, np.full(count, part.top_m)])
    return np.concatenate([low, high])


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """One body at one time; NaN behind the camera."""

    corners: FloatArray
    """(N, 2) [px]. Of its parts, as by `corners`."""

    lamps: FloatArray
    """(L, 2) [px]. Its lamps."""

    depths: FloatArray
    """(L,) [m]. How far its lamps are, along the optical axis."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """One body in the middle of an exposure."""

    seen: Seen
    """The body."""

    shadow: FloatArray
    """(N, 2) [px]. Shadows of its corners on the ground; NaN behind the camera."""

    box: tuple[float, float, float, float]
    """Left, top, right, bottom of its corners [px]; NaN if one is behind the camera, or there is none."""

    shadow_box: tuple[float, float, float, float]
    """That of the shadow [px]."""

    shadow_m: float
    """Longer side of the shadow on the ground, along x and y [m]."""

    way_px: float
    """How far the body moves in the image while the shutter is open [px]."""


class Crowd:
    """Bodies whose points are taken to the image together.

    Parameters
    ----------
    bodies : list of Body
        Some bodies of a scene.
    sun : Sun
        Casts their shadows.
    """

    def __init__(self, bodies: list[Body], sun: Sun) -> None:
        xyz, cast, owner, marks = [], [], [], []
        count = 0
        for k, body in enumerate(bodies):
            solid = [corners(part) for part in body.parts]
            lamps = [np.array([lamp.at_m]) for lamp in body.lamps]
            gauge = np.stack([body.reference, [body.radius_m, 0.0, 0.0]])
            shade = np.concatenate([*solid, np.zeros((0, 3))])
            # A shadow's corner: straight below the body's, and then along the sunlight.
            points = np.concatenate([shade * [1.0, 1.0, 0.0], *solid, *lamps, gauge])
            shift = np.zeros((len(points), 2))
            shift[: len(shade)] = shade[:, 2:] * sun.slant
            xyz.append(points)
            cast.append(shift)
            owner.append(np.full(len(points), k))
            ends = np.cumsum([count, len(shade), len(shade), len(lamps), 2]).tolist()
            marks.append(ends)
            count = ends[-1]
        self._xyz = np.concatenate([*xyz, np.zeros((0, 3))])
        self._cast = np.concatenate([*cast, np.zeros((0, 2))])
        self._owner = np.concatenate([*owner, np.zeros(0)]).astype(np.intp)
        self._marks = marks
        self._starts = np.array([end for ends in marks for end in ends[:4]], dtype=np.intp)
        gauges = [end + k for ends in marks for end in ends[3:4] for k in (0, 1)]
        self._gauges = np.array(gauges, dtype=np.intp)

    def sights(self, view: View, motions: list[BodyMotion], exposure_s: float) -> list[Sight]:
        """See all bodies in the middle of an exposure.

        Parameters
        ----------
        view : View
            The camera then.
        motions : list of BodyMotion
            Of all bodies.
        exposure_s : float [s]
            How long the shutter is open.

        Returns
        -------
        sights : list of Sight
            One for each body.
        """
        if not self._marks:
            return []
        count, half = len(self._xyz), exposure_s / 2
        every = np.arange(count)
        which, since = every, np.zeros(count)
        if half:
            which = np.concatenate([every, self._gauges, self._gauges])
            since = np.zeros(len(which))
            since[count : count + len(self._gauges)] = -half
            since[count + len(self._gauges) :] = half
        uv, depth, xyz = self._project(view, motions, which, view.t + since)
        ways = np.zeros(len(self._marks))
        if half:
            first, last = uv[count:].reshape(2, -1, 2, 2)
            ways = np.nan_to_num(np.hypot(*np.moveaxis(last - first, -1, 0))).max(axis=1)
        uv, flat = uv[:count], xyz[:count, :2]
        both = np.column_stack([uv, flat])
        low = np.minimum.reduceat(both, self._starts).tolist()
        high = np.maximum.reduceat(both, self._starts).tolist()
        sights = []
        for k, (shade, solid, lamps, gauge, _) in enumerate(self._marks):
            boxes = [
                (*low[n][:2], *high[n][:2]) if last > first else NOWHERE
                for n, first, last in ((4 * k, shade, solid), (4 * k + 1, solid, lamps))
            ]
            long_m = max(high[4 * k][n] - low[4 * k][n] for n in (2, 3))
            seen = Seen(uv[solid:lamps], uv[lamps:gauge], depth[lamps:gauge])
            sights.append(Sight(seen, uv[shade:solid], boxes[1], boxes[0], long_m, float(ways[k])))
        return sights

    def seen(
        self, view: View, motions: list[BodyMotion], wanted: list[tuple[int, float]]
    ) -> list[Seen]:
        """See bodies at other times.

        Parameters
        ----------
        view : View
            The camera.
        motions : list of BodyMotion
            Of all bodies.
        wanted : list of (int, float)
            Numbers of bodies, and times of the middle row [s].

        Returns
        -------
        seen : list of Seen
            As wanted.
        """
        if not wanted:
            return []
        spans = [range(self._marks[k][1], self._marks[k][3]) for k, _ in wanted]
        counts = [len(span) for span in spans]
        which = np.concatenate([np.arange(span.start, span.stop) for span in spans])
        times = np.repeat([t for _, t in wanted], counts)
        uv, depth, _ = self._project(view, motions, which, times)
        found, first = [], 0
        for (k, _), count in zip(wanted, counts, strict=True):
            middle = first + self._marks[k][2] - self._marks[k][1]
            last = first + count
            found.append(Seen(uv[first:middle], uv[middle:last], depth[middle:last]))
            first = last
        return found

    def _project(
        self, view: View, motions: list[BodyMotion], which: IntArray, times: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Images (N, 2) of points, depths (N,) and places in the world (N, 3); times are those of the middle row."""
        local, cast, owner = self._xyz[which], self._cast[which], self._owner[which]
        x, y, _ = local.T
        knots, poses = motions[0].times, np.stack([motion.poses for motion in motions])
        xyz = local.copy()
        t = times
        for _ in range(ROUNDS if view.readout_s else 1):
            if len(knots) == 1:
                pose = poses[owner, 0]
            else:
                low, share = between(knots, t)
                before = poses[owner, low]
                pose = before + share[:, None] * (poses[owner, low + 1] - before)
            c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
            xyz[:, 0] = pose[:, 0] + c * x - s * y + cast[:, 0]
            xyz[:, 1] = pose[:, 1] + s * x + c * y + cast[:, 1]
            P = view.projections_at(t)
            turned = xyz @ P[0, :, :3].T if len(P) == 1 else (P[..., :3] @ xyz[..., None])[..., 0]
            w = turned + P[..., 3]
            depth = np.where(w[:, 2] > NEAREST_M, w[:, 2], np.nan)
            uv = w[:, :2] / depth[:, None]
            if view.lens is not None:
                uv = view.lens.distort(uv)
            if view.readout_s:
                rows = np.where(np.isfinite(uv[:, 1]), uv[:, 1], 0.0)
                t = view.row_times(rows) + (times - view.t)
        return uv, depth, xyz

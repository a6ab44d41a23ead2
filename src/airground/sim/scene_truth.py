"""What is really in an image: where each body's mark is, to rounding; shares no code with what draws it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.sim.body import Body
    from airground.sim.scene import Scene

__all__ = ["BodyTruth", "scene_truth"]

ROUNDS = 6  # each shrinks the error of a row's time by the share of the readout in which a body moves a row
AHEAD_M = 1e-4  # a step along the heading, to see where it points in the image


@dataclass(frozen=True, slots=True, eq=False)
class BodyTruth:
    """One body in one image."""

    name: str
    """Of the body."""

    t: float
    """When its mark was exposed, the middle of it [s]."""

    xy: FloatArray
    """(2,) [m]. Ground point below its frame's origin, then."""

    theta: float
    """Its heading then, counter-clockwise from x [rad]."""

    mark_xyz: FloatArray
    """(3,) [m]. Its reference point in the world, then."""

    uv: FloatArray
    """(2,) [px]. That point in the image, through lens and shutter; NaN behind the camera."""

    angle: float
    """Its heading in the image, from u towards v [rad]."""

    in_view: bool
    """Does the point fall onto pixels?"""

    hidden: bool
    """Is something else in front of the point?"""

    corners: FloatArray
    """(N, 4, 2) [px]. Corners of each tag's black square, clockwise from the upright tag's upper left."""


def scene_truth(scene: Scene, t: float) -> tuple[BodyTruth, ...]:
    """Tell the truth about a frame.

    Parameters
    ----------
    scene : Scene
        What is looked at.
    t : float [s]
        Time of the frame.

    Returns
    -------
    truths : tuple of BodyTruth
        One for each body, in the scene's order, seen or not.
    """
    return tuple(_truth(scene, body, t) for body in scene.bodies)


def _world(body: Body, points: FloatArray, t: FloatArray) -> FloatArray:
    """(N, 3). Points of a body in the world, each at its own time."""
    xy, theta = body.pose(t)
    c, s = np.cos(theta), np.sin(theta)
    x, y, z = points.T
    return np.column_stack([xy[:, 0] + c * x - s * y, xy[:, 1] + s * x + c * y, z])


def _image(scene: Scene, body: Body, points: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
    """Image points (N, 2) of a body's points, and when their rows were exposed (N,)."""
    when = np.full(len(points), t)
    uv = np.full((len(points), 2), np.nan)
    for _ in range(ROUNDS if scene.readout_s else 1):
        xyz = _world(body, points, when)
        if scene.still or not scene.readout_s:
            uv = scene.camera_at(t).project(xyz)
        else:
            uv = np.array(
                [
                    scene.camera_at(float(instant)).project(point)
                    for instant, point in zip(when, xyz, strict=True)
                ]
            )
        if scene.lens is not None:
            uv = scene.lens.distort(uv)
        rows = np.where(np.isfinite(uv[:, 1]), uv[:, 1], 0.0)
        when = np.array([scene.row_time(t, float(row)) for row in rows])
    return uv, when


def _truth(scene: Scene, body: Body, t: float) -> BodyTruth:
    tags = [
        np.array([*(np.array(tag.at_m) + tag.size_m / 2 * np.array(corner)), height])
        for tag, height in body.tags
        for corner in ((1, 1), (1, -1), (-1, -1), (-1, 1))
    ]
    reference = body.reference
    points = np.stack([reference, reference + [AHEAD_M, 0.0, 0.0], *tags])
    uvs, times = _image(scene, body, points, t)
    uv, when = uvs[0], float(times[0])
    xy, theta = body.pose(times[:1])
    mark = _world(body, points[:1], times[:1])[0]
    step = uvs[1] - uv
    width, height_px = scene.image_size_px
    inside = -0.5 <= uv[0] <= width - 0.5 and -0.5 <= uv[1] <= height_px - 0.5
    eye = scene.camera_at(when).centre_m
    return BodyTruth(
        name=body.name,
        t=when,
        xy=xy[0],
        theta=float(theta[0]),
        mark_xyz=mark,
        uv=uv,
        angle=float(np.arctan2(step[1], step[0])),
        in_view=bool(inside),
        hidden=any(_hides(other, eye, mark, when) for other in scene.bodies if other is not body),
        corners=uvs[2:].reshape(-1, 4, 2),
    )


def _hides(body: Body, eye: FloatArray, mark: FloatArray, t: float) -> bool:
    """Does the line of sight meet a part of the body? Cuts the line by each side of the prism."""
    if mark[2] >= body.height_m:  # a line of sight only goes down
        return False
    xy, theta = body.pose(np.array([t]))
    c, s = np.cos(theta[0]), np.sin(theta[0])
    turn = np.array([[c, s], [-s, c]])
    start, end = turn @ (eye[:2] - xy[0]), turn @ (mark[:2] - xy[0])
    share = np.clip(
        -(start @ (end - start)) / max(float((end - start) @ (end - start)), 1e-12), 0, 1
    )
    if np.hypot(*(start + share * (end - start))) > body.radius_m:
        return False  # the line passes it by
    for part in body.parts:
        low, high = 0.0, 1.0 - 1e-9
        planes = []  # depth inside each side at the eye and at the mark
        step = np.roll(part.outline, -1, axis=0) - part.outline
        for corner, (dx, dy) in zip(part.outline, step, strict=True):
            inward = np.array([-dy, dx])
            planes.append((inward @ (start - corner), inward @ (end - corner)))
        planes += [
            (eye[2] - part.bottom_m, mark[2] - part.bottom_m),
            (part.top_m - eye[2], part.top_m - mark[2]),
        ]
        for first, last in planes:
            if first < 0 and last < 0:
                low, high = 1.0, 0.0
            elif first < 0:
                low = max(low, first / (first - last))
            elif last < 0:
                high = min(high, first / (first - last))
        if low < high:
            return True
    return False

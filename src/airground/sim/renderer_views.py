"""Cameras and bodies during one short exposure: matrices at a few times, linear in between.

A rolling shutter exposes each row at its own time. Over the few milliseconds that a part of the image takes, camera
and bodies move so little that their matrices may be interpolated; `scene_truth` does not do so.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray
from airground.sim.lens import Lens

if TYPE_CHECKING:
    from airground.sim.body import Body
    from airground.sim.scene import Scene

__all__ = ["BodyMotion", "View", "between"]

KNOTS = 5  # over a readout of 20 ms a drone that shakes by 5 px at 2 Hz is met within 0.01 px


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """How the image is made at one time: a plane's homography for each row."""

    t: float
    """Time of the middle row [s]."""

    readout_s: float
    """From the first row to the last [s]."""

    image_size_px: tuple[int, int]
    """Width and height [px]."""

    lens: Lens | None
    """Of the camera."""

    times: FloatArray
    """(K,) [s]. When the camera is known, over all of the frame; one for a still one."""

    projections: FloatArray
    """(K, 3, 4). K (R | -R c) then."""

    eye: FloatArray
    """(3,) [m]. Where the camera is at `t`."""

    planes: dict[float, FloatArray] = field(default_factory=dict)
    """Of a camera that stands still: what `planes_at` has found, by height [m]."""

    @classmethod
    def of(cls, scene: Scene, t: float) -> View:
        """Take the camera's matrices.

        Parameters
        ----------
        scene : Scene
            The scene.
        t : float [s]
            Time of the middle row.

        Returns
        -------
        view : View
            At that time.
        """
        span = 0.0 if scene.still else scene.readout_s + scene.exposure_s
        times = _knots(t, span)
        cameras = [scene.camera_at(float(when)) for when in times]
        return cls(
            t,
            scene.readout_s,
            cameras[0].image_size_px,
            scene.lens if scene.lens and scene.lens.k1_per_px2 else None,
            times,
            np.stack([camera.projection for camera in cameras]),
            cameras[len(cameras) // 2].centre_m,
        )

    def later(self, t: float) -> View:
        """Give the view at another time of the same exposure, or at any time if the camera stands still.

        Parameters
        ----------
        t : float [s]
            Of the middle row.

        Returns
        -------
        view : View
            Then.
        """
        return replace(self, t=t)

    def row_times(self, v: FloatArray) -> FloatArray:
        """When rows are exposed.

        Parameters
        ----------
        v : (N,) array [px]
            Rows.

        Returns
        -------
        t : (N,) array [s]
            Times.
        """
        height = self.image_size_px[1]
        inside = np.minimum(np.maximum(v, -0.5), height - 0.5)
        return np.asarray(self.t + self.readout_s * (inside - (height - 1) / 2) / height)

    def projections_at(self, t: FloatArray) -> FloatArray:
        """Camera matrices.

        Parameters
        ----------
        t : (N,) array [s]
            Times within the readout.

        Returns
        -------
        projections : (N, 3, 4) or (1, 3, 4) array
            One for all where the camera does not move.
        """
        if len(self.times) == 1:
            return self.projections
        low, share = between(self.times, t)
        before = self.projections[low]
        return np.asarray(before + share[:, None, None] * (self.projections[low + 1] - before))

    def planes_at(self, v: FloatArray, height_m: float) -> FloatArray:
        """From the image to a plane above the ground, row by row.

        Parameters
        ----------
        v : (N,) array [px]
            Rows.
        height_m : float [m]
            Of the plane.

        Returns
        -------
        plane_from_image : (N, 3, 3) or (1, 3, 3) array
            The third coordinate is positive where the plane is seen.
        """
        still = len(self.times) == 1
        if still and height_m in self.planes:
            return self.planes[height_m]
        P = self.projections_at(self.row_times(v))
        G = np.stack([P[..., 0], P[..., 1], P[..., 3] + height_m * P[..., 2]], axis=-1)
        planes = np.asarray(np.linalg.inv(G))
        if still:
            self.planes[height_m] = planes
        return planes


@dataclass(frozen=True, slots=True, eq=False)
class BodyMotion:
    """Poses of a body around the time of a frame, linear in between."""

    times: FloatArray
    """(K,) [s]. Ascending, evenly."""

    poses: FloatArray
    """(K, 3) [m, m, rad]. Positions and headings, without jumps by whole turns."""

    @classmethod
    def of(cls, body: Body, t: float, span_s: float) -> BodyMotion:
        """Take a body's poses.

        Parameters
        ----------
        body : Body
            The body.
        t : float [s]
            Middle of the exposure of the middle row.
        span_s : float [s]
            From the first light on the first row to the last on the last.

        Returns
        -------
        motion : BodyMotion
            Of that time.
        """
        times = _knots(t, span_s)
        xy, theta = body.pose(times)
        poses = np.empty((len(times), 3))
        poses[:, :2] = xy
        poses[:, 2] = theta if np.ptp(theta) < np.pi else np.unwrap(theta)
        return cls(times, poses)

    def at(self, t: FloatArray) -> FloatArray:
        """Interpolate.

        Parameters
        ----------
        t : (N,) array [s]
            Times.

        Returns
        -------
        poses : (N, 3) or (1, 3) array [m, m, rad]
            Positions and headings; one where the body is known at one time only.
        """
        if len(self.times) == 1:
            return self.poses
        low, share = between(self.times, t)
        before = self.poses[low]
        return np.asarray(before + share[:, None] * (self.poses[low + 1] - before))

    def pose(self, t: float) -> tuple[float, float, float]:
        """Interpolate at one time.

        Parameters
        ----------
        t : float [s]
            When.

        Returns
        -------
        pose : (float, float, float) [m, m, rad]
            Position and heading.
        """
        last = len(self.times) - 1
        if last == 0:
            x, y, theta = self.poses[0].tolist()
            return x, y, theta
        first, end = float(self.times[0]), float(self.times[-1])
        place = min(max((t - first) * (last / (end - first)), 0.0), last)
        low = min(int(place), last - 1)
        (x, y, theta), (u, v, turn) = self.poses[low : low + 2].tolist()
        share = place - low
        return x + share * (u - x), y + share * (v - y), theta + share * (turn - theta)

    def body_from_plane(self, t: FloatArray) -> FloatArray:
        """From the ground, or a plane above it, into the body's frame.

        Parameters
        ----------
        t : (N,) array [s]
            Times.

        Returns
        -------
        body_from_plane : (N, 3, 3) or (1, 3, 3) array
            Turns and shifts.
        """
        x, y, theta = self.at(t).T
        c, s = np.cos(theta), np.sin(theta)
        out = np.zeros((len(theta), 3, 3))
        out[:, 0, 0], out[:, 0, 1], out[:, 0, 2] = c, s, -(c * x + s * y)
        out[:, 1, 0], out[:, 1, 1], out[:, 1, 2] = -s, c, s * x - c * y
        out[:, 2, 2] = 1.0
        return out


def between(times: FloatArray, t: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Find the knots around some times.

    Parameters
    ----------
    times : (K,) array [s]
        At least two, evenly.
    t : (N,) array [s]
        Times; those outside are moved to the ends.

    Returns
    -------
    low : (N,) array of int
        The knot before, never the last.
    share : (N,) array
        Of the way to the next one.
    """
    last = len(times) - 1
    place = (t - times[0]) * (last / (times[-1] - times[0]))
    place = np.minimum(np.maximum(place, 0.0), last)
    low = np.minimum(place.astype(np.intp), last - 1)
    return low, place - low


def _knots(t: float, span_s: float) -> FloatArray:
    return t + np.linspace(-0.5, 0.5, KNOTS) * span_s if span_s > 0 else np.array([t])

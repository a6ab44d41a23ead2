"""Cameras and bodies during one short exposure: matrices at a few times, linear in between.

A rolling shutter exposes each row at its own time. Over the few milliseconds that a part of the image takes, camera
and bodies move so little that their matrices may be interpolated; `scene_truth` does not do so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.sim.lens import Lens

if TYPE_CHECKING:
    from airground.sim.body import Body
    from airground.sim.scene import Scene

__all__ = ["BodyMotion", "View"]

KNOTS = 5  # over a readout of 20 ms a drone that shakes by 5 px at 2 Hz is met within 0.01 px
ROUNDS = 3  # for the time of a point's row


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
    """(K,) [s]. When the camera is known; one for a still one."""

    projections: FloatArray
    """(K, 3, 4). K (R | -R c) then."""

    eye: FloatArray
    """(3,) [m]. Where the camera is at `t`."""

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
        rolls = scene.readout_s > 0 and not scene.still
        offsets = np.linspace(-0.5, 0.5, KNOTS) if rolls else np.zeros(1)
        times = t + offsets * scene.readout_s
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
        """Give the view of a camera that stands still, at another time.

        Parameters
        ----------
        t : float [s]
            When.

        Returns
        -------
        view : View
            Then.
        """
        return View(
            t, self.readout_s, self.image_size_px, self.lens, self.times, self.projections, self.eye
        )

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
        inside = np.clip(v, -0.5, height - 0.5)
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
        step = self.times[1] - self.times[0]
        place = np.clip((t - self.times[0]) / step, 0, len(self.times) - 1)
        low = np.minimum(place.astype(int), len(self.times) - 2)
        share = (place - low)[:, None, None]
        return np.asarray(self.projections[low] * (1 - share) + self.projections[low + 1] * share)

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
        P = self.projections_at(self.row_times(v))
        G = np.stack([P[..., 0], P[..., 1], P[..., 3] + height_m * P[..., 2]], axis=-1)
        return np.asarray(np.linalg.inv(G))

    def image_of(self, body: BodyMotion, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where points of a body are in the image.

        Parameters
        ----------
        body : BodyMotion
            How it moves.
        points : (N, 3) array [m]
            In its frame.

        Returns
        -------
        uv : (N, 2) array [px]
            Through lens and shutter; NaN behind the camera.
        depth : (N,) array [m]
            Along the optical axis.
        """
        t = np.full(len(points), self.t)
        for _ in range(ROUNDS if self.readout_s else 1):
            xyz = body.world(points, t)
            P = self.projections_at(t)
            if len(P) == 1:
                w = xyz @ P[0, :, :3].T + P[0, :, 3]
            else:
                w = np.einsum("nij,nj->ni", P[..., :3], xyz) + P[..., 3]
            depth = np.where(w[:, 2] > 1e-3, w[:, 2], np.nan)
            uv = w[:, :2] / depth[:, None]
            if self.lens is not None:
                uv = self.lens.distort(uv)
            t = self.row_times(np.nan_to_num(uv[:, 1], nan=0.0))
        return uv, depth


@dataclass(frozen=True, slots=True, eq=False)
class BodyMotion:
    """Poses of a body around the time of a frame, linear in between."""

    times: FloatArray
    """(K,) [s]. Ascending."""

    xy: FloatArray
    """(K, 2) [m]. Positions."""

    theta: FloatArray
    """(K,) [rad]. Headings."""

    @classmethod
    def of(cls, body: Body, start_s: float, end_s: float) -> BodyMotion:
        """Take a body's poses.

        Parameters
        ----------
        body : Body
            The body.
        start_s, end_s : float [s]
            From the first light on the first row to the last on the last.

        Returns
        -------
        motion : BodyMotion
            Of that time.
        """
        times = np.linspace(start_s, end_s, KNOTS) if end_s > start_s else np.array([start_s])
        xy, theta = body.pose(times)
        return cls(times, xy, theta)

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Interpolate.

        Parameters
        ----------
        t : (N,) array [s]
            Times.

        Returns
        -------
        xy : (N, 2) array [m]
            Positions.
        theta : (N,) array [rad]
            Headings.
        """
        if len(self.times) == 1:
            return np.broadcast_to(self.xy, (len(t), 2)), np.broadcast_to(self.theta, len(t))
        x, y, theta = (np.interp(t, self.times, a) for a in (*self.xy.T, self.theta))
        return np.column_stack([x, y]), theta

    def world(self, points: FloatArray, t: FloatArray) -> FloatArray:
        """Points of the body in the world.

        Parameters
        ----------
        points : (N, 3) array [m]
            In the body's frame.
        t : (N,) array [s]
            One time for each.

        Returns
        -------
        xyz : (N, 3) array [m]
            In the world.
        """
        xy, theta = self.at(t)
        c, s = np.cos(theta), np.sin(theta)
        x, y, z = points.T
        out = np.empty_like(points)
        out[:, 0], out[:, 1], out[:, 2] = xy[:, 0] + c * x - s * y, xy[:, 1] + s * x + c * y, z
        return out

    def body_from_plane(self, t: FloatArray) -> FloatArray:
        """From the ground, or a plane above it, into the body's frame.

        Parameters
        ----------
        t : (N,) array [s]
            Times.

        Returns
        -------
        body_from_plane : (N, 3, 3) array
            Turns and shifts.
        """
        xy, theta = self.at(t)
        c, s = np.cos(theta), np.sin(theta)
        out = np.zeros((len(t), 3, 3))
        out[:, 0, 0], out[:, 0, 1], out[:, 0, 2] = c, s, -(c * xy[:, 0] + s * xy[:, 1])
        out[:, 1, 0], out[:, 1, 1], out[:, 1, 2] = -s, c, s * xy[:, 0] - c * xy[:, 1]
        out[:, 2, 2] = 1.0
        return out

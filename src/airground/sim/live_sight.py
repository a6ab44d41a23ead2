"""Sightings in the embedded world without pictures: what a good detector of tags would find, at little cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.sim.live_scene import CLOTH
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.geometry.arrays import FloatArray
    from airground.sim.body import Body, Tag
    from airground.sim.live_pictures import Picture
    from airground.sim.scene_camera import Pinhole

__all__ = ["LiveSight"]

ANGLE_SIGMA_RAD = 0.01
LEAST_SIGMA_PX = 0.05  # a covariance must not be zero


class LiveSight:
    """Finds the tags of bodies.

    Parameters
    ----------
    bodies : tuple of Body
        Some with tags.
    camera : Pinhole
        Without a lens.
    sigma_px : float [px]
        Noise of positions.
    seed : int
        Of the noise; that of a picture depends on its number only.
    """

    def __init__(
        self, bodies: tuple[Body, ...], camera: Pinhole, sigma_px: float, seed: int
    ) -> None:
        self._tagged = [body for body in bodies if body.tags]
        self._others = [body for body in bodies if not body.name.startswith(CLOTH)]
        self._rows = [self._others.index(body) for body in self._tagged]
        self._radii = np.array([body.radius_m for body in self._others])
        self._heights = np.array([body.height_m for body in self._others])
        self._points = np.stack([_points(*body.tags[0]) for body in self._tagged])
        self._labels = [str(body.tags[0][0].number) for body in self._tagged]
        self._camera = camera
        self._last_px = np.array(self._camera.image_size_px) - 1
        self._sigma_px = sigma_px
        self._seed = seed

    def look(self, picture: Picture, covered: frozenset[str]) -> Sightings:
        """See what is in a picture.

        Parameters
        ----------
        picture : Picture
            When it was taken.
        covered : frozenset of str
            Names of bodies whose tags are under a cloth.

        Returns
        -------
        sightings : Sightings
            With labels as a detector of tags gives them: their numbers; stamped as the picture.
        """
        when = np.array([picture.exposed_s])
        noise = np.random.default_rng([self._seed, picture.index, 0x519])
        shakes = noise.normal(size=(len(self._tagged), 3))
        poses = [(*xy[0], theta[0]) for xy, theta in (body.pose(when) for body in self._others)]
        places = np.array(poses)
        x, y, theta = places[self._rows].T[:, :, None]
        c, s = np.cos(theta), np.sin(theta)
        ahead, left, up = np.moveaxis(self._points, -1, 0)  # (tag, point)
        xyz = np.stack([x + c * ahead - s * left, y + s * ahead + c * left, up], axis=-1)
        uv = self._camera.project(xyz)
        # NaN, of what is not in front of the camera, compares as False.
        seen = ((uv >= 0) & (uv <= self._last_px)).all(axis=(1, 2))
        seen &= ~self._hidden(places, xyz[:, 0])
        seen &= [body.name not in covered for body in self._tagged]
        rows = np.flatnonzero(seen)
        if not len(rows):
            return Sightings.none(picture.t)
        uv = uv[rows] + self._sigma_px * shakes[rows, None, :2]
        along = uv[:, 1] - uv[:, 0]
        angle = np.arctan2(along[:, 1], along[:, 0]) + ANGLE_SIGMA_RAD * shakes[rows, 2]
        count = len(rows)
        sigma_px = max(self._sigma_px, LEAST_SIGMA_PX)
        return Sightings(
            picture.t,
            uv[:, 0],
            np.tile(sigma_px**2 * np.eye(2), (count, 1, 1)),
            tuple(self._labels[row] for row in rows),
            angle,
            np.full(count, ANGLE_SIGMA_RAD),
            np.ones(count),
            uv[:, 2:],
        )

    def _hidden(self, places: FloatArray, marks: FloatArray) -> NDArray[np.bool_]:
        """(N,). Whether the line of sight to each mark meets another body, taken for an upright cylinder."""
        eye = self._camera.centre_m
        way = (marks - eye)[:, None]  # (mark, 1, 3)
        to = places[None, :, :2] - eye[:2]  # (1, body, 2)
        flat = (way[..., :2] ** 2).sum(axis=-1)
        share = np.clip((to * way[..., :2]).sum(axis=-1) / flat, 0.0, 1.0)
        off = np.linalg.norm(to - share[..., None] * way[..., :2], axis=-1)
        below = eye[2] + share * way[..., 2] < self._heights
        meets = below & (off < self._radii) & (self._heights > marks[:, 2:])
        meets[np.arange(len(marks)), self._rows] = False
        return np.asarray(meets.any(axis=1))


def _points(tag: Tag, height_m: float) -> FloatArray:
    """(6, 3) [m]. Middle of a tag, a point ahead of it, and its corners, on its body."""
    half = tag.size_m / 2
    corners = [(half, half), (half, -half), (-half, -half), (-half, half)]
    flat = np.array([(0.0, 0.0), (half / 2, 0.0), *corners]) + tag.at_m
    return np.column_stack([flat, np.full(6, height_m)])

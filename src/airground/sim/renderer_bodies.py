"""A body as a small layer with transparency: walls, roofs, and the mean over its motion while the shutter is open."""

from __future__ import annotations

from math import cos, hypot, sin
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.sim.body_roof import Roof
from airground.sim.renderer_layers import Layer, Window
from airground.sim.renderer_strips import through_corners
from airground.sim.renderer_walls import Walls
from airground.vision.frame import ImageArray
from airground.vision.raster import paint
from airground.vision.raster.maps import grid_positions, spread
from airground.vision.raster.pyramid import shrink

if TYPE_CHECKING:
    from airground.sim.body import Body
    from airground.sim.renderer_crowd import Seen
    from airground.sim.renderer_views import BodyMotion, View
    from airground.sim.scene import Sun

__all__ = ["BodyArtist"]

STEP = (
    8  # samples of a map from one exact place to the next; what is between is met within 0.005 px
)
WALLS = 2  # samples to a pixel on walls, along u and along v
ACROSS = 2  # samples to a pixel on roofs, along u
DOWN = (2, 4)  # along v: roofs seen at a flat angle need more
SHARPER = 0.85  # texels of a roof are that much finer than the samples, about
STEEP = 1.2  # over how much longer than wide a pixel's piece of roof may be before they do


class BodyArtist:
    """Draws one body.

    Parameters
    ----------
    body : Body
        The body.
    sun : Sun
        Shades its walls.
    light : float
        What all colours are multiplied by.
    finest_m : float [m]
        Texels of its roof need not be smaller.
    """

    def __init__(self, body: Body, sun: Sun, light: float, finest_m: float) -> None:
        self.body = body
        self._roofs = [
            Roof.paint(part, finest_m, light) if part.marks else None for part in body.parts
        ]
        slant = sun.slant
        self._to_sun = -slant / np.hypot(1.0, np.hypot(*slant))
        self._walls = Walls.of(body.parts)
        paints = [light * np.array(part.colour) for part in body.parts]
        counts = [len(part.outline) for part in body.parts]
        self._paints = np.repeat(np.reshape(paints, (-1, 3)), counts, axis=0)
        self._tops = [(*np.rint(np.minimum(p, 255)).astype(int).tolist(), 255) for p in paints]
        self._middles = [part.outline.mean(axis=0).tolist() for part in body.parts]
        tops = [0.0] + [part.top_m for part in body.parts]
        self._levels = [max(h for h in tops if h <= part.bottom_m + 1e-9) for part in body.parts]

    def draw(self, views: list[View], motion: BodyMotion, seen: list[Seen]) -> Layer | None:
        """Draw the mean over some times.

        Parameters
        ----------
        views : list of View
            Cameras, evenly over the exposure.
        motion : BodyMotion
            Poses over the exposure.
        seen : list of Seen
            Where the body's corners are then.

        Returns
        -------
        layer : Layer or None
            None where nothing of the body is in the image.
        """
        if not self.body.parts:
            return None
        window = Window.around(
            np.concatenate([one.corners for one in seen]), views[0].image_size_px
        )
        if window is None:
            return None
        layers = [
            self._once(view, motion, one.corners, window)
            for view, one in zip(views, seen, strict=True)
        ]
        return Layer(window, paint.average(layers))

    def _once(self, view: View, motion: BodyMotion, uv: FloatArray, window: Window) -> ImageArray:
        canvas = np.zeros((window.height * WALLS, window.width * WALLS, 4), dtype=np.uint8)
        # The outer edge of the first pixel is the outer edge of the first sample.
        fixed = paint.fixed_point((uv - [window.left, window.top] + 0.5) * WALLS - 0.5)
        x, y, theta = motion.pose(view.t)
        c, s = cos(theta), sin(theta)
        turn = np.array([[c, s], [-s, c]])
        off = view.eye[:2] - [x, y]
        eye, sun = turn @ off, turn @ self._to_sun
        # Roofs at a flat angle are squeezed along v: as many more samples there.
        drop = float(view.eye[2]) - self.body.height_m
        slope = hypot(drop, *off.tolist()) / max(drop, 1e-3)
        down = DOWN[0] if slope < STEEP else DOWN[1]
        order = self._far_to_near(eye.tolist())
        faces, shades = self._walls.seen(eye, sun)
        colours = np.rint(np.minimum(self._paints * shades[:, None], 255.0)).astype(int).tolist()
        quads = fixed[self._walls.corners]
        later = []  # roofs with nothing above them keep all their samples to the end
        for place, k in enumerate(order):
            part, first, last = self.body.parts[k], *self._walls.firsts[k : k + 2]
            for n in range(first, last):
                if faces[n]:
                    paint.fill(canvas, quads[n], (*colours[n], 255))
            if view.eye[2] <= part.top_m:
                continue
            paint.fill(canvas, fixed[first + last : 2 * last], self._tops[k])
            if self._roofs[k] is None:
                continue
            if any(self.body.parts[n].top_m > part.top_m for n in order[place + 1 :]):
                roof = self._roof(k, uv, view, motion, (window, (WALLS, WALLS)))
                if roof is not None:
                    paint.lay_over(roof.window.of(canvas), roof.picture)
            else:
                later.append(k)
        layer = shrink(canvas, (window.width, window.height))
        for k in later:
            roof = self._roof(k, uv, view, motion, (window, (ACROSS, down)))
            if roof is not None:
                cut = roof.window
                size = (cut.width // ACROSS, cut.height // down)
                left, top = cut.left // ACROSS, cut.top // down
                pixels = layer[top : top + size[1], left : left + size[0]]
                paint.lay_over(pixels, shrink(roof.picture, size))
        return layer

    def _far_to_near(self, eye: list[float]) -> list[int]:
        """Parts in the order of painting: what stands on another comes later, and nearer things at one level do."""
        away = [hypot(x - eye[0], y - eye[1]) for x, y in self._middles]
        return sorted(range(len(away)), key=lambda k: (self._levels[k], -away[k]))

    def _roof(
        self,
        k: int,
        uv: FloatArray,
        view: View,
        motion: BodyMotion,
        grid: tuple[Window, tuple[int, int]],
    ) -> Layer | None:
        """A part's roof, on a grid of some samples to each pixel of the window."""
        window, fine = grid
        roof, height_m = self._roofs[k], self.body.parts[k].top_m
        first, last = self._walls.firsts[k : k + 2]
        assert roof is not None
        pixels = Window.around(
            uv[first + last : 2 * last] - [window.left, window.top],
            (window.width, window.height),
            1,
        )
        if pixels is None:
            return None
        columns, rows = pixels.width * fine[0], pixels.height * fine[1]
        if view.lens is None:
            ends = np.array([0.0, rows - 1.0] if view.readout_s else [0.0])
            v = window.top + pixels.top - 0.5 + (ends + 0.5) / fine[1]
            body = motion.body_from_plane(view.row_times(v)) @ view.planes_at(v, height_m)
            texel = roof.texel_from_body @ body
            left = window.left + pixels.left - 0.5 + 0.5 / fine[0]
            shift = np.array([[1 / fine[0], 0.0, left], [0.0, 1 / fine[1], v[0]], [0.0, 0.0, 1.0]])
            if len(texel) == 1:
                texel_from_sample = texel[0] @ shift
            else:
                across = np.array([0.0, columns - 1.0])
                u = left + across / fine[0]
                w = texel[:, :, :1] * u + (texel[:, :, 1] * v[:, None] + texel[:, :, 2])[..., None]
                corners = (w[:, :2] / w[:, 2:]).transpose(0, 2, 1)
                texel_from_sample = through_corners(across, ends, corners)
            painted = roof.picture.warp(texel_from_sample, (columns, rows), SHARPER)
        else:
            u = window.left + pixels.left - 0.5 + (grid_positions(columns, STEP) + 0.5) / fine[0]
            v = window.top + pixels.top - 0.5 + (grid_positions(rows, STEP) + 0.5) / fine[1]
            body = motion.body_from_plane(view.row_times(v)) @ view.planes_at(v, height_m)
            texel = roof.texel_from_body @ body
            flat = view.lens.undistort(np.stack(np.meshgrid(u, v), axis=-1))
            w = texel[:, :, :2] @ flat.transpose(0, 2, 1) + texel[:, :, 2:]
            texels = (w[:, :2] / w[:, 2:]).transpose(0, 2, 1)
            # NaN, beyond the lens's rim, becomes a place outside the roof.
            texels = np.where(np.abs(texels) < 3e4, texels, -1e4)
            places = spread(texels, (STEP, STEP), (columns, rows))
            middle = places[rows // 2, columns // 2]
            steps = places[min(rows // 2 + 1, rows - 1), columns // 2] - middle
            aside = places[rows // 2, min(columns // 2 + 1, columns - 1)] - middle
            density = max(float(np.hypot(*steps)), float(np.hypot(*aside)))
            painted = roof.picture.sample(places, roof.picture.level_for(SHARPER * density))
        return Layer(Window(pixels.left * fine[0], pixels.top * fine[1], columns, rows), painted)

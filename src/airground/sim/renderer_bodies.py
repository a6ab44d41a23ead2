"""A body as a small layer with transparency: walls, roofs, and the mean over its motion while the shutter is open."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.sim.body_roof import Roof
from airground.sim.renderer_layers import Layer, Window
from airground.sim.renderer_walls import Walls
from airground.vision.frame import ImageArray
from airground.vision.raster import paint
from airground.vision.raster.maps import grid_positions, spread
from airground.vision.raster.pyramid import shrink

if TYPE_CHECKING:
    from airground.sim.body import Body, Part
    from airground.sim.renderer_views import BodyMotion, View
    from airground.sim.scene import Sun

__all__ = ["BodyArtist"]

MARGIN_PX = 8.0  # around corners, for the glow of lamps
STEP = (
    8  # samples of a map from one exact place to the next; what is between is met within 0.005 px
)
WALLS = 2  # samples to a pixel on walls, along u and along v
ACROSS = 2  # samples to a pixel on roofs, along u
DOWN = (2, 4)  # along v: roofs seen at a flat angle need more
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
        self._light = light
        self._roofs = [
            Roof.paint(part, finest_m, light) if part.marks else None for part in body.parts
        ]
        slant = sun.slant
        self._to_sun = np.array([-slant[0], -slant[1], 1.0]) / np.hypot(1.0, np.hypot(*slant))
        self._points = (
            np.concatenate([_corners(part) for part in body.parts]) if body.parts else None
        )
        firsts = np.cumsum([0] + [2 * len(part.outline) for part in body.parts]).tolist()
        self._walls = [Walls.of(part, k) for part, k in zip(body.parts, firsts, strict=False)]
        self._middles = np.array([part.outline.mean(axis=0) for part in body.parts]).reshape(-1, 2)
        tops = [0.0] + [part.top_m for part in body.parts]
        self._levels = [max(h for h in tops if h <= part.bottom_m + 1e-9) for part in body.parts]

    def draw(self, views: list[View], motion: BodyMotion) -> Layer | None:
        """Draw the mean over some times.

        Parameters
        ----------
        views : list of View
            Cameras, evenly over the exposure.
        motion : BodyMotion
            Poses over the exposure.

        Returns
        -------
        layer : Layer or None
            None where nothing of the body is in the image.
        """
        if self._points is None:
            return None
        places = [view.image_of(motion, self._points)[0] for view in views]
        window = Window.around(np.concatenate(places), views[0].image_size_px)
        if window is None:
            return None
        down = self._samples_down(views[0], motion)
        layers = [
            self._once(view, motion, uv, window, down)
            for view, uv in zip(views, places, strict=True)
        ]
        return Layer(window, paint.average(layers))

    def window(self, view: View, motion: BodyMotion) -> Window | None:
        """Give the part of the image that the body takes, lamps included.

        Parameters
        ----------
        view : View
            The camera.
        motion : BodyMotion
            Poses.

        Returns
        -------
        window : Window or None
            None where nothing of it is in the image.
        """
        points = [] if self._points is None else [self._points]
        points += [np.array([lamp.at_m]) for lamp in self.body.lamps]
        uv = view.image_of(motion, np.concatenate(points))[0]
        return Window.around(uv, view.image_size_px, MARGIN_PX)

    def motion_px(self, first: View, last: View, motion: BodyMotion) -> float:
        """How far the body moves in the image while the shutter is open.

        Parameters
        ----------
        first, last : View
            When it opens and closes.
        motion : BodyMotion
            Poses.

        Returns
        -------
        way_px : float [px]
            Of its reference point and of a point at its rim; 0 if it is behind the camera.
        """
        points = np.stack([self.body.reference, [self.body.radius_m, 0.0, 0.0]])
        way = last.image_of(motion, points)[0] - first.image_of(motion, points)[0]
        return float(np.nan_to_num(np.hypot(*way.T)).max())

    def _samples_down(self, view: View, motion: BodyMotion) -> int:
        """Roofs at a flat angle are squeezed along v: as many more samples there."""
        xy = motion.at(np.array([view.t]))[0][0]
        drop = view.eye[2] - self.body.height_m
        slope = np.hypot(drop, np.hypot(*(xy - view.eye[:2]))) / max(drop, 1e-3)
        return DOWN[0] if slope < STEEP else DOWN[1]

    def _once(
        self, view: View, motion: BodyMotion, uv: FloatArray, window: Window, down: int
    ) -> ImageArray:
        canvas = np.zeros((window.height * WALLS, window.width * WALLS, 4), dtype=np.uint8)
        # The outer edge of the first pixel is the outer edge of the first sample.
        fixed = paint.fixed_point((uv - [window.left, window.top] + 0.5) * WALLS - 0.5)
        xy, theta = motion.at(np.array([view.t]))
        c, s = np.cos(theta[0]), np.sin(theta[0])
        turn = np.array([[c, s], [-s, c]])
        eye, sun = turn @ (view.eye[:2] - xy[0]), turn @ self._to_sun[:2]
        order = self._far_to_near(eye)
        later = []  # roofs with nothing above them keep all their samples to the end
        for place, k in enumerate(order):
            part, walls = self.body.parts[k], self._walls[k]
            low = fixed[walls.first : walls.first + walls.count]
            high = fixed[walls.first + walls.count : walls.first + 2 * walls.count]
            for edge, shade in walls.seen(eye, sun):
                after = (edge + 1) % walls.count
                quad = np.stack((low[edge], low[after], high[after], high[edge]))
                paint.fill(canvas, quad, self._colour(part, shade))
            if view.eye[2] <= part.top_m:
                continue
            paint.fill(canvas, high, self._colour(part, 1.0))
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

    def _far_to_near(self, eye: FloatArray) -> list[int]:
        """Parts in the order of painting: what stands on another comes later, and nearer things at one level do."""
        away = np.hypot(*(self._middles - eye).T)
        return sorted(range(len(away)), key=lambda k: (self._levels[k], -away[k]))

    def _colour(self, part: Part, shade: float) -> tuple[int, ...]:
        colours = [min(round(level * shade * self._light), 255) for level in part.colour]
        return (*colours, 255)

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
        walls, roof, height_m = self._walls[k], self._roofs[k], self.body.parts[k].top_m
        assert roof is not None
        outline = uv[walls.first + walls.count : walls.first + 2 * walls.count]
        pixels = Window.around(
            outline - [window.left, window.top], (window.width, window.height), 1
        )
        if pixels is None:
            return None
        columns, rows = pixels.width * fine[0], pixels.height * fine[1]
        u = window.left + pixels.left - 0.5 + (grid_positions(columns, STEP) + 0.5) / fine[0]
        v = window.top + pixels.top - 0.5 + (grid_positions(rows, STEP) + 0.5) / fine[1]
        body = motion.body_from_plane(view.row_times(v)) @ view.planes_at(v, height_m)
        texel = roof.texel_from_body @ body
        if view.lens is None:
            w = texel[:, :, 0, None] * u + (texel[:, :, 1] * v[:, None] + texel[:, :, 2])[..., None]
            w = w.transpose(1, 0, 2)
        else:
            uv = view.lens.undistort(np.stack(np.meshgrid(u, v), axis=-1))
            w = np.einsum("nij,nmj->inm", texel[:, :, :2], uv) + texel[:, :, 2].T[:, :, None]
        texels = (w[:2] / w[2]).transpose(1, 2, 0)
        texels = np.clip(np.nan_to_num(texels, nan=-1e4), -1e4, 3e4)
        places = spread(texels, (STEP, STEP), (columns, rows))
        middle = places[rows // 2, columns // 2]
        steps = places[min(rows // 2 + 1, rows - 1), columns // 2] - middle
        aside = places[rows // 2, min(columns // 2 + 1, columns - 1)] - middle
        density = max(float(np.hypot(*steps)), float(np.hypot(*aside)))
        painted = roof.picture.sample(places, roof.picture.level_for(0.85 * density))
        return Layer(Window(pixels.left * fine[0], pixels.top * fine[1], columns, rows), painted)


def _corners(part: Part) -> FloatArray:
    """(2 N, 3). Of the underside, then of the roof."""
    count = len(part.outline)
    low = np.column_stack([part.outline, np.full(count, part.bottom_m)])
    high = np.column_stack([part.outline, np.full(count, part.top_m)])
    return np.concatenate([low, high])

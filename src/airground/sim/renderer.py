"""Pictures of a scene: ground, shadows, bodies, lamps, blur, shutter and noise."""

from __future__ import annotations

from math import ceil, hypot
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.renderer_bodies import BodyArtist
from airground.sim.renderer_crowd import Crowd
from airground.sim.renderer_ground import GroundArtist
from airground.sim.renderer_lamps import add_lamps
from airground.sim.renderer_layers import Layer, Window
from airground.sim.renderer_shadows import cast_shadow
from airground.sim.renderer_views import BodyMotion, View
from airground.vision.frame import ImageArray
from airground.vision.raster import paint
from airground.vision.raster.noise import SensorNoise

if TYPE_CHECKING:
    from airground.sim.renderer_crowd import Sight
    from airground.sim.scene import Scene

__all__ = ["Renderer"]

BLUR_STEP_PX = 1.25  # hardly more than the pixel that blurs it anyway: a blur is seen without steps
MOST_STEPS = 6
GLOW_PX = 8.0  # of a lamp, or way of a body, that is just outside the image


class Renderer:
    """Draws frames of a scene. A frame depends on its time and number only, not on those drawn before.

    Parameters
    ----------
    scene : Scene
        What to draw.
    seed : int
        Of the sensor's noise.
    """

    def __init__(self, scene: Scene, seed: int = 0) -> None:
        self.scene = scene
        camera = scene.camera_at(0.0)
        self._at_rest = View.of(scene, 0.0) if scene.still else None
        self._ground = GroundArtist(scene.ground, scene.brightness)
        self._artists = [
            BodyArtist(body, scene.sun, scene.brightness, _finest(scene, body.height_m))
            for body in scene.bodies
        ]
        self._crowds = {
            moves: Crowd([body for body in scene.bodies if moves in (None, body.moves)], scene.sun)
            for moves in (None, False, True)
        }
        self._noise = SensorNoise(camera.image_size_px, scene.noise, scene.shot_noise, seed)
        self._still: tuple[ImageArray, list[tuple[float, Layer]]] | None = None

    def image(self, t: float, index: int = 0) -> ImageArray:
        """Draw a frame.

        Parameters
        ----------
        t : float [s]
            Middle of the exposure of the image's middle row.
        index : int
            Number of the frame: its noise.

        Returns
        -------
        image : (H, W, 3) array
            Blue, green, red; the caller's own.

        Raises
        ------
        InputError
            If the time is not finite.
        """
        image = self.clean(t)
        self._noise.apply(image, index)
        return image

    def clean(self, t: float) -> ImageArray:
        """Draw a frame without noise.

        Parameters
        ----------
        t : float [s]
            As for `image`.

        Returns
        -------
        image : (H, W, 3) array
            Blue, green, red; the caller's own.

        Raises
        ------
        InputError
            If the time is not finite.
        """
        if not np.isfinite(t):
            raise InputError(f"a frame's time must be a number of seconds, not {t}")
        if self.scene.still:
            if self._still is None:
                self._still = self._background()
            image, layers = self._still[0].copy(), self._still[1]
            self._draw(image, True, layers, self._view(t))
        else:
            view = self._view(t)
            image = self._ground.draw_quickly(view, self._way_px(view))
            self._draw(image, None, [], view)
        return image

    def _view(self, t: float) -> View:
        return View.of(self.scene, t) if self._at_rest is None else self._at_rest.later(t)

    def _way_px(self, view: View) -> FloatArray:
        """How far the ground in the middle of the image moves while the shutter is open."""
        half = self.scene.exposure_s / 2
        if half == 0:
            return np.zeros(2)
        width, height = view.image_size_px
        middle = np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
        P = view.projections_at(view.t + np.array([-half, 0.0, half]))[..., [0, 1, 3]]
        first, last = P[[0, -1]] @ np.linalg.solve(P[len(P) // 2], middle)
        return np.asarray(last[:2] / last[2] - first[:2] / first[2])

    def _background(self) -> tuple[ImageArray, list[tuple[float, Layer]]]:
        """Ground and all that never moves, and those bodies again, for what passes behind them."""
        image = self._ground.draw(self._view(0.0))
        if self.scene.vignetting:
            width, height = self.scene.image_size_px
            u, v = np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2
            radius = (u**2 + (v**2)[:, None]) / (width**2 / 4 + height**2 / 4)
            light = 1 - self.scene.vignetting * radius[..., None]
            image = np.rint(image * light).astype(np.uint8)
        return image, self._draw(image, False, [], self._view(0.0))

    def _draw(
        self,
        image: ImageArray,
        moves: bool | None,
        again: list[tuple[float, Layer]],
        view: View,
    ) -> list[tuple[float, Layer]]:
        """Draw bodies, the farthest first; layers of `again` that are in front of one are drawn again."""
        scene, crowd = self.scene, self._crowds[moves]
        artists = [a for a in self._artists if moves in (None, a.body.moves)]
        span = scene.exposure_s + scene.readout_s
        motions = [BodyMotion.of(artist.body, view.t, span) for artist in artists]
        sights = crowd.sights(view, motions, scene.exposure_s)
        for artist, sight in zip(artists, sights, strict=True):
            cast_shadow(image, artist.body, scene.sun, sight, view.image_size_px)
        x, y = view.eye[:2].tolist()
        away = [hypot(*(m.poses[len(m.poses) // 2, :2] - (x, y)).tolist()) for m in motions]
        inside = [k for k, sight in enumerate(sights) if _in_view(sight, view)]
        times = {k: self._times(view.t, sights[k].way_px) for k in inside}
        wanted = [(k, t) for k in inside for t in times[k] if len(times[k]) > 1]
        blurred = iter(crowd.seen(view, motions, wanted))
        seen = {
            k: [next(blurred) for _ in times[k]] if len(times[k]) > 1 else [sights[k].seen]
            for k in inside
        }
        drawn: list[tuple[float, Layer]] = []
        touched: list[Window] = []
        queue = [(-away[k], 0, k) for k in inside]
        queue += [(-d, 1, k) for k, (d, _) in enumerate(again)]
        for minus_away, kind, k in sorted(queue):
            if kind == 1:
                layer = again[k][1]
                if any(layer.window.meets(window) for window in touched):
                    paint.lay_over(layer.window.of(image), layer.picture)
                continue
            views = [view.later(t) for t in times[k]]
            found = artists[k].draw(views, motions[k], seen[k])
            if found is not None:
                paint.lay_over(found.window.of(image), found.picture)
                drawn.append((-minus_away, found))
                touched.append(found.window)
            add_lamps(image, artists[k].body, views, seen[k], scene)
        return drawn

    def _times(self, t: float, way_px: float) -> list[float]:
        """Enough times, evenly over the exposure, that a body's blur has no steps."""
        count = min(max(ceil(way_px / BLUR_STEP_PX), 1), MOST_STEPS)
        return [t + self.scene.exposure_s * ((k + 0.5) / count - 0.5) for k in range(count)]


def _in_view(sight: Sight, view: View) -> bool:
    lamps = sight.seen.lamps
    return Window.of_box(sight.box, view.image_size_px, GLOW_PX) is not None or (
        len(lamps) > 0 and Window.around(lamps, view.image_size_px, GLOW_PX) is not None
    )


def _finest(scene: Scene, height_m: float) -> float:
    """Half of the least distance that a pixel can see at a height: straight below the camera."""
    camera = scene.camera_at(0.0)
    drop = max(float(camera.centre_m[2]) - height_m, 0.1)
    forward = camera.camera_from_world[2]
    half = np.hypot(*camera.image_size_px) / 2 / camera.focal_length_px
    tilt = np.arccos(np.clip(-forward[2], -1, 1))
    flattest = max(tilt - np.arctan(half), 0.0)
    return float(drop / np.cos(min(flattest, 1.4)) / camera.focal_length_px / 2)

"""Pictures of a scene: ground, shadows, bodies, lamps, blur, shutter and noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.renderer_bodies import BodyArtist
from airground.sim.renderer_ground import GroundArtist
from airground.sim.renderer_lamps import add_lamps
from airground.sim.renderer_layers import Layer, Window
from airground.sim.renderer_shadows import cast_shadow
from airground.sim.renderer_views import BodyMotion, View
from airground.vision.frame import ImageArray
from airground.vision.raster import paint
from airground.vision.raster.noise import SensorNoise

if TYPE_CHECKING:
    from airground.sim.scene import Scene

__all__ = ["Renderer"]

BLUR_STEP_PX = 1.25  # hardly more than the pixel that blurs it anyway: a blur is seen without steps
MOST_STEPS = 6


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
        self._views_now: dict[float, View] = {}  # the bodies of a frame share them
        self._at_rest = View.of(scene, 0.0) if scene.still else None
        self._ground = GroundArtist(scene.ground, scene.brightness)
        self._artists = [
            BodyArtist(body, scene.sun, scene.brightness, _finest(scene, body.height_m))
            for body in scene.bodies
        ]
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
            artists = [artist for artist in self._artists if artist.body.moves]
        else:
            view = self._view(t)
            image, layers = self._ground.draw_quickly(view, self._way_px(view)), []
            artists = self._artists
        self._draw(image, artists, layers, t)
        return image

    def _view(self, t: float) -> View:
        if self._at_rest is not None:
            return self._at_rest.later(t)
        if t not in self._views_now:
            if len(self._views_now) > 4 * MOST_STEPS:
                self._views_now.clear()
            self._views_now[t] = View.of(self.scene, t)
        return self._views_now[t]

    def _way_px(self, view: View) -> FloatArray:
        """How far the ground in the middle of the image moves while the shutter is open."""
        half = self.scene.exposure_s / 2
        if half == 0:
            return np.zeros(2)
        width, height = view.image_size_px
        middle = np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
        spot = np.linalg.inv(self.scene.image_from_plane(0.0, view.t)) @ middle
        ends = [self.scene.image_from_plane(0.0, view.t + k * half) @ spot for k in (-1, 1)]
        return np.asarray(ends[1][:2] / ends[1][2] - ends[0][:2] / ends[0][2])

    def _background(self) -> tuple[ImageArray, list[tuple[float, Layer]]]:
        """Ground and all that never moves, and those bodies again, for what passes behind them."""
        image = self._ground.draw(self._view(0.0))
        if self.scene.vignetting:
            width, height = self.scene.image_size_px
            u, v = np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2
            radius = (u**2 + (v**2)[:, None]) / (width**2 / 4 + height**2 / 4)
            light = 1 - self.scene.vignetting * radius[..., None]
            image = np.rint(image * light).astype(np.uint8)
        fixed = [artist for artist in self._artists if not artist.body.moves]
        return image, self._draw(image, fixed, [], 0.0)

    def _draw(
        self,
        image: ImageArray,
        artists: list[BodyArtist],
        again: list[tuple[float, Layer]],
        t: float,
    ) -> list[tuple[float, Layer]]:
        """Draw bodies, the farthest first; layers of `again` that are in front of one are drawn again."""
        scene = self.scene
        around = (scene.exposure_s + scene.readout_s) / 2
        middle = self._view(t)
        motions = [BodyMotion.of(artist.body, t - around, t + around) for artist in artists]
        for artist, motion in zip(artists, motions, strict=True):
            cast_shadow(image, artist.body, scene.sun, middle, motion)
        away = [float(np.hypot(*(m.at(np.array([t]))[0][0] - middle.eye[:2]))) for m in motions]
        drawn: list[tuple[float, Layer]] = []
        touched: list[Window] = []
        queue = [(-d, 0, k) for k, d in enumerate(away)]
        queue += [(-d, 1, k) for k, (d, _) in enumerate(again)]
        for minus_away, kind, k in sorted(queue):
            if kind == 1:
                layer = again[k][1]
                if any(layer.window.meets(window) for window in touched):
                    paint.lay_over(layer.window.of(image), layer.picture)
                continue
            if artists[k].window(middle, motions[k]) is None:
                continue
            views = self._views(artists[k], motions[k], t, middle)
            found = artists[k].draw(views, motions[k])
            if found is not None:
                paint.lay_over(found.window.of(image), found.picture)
                drawn.append((-minus_away, found))
                touched.append(found.window)
            add_lamps(image, artists[k].body, views, motions[k], scene)
        return drawn

    def _views(self, artist: BodyArtist, motion: BodyMotion, t: float, middle: View) -> list[View]:
        """Enough times, evenly over the exposure, that its blur has no steps."""
        scene = self.scene
        if scene.exposure_s == 0:
            return [middle]
        half = scene.exposure_s / 2
        way = artist.motion_px(self._view(t - half), self._view(t + half), motion)
        count = int(np.clip(np.ceil(way / BLUR_STEP_PX), 1, MOST_STEPS))
        if count == 1:
            return [middle]
        return [self._view(t + scene.exposure_s * ((k + 0.5) / count - 0.5)) for k in range(count)]


def _finest(scene: Scene, height_m: float) -> float:
    """Half of the least distance that a pixel can see at a height: straight below the camera."""
    camera = scene.camera_at(0.0)
    drop = max(float(camera.centre_m[2]) - height_m, 0.1)
    forward = camera.camera_from_world[2]
    half = np.hypot(*camera.image_size_px) / 2 / camera.focal_length_px
    tilt = np.arccos(np.clip(-forward[2], -1, 1))
    flattest = max(tilt - np.arctan(half), 0.0)
    return float(drop / np.cos(min(flattest, 1.4)) / camera.focal_length_px / 2)

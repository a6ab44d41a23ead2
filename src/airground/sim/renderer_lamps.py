"""Lamps: small glowing spots that may saturate the sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.sim.renderer_layers import Window

if TYPE_CHECKING:
    from airground.sim.body import Body
    from airground.sim.renderer_crowd import Seen
    from airground.sim.renderer_views import View
    from airground.sim.scene import Scene
    from airground.vision.frame import ImageArray

__all__ = ["add_lamps"]

LEAST_PX = 0.8  # standard deviation of the smallest spot: the lens's own blur
REACH = 4.0  # standard deviations


def add_lamps(
    image: ImageArray, body: Body, views: list[View], seen: list[Seen], scene: Scene
) -> None:
    """Add the light of a body's lamps, in place.

    Parameters
    ----------
    image : (H, W, 3) array
        Added to.
    body : Body
        With lamps, or without.
    views : list of View
        Evenly over the exposure.
    seen : list of Seen
        The body at their times.
    scene : Scene
        Its exposure tells how much of a blink is seen.
    """
    if not body.lamps:
        return
    focal = scene.camera_at(views[0].t).focal_length_px
    for k, lamp in enumerate(body.lamps):
        uv = np.array([at.lamps[k] for at in seen])
        if not np.isfinite(uv).all():
            continue
        sigma = max(lamp.radius_m * focal / float(seen[0].depths[k]), LEAST_PX)
        window = Window.around(uv, views[0].image_size_px, REACH * sigma)
        if window is None:
            continue
        when = float(views[len(views) // 2].row_times(uv[:1, 1])[0])
        half = scene.exposure_s / 2
        share = lamp.light(when - half, when + half)
        if share == 0:
            continue
        u = window.left + np.arange(window.width)
        v = window.top + np.arange(window.height)
        glow = np.zeros((window.height, window.width))
        for at in uv:
            across = np.exp(-((u - at[0]) ** 2) / (2 * sigma**2))
            glow += np.exp(-((v - at[1]) ** 2) / (2 * sigma**2))[:, None] * across
        light = (share * lamp.power / len(uv)) * glow[..., None] * np.array(lamp.colour)
        part = window.of(image)
        part[:] = np.clip(np.rint(part + light), 0, 255).astype(np.uint8)

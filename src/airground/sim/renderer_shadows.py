"""Shadows on the ground: the outline of each part, cast along the sunlight, with a soft edge."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.sim.renderer_layers import Window
from airground.vision.raster import paint
from airground.vision.raster.pyramid import shrink

if TYPE_CHECKING:
    from airground.sim.body import Body
    from airground.sim.renderer_views import BodyMotion, View
    from airground.sim.scene import Sun
    from airground.vision.frame import ImageArray

__all__ = ["cast_shadow"]

FINE = 2  # samples to a pixel, where no blur hides the steps
SOFTEST_PX = 6.0


def cast_shadow(image: ImageArray, body: Body, sun: Sun, view: View, motion: BodyMotion) -> None:
    """Darken the ground where a body keeps the sun away, in place.

    Parameters
    ----------
    image : (H, W, 3) array
        Painted on.
    body : Body
        What casts the shadow.
    sun : Sun
        Where the light comes from.
    view : View
        The camera, in the middle of the exposure: a soft edge hides its blur.
    motion : BodyMotion
        Poses.
    """
    if sun.shadow == 0 or not body.parts:
        return
    theta = motion.at(np.array([view.t]))[1][0]
    c, s = np.cos(theta), np.sin(theta)
    x, y = sun.slant
    slant = np.array([c * x + s * y, -s * x + c * y])
    shadows = [
        np.concatenate([part.outline + slant * part.bottom_m, part.outline + slant * part.top_m])
        for part in body.parts
    ]
    points = np.concatenate(shadows)
    uv, depth = view.image_of(motion, np.column_stack([points, np.zeros(len(points))]))
    if not np.isfinite(depth).all():
        return
    scale = float(np.ptp(uv, axis=0).max()) / max(float(np.ptp(points, axis=0).max()), 1e-6)
    blur = min(sun.softness * body.height_m * scale, SOFTEST_PX)
    window = Window.around(uv, view.image_size_px, 3 * blur + 2)
    if window is None:
        return
    fine = FINE if blur < 1 else 1
    mask = np.zeros((window.height * fine, window.width * fine), dtype=np.uint8)
    samples = paint.fixed_point((uv - [window.left, window.top] + 0.5) * fine - 0.5)
    first = 0
    for shadow in shadows:
        paint.fill(mask, paint.hull(samples[first : first + len(shadow)]), (255,))
        first += len(shadow)
    if fine > 1:
        mask = shrink(mask, (window.width, window.height))
    soft = paint.soften(mask, blur)
    paint.darken(window.of(image), soft, sun.shadow)

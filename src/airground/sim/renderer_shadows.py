"""Shadows on the ground: the outline of each part, cast along the sunlight, with a soft edge."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.sim.renderer_layers import Window
from airground.vision.raster import paint
from airground.vision.raster.pyramid import shrink

if TYPE_CHECKING:
    from airground.sim.body import Body
    from airground.sim.renderer_crowd import Sight
    from airground.sim.scene import Sun
    from airground.vision.frame import ImageArray

__all__ = ["cast_shadow"]

FINE = 2  # samples to a pixel, where no blur hides the steps
SOFTEST_PX = 6.0


def cast_shadow(
    image: ImageArray, body: Body, sun: Sun, sight: Sight, image_size_px: tuple[int, int]
) -> None:
    """Darken the ground where a body keeps the sun away, in place.

    Parameters
    ----------
    image : (H, W, 3) array
        Painted on.
    body : Body
        What casts the shadow.
    sun : Sun
        Where the light comes from.
    sight : Sight
        Where the shadow is in the middle of the exposure: a soft edge hides its blur.
    image_size_px : (int, int) [px]
        Width and height.
    """
    if sun.shadow == 0 or not body.parts:
        return
    left, top, right, bottom = sight.shadow_box
    scale = max(right - left, bottom - top) / max(sight.shadow_m, 1e-6)
    blur = min(sun.softness * body.height_m * scale, SOFTEST_PX)
    window = Window.of_box(sight.shadow_box, image_size_px, 3 * blur + 2)
    if window is None:
        return
    fine = FINE if blur < 1 else 1
    mask = np.zeros((window.height * fine, window.width * fine), dtype=np.uint8)
    samples = paint.fixed_point((sight.shadow - [window.left, window.top] + 0.5) * fine - 0.5)
    first = 0
    for part in body.parts:
        last = first + 2 * len(part.outline)
        paint.fill(mask, paint.hull(samples[first:last]), (255,))
        first = last
    if fine > 1:
        mask = shrink(mask, (window.width, window.height))
    paint.darken(window.of(image), paint.soften(mask, blur), sun.shadow)

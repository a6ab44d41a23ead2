"""Roofs as pictures: every mark painted with the share of each texel that it covers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.sim.body import Disc, Part, Patch, Tag
from airground.vision.raster.pyramid import Pyramid
from airground.vision.raster.tags import tag_cells

if TYPE_CHECKING:
    from airground.sim.body import Colour, Mark

__all__ = ["Roof"]

MOST_TEXELS = 1600  # along a side; a larger roof gets larger texels
BLACK, WHITE = 18.0, 232.0  # printer's ink and paper


@dataclass(frozen=True, slots=True, eq=False)
class Roof:
    """A part's roof, seen from above, with y growing along the rows."""

    picture: Pyramid
    """Blue, green and red times the opacity, then the opacity."""

    texel_m: float
    """Side of a texel [m]."""

    corner_m: tuple[float, float]
    """Middle of texel (0, 0) in the body's frame [m]."""

    @classmethod
    def paint(cls, part: Part, finest_m: float, light: float) -> Roof:
        """Paint a part's roof.

        Parameters
        ----------
        part : Part
            Outline, colour and marks.
        finest_m : float [m]
            Side of a texel, if that does not make too many.
        light : float
            What all colours are multiplied by.

        Returns
        -------
        roof : Roof
            With all its smaller copies.
        """
        low, high = part.outline.min(axis=0), part.outline.max(axis=0)
        texel = max(finest_m, float((high - low).max()) / MOST_TEXELS)
        count = np.ceil((high - low) / texel).astype(int) + 2
        middle = (low + high) / 2
        first = middle - (count - 1) / 2 * texel
        x = first[0] + np.arange(count[0]) * texel
        y = first[1] + np.arange(count[1]) * texel
        paint = np.empty((count[1], count[0], 3))
        paint[:] = part.colour
        for mark in part.marks:
            cover, colour = _cover(mark, x, y, texel)
            paint += cover[..., None] * (colour - paint)
        opacity = _inside(part.outline, x, y, texel)[..., None]
        layer = np.concatenate([paint * (opacity * light), 255.0 * opacity], axis=-1)
        picture = np.rint(np.clip(layer, 0.0, 255.0)).astype(np.uint8)
        return cls(Pyramid.of(picture), texel, (float(first[0]), float(first[1])))

    @property
    def texel_from_body(self) -> FloatArray:
        """(3, 3). From the body's frame to texels of level 0: column, row."""
        x, y = self.corner_m
        s = 1 / self.texel_m
        return np.array([[s, 0.0, -s * x], [0.0, s, -s * y], [0.0, 0.0, 1.0]])


def _cover(
    mark: Mark, x: FloatArray, y: FloatArray, texel: float
) -> tuple[FloatArray, FloatArray | Colour]:
    """Share of each texel that a mark covers, and its colour there."""
    match mark:
        case Disc():
            away = np.hypot(x - mark.at_m[0], (y - mark.at_m[1])[:, None])
            return np.clip((mark.radius_m - away) / texel + 0.5, 0.0, 1.0), mark.colour
        case Patch():
            along = _overlap(
                x, texel, np.array(mark.at_m[0] + np.array([-0.5, 0.5]) * mark.size_m[0])
            )
            across = _overlap(
                y, texel, np.array(mark.at_m[1] + np.array([-0.5, 0.5]) * mark.size_m[1])
            )
            return across * along.T, mark.colour
        case Tag():
            return _tag(mark, x, y, texel)


def _tag(mark: Tag, x: FloatArray, y: FloatArray, texel: float) -> tuple[FloatArray, FloatArray]:
    cells = tag_cells(mark.family, mark.number)
    count = len(cells)
    cell = mark.size_m / count
    margin = cell if mark.margin_m is None else mark.margin_m
    inner = np.linspace(-0.5, 0.5, count + 1) * mark.size_m
    edges = np.concatenate([[inner[0] - margin], inner, [inner[-1] + margin]])
    white = np.pad(cells, 1, constant_values=True)
    # Forward is up and left is left: rows of the tag count down x, its columns count down y.
    ink = np.where(white, WHITE, BLACK)[::-1, ::-1].T
    across, along = (
        _overlap(y, texel, mark.at_m[1] + edges),
        _overlap(x, texel, mark.at_m[0] + edges),
    )
    cover = across.sum(axis=1)[:, None] * along.sum(axis=1)
    shade = across @ ink @ along.T / np.maximum(cover, 1e-12)
    return cover, np.repeat(shade[..., None], 3, axis=-1)


def _overlap(at: FloatArray, texel: float, edges: FloatArray) -> FloatArray:
    """(texels, intervals). Share of each texel that lies between two edges."""
    low, high = at[:, None] - texel / 2, at[:, None] + texel / 2
    inside = np.minimum(high, edges[1:]) - np.maximum(low, edges[:-1])
    return np.asarray(np.clip(inside / texel, 0.0, 1.0))


def _inside(outline: FloatArray, x: FloatArray, y: FloatArray, texel: float) -> FloatArray:
    """(rows, columns). Share of each texel inside a convex outline, to first order."""
    step = np.roll(outline, -1, axis=0) - outline
    length = np.hypot(*step.T)
    keep = length > 0
    inward = np.column_stack([-step[:, 1], step[:, 0]])[keep] / length[keep, None]
    share = np.ones((len(y), len(x)))
    for corner, normal in zip(outline[keep], inward, strict=True):
        depth = normal[0] * (x - corner[0]) + (normal[1] * (y - corner[1]))[:, None]
        np.minimum(share, depth / texel + 0.5, out=share)
    return np.clip(share, 0.0, 1.0)

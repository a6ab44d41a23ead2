"""What the pixels of printed tags look like, and how that changes with their place: for several tags at once.

A pixel is ``dark + contrast * pattern + ramp``: the pattern, white 1 and black 0, is mapped by a homography and
blurred by a Gaussian, whose width may differ along its rows and its columns. Only the eight cells around a pixel's own
count, so the blur must stay below half a cell.

Coordinates of a tag: its black square is [-1, 1] squared, x right and y down as printed.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray32 = NDArray[np.float32]

__all__ = ["CORNERS", "design_of", "homographies", "pixels_of", "steps_of"]

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
"""(4, 2). Corners of the black square: top left, top right, bottom right, bottom left as printed."""

OUTSIDE_CELLS = 0.7  # of the white margin, which some cut off narrow
NEAR_EDGE_PX = 3.0  # flats tell nothing
COARSE, FINE = 1.1, 2.5  # places where pixels are looked for, for each that is wanted
FEW = 2.2  # pixels of a tag for each that is wanted: if there are fewer, hardly one may be missed
CUTOFF = np.float32(6.0)  # standard deviations
ROOT = np.float32(0.3989423)  # (2 pi) ** -0.5
HALF = np.array([[0.5, 0.0, 0.5], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]])  # [-1, 1] to [0, 1]


def homographies(corners: FloatArray) -> FloatArray:
    """Homographies that take the square [-1, 1] squared to four corners each.

    Parameters
    ----------
    corners : (K, 4, 2) array [px]
        In the order of `CORNERS`.

    Returns
    -------
    image_from_tag : (K, 3, 3) array
        The last entry of each is 1; NaN where the corners have no such homography.
    """
    # P. Heckbert, Fundamentals of texture mapping and image warping, 1989, equation 2.10.
    a, b, c, d = corners.swapaxes(0, 1)
    right, down, skew = b - c, d - c, a - b + c - d
    H = np.empty((len(corners), 3, 3))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        size = _cross(right, down)
        g, h = _cross(skew, down) / size, _cross(right, skew) / size
        H[:, :2, 0], H[:, :2, 1], H[:, :2, 2] = b - a + g[:, None] * b, d - a + h[:, None] * d, a
        H[:, 2, 0], H[:, 2, 1], H[:, 2, 2] = g, h, 1.0
        H = H @ HALF
        H /= H[:, 2:, 2:].copy()
    H[~((np.abs(size) > 1e-9) & np.isfinite(H).all(axis=(1, 2)))] = np.nan
    return np.asarray(H)


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    product: FloatArray = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return product


def steps_of(pattern: FloatArray) -> FloatArray32:
    """How a tag's brightness steps from cell to cell, by which `design_of` draws it.

    Parameters
    ----------
    pattern : (C, C) array
        0 where it is black, 1 where it is white.

    Returns
    -------
    steps : (9, (C + 2) ** 2) array
        For each block of 3 x 3 cells of the pattern within two rows of white margin: its first cell, the two steps from
        there along its first row; the same of the steps from its first row to the second, and on to the third.
    """
    size = len(pattern) + 4
    sheet = np.ones((size, size), dtype=np.float32)
    sheet[2:-2, 2:-2] = pattern
    steps = np.empty((3, 3, size - 2, size - 2), dtype=np.float32)
    rows = (sheet[:-2], sheet[1:-1] - sheet[:-2], sheet[2:] - sheet[1:-1])
    for r, row in enumerate(rows):
        steps[r, 0] = row[:, :-2]
        steps[r, 1] = row[:, 1:-1] - row[:, :-2]
        steps[r, 2] = row[:, 2:] - row[:, 1:-1]
    return steps.reshape(9, -1)


def pixels_of(
    shape: tuple[int, ...], H: FloatArray, cells: int, most: int
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Pixels that show tags near a border of their cells.

    Parameters
    ----------
    shape : tuple of int
        Height and width of the image [px].
    H : (K, 3, 3) array
        Homographies from the tags.
    cells : int
        Cells along their sides.
    most : int
        How many of each to give at most, about.

    Returns
    -------
    pixels : (2, K, N) array [px]
        Columns and rows.
    there : (K, N) array of bool
        Which to take: the others are outside of the image, or are there twice, and are put where one of these is.
    """
    with np.errstate(invalid="ignore"):
        cell_px = np.sqrt(np.abs(H[:, 0, 0] * H[:, 1, 1] - H[:, 0, 1] * H[:, 1, 0])) * 2.0 / cells
        small = (cell_px * (cells + 2 * OUTSIDE_CELLS)).min(initial=1e3, where=cell_px > 0) ** 2
        count = most * (FINE if small < FEW * most else COARSE)
        base, off, out = _lattice(cells, int(count))
        near = np.where(cell_px > 2.5 * NEAR_EDGE_PX, 2 * NEAR_EDGE_PX / cell_px, 1.0)
        rim = np.clip(1.0 - 0.5 / (OUTSIDE_CELLS * cell_px), 0.0, near)  # a pixel is no point
        q = H[:, :, :2] @ (base + near[:, None, None] * off + rim[:, None, None] * out)
        q += H[:, :, 2:]
        uv = np.rint(q[:, :2] / q[:, 2:])
        u, v = uv[:, 0], uv[:, 1]
        within = (u >= 0) & (v >= 0) & (u < shape[1]) & (v < shape[0])
        within &= (q[:, 2] > 0).all(axis=1, keepdims=True)
    place = np.where(within, v * shape[1] + u, -1).astype(np.intp)
    place.sort(axis=1)
    there = np.ones(place.shape, dtype=np.bool_)
    there[:, 1:] = place[:, 1:] != place[:, :-1]
    there &= place >= 0
    if count > COARSE * most:
        place, there = _thinned(place, there, most)
    pixels = np.empty((2, *place.shape), dtype=np.intp)
    some = np.maximum(place.max(axis=1), 0)[:, None]
    np.divmod(np.where(there, place, some), shape[1], out=(pixels[1], pixels[0]))
    return pixels, there


@cache
def _lattice(cells: int, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places that cover a tag evenly, as sums: on the nearest border of a cell; from there; beyond the outermost."""
    # M. Roberts' R2 sequence: no two are close, and there are no rows that could run along with those of the pixels.
    golden = 1.324717957244746
    ordinal = np.arange(1, count + 1)[None]
    share = (0.5 + ordinal / np.array([[golden], [golden**2]])) % 1.0
    place = share * (cells + 2 * OUTSIDE_CELLS) - OUTSIDE_CELLS
    within = np.clip(place, 0, cells)
    off = within - np.rint(within)
    off[np.argmax(np.abs(off), axis=0), np.arange(count)] = 0.0
    scale = 2.0 / cells
    return (within - off) * scale - 1.0, off * scale, (place - within) * scale


def _thinned(
    place: NDArray[np.intp], there: NDArray[np.bool_], most: int
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """No more of each than so many, evenly chosen, and first."""
    count = there.sum(axis=1)
    kept = np.minimum(count, most)
    pick = np.arange(max(int(kept.max(initial=0)), 1)) * (count / np.maximum(kept, 1))[:, None]
    pick = np.minimum(pick.astype(np.intp), place.shape[1] - 1)
    order = np.take_along_axis(np.argsort(~there, axis=1, kind="stable"), pick, axis=1)
    chosen = np.arange(pick.shape[1]) < kept[:, None]
    return np.take_along_axis(place, order, axis=1), chosen


def _seen_from(H: FloatArray, middle: NDArray[np.intp]) -> FloatArray32:
    """Inverse homographies of pixels that are counted from a place of their own."""
    moved = H.copy()
    moved[:, :2] -= middle[:, :, None] * H[:, 2:]
    return np.linalg.inv(moved).astype(np.float32)


def design_of(
    pixels: NDArray[np.intp],
    H: FloatArray,
    blur_px: FloatArray,
    steps: FloatArray32,
    cells: int,
) -> FloatArray32:
    """Derivatives of the pixels' brightness, but for the contrast.

    Parameters
    ----------
    pixels : (2, K, N) array [px]
        Columns and rows of the pixels of each of K tags.
    H : (K, 3, 3) array
        Their homographies.
    blur_px : (K, 2) array [px]
        Standard deviations of the blur along x and along y.
    steps : (9, K, (C + 2) ** 2) array
        Of each, from `steps_of`.
    cells : int
        C, cells along a side.

    Returns
    -------
    design : (K, 14, N) array
        By D in ``H @ (I + D)`` (8) and by the logarithms of the blurs (2); then 1, the pattern (0 to 1), x and y.
    """
    half = np.float32(cells / 2)
    middle = np.rint(H[:, :2, 2]).astype(np.intp)
    Hinv = _seen_from(H, middle)
    design = np.empty((len(H), 14, pixels.shape[2]), dtype=np.float32)
    place = design[:, 10:13]  # for the while: x, y, 1
    place[:, :2] = (pixels - middle.T[:, :, None]).swapaxes(0, 1)
    place[:, 2] = 1.0
    q = Hinv @ place
    xy = q[:, :2] / q[:, 2:]
    place[:, :2] = xy
    # The blur is in pixels; d(tag)/d(pixel) turns it into cells.
    by = Hinv[:, :2, :2, None] - xy[:, :, None] * Hinv[:, 2:, :2, None]
    by /= q[:, 2:, None]
    steep = np.sqrt(by[:, :, 0] ** 2 + by[:, :, 1] ** 2)
    slant = (by[:, 0, 0] * by[:, 1, 0] + by[:, 0, 1] * by[:, 1, 1]) / (steep[:, 0] * steep[:, 1])
    sharp = 1 / (steep * (blur_px * half).astype(np.float32)[:, :, None])
    offset = xy * half
    offset += half + 1  # in cells, from the edge of the margin
    cell = np.minimum(np.maximum(offset, 1), cells).astype(np.int32)
    offset -= cell
    # How much of a pixel falls beyond its own cell's first edge and its last; and the derivatives of that.
    z = np.empty((2, *offset.shape), dtype=np.float32)
    np.multiply(offset, sharp, out=z[0])
    np.subtract(z[0], sharp, out=z[1])
    np.minimum(np.maximum(z, -CUTOFF, out=z), CUTOFF, out=z)
    square = z * z
    share = np.empty((3, *z.shape), dtype=np.float32)
    share[0] = _rise(z, square)
    np.exp(-0.5 * square, out=share[1])
    share[1] *= ROOT
    np.multiply(share[1], -z, out=share[2])
    ax, ay, bx, by_ = (share[:, edge, :, axis] for edge in range(2) for axis in range(2))
    index = cell[:, 1] * (cells + 2) + cell[:, 0]
    index += np.arange(0, index.shape[0] * steps.shape[2], steps.shape[2], dtype=np.int32)[:, None]
    block = steps.reshape(9, -1).take(index, axis=1).reshape(3, 3, *index.shape)
    # [derivative by x] of each row of the block, then [derivative by x, by y] of the pixel
    rows = block[:, 1] * ax[:, None] + block[:, 2] * bx[:, None]
    rows[0] += block[:, 0]
    pixel = rows[:, None, 1] * ay + rows[:, None, 2] * by_
    pixel[:, 0] += rows[:, 0]
    slope = (half * sharp).swapaxes(0, 1)
    slope[0] *= pixel[1, 0]
    slope[1] *= pixel[0, 1]
    # A round blur in the image is a slanted one on a tag that is seen from the side: the normal distribution of two
    # variables by powers of their correlation (Pearson's tetrachoric series).
    pattern = pixel[0, 0] + slant * (pixel[1, 1] + np.float32(0.5) * slant * pixel[2, 2])
    np.multiply(place, -slope[0][:, None], out=design[:, 0:3])
    np.multiply(place, -slope[1][:, None], out=design[:, 3:6])
    radial = slope[0] * xy[:, 0] + slope[1] * xy[:, 1]
    np.multiply(xy, radial[:, None], out=design[:, 6:8])
    design[:, 8], design[:, 9] = pixel[2, 0], pixel[0, 2]
    design[:, 12:] = xy
    design[:, 10], design[:, 11] = 1.0, pattern
    return design


def _rise(z: FloatArray32, square: FloatArray32) -> FloatArray32:
    """The normal distribution, to 2e-4."""
    rise = np.tanh(z * (np.float32(0.7978846) + np.float32(0.0356774) * square))
    rise *= np.float32(0.5)
    rise += np.float32(0.5)
    return rise

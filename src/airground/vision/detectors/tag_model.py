"""What the pixels of printed tags look like, and how that changes with their place: for several tags at once.

A pixel is ``dark + contrast * pattern + ramp``: the pattern, white 1 and black 0, is mapped by a homography and
blurred by a Gaussian, whose width may differ along its rows and its columns. Only the eight cells around a pixel's own
count, so the blur must stay below half a cell.

Coordinates of a tag: its black square is [-1, 1] squared, x right and y down as printed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray, homogeneous

if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    Floats = NDArray[np.floating[Any]]

__all__ = ["CORNERS", "design_of", "homographies", "pixels_of", "sheet_of"]

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
"""(4, 2). Corners of the black square: top left, top right, bottom right, bottom left as printed."""

OUTSIDE_CELLS = 0.7  # of the white margin, which some cut off narrow
NEAR_EDGE_PX = 3.0  # flats tell nothing
CUTOFF = np.float32(6.0)  # standard deviations
ROOT = np.float32(0.3989423)  # (2 pi) ** -0.5


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
    count = len(corners)
    A = np.zeros((count, 8, 8))
    A[:, :4, :3] = A[:, 4:, 3:6] = homogeneous(CORNERS)
    A[:, :4, 6:] = -corners[:, :, :1] * CORNERS
    A[:, 4:, 6:] = -corners[:, :, 1:] * CORNERS
    b = np.concatenate([corners[:, :, 0], corners[:, :, 1]], axis=1)
    h = np.full((count, 9), np.nan)
    good = np.abs(np.linalg.det(A)) > 1e-9
    h[good, :8] = np.linalg.solve(A[good], b[good, :, None])[:, :, 0]
    h[good, 8] = 1.0
    return h.reshape(count, 3, 3)


def sheet_of(pattern: FloatArray) -> NDArray[np.float32]:
    """A tag's cells within two rows of white margin.

    Parameters
    ----------
    pattern : (C, C) array
        0 where it is black, 1 where it is white.

    Returns
    -------
    sheet : (C + 4, C + 4) array
        The same, with the margin.
    """
    sheet = np.ones((len(pattern) + 4, len(pattern) + 4), dtype=np.float32)
    sheet[2:-2, 2:-2] = pattern
    return sheet


def pixels_of(shape: tuple[int, ...], H: FloatArray, cells: int, most: int) -> NDArray[np.intp]:
    """Pixels that show a tag near a border of its cells.

    Parameters
    ----------
    shape : tuple of int
        Height and width of the image [px].
    H : (3, 3) array
        Homography from the tag.
    cells : int
        Cells along its side.
    most : int
        How many to give at most; evenly chosen where there are more.

    Returns
    -------
    pixels : (N, 2) array
        Columns and rows; empty where the tag is not in the image.
    """
    none = np.empty((0, 2), dtype=np.intp)
    if not np.isfinite(H).all():
        return none
    reach = 1.0 + 2.0 * OUTSIDE_CELLS / cells
    hull = homogeneous(reach * CORNERS) @ H.T
    if not (hull[:, 2] > 0).all():
        return none
    hull = hull[:, :2] / hull[:, 2:]
    low = np.clip(np.floor(hull.min(axis=0)), 0, 1e6).astype(int)
    high = np.minimum(np.ceil(hull.max(axis=0)), [shape[1] - 1, shape[0] - 1]).astype(int)
    if (high - low < 4).any():
        return none
    stride = max(1, int((high - low).max()) // 64)
    u = np.arange(low[0], high[0] + 1, stride)
    v = np.arange(low[1], high[1] + 1, stride)
    Hinv = np.linalg.inv(H)
    q = [(Hinv[i, 1] * v + Hinv[i, 2])[:, None] + Hinv[i, 0] * u for i in range(3)]
    offsets = [(q[i] / q[2] + 1.0) * (cells / 2) for i in range(2)]
    margin = OUTSIDE_CELLS
    inside = np.ones(q[0].shape, dtype=bool)
    for offset in offsets:
        inside &= (offset > -margin) & (offset < cells + margin)
    cell_px = np.sqrt(abs(np.linalg.det(H[:2, :2]))) * 2.0 / cells
    if cell_px > 2.5 * NEAR_EDGE_PX:
        close = [np.abs(offset - np.rint(offset)) < NEAR_EDGE_PX / cell_px for offset in offsets]
        inside &= close[0] | close[1]
    rows, columns = np.nonzero(inside)
    if len(rows) > most:
        pick = np.linspace(0, len(rows) - 1, most).astype(np.intp)
        rows, columns = rows[pick], columns[pick]
    return np.column_stack([u[columns], v[rows]])


def design_of(
    pixels: NDArray[np.intp], H: FloatArray, blur_px: FloatArray, sheets: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Derivatives of the pixels' brightness, but for the contrast.

    Parameters
    ----------
    pixels : (2, K, N) array [px]
        Columns and rows of the pixels of each of K tags.
    H : (K, 3, 3) array
        Their homographies.
    blur_px : (K, 2) array [px]
        Standard deviations of the blur along x and along y.
    sheets : (K, C + 4, C + 4) array
        Their cells, from `sheet_of`.

    Returns
    -------
    design : (K, 14, N) array
        By D in ``H @ (I + D)`` (8) and by the logarithms of the blurs (2); then 1, the pattern (0 to 1), x and y.
    """
    count, cells = len(H), sheets.shape[1] - 4
    half = cells / 2
    Hinv = np.linalg.inv(H)[..., None]  # (K, 3, 3, 1)
    u, v = pixels
    q = [Hinv[:, i, 0] * u + Hinv[:, i, 1] * v + Hinv[:, i, 2] for i in range(3)]
    x, y = q[0] / q[2], q[1] / q[2]
    axes, gradients, scales = [], [], []
    first = np.arange(count)[:, None] * sheets[0].size  # of the tag in the flat array of all cells
    for axis, place in enumerate((x, y)):
        # The blur is in pixels; d(tag)/d(pixel) turns it into cells.
        by_u = (Hinv[:, axis, 0] - place * Hinv[:, 2, 0]) / q[2]
        by_v = (Hinv[:, axis, 1] - place * Hinv[:, 2, 1]) / q[2]
        steep = np.sqrt(by_u * by_u + by_v * by_v)
        gradients.append((by_u / steep, by_v / steep))
        sigma = steep * (blur_px[:, axis, None] * half)
        s = (place + 1.0) * half + 1.0  # in cells, from the edge of the margin
        k = np.clip(s, 1, cells).astype(np.intp)
        axes.append(_shares((s - k).astype(np.float32), sigma.astype(np.float32)))
        scales.append((half / sigma).astype(np.float32))
        first = first + k * (sheets.shape[1] if axis else 1)
    (wx, by_x, blur_x), (wy, by_y, blur_y) = axes
    flat = sheets.ravel()
    cell = [[flat.take(first + (r * sheets.shape[1] + c)) for c in range(3)] for r in range(3)]
    rows = [_dot(cell[r], wx) for r in range(3)]
    columns = [_dot([cell[r][c] for r in range(3)], wy) for c in range(3)]
    x, y = x.astype(np.float32), y.astype(np.float32)
    slope_x, slope_y = _dot(columns, by_x) * scales[0], _dot(rows, by_y) * scales[1]
    # A round blur in the image is a slanted one on a tag that is seen from the side: the normal distribution of two
    # variables by powers of their correlation (Pearson's tetrachoric series).
    (gu, gv), (hu, hv) = gradients
    slant = (gu * hu + gv * hv).astype(np.float32)
    pattern = _dot(rows, wy)
    pattern += slant * _dot([_dot(cell[r], by_x) for r in range(3)], by_y)
    pattern += 0.5 * slant * slant * _dot([_dot(cell[r], blur_x) for r in range(3)], blur_y)
    radial = slope_x * x + slope_y * y
    design = np.empty((count, 14, pixels.shape[2]), dtype=np.float32)
    for j, column in enumerate(
        (
            *(-slope_x * x, -slope_x * y, -slope_x),
            *(-slope_y * x, -slope_y * y, -slope_y),
            *(radial * x, radial * y),
            *(_dot(columns, blur_x), _dot(rows, blur_y)),
            *(1.0, pattern, x, y),
        )
    ):
        design[:, j] = column
    return design


def _shares(offset: Floats, sigma: Floats) -> list[list[Floats]]:
    """How much of a pixel falls on the cell before its own, its own and the next; and the derivatives of that."""
    a = np.clip(offset / sigma, -CUTOFF, CUTOFF)
    b = np.clip((offset - 1) / sigma, -CUTOFF, CUTOFF)
    bell_a, bell_b = np.exp(-0.5 * a * a) * ROOT, np.exp(-0.5 * b * b) * ROOT
    rise_a, rise_b = _rise(a), _rise(b)
    wide_a, wide_b = bell_a * a, bell_b * b
    return [
        [1 - rise_a, rise_a - rise_b, rise_b],
        [-bell_a, bell_a - bell_b, bell_b],
        [wide_a, wide_b - wide_a, -wide_b],
    ]


def _rise(z: Floats) -> Floats:
    """The normal distribution, to 2e-4."""
    rise: Floats = 0.5 + 0.5 * np.tanh(z * (0.7978846 + 0.0356774 * (z * z)))
    return rise


def _dot(a: list[Floats], b: list[Floats]) -> Floats:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

"""Where tags are, to a few hundredths of a pixel: their printed patterns fitted to the pixels that show them.

A decoded tag is known down to its cells, so every edge in it tells of its place, not only the four outer ones. Least
squares (Gauss-Newton, Huber's weights) over all pixels at once; the covariance is the sandwich estimate, which needs no
noise level and stays honest where the model fits edges less well than flats (White, Econometrica 1980).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Self

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray, homogeneous
from airground.vision.detectors.tag_equations import (
    PARAMETERS,
    Step,
    best_step,
    brightness,
    correlation,
    huber_weight,
    what_is_left,
)
from airground.vision.detectors.tag_model import design_of, pixels_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.vision.frame import ImageArray

    FloatArray32 = NDArray[np.float32]

__all__ = ["ITERATIONS", "TagFits", "fit_tags"]

MOST_PIXELS = 400  # enough for 0.02 px at any noise; more costs time
START_BLUR_PX = 0.9
BLUR_RANGE = np.log(0.25), np.log(6.0)  # px; a pixel alone blurs by 12 ** -0.5
SMALL_STEP = 2e-4  # of half a side
LARGEST_STEP = 2e-2
BENT = 0.2  # what a step is wrong by is this times its square over the blur, as found by trying
ENOUGH = 1.0  # of the standard deviation; by trying, what is left is then below a fifth of it
MOST_CHANGE = np.array([0.3] * 8 + [0.5] * 2)  # in a step
LONGEST = np.array([LARGEST_STEP] * 8 + [0.3] * 2)  # of the last one
ITERATIONS = 8


@dataclass(frozen=True, slots=True, eq=False)
class TagFits:
    """Places of K tags in the image."""

    ok: NDArray[np.bool_]
    """(K,). Whether the pixels determine its place; where they do not, the rest is void."""

    image_from_tag: FloatArray
    """(K, 3, 3). Homography from the tag's plane, where its black square is [-1, 1] squared, y down."""

    covariance: FloatArray
    """(K, 8, 8). Of a small change D of it, ``image_from_tag @ (I + D)``, row by row without the last entry."""

    correlation: FloatArray
    """(K,). Between the image and the pattern, at most 1; pixels that something covers count less."""

    code_correlation: FloatArray
    """(K,). The same within the border, where the tag's number is written; every pixel counts."""

    contrast: FloatArray
    """(K,). White less black [grey levels]."""

    blur_px: FloatArray
    """(K, 2). Standard deviation of the blur [px] along the tag's rows and columns."""

    @classmethod
    def none(cls, count: int) -> Self:
        """Of tags that are not to be seen.

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        fits : TagFits
            None is ok.
        """
        H, covariance = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 8, 8))
        return cls(
            np.zeros(count, dtype=bool),
            H,
            covariance,
            np.zeros(count),
            np.zeros(count),
            np.zeros(count),
            np.ones((count, 2)),
        )

    def put(self, rows: NDArray[np.intp], other: TagFits) -> None:
        """Replace some.

        Parameters
        ----------
        rows : (J,) array of int
            Which.
        other : TagFits
            By these J.
        """
        for name in type(self).__slots__:
            getattr(self, name)[rows] = getattr(other, name)

    def points(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Images of points of the tags, and how they hang on the parameters.

        Parameters
        ----------
        xy : (N, 2) array
            On each tag.

        Returns
        -------
        uv : (K, N, 2) array [px]
            In the image.
        jacobian : (K, N, 2, 8) array [px]
            By the eight parameters of `covariance`.
        """
        H, p = self.image_from_tag, homogeneous(xy)
        q = p @ H.swapaxes(1, 2)
        uv = q[..., :2] / q[..., 2:]
        by_q = (H[:, None, :2] - uv[..., None] * H[:, None, 2:]) / q[..., 2, None, None]
        jacobian = (by_q[..., None] * p[:, None, None, :]).reshape(*uv.shape, 9)
        return uv, jacobian[..., :8]


def fit_tags(
    image: ImageArray,
    H: FloatArray,
    steps: FloatArray32,
    cells: int,
    blur_px: FloatArray,
    *,
    most: int = ITERATIONS,
) -> TagFits:
    """Fit the patterns of tags to an image.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        Grey, or blue, green, red; only the pixels that are needed are turned to grey.
    H : (K, 3, 3) array
        Homographies from the tags, good to half a cell; NaN for those that have none.
    steps : (9, K, (C + 2) ** 2) array
        Of their patterns, from `tag_model.steps_of`.
    cells : int
        C, cells along a side, border included.
    blur_px : (K, 2) array [px]
        Blurs as fitted in the frame before, which saves steps; NaN where there are none.
    most : int
        Steps of the fit, at most.

    Returns
    -------
    fits : TagFits
        Of each.
    """
    pixels, there = pixels_of(image.shape, H, cells, MOST_PIXELS)
    alive = there.sum(axis=1) > 3 * PARAMETERS
    blur_px = np.where(np.isnan(blur_px), START_BLUR_PX, blur_px)
    if alive.all():
        grey = _grey_of(image, pixels)
        use, started = there.astype(np.float32), np.ones(len(H), dtype=bool)
        return _fit(_Views(pixels, steps, grey, use, H, np.log(blur_px), started), cells, most)
    fits = TagFits.none(len(H))
    rows = np.flatnonzero(alive)
    if len(rows):
        fits.put(rows, fit_tags(image, H[rows], steps[:, rows], cells, blur_px[rows], most=most))
    return fits


def _grey_of(image: ImageArray, pixels: NDArray[np.intp]) -> FloatArray32:
    at = image[pixels[1], pixels[0]]
    grey = at if image.ndim == 2 else np.asarray(cv2.cvtColor(at, cv2.COLOR_BGR2GRAY))
    return grey.astype(np.float32)


def _fit(views: _Views, cells: int, most: int) -> TagFits:
    count = len(views.H)
    fits, rows = TagFits.none(0), np.arange(count)
    for left in range(most - 1, -1, -1):
        drawn = _draw(views, cells)
        done = _is_short(views.H, views.blur, drawn.step) | ~views.alive
        if done.all() or not left:
            last = _end(views, drawn, cells, settled=bool(done.all()))
            if len(rows) == count:
                return last
            fits.put(rows, last)
            break
        if done.any():  # the others go on alone: they are few, and often not there at all
            fits = fits if len(fits.ok) else TagFits.none(count)
            some, rest = np.flatnonzero(done), np.flatnonzero(~done)
            fits.put(rows[some], _end(views.take(some), drawn.take(some), cells, settled=True))
            views, drawn, rows = views.take(rest), drawn.take(rest), rows[rest]
        views = _moved(views, drawn.step)
    return fits


def _draw(views: _Views, cells: int) -> _Drawn:
    """Draw the patterns where they are supposed to be, and see which step would be best."""
    design = design_of(views.pixels, views.H, np.exp(views.blur), views.steps, cells)
    residual, contrast = brightness(design[:, 10:], views.seen, views.use)
    design[:, :10] *= contrast[:, None, None]
    step = best_step(design, residual, huber_weight(residual, views.use), views.alive)
    return _Drawn(design, residual, contrast, step)


def _moved(views: _Views, step: Step) -> _Views:
    """Take a step."""
    alive = views.alive
    step.change[~alive] = 0.0
    bounded = np.minimum(np.maximum(step.change[:, :10], -MOST_CHANGE), MOST_CHANGE)
    D = np.zeros((len(alive), 9))
    D[:, :8] = bounded[:, :8]
    moved = views.H + views.H @ D.reshape(-1, 3, 3)
    alive &= np.abs(moved[:, 2, 2]) > 1e-6
    moved[~alive] = views.H[~alive]
    blur = np.minimum(np.maximum(views.blur + bounded[:, 8:], BLUR_RANGE[0]), BLUR_RANGE[1])
    return views._replace(H=moved / moved[:, 2:, 2:], blur=blur)


def _end(views: _Views, drawn: _Drawn, cells: int, *, settled: bool) -> TagFits:
    """Take the last step, and tell how well it fits."""
    design, residual, contrast, step = drawn
    seen, use = views.seen, views.use
    if settled:  # weights by what is left, as if the pattern had been drawn anew
        weight = huber_weight(what_is_left(design, residual, step), use)
        step = best_step(design, residual, weight, views.alive)
    views = _moved(views, step)
    alive = views.alive & (np.abs(step.change[:, :8]).max(axis=1) < LARGEST_STEP)
    left, inverse = what_is_left(design, residual, step), step.inverse
    weight = huber_weight(left, use)
    scaled = design * (weight * left)[:, None]
    pixel_count = use.sum(axis=1)
    covariance = inverse @ (scaled @ scaled.swapaxes(1, 2)) @ inverse
    covariance *= (pixel_count / (pixel_count - PARAMETERS))[:, None, None]
    code = use * (np.abs(design[:, 12:]).max(axis=1) < 1.0 - 2.0 / cells)
    alike = correlation(seen, left, np.stack([weight, code])).astype(np.float64)
    return TagFits(
        alive,
        views.H,
        covariance[:, :8, :8],
        alike[0],
        alike[1],
        contrast.astype(np.float64),
        np.exp(views.blur),
    )


class _Views(NamedTuple):
    """Pixels that show tags, and what is supposed of these."""

    pixels: NDArray[np.intp]
    """(2, K, N). Columns and rows."""

    steps: FloatArray32
    """(9, K, S). Of the patterns."""

    seen: FloatArray32
    """(K, N). Brightness [grey levels]."""

    use: FloatArray32
    """(K, N). 1, or 0 for those that do not count."""

    H: FloatArray
    """(K, 3, 3). Homographies from the tags."""

    blur: FloatArray
    """(K, 2). Logarithms of the blurs."""

    alive: NDArray[np.bool_]
    """(K,). False once the pixels turned out not to determine a place; written to."""

    def take(self, rows: NDArray[np.intp]) -> _Views:
        """Those of some of the tags."""
        return _Views(
            self.pixels[:, rows],
            self.steps[:, rows],
            self.seen[rows],
            self.use[rows],
            self.H[rows],
            self.blur[rows],
            self.alive[rows],
        )


class _Drawn(NamedTuple):
    """Patterns drawn into the image."""

    design: FloatArray32
    """(K, 14, N). Derivatives of the brightness by all parameters."""

    residual: FloatArray32
    """(K, N). What it differs by."""

    contrast: FloatArray32
    """(K,)."""

    step: Step
    """Best one from there."""

    def take(self, rows: NDArray[np.intp]) -> _Drawn:
        """Those of some of the tags."""
        return _Drawn(
            self.design[rows],
            self.residual[rows],
            self.contrast[rows],
            Step(*(array[rows] for array in self.step)),
        )


def _is_short(H: FloatArray, blur: FloatArray, step: Step) -> NDArray[np.bool_]:
    """Whether the pattern may be taken as linear along a step, so that it need not be drawn anew."""
    # Twice the mean square of the step over the pixels, and the variance of the place: [half a side, squared].
    place = step.inverse[:, 2, 2] + step.inverse[:, 5, 5]
    moved = np.maximum((step.change * step.gradient).sum(axis=1), 0.0) * place
    half_px = np.sqrt(np.abs(H[:, 0, 0] * H[:, 1, 1] - H[:, 0, 1] * H[:, 1, 0]))
    bent = BENT / 2 * moved * half_px / np.exp(blur.min(axis=1))
    size = np.abs(step.change[:, :10])
    short = (bent < ENOUGH * np.sqrt(step.square * place / 2)) | (size.max(axis=1) < SMALL_STEP)
    short &= (size <= LONGEST).all(axis=1)
    return np.asarray(short)

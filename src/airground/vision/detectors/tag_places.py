"""Tags that were fitted, as sightings have them: who, where, which way up; and which fits are to be believed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray, homogeneous
from airground.vision.detectors.tag_fit import ITERATIONS, TagFits, fit_tags
from airground.vision.detectors.tag_model import CORNERS, steps_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from airground.vision.detectors.tag_families import TagFamily
    from airground.vision.frame import ImageArray

__all__ = ["PlacedTag", "distinct", "place_tags"]

FLOOR_PX = 0.005  # a printed tag is no plane, a lens no homography
ALIASING_PX = 0.015  # what an image that is sharper than its pixels adds to that
SHARP_PX, SOFT_PX = 0.3, 0.5  # blurs between which it does; a pixel alone blurs by 0.29
LEAST_CONTRAST = 8.0  # grey levels
PLACES = np.concatenate([CORNERS, [[0.0, 0.0], [0.0, -1.0]]])


@dataclass(frozen=True, slots=True, eq=False)
class PlacedTag:
    """A tag in an image."""

    family: TagFamily
    """Whose it is."""

    number: int
    """Which."""

    corners: FloatArray
    """(4, 2) [px]."""

    uv: FloatArray
    """(2,) [px]. Its centre."""

    covariance: FloatArray
    """(2, 2) [px2]. Of that."""

    angle: float
    """Heading [rad]: from there to the middle of the top edge."""

    angle_sigma: float
    """Its standard deviation [rad]."""

    correlation: float
    """Between the image and the pattern, at most 1; what covers it counts less."""

    code_correlation: float
    """The same within the border, where the tag's number is written; every pixel counts."""

    blur_px: FloatArray
    """(2,) [px]. Along the tag's rows and columns."""

    side_px: float
    """Shortest side [px]."""

    slip_cells: float
    """How far a corner lies from where it was looked for, in cells; less than `slip_px` can be no slip."""

    slip_px: float
    """The same [px]."""

    image_from_tag: FloatArray
    """(3, 3). Homography from its plane, where its black square is [-1, 1] squared, y down."""

    drift: FloatArray
    """(3, 3) [1/s]. D of ``image_from_tag @ (I + D dt)`` a short time later; zero until it is known."""

    def ahead(self, dt: float) -> FloatArray:
        """Where it will be, if it goes on as before: straight, or in a circle.

        Parameters
        ----------
        dt : float [s]
            How much later.

        Returns
        -------
        image_from_tag : (3, 3) array
            Then.
        """
        H = self.image_from_tag + dt * (self.image_from_tag @ self.drift)
        return np.asarray(H / H[2, 2])

    def stayed(self, cells: float, px: float = np.inf) -> bool:
        """Whether the fit stayed where it began: one that slipped is no sighting.

        Parameters
        ----------
        cells : float
            How far is too far.
        px : float
            That is too far as well [px].

        Returns
        -------
        stayed : bool
            True within three pixels, too.
        """
        return self.slip_px < 3.0 or (self.slip_cells < cells and self.slip_px < px)


def place_tags(
    image: ImageArray,
    tags: Sequence[tuple[TagFamily, int]],
    H: FloatArray,
    blurs_px: Sequence[FloatArray] = (),
    *,
    least_correlation: float,
    most: int = ITERATIONS,
) -> list[PlacedTag | None]:
    """Fit tags to an image.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        The image.
    tags : sequence of tuple
        Which.
    H : (K, 3, 3) array
        Where, roughly: homographies from them.
    blurs_px : sequence of (2,) array [px]
        Blurs as fitted in the frame before; none for new tags.
    least_correlation : float
        Between the image and the printed pattern; what is below is not a tag.
    most : int
        Steps of the fit, at most.

    Returns
    -------
    tags : list of PlacedTag or None
        None where the image does not show that tag.
    """
    placed: list[PlacedTag | None] = [None] * len(tags)
    blur = np.array(blurs_px) if len(blurs_px) else np.full((len(tags), 2), np.nan)
    for cells in sorted({family.cells for family, _ in tags}):
        rows = [k for k, (family, _) in enumerate(tags) if family.cells == cells]
        chosen = [tags[k] for k in rows]
        steps = np.stack([_steps(family, number) for family, number in chosen], axis=1)
        start = H if len(rows) == len(tags) else H[rows]
        fits = fit_tags(image, start, steps, cells, blur[rows], most=most)
        good = fits.ok & (fits.correlation >= least_correlation) & (fits.contrast >= LEAST_CONTRAST)
        if good.any():
            for k, tag in zip(rows, _placed(chosen, start, fits, good), strict=True):
                placed[k] = tag
    return placed


@cache
def _steps(family: TagFamily, number: int) -> NDArray[np.float32]:
    return steps_of(family.pattern(number))


def _placed(
    tags: list[tuple[TagFamily, int]],
    H: FloatArray,
    fits: TagFits,
    good: NDArray[np.bool_],
) -> list[PlacedTag | None]:
    points, jacobian = fits.points(PLACES)
    corners, uv, top = points[:, :4], points[:, 4], points[:, 5]
    J, spread = jacobian[:, 4:], fits.covariance
    sharp = np.clip((SOFT_PX - fits.blur_px.min(axis=1)) / (SOFT_PX - SHARP_PX), 0.0, 1.0)
    floor = FLOOR_PX**2 + (sharp * ALIASING_PX) ** 2
    covariance = J[:, 0] @ spread @ J[:, 0].swapaxes(1, 2)
    covariance = 0.5 * (covariance + covariance.swapaxes(1, 2)) + floor[:, None, None] * np.eye(2)
    arm = top - uv
    square = (arm * arm).sum(axis=1)
    across = np.stack([-arm[:, 1], arm[:, 0]], axis=1) / square[:, None]
    by = (across[:, None] @ (J[:, 1] - J[:, 0]))[:, 0]
    variance = ((by[:, None] @ spread)[:, 0] * by).sum(axis=1) + 2.0 * floor / square
    angle = np.arctan2(arm[:, 1], arm[:, 0]).tolist()
    sigma = np.sqrt(variance).tolist()
    q = homogeneous(CORNERS) @ H.swapaxes(1, 2)
    slip = _lengths(corners - q[..., :2] / q[..., 2:]).max(axis=1)
    sides = _lengths(corners - corners[:, [3, 0, 1, 2]])
    slip_cells = (slip / sides.mean(axis=1)).tolist()
    shortest = sides.min(axis=1).tolist()
    still = np.zeros((3, 3))
    return [
        PlacedTag(
            family,
            number,
            corners[k],
            uv[k],
            covariance[k],
            angle[k],
            sigma[k],
            float(fits.correlation[k]),
            float(fits.code_correlation[k]),
            fits.blur_px[k],
            shortest[k],
            slip_cells[k] * family.cells,
            float(slip[k]),
            fits.image_from_tag[k],
            still,
        )
        if good[k]
        else None
        for k, (family, number) in enumerate(tags)
    ]


def _lengths(arrows: FloatArray) -> FloatArray:
    length: FloatArray = np.sqrt((arrows * arrows).sum(axis=-1))
    return length


def distinct(tags: list[PlacedTag], least_side_px: float) -> list[PlacedTag]:
    """One tag at one place: the one that fits best; the first of equals.

    Parameters
    ----------
    tags : list of PlacedTag
        Of one image.
    least_side_px : float
        Two that are nearer than half of that are at one place.

    Returns
    -------
    kept : list of PlacedTag
        Best first.
    """
    kept: list[tuple[PlacedTag, complex]] = []
    for tag in sorted(tags, key=lambda tag: -tag.correlation):
        middle = complex(*tag.corners.mean(axis=0).tolist())
        reach = 0.5 * max(tag.side_px, least_side_px)
        if all(abs(middle - other) > reach for _, other in kept):
            kept.append((tag, middle))
    return [tag for tag, _ in kept]

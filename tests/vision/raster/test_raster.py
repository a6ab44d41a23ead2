"""Drawing kernels: maps, pyramids, layers, tags."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.vision.raster.maps import grid_positions, spread
from airground.vision.raster.noise import SensorNoise
from airground.vision.raster.paint import average, darken, lay_over
from airground.vision.raster.pyramid import Pyramid, shrink
from airground.vision.raster.tags import FAMILIES, tag_cells
from airground.vision.raster.warp import GreyTile


def test_a_linear_map_is_spread_exactly() -> None:
    rows, columns = 37, 53
    y, x = np.meshgrid(grid_positions(rows, 8), grid_positions(columns, 4), indexing="ij")
    full = spread(np.stack([2 * x - y, 0.5 * y], axis=-1), (4, 8), (columns, rows))
    v, u = np.mgrid[:rows, :columns]
    assert_allclose(full[..., 0], 2 * u - v, atol=1e-3)
    assert_allclose(full[..., 1], 0.5 * v, atol=1e-3)


@pytest.mark.parametrize("factor", [(2, 2), (2, 4), (4, 4), (2, 3), (1, 1)])
def test_shrinking_is_the_mean(factor: tuple[int, int], rng: np.random.Generator) -> None:
    image = rng.integers(0, 256, (12 * factor[1], 10 * factor[0], 4)).astype(np.uint8)
    mean = image.reshape(12, factor[1], 10, factor[0], 4).mean(axis=(1, 3))
    assert np.abs(shrink(image, (10, 12)) - mean).max() <= 1.5  # rounded at most twice
    assert abs((shrink(image, (10, 12)) - mean).mean()) < 0.3


def test_levels_of_a_pyramid_show_the_same_places() -> None:
    v, u = np.mgrid[:128, :128]
    picture = (u + 0.5 * v).astype(np.uint8)
    pyramid = Pyramid.of(picture)
    places = np.stack(np.meshgrid(np.linspace(40, 80, 9), np.linspace(40, 80, 9)), axis=-1)
    for level in range(4):
        read = pyramid.sample(places.astype(np.float32), level).astype(np.float64)
        assert np.abs(read - (places[..., 0] + 0.5 * places[..., 1])).max() < 2.0
    outside = np.full((2, 2, 2), -900.0, dtype=np.float32)
    assert (pyramid.sample(outside, 0) == 0).all()
    assert pyramid.level_for(4.0) == 2
    assert pyramid.level_for(0.0) == 0


def test_layers_and_shadows(rng: np.random.Generator) -> None:
    below = rng.integers(0, 256, (6, 7, 3)).astype(np.uint8)
    opacity = rng.random((6, 7, 1))
    colour = rng.integers(0, 256, (6, 7, 3))
    layer = np.rint(np.concatenate([colour * opacity, 255 * opacity], axis=-1)).astype(np.uint8)
    image = below.copy()
    lay_over(image, layer)
    assert np.abs(image - (below * (1 - opacity) + colour * opacity)).max() <= 2
    dark = below.copy()
    mask = np.zeros((6, 7), dtype=np.uint8)
    mask[2:4] = 255
    darken(dark, mask, 0.4)
    assert np.abs(dark[2:4] - 0.6 * below[2:4]).max() <= 1
    assert np.array_equal(dark[:2], below[:2])
    assert_allclose(average([below, below]), below)


def test_a_warp_goes_on_where_the_tile_repeats(rng: np.random.Generator) -> None:
    picture = np.repeat(rng.integers(60, 200, (64, 64, 1)), 3, axis=2).astype(np.uint8)
    tile = GreyTile(picture)
    out = np.empty((50, 200), dtype=np.uint8)
    for shift in (0.0, -1000.0, 5 * 64.0 + 7):
        H = np.array([[1.0, 0, shift], [0, 1.0, 3.0], [0, 0, 1.0]])
        assert tile.warp(H, 0, out)
        column = (np.arange(200) + int(shift)) % 64
        row = (np.arange(50) + 3) % 64
        assert np.abs(out.astype(int) - picture[np.ix_(row, column)][..., 0]).max() <= 1
        grid = np.stack(np.meshgrid(grid_positions(200, 16), grid_positions(50, 4)), axis=-1)
        looked = np.empty_like(out)
        assert tile.look_up(grid + [shift, 3.0], (16, 4), 0, looked)
        assert np.array_equal(looked, out)
    assert not tile.warp(np.diag([99.0, 99.0, 1.0]), 0, out)  # too far for this level
    coloured = tile.colour(out)
    assert np.abs(coloured.astype(int) - out[..., None]).max() <= 2


def test_blur_has_the_variance_of_a_line() -> None:
    tile = GreyTile(np.full((16, 16, 3), 90, dtype=np.uint8))
    dot = np.zeros((21, 21), dtype=np.uint8)
    dot[10, 10] = 250
    blurred = tile.blur(dot, np.array([2.0, 0.0])).astype(np.float64)
    u = np.arange(21) - 10
    assert (blurred.sum(axis=0) * u**2).sum() / blurred.sum() == pytest.approx(4 / 12, rel=0.02)
    assert blurred.sum() == pytest.approx(250, abs=2)


def test_a_pyramid_warps_as_it_samples(rng: np.random.Generator) -> None:
    grain = rng.integers(0, 256, (96, 96, 4)).astype(np.uint8)
    pyramid = Pyramid.of(np.asarray(cv2.blur(grain, (5, 5)), dtype=np.uint8))
    H = np.array([[1.4, 0.3, 9.0], [-0.2, 1.1, 14.0], [1e-3, 2e-3, 1.0]])
    v, u = np.mgrid[:40, :50].astype(np.float64)
    w = np.stack([u, v, np.ones_like(u)], axis=-1) @ H.T
    places = (w[..., :2] / w[..., 2:]).astype(np.float32)
    for scale, level in ((0.7, 0), (2.0, 1)):
        warped = pyramid.warp(H, (50, 40), scale).astype(int)
        assert np.abs(warped - pyramid.sample(places, level)).max() <= 4


def test_photons_add_noise_in_proportion_to_the_light() -> None:
    noise = SensorNoise((320, 240), 0.0, 6.0, 1)
    for level in (0, 64, 128, 192):
        image = np.full((240, 320, 3), level, dtype=np.uint8)
        noise.apply(image, 5)
        variance = (image.astype(np.float64) - level).var()
        assert variance == pytest.approx((36 + 1 / 12) * level / 255, rel=0.05, abs=1e-9)


def test_tags_have_their_families_cells() -> None:
    for family in FAMILIES:
        cells = tag_cells(family, 0)
        assert not cells[0].any()
        assert cells.any()
    assert tag_cells("36h11", 0).shape == (8, 8)
    with pytest.raises(InputError, match="36h11"):
        tag_cells("nothing", 0)
    with pytest.raises(InputError, match="numbers 0 to 586"):
        tag_cells("36h11", 587)

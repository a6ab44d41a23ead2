from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError
from airground.vision.raster.pixel_map import PixelMap


def test_pixels_come_from_where_the_map_says() -> None:
    u, v = np.meshgrid(np.arange(30.0), np.arange(20.0))
    picture = np.stack([4 * u, 6 * v, 2 * u + 3 * v], axis=-1).astype(np.uint8)
    found = PixelMap(np.stack([u[:10, :12] + 3.5, v[:10, :12] + 2.25], axis=-1)).apply(picture)
    assert found.shape == (10, 12, 3)
    wanted = np.stack([4 * (u + 3.5), 6 * (v + 2.25)], axis=-1)[:10, :12]
    assert found[..., :2].astype(float) == pytest.approx(wanted, abs=0.6)


def test_outside_is_black_and_nowhere_is_refused() -> None:
    picture = np.full((5, 5, 3), 200, np.uint8)
    assert PixelMap(np.full((2, 2, 2), -10.0)).apply(picture).max() == 0
    with pytest.raises(InputError, match="every pixel"):
        PixelMap(np.full((2, 2, 2), np.nan))

from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError
from airground.sim3d.canvas import Canvas
from airground.sim3d.options import CameraOptions3d


@pytest.mark.parametrize("k1", [-0.2, 0.0, 0.2])
def test_every_pixel_of_the_image_has_a_place_in_the_picture(k1: float) -> None:
    canvas = Canvas.of(CameraOptions3d(k1=k1))
    places = canvas.places()
    width, height = canvas.size_px
    assert places.shape == (720, 1280, 2)
    assert places.min() >= 0
    assert places[..., 0].max() <= width - 1
    assert places[..., 1].max() <= height - 1
    assert (width < 1290) == (k1 >= 0), "no more than needed"


def test_the_middle_stays_and_the_scale_there_too() -> None:
    canvas = Canvas.of(CameraOptions3d())
    places = canvas.places()
    middle = (places[359, 639] + places[360, 640]) / 2
    assert middle == pytest.approx((np.array(canvas.size_px) - 1) / 2)
    assert places[360, 640] - places[359, 639] == pytest.approx([1, 1], abs=1e-4)
    assert np.tan(canvas.fovy_rad / 2) * canvas.focal_length_px == pytest.approx(
        canvas.size_px[1] / 2
    )


def test_a_lens_that_shows_what_is_behind_is_refused() -> None:
    with pytest.raises(InputError):
        CameraOptions3d(k1=-0.99)

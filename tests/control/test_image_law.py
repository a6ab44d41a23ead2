"""The image law in plain numbers, against a pinhole camera."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import Floor
from airground.control.image_law import ImageLaw
from airground.geometry import LimitedHomography
from airground.sim import SimCamera, demo_world

CAMERA = demo_world().camera
MIRRORED = SimCamera(CAMERA.image_from_ground @ np.diag([1.0, -1.0, 1.0]), CAMERA.image_size_px)


@pytest.mark.parametrize(("camera", "y"), [(CAMERA, 1.0), (MIRRORED, -1.0)])
def test_it_is_the_camera(camera: SimCamera, y: float, rng: np.random.Generator) -> None:
    law = ImageLaw(Floor(LimitedHomography(camera.g), camera.project([0.0, 4.1 * y])))
    for _ in range(20):
        a, b = rng.uniform([-2.0, 2.6], [2.0, 5.6], (2, 2)) * [1.0, y]
        (u, v), goal = camera.project([a, b])
        assert_allclose(law.displacement(u, v, *goal), b - a, atol=1e-9)
        w, h = rng.normal(size=2), 1e-5
        ahead, back = camera.project([a + h * w, a - h * w])
        uv_dot = (ahead - back) / (2 * h)
        assert_allclose(law.to_image(u, v, *w), uv_dot, rtol=1e-6, atol=1e-6)
        assert_allclose(law.to_ground(u, v, *uv_dot), w, rtol=1e-6, atol=1e-6)
        other = rng.normal(size=2)  # J' on a vector that is not the motion's own
        rates = [np.array(law.to_image(*c, *other)) for c in (ahead, back)]
        bend = law.bend((u, v), (uv_dot[0], uv_dot[1]), (other[0], other[1]))
        assert_allclose(bend, (rates[0] - rates[1]) / (2 * h), rtol=1e-4, atol=1e-4)


def test_what_is_no_ground_is_nan() -> None:
    law = ImageLaw(Floor(LimitedHomography(CAMERA.g), CAMERA.project([0.0, 4.1])))
    here, above = (640.0, 500.0), (640.0, -2000.0)
    assert law.sees(*here)
    assert not law.sees(*above)
    assert not law.sees(np.nan, 0.0)
    assert np.isnan(law.displacement(*here, *above)).all()
    assert np.isnan(law.displacement(*above, *here)).all()
    assert np.isnan(law.displacement(np.nan, 0.0, *here)).all()
    assert np.isnan(law.to_ground(*above, 1.0, 1.0)).all()

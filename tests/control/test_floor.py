"""Ground coordinates through g against a pinhole camera in three dimensions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import Floor
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import SimCamera, demo_world

CAMERA = demo_world().camera
UV = np.array([[300.0, 500.0], [900.0, 300.0], [640.0, 700.0]])
ORIGIN = np.array([640.0, 400.0])


@pytest.fixture
def floor() -> Floor:
    return Floor(LimitedHomography(CAMERA.g), ORIGIN)


def test_positions_are_the_ground_apart_from_the_origin(floor: Floor) -> None:
    true = CAMERA.unproject(UV) - CAMERA.unproject(ORIGIN)
    assert_allclose(floor.position(UV), true, atol=1e-9)
    assert_allclose(floor.pixel(true), UV, atol=1e-7)
    for uv, xy in zip(UV, true, strict=True):  # one point goes another way
        assert_allclose(floor.position(uv), xy, atol=1e-9)
        assert_allclose(floor.pixel(xy), uv, atol=1e-7)
        assert_allclose(floor.position_of(*uv), xy, atol=1e-9)
        assert_allclose(floor.pixel_of(*xy), uv, atol=1e-7)
    assert_allclose(floor.distance(UV[0], UV[1]), np.hypot(*(true[1] - true[0])), atol=1e-9)


def test_what_is_no_ground_is_nan(floor: Floor) -> None:
    above = np.array([640.0, -2000.0])  # beyond the horizon
    assert np.isnan(floor.position(above)).all()
    assert np.isnan(floor.position([above, ORIGIN])[0]).all()
    assert_allclose(floor.position([above, ORIGIN])[1], 0.0, atol=1e-9)
    assert np.isnan(floor.position([np.nan, 3.0])).all()
    behind = CAMERA.unproject(ORIGIN) - np.array([0.0, 1e3])
    assert np.isnan(floor.pixel(behind)).all()


def test_a_left_handed_ground_is_told_apart() -> None:
    mirrored = CAMERA.image_from_ground @ np.diag([1.0, -1.0, 1.0])
    camera = SimCamera(mirrored, CAMERA.image_size_px)
    assert Floor(LimitedHomography(camera.g), ORIGIN).clockwise
    assert not Floor(LimitedHomography(CAMERA.g), ORIGIN).clockwise


def test_an_origin_on_the_horizon_is_refused(floor: Floor) -> None:
    n = floor.model.horizon
    with pytest.raises(InputError, match="horizon"):
        Floor(floor.model, np.array([0.0, -n[2] / n[1]]))

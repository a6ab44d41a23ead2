"""The camera of Table 1."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.sim import SegmentDrive
from airground.studies.paper_camera import G_IDEAL, IMAGE_SIZE_PX, camera_at, paper_camera

TABLE_1 = [[-8.8347, -2.0486], [-0.2190, 3.3972], [-0.00065, -0.0048]]


@pytest.mark.parametrize("origin", [(511.5, 383.5), (0.0, 0.0), (291.0, 634.0), (1000.0, 20.0)])
def test_g_is_table_1_for_every_origin(origin: tuple[float, float]) -> None:
    """No rescaling is needed: eq. 21's determinant is one whatever the origin."""
    camera = camera_at(np.array(origin))
    assert_allclose(camera.g, TABLE_1, rtol=1e-9)
    assert_allclose(abs(np.linalg.det(camera.image_from_ground)), 1.0, rtol=1e-9)
    assert_allclose(camera.project([0.0, 0.0]), origin, atol=1e-9)


def test_the_drive_is_in_the_middle_of_the_image_and_inside() -> None:
    drive = SegmentDrive()
    camera = paper_camera(drive.corners)
    xy, _ = drive.at(np.linspace(0, drive.total_s, 1001))
    uv = camera.project(xy)
    middle = (np.array(IMAGE_SIZE_PX) - 1) / 2
    assert_allclose((uv.min(axis=0) + uv.max(axis=0)) / 2, middle, atol=1e-6)
    assert camera.visible(xy, margin_px=130).all()


def test_the_drive_can_be_seen_elsewhere() -> None:
    uv = paper_camera(SegmentDrive().corners, (100.0, -80.0)).project(SegmentDrive().corners)
    assert_allclose((uv.min(axis=0) + uv.max(axis=0)) / 2, [611.5, 303.5], atol=1e-6)


@pytest.mark.parametrize("duration", [10.0, 60.0])
def test_a_drive_that_does_not_fit_is_refused(duration: float) -> None:
    with pytest.raises(InputError, match="1024x768"):
        paper_camera(SegmentDrive(duration_s=duration).corners)


def test_the_constants_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        G_IDEAL[0, 0] = 1.0

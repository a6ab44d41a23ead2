"""Renderer, lens, survey and truth against each other, by the eyes of those who do not know them."""

from __future__ import annotations

from math import tan

import numpy as np
import pytest

from airground.errors import UndeterminedError
from airground.geometry import LimitedHomography
from airground.geometry.arrays import FloatArray
from airground.sim3d.camera_pose import CameraPose
from airground.sim3d.options import FAMILY, CameraOptions3d, World3dOptions
from airground.sim3d.survey import survey
from airground.sim3d.world import World3d
from airground.vision.detectors.registry import make_detector
from airground.vision.frame import Frame
from worlds3d import alone, drive, small_camera

pytestmark = pytest.mark.usefixtures("drawing")

HEIGHT_M = 0.30


def by_hand(pose: CameraPose, camera: CameraOptions3d, xyz: FloatArray) -> FloatArray:
    """Pinhole projection."""
    width, height = camera.image_size_px
    seen = (xyz - pose.position) @ pose.world_from_camera
    f = height / 2 / tan(camera.fovy_rad / 2)
    return f * seen[:, :2] / seen[:, 2:] + [(width - 1) / 2, (height - 1) / 2]


def sighting(frame: Frame, tag: int) -> FloatArray:
    seen = make_detector(f"tag:family={FAMILY}").detect(frame)
    assert str(tag) in seen.labels
    return np.array(seen.uv[seen.labels.index(str(tag))])


def test_the_survey_is_what_a_pinhole_gives() -> None:
    with World3d(alone(CameraOptions3d(roll_rad=0.3, k1=-0.1))) as world:
        found = survey(world, HEIGHT_M)
        camera = world.options.camera
        xyz = np.column_stack([found.xy, np.full(len(found.xy), HEIGHT_M)])
        assert found.residual_px < 0.1
        wanted = by_hand(world.camera_pose(0.0), camera, xyz)
        assert found.project(found.xy) == pytest.approx(wanted, abs=0.1)
        assert np.linalg.det(found.image_from_plane) == pytest.approx(1.0)
        model = LimitedHomography.from_homography(found.image_from_plane)
        assert model.g == pytest.approx(found.g)


def test_a_camera_that_looks_away_sees_no_points() -> None:
    away = alone(small_camera(target_m=(0.0, -9.0, 0.0)))
    with World3d(away) as world, pytest.raises(UndeterminedError, match="must see 8"):
        survey(world, HEIGHT_M)


def test_tags_are_detected_where_survey_and_truth_say() -> None:
    with World3d(World3dOptions(), seed=4) as world:
        drive(world, 0.15, 0.5, 2.0)
        world.drop_frames()
        drive(world, 0.15, 0.5, 0.2)
        frame = world.frames(world.now)[-1]
        exposed = frame.t - world.options.camera.latency_s
        plane = survey(world, HEIGHT_M)
        for name, tag in (("red", 0), ("cart", 9)):
            wanted = plane.project(world.truth(name, exposed).xy)
            uv = sighting(frame, tag)
            assert np.hypot(*(world.lens.undistort(uv) - wanted)) < 0.3
            assert np.hypot(*(uv - wanted)) > 0.5, "the lens counts"


def test_the_tag_says_where_forward_is() -> None:
    with World3d(alone()) as world:
        drive(world, 0.0, 0.8, 1.0)
        frame = world.frames(world.now)[-1]
        truth = world.truth("red", frame.t - world.options.camera.latency_s)
        plane = survey(world, HEIGHT_M)
        ahead = np.array([np.cos(truth.theta), np.sin(truth.theta)])
        way = plane.project(truth.xy + 0.01 * ahead) - plane.project(truth.xy)
        seen = make_detector(f"tag:family={FAMILY}").detect(frame)
        off = seen.angle[0] - np.arctan2(way[1], way[0])
        assert np.angle(np.exp(1j * off)) == pytest.approx(0.0, abs=0.1)


def test_a_camera_that_drifts_sees_what_stands_elsewhere() -> None:
    def drifts(t: float) -> CameraPose:
        return CameraPose.looking_at((0.3 * np.sin(t), -1.9, 3.3 + 0.1 * t), (0.1 * t, 0.0, 0.0))

    options = alone(small_camera(image_size_px=(960, 540), rate_hz=1.0))
    with World3d(options, camera_pose=drifts) as world:
        world.advance(2.5)
        frames = world.frames(world.now)
        seen = []
        for frame in frames[::2]:
            exposed = frame.t - options.camera.latency_s
            wanted = survey(world, HEIGHT_M, t=exposed).project(world.truth("red", exposed).xy)
            seen.append(world.lens.undistort(sighting(frame, 0)))
            assert np.hypot(*(seen[-1] - wanted)) < 0.5
        assert np.hypot(*(seen[-1] - seen[0])) > 20

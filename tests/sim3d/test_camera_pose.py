from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation  # type: ignore[import-untyped]

from airground.errors import InputError
from airground.sim3d.camera_pose import CameraPose


def test_what_it_looks_at_is_ahead_and_up_is_up() -> None:
    pose = CameraPose.looking_at((1.0, -2.0, 3.0), (1.0, 0.0, 0.0))
    right, down, forward = pose.world_from_camera.T
    assert forward == pytest.approx(np.array([0.0, 2.0, -3.0]) / np.sqrt(13))
    assert right == pytest.approx([1.0, 0.0, 0.0])
    assert down[2] < 0


def test_straight_down_y_is_up_in_the_image() -> None:
    right, down, forward = CameraPose.looking_at((0, 0, 3), (0, 0, 0)).world_from_camera.T
    assert right == pytest.approx([1, 0, 0])
    assert down == pytest.approx([0, -1, 0])
    assert forward == pytest.approx([0, 0, -1])


def test_a_roll_is_clockwise_as_the_camera_sees_it() -> None:
    """What was on the right of a camera that turned clockwise is now further up in its image."""
    pose = CameraPose.looking_at((0, 0, 3), (0, 0, 0), roll_rad=0.1)
    seen = pose.world_from_camera.T @ np.array([1.0, 0.0, -3.0])
    assert seen[1] < 0


def test_quaternions_are_rotations(rng: np.random.Generator) -> None:
    half_turns = [Rotation.from_euler(axis, np.pi) for axis in "xyz"]
    for turn in [Rotation.identity(), *half_turns, *Rotation.random(50, rng=rng)]:
        pose = CameraPose(np.zeros(3), turn.as_matrix())
        w, *xyz = pose.quaternion.tolist()
        axes = Rotation.from_quat([*xyz, w]).as_matrix()
        assert axes * np.array([1, -1, -1]) == pytest.approx(pose.world_from_camera, abs=1e-12)


def test_what_is_no_pose_is_refused() -> None:
    with pytest.raises(InputError, match="rotation"):
        CameraPose(np.zeros(3), np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(InputError, match="where it is"):
        CameraPose.looking_at((1, 2, 3), (1, 2, 3))

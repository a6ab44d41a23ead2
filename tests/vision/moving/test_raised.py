"""Marks above the ground under a camera that moves, against a pinhole in three dimensions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError, UndeterminedError
from airground.vision.moving import Stabilization, raised

F, MIDDLE = 900.0, np.array([639.5, 359.5])
K = np.array([[F, 0, MIDDLE[0]], [0, F, MIDDLE[1]], [0, 0, 1.0]])
Array = np.ndarray


def pinhole(centre: Array, tilt: float, turn: float, roll: float = 0.0) -> tuple[Array, Array]:
    """Rotation (rows right, down, forward) and projection of a camera over z = 0."""
    ahead = np.array([np.cos(turn), np.sin(turn), 0.0])
    up = np.array([0, 0, 1.0])
    forward = np.sin(tilt) * ahead - np.cos(tilt) * up
    right = np.cross(forward, up)
    right = right / np.linalg.norm(right)
    down = np.cross(forward, right)
    c, s = np.cos(roll), np.sin(roll)
    R = np.stack([c * right + s * down, -s * right + c * down, forward])
    return R, K @ np.column_stack([R, -R @ centre])


def see(P: Array, xyz: Array) -> Array:
    w = np.column_stack([xyz, np.ones(len(xyz))]) @ P.T
    return np.asarray(w[:, :2] / w[:, 2:])


@pytest.mark.parametrize("height", [0.0, 0.3, 1.5])
def test_marks_on_a_roof_are_held_still(rng: np.random.Generator, height: float) -> None:
    R0, P0 = pinhole(np.array([0.0, 0.0, 8.0]), 0.7, 1.5, 0.05)
    _, P1 = pinhole(np.array([1.5, -0.8, 7.1]), 0.6, 1.9, -0.1)
    H = P0[:, [0, 1, 3]] @ np.linalg.inv(P1[:, [0, 1, 3]])
    ground = Stabilization(0.0, "ok", -3 * H, 1e-9 * np.eye(8))
    xyz = np.column_stack([rng.uniform(-2, 2, 9), rng.uniform(5, 8, 9), np.full(9, height)])
    roof = raised(
        ground,
        height_ratio=height / 8.0,
        normal=R0 @ np.array([0, 0, -1.0]),
        focal_length_px=F,
        principal_point=MIDDLE,
    )
    assert roof.stable_from_image is not None
    w = np.column_stack([see(P1, xyz), np.ones(9)]) @ roof.stable_from_image.T
    assert_allclose(w[:, :2] / w[:, 2:], see(P0, xyz), atol=1e-6)
    if height:
        w = np.column_stack([see(P1, xyz), np.ones(9)]) @ H.T
        assert np.abs(w[:, :2] / w[:, 2:] - see(P0, xyz)).max() > 5  # what it would be without


def test_what_cannot_be_is_refused() -> None:
    camera = {"normal": [0, 0.6, 0.8], "focal_length_px": F, "principal_point": MIDDLE}
    still = Stabilization(0.0, "ok", np.eye(3), np.zeros((8, 8)))
    for wrong in ({"focal_length_px": 0.0}, {"height_ratio": 1.0}, {"normal": [0, 0, 0]}):
        with pytest.raises(InputError, match="must be positive"):
            raised(still, **({"height_ratio": 0.1} | camera | wrong))  # type: ignore[arg-type]
    near = Stabilization(0.0, "ok", np.diag([0.1, 0.1, 1.0]), np.zeros((8, 8)))
    down = {"normal": [0, 0, 1], "focal_length_px": F, "principal_point": [0, 0]}
    with pytest.raises(UndeterminedError, match="below the marks"):
        raised(near, height_ratio=0.2, **down)  # type: ignore[arg-type]
    lost = Stabilization(0.0, "lost")
    assert raised(lost, height_ratio=0.1, **camera) is lost  # type: ignore[arg-type]

"""Marks above the ground under a camera in wind: found from focal length and the marks' height, beside the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.calibration import Motion, Tracks
from airground.errors import UndeterminedError
from airground.geometry import align_rotation, n_error
from airground.geometry.arrays import FloatArray
from airground.sim.flights import hover
from airground.sim.scene_camera import Pinhole
from airground.vision.moving import MarksView, calibrate_marks

BASE = Pinhole.looking_down(
    focal_length_px=800.0, tilt_rad=0.5, height_m=5.0, image_size_px=(1280, 720)
)
CAMERA = hover(BASE, seed=2)
K = np.array([[800.0, 0, 639.5], [0, 800.0, 359.5], [0, 0, 1]])
MARK_M = 0.3
T = np.arange(0, 40, 0.1)


def plane(t: float, height: float) -> FloatArray:
    """Image from a plane at a height, written out."""
    camera = CAMERA(t)
    R = camera.camera_from_world
    return np.asarray(
        K @ np.column_stack([R[:, 0], R[:, 1], R @ (np.array([0, 0, height]) - camera.centre_m)])
    )


def seen(H: FloatArray, xy: FloatArray) -> FloatArray:
    w = H @ np.array([*xy, 1.0])
    return np.asarray(w[:2] / w[2])


def drive(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A figure eight, and its velocity."""
    a, b = 2 * np.pi * t / 27, 4 * np.pi * t / 27
    xy = np.column_stack([1.0 * np.sin(a), 2.7 + 0.6 * np.sin(b)])
    rate = np.column_stack([2 * np.pi / 27 * np.cos(a), 0.6 * 4 * np.pi / 27 * np.cos(b)])
    return xy, rate


@pytest.fixture(scope="module")
def recorded() -> tuple[Tracks, dict[float, FloatArray], Motion, FloatArray]:
    """Sightings held still as if on the ground, the homographies, readings, and the true plane of the marks."""
    noise = np.random.default_rng(5)
    xy, _ = drive(T)
    first = plane(0.0, 0.0)
    ground = {t: first @ np.linalg.inv(plane(t, 0.0)) for t in T.tolist()}
    raw = np.array([seen(plane(t, MARK_M), p) for t, p in zip(T.tolist(), xy, strict=True)])
    raw += noise.normal(0, 0.05, raw.shape)
    uv = np.array([seen(ground[t], p) for t, p in zip(T.tolist(), raw, strict=True)])
    t = np.arange(-0.5, 40.5, 0.05)
    _, rate = drive(t)
    motion = Motion.from_rows(
        t,
        ["red"] * len(t),
        heading=np.arctan2(rate[:, 1], rate[:, 0]) + noise.normal(0, 0.01, len(t)),
        speed=np.hypot(*rate.T) * (1 + noise.normal(0, 0.01, len(t))),
    )
    return Tracks.from_rows(T, ["red"] * len(T), uv), ground, motion, plane(0.0, MARK_M)


def view(mark_height_m: float = MARK_M) -> MarksView:
    return MarksView(mark_height_m, 800.0, (1280, 720))


def test_marks_above_the_ground_calibrate_as_under_a_camera_that_stands(
    recorded: tuple[Tracks, dict[float, FloatArray], Motion, FloatArray],
) -> None:
    tracks, ground, motion, truth = recorded
    found = calibrate_marks(tracks, ground, motion, view())
    g = truth[:, :2] / np.cbrt(np.linalg.det(truth))
    assert n_error(g, align_rotation(g, found.calibration.model)[0]) < 0.01
    assert found.camera_height_m == pytest.approx(CAMERA(0.0).centre_m[2], rel=0.01)
    down = CAMERA(0.0).camera_from_world @ np.array([0.0, 0.0, -1.0])
    assert np.degrees(np.arccos(found.normal @ down)) < 0.05
    flat = calibrate_marks(tracks, ground, motion, view(mark_height_m=1e-6))
    n_flat = n_error(g, align_rotation(g, flat.calibration.model)[0])
    assert n_flat > 0.03, "or there was nothing to allow for"


def test_a_tilt_that_cannot_be_is_refused(
    recorded: tuple[Tracks, dict[float, FloatArray], Motion, FloatArray],
) -> None:
    tracks, ground, motion, _ = recorded
    wrong = BASE.camera_from_world @ np.array([0.5, 0.0, -1.0])
    with pytest.raises(UndeterminedError, match="fit no level"):
        calibrate_marks(tracks, ground, motion, replace(view(), down=wrong / np.linalg.norm(wrong)))

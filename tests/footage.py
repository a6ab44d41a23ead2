"""Rendered videos whose truth is known, for tests of what reads videos: small images, a few seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.sim import Pinhole, Scene, Tag, WorldCamera, ground
from airground.sim.body_kinds import box, robot
from airground.sim.body_poses import parked
from airground.sim.flights import hover
from airground.vision.video_writer import VideoWriter

if TYPE_CHECKING:
    from pathlib import Path

    from airground.geometry import FloatArray

RATE_HZ = 20.0
SIZE_PX = (480, 270)
CAMERA = Pinhole.looking_down(
    focal_length_px=400.0, tilt_rad=0.6, height_m=3.0, image_size_px=SIZE_PX, heading_rad=np.pi / 2
)


def circle(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Once around in 12 s, in the middle of the image."""
    phi = 2 * np.pi * t / 12
    xy = np.column_stack([0.7 * np.cos(phi), 2.0 + 0.5 * np.sin(phi)])
    return xy, np.arctan2(0.5 * np.cos(phi), -0.7 * np.sin(phi))


def circling(*, tag: bool = True, moving_camera: bool = False, seed: int = 0) -> Scene:
    """A robot that drives in a circle past two boxes."""
    marks = (Tag("36h11", 7, 0.36),) if tag else ()
    bodies = (
        robot("robot", circle, *marks, size_m=(0.6, 0.5, 0.1)),
        box("left", parked(-1.5, 2.4, 0.3), (0.4, 0.3, 0.05)),
        box("right", parked(1.6, 1.5, 0.9), (0.5, 0.3, 0.05)),
    )
    return Scene(
        camera=hover(CAMERA, seed=seed) if moving_camera else CAMERA,
        ground=ground("asphalt", seed=seed, tile_m=6.0, texel_m=0.006),
        bodies=bodies,
        exposure_s=0.004,
        noise=1.5,
    )


def write_film(path: Path, scene: Scene, duration_s: float, *, rate_hz: float = RATE_HZ) -> None:
    """Render to a lossless video."""
    with (
        VideoWriter(path, size_px=scene.image_size_px, rate_hz=rate_hz) as video,
        WorldCamera(scene, rate_hz=rate_hz, duration_s=duration_s) as camera,
    ):
        for frame in camera:
            video.write(frame.image)


def true_uv(scene: Scene, t: FloatArray) -> FloatArray:
    """(N, 2). Where the robot's mark is in the camera's first view, at times t: where a still camera would see it."""
    xy, _ = scene.body("robot").pose(t)
    height = float(scene.body("robot").reference[2])
    return np.asarray(scene.plane(height, 0.0).project(xy))

"""The embedded world filmed: tracks from its images, and a video with what was found drawn in."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from airground.records import replacing
from airground.sim import WorldCamera
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes, Look
from airground.vision.overlay import Overlay
from airground.vision.preview import Preview
from airground.vision.sources import ahead
from airground.vision.tracker import Tracker, TrackRecorder
from airground.vision.video_tracks import track_video

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from airground.calibration import Calibration, Tracks
    from airground.geometry import FloatArray
    from airground.sim import Scene

__all__ = ["film", "mark_positions", "watch"]

RATE_HZ = 30.0
FILM_HZ = 15.0  # of the video, which is for people


def watch(
    scene: Scene,
    *,
    duration_s: float,
    seed: int,
    names: Mapping[str, str],
    say: Callable[[str], None],
) -> Tracks:
    """Film a scene and follow its tags: images in, tracks out, and nothing else of the world.

    Parameters
    ----------
    scene : Scene
        What the camera looks at.
    duration_s : float [s]
        How long.
    seed : int
        Of the sensor's noise.
    names : mapping of str to str
        From the number of a tag to who bears it.
    say : callable
        Is told what is being done.

    Returns
    -------
    tracks : Tracks
        Sightings of the tags' centres.
    """
    camera = WorldCamera(scene, rate_hz=RATE_HZ, duration_s=duration_s, seed=seed)
    done = 0

    def each(look: Look) -> None:
        nonlocal done
        del look
        done += 1
        if done % 30 == 0:
            say(f"film and track: frame {done} of {camera.frame_count}")

    with camera, ahead(camera) as frames:
        eyes = Eyes(make_detector("tag:family=36h11"), Tracker())
        tracks = track_video(frames, eyes, TrackRecorder(), each=each).tracks
    return replace(tracks, targets=tuple(names.get(name, name) for name in tracks.targets))


def film(
    path: Path,
    scene: Scene,
    calibration: Calibration,
    *,
    duration_s: float,
    seed: int,
    names: Mapping[str, str],
    say: Callable[[str], None],
) -> None:
    """Write a video of a scene with tracks, speeds, horizon and metric grid drawn in.

    Parameters
    ----------
    path : Path
        Video to write.
    scene : Scene
        What the camera looks at.
    calibration : Calibration
        Found before, from the same drive.
    duration_s : float [s]
        How long.
    seed : int
        Of the sensor's noise.
    names : mapping of str to str
        From the number of a tag to who bears it.
    say : callable
        Is told what is being done.
    """
    camera = WorldCamera(scene, rate_hz=FILM_HZ, duration_s=duration_s, seed=seed)
    eyes = Eyes(make_detector("tag:family=36h11"), Tracker())
    overlay = Overlay(calibration=calibration, names=names)
    with (
        replacing(path) as temporary,
        Preview(temporary, overlay) as preview,
        camera,
        ahead(camera) as frames,
    ):
        for k, frame in enumerate(frames):
            preview.add(eyes.look(frame))
            if k % 15 == 0:
                say(f"draw the video: frame {k} of {camera.frame_count}")


def mark_positions(scene: Scene, name: str, t: FloatArray) -> FloatArray:
    """Where a body's mark really is.

    Parameters
    ----------
    scene : Scene
        Where it drives.
    name : str
        Of the body.
    t : (N,) array [s]
        Times.

    Returns
    -------
    xy : (N, 2) array [m]
        Below the mark, on the ground.
    """
    body = scene.body(name)
    xy, theta = body.pose(t)
    x, y, _ = body.reference
    forward = np.column_stack([np.cos(theta), np.sin(theta)])
    left = np.column_stack([-forward[:, 1], forward[:, 0]])
    return np.asarray(xy + x * forward + y * left)

"""The embedded world filmed: tracks from its images, and a video with what was found drawn in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.records import replacing
from airground.sim import WorldCamera
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes, Look
from airground.vision.image_files import write_png
from airground.vision.overlay import Overlay
from airground.vision.sources import ahead
from airground.vision.tracker import Tracker, TrackRecorder
from airground.vision.video_tracks import track_video
from airground.vision.video_writer import VideoWriter

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from airground.calibration import Calibration, Tracks
    from airground.geometry import FloatArray
    from airground.sim import Scene
    from airground.vision.tracker import Track

__all__ = ["Watched", "film", "mark_positions", "watch"]

RATE_HZ = 20.0
FILM_EVERY = 2  # frames: the video is for people


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """What the eyes made of a scene."""

    tracks: Tracks
    """Sightings of the tags' centres."""

    states: tuple[tuple[int, tuple[Track, ...]], ...]
    """Of every `FILM_EVERY`-th frame: its number, and what the tracker believed then."""


def watch(
    scene: Scene,
    *,
    duration_s: float,
    seed: int,
    names: Mapping[str, str],
    say: Callable[[str], None],
) -> Watched:
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
    watched : Watched
        Tracks, and what to draw into a video.
    """
    camera = WorldCamera(scene, rate_hz=RATE_HZ, duration_s=duration_s, seed=seed)
    states: list[tuple[int, tuple[Track, ...]]] = []

    def each(look: Look) -> None:
        index = look.frame.index
        if index % FILM_EVERY == 0:
            states.append((index, look.state.tracks))
        if index % 20 == 0:
            say(f"film and track: frame {index} of {camera.frame_count}")

    with camera, ahead(camera) as frames:
        eyes = Eyes(make_detector("tag:family=36h11"), Tracker())
        tracks = track_video(frames, eyes, TrackRecorder(), each=each).tracks
    tracks = replace(tracks, targets=tuple(names.get(name, name) for name in tracks.targets))
    return Watched(tracks, tuple(states))


def film(
    path: Path,
    scene: Scene,
    calibration: Calibration,
    watched: Watched,
    *,
    seed: int,
    names: Mapping[str, str],
    say: Callable[[str], None],
) -> None:
    """Write a video of a scene with tracks, speeds and metric grid drawn in, and one picture of it, ``frame.png``.

    Parameters
    ----------
    path : Path
        Video to write.
    scene : Scene
        What the camera looks at.
    calibration : Calibration
        Found from the tracks; it was not known yet when they were made.
    watched : Watched
        What the eyes made of it.
    seed : int
        Of the sensor's noise: the same as then, and the same images come again.
    names : mapping of str to str
        From the number of a tag to who bears it.
    say : callable
        Is told what is being done.
    """
    last = watched.states[-1][0]
    still = _telling(watched)
    camera = WorldCamera(scene, rate_hz=RATE_HZ, duration_s=last / RATE_HZ, seed=seed)
    overlay = Overlay(calibration=calibration, names=names)
    with (
        replacing(path) as temporary,
        VideoWriter(temporary, size_px=scene.image_size_px, rate_hz=RATE_HZ / FILM_EVERY) as video,
        ahead(camera.frame(index) for index, _ in watched.states) as frames,
    ):
        for frame, (index, tracks) in zip(frames, watched.states, strict=True):
            image = overlay.draw(frame, tracks)
            video.write(image)
            if index == still:
                with replacing(path.with_name("frame.png")) as picture:
                    write_png(picture, image)
            if index % 20 == 0:
                say(f"draw the video: frame {index} of {last}")


def _telling(watched: Watched) -> int:
    """Number of a frame with as many targets as there ever are, half way through those."""
    counts = [sum(track.confirmed for track in tracks) for _, tracks in watched.states]
    full = [index for (index, _), n in zip(watched.states, counts, strict=True) if n == max(counts)]
    return full[len(full) // 2]


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

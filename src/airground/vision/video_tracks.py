"""A whole video to tracks."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from airground.errors import InputError, UndeterminedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from airground.calibration import Tracks
    from airground.vision.eyes import Eyes, Look
    from airground.vision.frame import Clock, Frame
    from airground.vision.tracker import TrackRecorder

__all__ = ["VideoTracks", "track_video"]


@dataclass(frozen=True, slots=True, eq=False)
class VideoTracks:
    """What a video gave."""

    tracks: Tracks
    """Sightings by target, as the detector gave them, in the first frame's pixels where the camera moves."""

    frames: int
    """How many frames were looked at."""

    unplaced: Mapping[str, int]
    """How many frames of a moving camera had no place in the stable frame, by reason."""

    image_size_px: tuple[int, int]
    """Width and height [px]."""

    clock: Clock
    """Where the times come from."""

    duration_s: float
    """From the first frame to the last [s]."""


def track_video(
    frames: Iterable[Frame],
    eyes: Eyes,
    recorder: TrackRecorder,
    *,
    each: Callable[[Look], None] | None = None,
) -> VideoTracks:
    """Look at all frames and collect who was where.

    Parameters
    ----------
    frames : iterable of Frame
        In order of time.
    eyes : Eyes
        Fresh: has seen no other frame.
    recorder : TrackRecorder
        Fresh too.
    each : callable, optional
        Is given what was made of each frame: for pictures and progress.

    Returns
    -------
    found : VideoTracks
        With one target or more.

    Raises
    ------
    UndeterminedError
        If there is no frame, or nothing was followed for long enough.
    """
    unplaced: Counter[str] = Counter()
    first: Frame | None = None
    last: Frame | None = None
    count = 0
    for frame in frames:
        look = eyes.look(frame)
        if look.stabilization is not None and not look.stabilization.ok:
            unplaced[look.stabilization.status] += 1
        recorder.add(look.sightings, look.state)
        if each is not None:
            each(look)
        first, last, count = first or frame, frame, count + 1
    if first is None or last is None:
        raise UndeterminedError("the video has no frames; nothing to track")
    try:
        tracks = recorder.tracks()
    except InputError:
        raise UndeterminedError(
            f"nothing was seen for {recorder.shortest_s:g} s or more in {count} frames; choose the detector that "
            "suits what there is to see"
        ) from None
    return VideoTracks(
        tracks=tracks,
        frames=count,
        unplaced=dict(unplaced),
        image_size_px=first.size_px,
        clock=first.clock,
        duration_s=last.t - first.t,
    )

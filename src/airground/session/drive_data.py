"""What a calibration drive has brought in, and the calibration that is made of it."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.calibration import Motion, Provenance, Tracks, calibrate
from airground.errors import UndeterminedError
from airground.session.live_estimate import Batch

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from airground.calibration import Calibration
    from airground.geometry.arrays import FloatArray
    from airground.robots import RobotReading

__all__ = ["DriveData"]

MOST_READINGS = (
    120_000  # forty minutes at 50 a second: memory is bounded, whoever forgets to end a drive
)
MOST_SIGHTINGS = 72_000
LEAST = 10  # sightings
SECONDS = 2.0  # of sightings and of readings, below which nothing can be said


class DriveData:
    """Sightings and readings of a drive, the oldest forgotten beyond what any drive needs."""

    def __init__(self) -> None:
        self._readings: deque[tuple[str, RobotReading]] = deque(maxlen=MOST_READINGS)
        self._sightings: deque[tuple[str, float, float, float]] = deque(maxlen=MOST_SIGHTINGS)
        self._new_readings: list[tuple[str, RobotReading]] = []
        self._new_frames: dict[float, list[tuple[str, tuple[float, float]]]] = {}

    @property
    def news(self) -> bool:
        """Whether anything came in since the last batch."""
        return bool(self._new_frames)

    def see(self, name: str, t: float, uv: FloatArray) -> None:
        """Take a sighting.

        Parameters
        ----------
        name : str
            Of the robot.
        t : float [s]
            As the camera stamped it.
        uv : (2,) array [px]
            In raw pixels.
        """
        u, v = uv.tolist()
        self._sightings.append((name, t, u, v))
        self._new_frames.setdefault(t, []).append((name, (u, v)))

    def hear(self, name: str, readings: Iterable[RobotReading]) -> None:
        """Take readings.

        Parameters
        ----------
        name : str
            Of the robot.
        readings : iterable of RobotReading
            Oldest first; those without heading or speed say nothing to a calibration.
        """
        useful = [(name, k) for k in readings if k.heading is not None and k.speed is not None]
        self._readings.extend(useful)
        self._new_readings.extend(useful)

    def batch(self) -> Batch:
        """Give what came in since the last time.

        Returns
        -------
        batch : Batch
            For the online estimator.
        """
        frames = tuple(
            (t, tuple(name for name, _ in seen), tuple(uv for _, uv in seen))
            for t, seen in sorted(self._new_frames.items())
        )
        batch = Batch(tuple(self._new_readings), frames)
        self._new_readings, self._new_frames = [], {}
        return batch

    def solution(
        self,
        size_px: tuple[int, int],
        distortion: Literal["auto", "none", "division"],
        command: str,
    ) -> Callable[[], Calibration]:
        """Give the work that makes a calibration of all of it, as it is now.

        Parameters
        ----------
        size_px : (int, int) [px]
            Of the image.
        distortion : {"auto", "none", "division"}
            Lens.
        command : str
            For the calibration's provenance.

        Returns
        -------
        work : callable
            Raises UndeterminedError if the drive says too little.
        """
        return partial(
            _solve, tuple(self._sightings), tuple(self._readings), size_px, distortion, command
        )


def _solve(
    sightings: tuple[tuple[str, float, float, float], ...],
    readings: tuple[tuple[str, RobotReading], ...],
    size_px: tuple[int, int],
    distortion: Literal["auto", "none", "division"],
    command: str,
) -> Calibration:
    names = {name for name, *_ in sightings} & {name for name, _ in readings}
    seen = [k for k in sightings if k[0] in names]
    span = max((k[1] for k in seen), default=0.0) - min((k[1] for k in seen), default=0.0)
    if span < SECONDS or len(seen) < LEAST:
        raise UndeterminedError(
            "too little was driven for a calibration: drive along three directions or more"
        )
    # A reading that was told twice is one.
    once = {(name, k.t): k for name, k in readings if name in names}
    tracks = Tracks.from_rows(
        [k[1] for k in seen], [k[0] for k in seen], np.array([k[2:] for k in seen])
    )
    motion = Motion.from_rows(
        [t for _, t in once],
        [name for name, _ in once],
        heading=np.array([k.heading for k in once.values()]),
        speed=np.array([k.speed for k in once.values()]),
    )
    found = calibrate(tracks, motion, distortion=distortion, image_size_px=size_px)
    return replace(found, provenance=Provenance(command=command))

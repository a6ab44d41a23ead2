"""A bounded amount of recent data, to start from: at first, and after the camera was moved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.online_rows import Frame
from airground.calibration.recordings import Motion, Tracks

if TYPE_CHECKING:
    from airground.calibration.online_intake import Intake, Seen
    from airground.calibration.online_model import ImageFrame
    from airground.calibration.online_path import PathPoint

__all__ = ["Recent", "frame_of"]

MOST = 1500
EACH = 60  # at least so many of each robot
MOST_ROBOTS = 12  # in the recordings for a first g


class Recent:
    """Sightings of the last while; when there are too many, every second of each robot goes."""

    def __init__(self) -> None:
        self._rows: list[Seen] = []
        self._stride = 1
        self._count: dict[int, int] = {}

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, seen: Seen) -> None:
        """Keep a sighting.

        Parameters
        ----------
        seen : Seen
            Newer than the same robot's others.
        """
        k = self._count.get(seen.robot, 0)
        self._count[seen.robot] = k + 1
        if k % self._stride:
            return
        self._rows.append(seen)
        if len(self._rows) > max(MOST, EACH * len(self._count)):
            self._halve()

    def _halve(self) -> None:
        self._stride *= 2
        place: dict[int, int] = {}
        kept = []
        for seen in self._rows:
            k = place.get(seen.robot, 0)
            place[seen.robot] = k + 1
            if k % 2 == 0:
                kept.append(seen)
        self._rows = kept

    def keep_after(self, t: float) -> None:
        """Forget what is older.

        Parameters
        ----------
        t : float [s]
            Than this.
        """
        self._rows = [seen for seen in self._rows if seen.t >= t]
        self._stride = 1
        self._count = dict.fromkeys({seen.robot for seen in self._rows}, 0)

    def uv(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """All image points.

        Returns
        -------
        uv : (N, 2) array [px]
            Undistorted.
        """
        return np.array([(seen.u, seen.v) for seen in self._rows]).reshape(-1, 2)

    def recordings(self, intake: Intake) -> tuple[Tracks, Motion] | None:
        """Give it as recordings, of the robots most seen.

        Parameters
        ----------
        intake : Intake
            That has the readings.

        Returns
        -------
        tracks, motion : Tracks, Motion
            None if there are too few.
        """
        count: dict[int, int] = {}
        for seen in self._rows:
            count[seen.robot] = count.get(seen.robot, 0) + 1
        robots = sorted(count, key=lambda k: -count[k])[:MOST_ROBOTS]
        robots = [k for k in robots if count[k] > 1 and len(intake.paths[k].t) > 1]
        if not robots:
            return None
        rows = [seen for seen in self._rows if seen.robot in set(robots)]
        begin = min(seen.t for seen in rows) - 2.0
        t: list[float] = []
        name: list[str] = []
        xy_dot: list[tuple[float, float]] = []
        for k in robots:
            path = intake.paths[k]
            first = int(np.searchsorted(path.t, begin))
            t += path.t[first:]
            xy_dot += [(p.x_dot, p.y_dot) for p in path.points[first:]]
            name += [intake.names[k]] * (len(path.t) - first)
        if not t:
            return None
        tracks = Tracks.from_rows(
            [seen.t for seen in rows],
            [intake.names[seen.robot] for seen in rows],
            [(seen.u, seen.v) for seen in rows],
        )
        return tracks, Motion.from_rows(t, name, xy_dot=xy_dot)

    def last_times(self) -> dict[int, float]:
        """Time of each robot's newest sighting.

        Returns
        -------
        last : dict of int to float
            By robot [s].
        """
        last: dict[int, float] = {}
        for seen in self._rows:
            last[seen.robot] = max(seen.t, last.get(seen.robot, seen.t))
        return last

    def with_points(self, intake: Intake, offset: float) -> list[tuple[Seen, PathPoint]]:
        """Sightings in the order of their times, with what the readings say.

        Parameters
        ----------
        intake : Intake
            That has the readings.
        offset : float [s]
            To be added to times to get the readings'.

        Returns
        -------
        pairs : list of (Seen, PathPoint)
            Those for which the readings say something.
        """
        pairs = []
        for seen in sorted(self._rows):
            point = intake.paths[seen.robot].at(seen.t + offset)
            if point is not None:
                pairs.append((seen, point))
        return pairs

    def frames(self, intake: Intake, image: ImageFrame, offset: float) -> list[Frame]:
        """Give it to the filter.

        Parameters
        ----------
        intake : Intake
            That has the readings.
        image : ImageFrame
            Normalised pixels.
        offset : float [s]
            To be added to times to get the readings'.

        Returns
        -------
        frames : list of Frame
            In order, each robot once in each.
        """
        frames: list[Frame] = []
        group: list[tuple[Seen, PathPoint]] = []
        inside: set[int] = set()
        before: dict[int, float] = {}
        for seen, point in self.with_points(intake, offset):
            if seen.robot in inside:
                frames.append(frame_of(group, image, before))
                group, inside = [], set()
            group.append((seen, point))
            inside.add(seen.robot)
        if group:
            frames.append(frame_of(group, image, before))
        return frames


def frame_of(
    group: list[tuple[Seen, PathPoint]], image: ImageFrame, before: dict[int, float]
) -> Frame:
    """Bring sightings of different robots into columns.

    Parameters
    ----------
    group : list of (Seen, PathPoint)
        Sightings and what the readings say at their times.
    image : ImageFrame
        Normalised pixels.
    before : dict of int to float
        Time of each robot's last sighting [s]; is brought up to date.

    Returns
    -------
    frame : Frame
        For the filter.
    """
    scale, (u0, v0) = image.scale, image.centre.tolist()
    if len(group) == 1:
        seen, point = group[0]
        last = before.get(seen.robot, seen.t)
        before[seen.robot] = seen.t
        return Frame(
            np.array([seen.robot]),
            np.array([[(seen.u - u0) * scale, (seen.v - v0) * scale]]),
            np.array([(seen.sigma * scale) ** 2]),
            np.array([point]),
            np.array([seen.t - last]),
        )
    robots, c, variance, dt = [], [], [], []
    for seen, _ in group:
        robots.append(seen.robot)
        c.append(((seen.u - u0) * scale, (seen.v - v0) * scale))
        variance.append((seen.sigma * scale) ** 2)
        dt.append(seen.t - before.get(seen.robot, seen.t))
        before[seen.robot] = seen.t
    return Frame(
        np.array(robots),
        np.array(c),
        np.array(variance),
        np.array([point for _, point in group]),
        np.array(dt),
    )

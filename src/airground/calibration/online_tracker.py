"""The recursive estimator while it runs: filter, monitor and bookkeeping, from one start to the next."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.calibration.bump import BumpMonitor
from airground.calibration.guidance_information import Position
from airground.calibration.online_coverage import Coverage
from airground.calibration.online_recent import frame_of
from airground.calibration.online_strays import Strays

if TYPE_CHECKING:
    from airground.calibration.bump import Bump
    from airground.calibration.online_intake import Seen
    from airground.calibration.online_model import ImageFrame
    from airground.calibration.online_path import PathPoint
    from airground.calibration.online_start import Refined
    from airground.calibration.online_state import OnlineOptions
    from airground.geometry.arrays import FloatArray

__all__ = ["Prior", "Tracker"]

RMS_MEMORY = 2000.0  # sightings
DOUBT = 0.3  # relative change of g for a jump by the spread of the sightings
NOTE_EVERY = 5  # frames: coverage needs no more
STILL = 1e-6  # m^2/s^2


class Prior(NamedTuple):
    """What is known of the globals before the data."""

    mean: FloatArray
    """(K,)."""

    information: FloatArray
    """(K, K). Zero for what the data have to tell."""


class Tracker:
    """What is known since the last start.

    Parameters
    ----------
    refined : Refined
        Filter that has seen all data up to now.
    image : ImageFrame
        Its normalised pixels.
    options : OnlineOptions
        Forgetting, and deviations.
    before : dict of int to float
        Time of each robot's last sighting [s].
    prior : Prior
        What was known before the data.
    """

    def __init__(
        self,
        refined: Refined,
        image: ImageFrame,
        options: OnlineOptions,
        before: dict[int, float],
        prior: Prior,
    ) -> None:
        self.filter = refined.filter
        self.image = image
        self.options = options
        self.monitor = BumpMonitor(len(self.filter.x))
        self.coverage = Coverage()
        self.used = self.refused = 0
        self.prior = prior
        self.doubt: float | None = None
        self._before = before
        self._strays = Strays()
        self._square = 2.0 * (options.sigma_px * image.scale) ** 2
        self._weight = 1.0
        self._forgot = -math.inf
        self._frames = 0

    def take(self, group: list[tuple[Seen, PathPoint]]) -> Bump | None:
        """Take sightings of different robots.

        Parameters
        ----------
        group : list of (Seen, PathPoint)
            Sightings and what the readings say.

        Returns
        -------
        bump : Bump or None
            If the camera has moved.
        """
        frame = frame_of(group, self.image, self._before)
        t = group[-1][0].t
        if self.options.memory_s is not None:
            self._forget(t, frame.path[:, 2:4])
        outcome = self.filter.update(frame)
        self._frames += 1
        if self._frames % NOTE_EVERY == 0:
            for pair in group:
                self.note(pair)
        if len(outcome.robots) == 0:
            return None
        if len(outcome.robots) == 1:
            good = int(outcome.weight[0] > 0)
            ru, rv = outcome.residual[0].tolist()
            square = good * (ru * ru + rv * rv)
        else:
            taken = outcome.weight > 0
            good = int(np.count_nonzero(taken))
            square = float((outcome.residual[taken] ** 2).sum())
        self.used += good
        bad = len(outcome.robots) - good
        self.refused += bad
        if good:
            self._weight = min(self._weight + good, RMS_MEMORY)
            self._square += (square - good * self._square) / self._weight
        if bad or len(self._strays):
            self._follow_strays(group, outcome.robots, outcome.weight, outcome.residual)
        if len(outcome.robots) == len(frame.robots):
            dt, velocity = frame.dt, frame.path[:, 2:4]
        else:
            kept = np.isin(frame.robots, outcome.robots)
            dt, velocity = frame.dt[kept], frame.path[kept, 2:4]
        self.monitor.add(outcome, dt, velocity, t)
        return self.monitor.check(t, self.filter.x)

    def _forget(self, t: float, velocity: FloatArray) -> None:
        """Exponential, by driving time: what nobody drives over does not get stale."""
        elapsed = t - self._forgot
        if elapsed <= 0:
            return
        self._forgot = t
        assert self.options.memory_s is not None
        if elapsed < 1.0 and bool(((velocity * velocity).sum(axis=1) > STILL).any()):
            self.filter.forget(math.exp(-elapsed / self.options.memory_s))

    def _follow_strays(
        self,
        group: list[tuple[Seen, PathPoint]],
        robots: np.ndarray[tuple[int, ...], np.dtype[np.intp]],
        weight: FloatArray,
        residual: FloatArray,
    ) -> None:
        place = {seen.robot: seen for seen, _ in group}
        for robot, counts, off in zip(robots.tolist(), weight, residual, strict=True):
            if counts > 0:
                self._strays.fits(robot)
                continue
            seen = place[robot]
            expected = (
                seen.u - float(off[0]) / self.image.scale,
                seen.v - float(off[1]) / self.image.scale,
            )
            lost, since = self._strays.refused(
                robot, seen.t, (seen.u, seen.v), expected, seen.sigma
            )
            if lost:
                self.filter.lose(robot)
                if since is None:
                    continue
                self.monitor.jumped(robot, since)
                if self.monitor.alone:
                    self._doubt(float(np.hypot(*off)), since)

    def _doubt(self, jump: float, since: float) -> None:
        """A robot alone jumped: was it lifted, or was the camera knocked? g may have changed as much as that takes.

        A camera that turns by a small angle moves the image by it, and changes the entries of g by about as much, both
        in normalised pixels and relative to their rows.
        """
        size = np.repeat(np.linalg.norm(self.filter.x[:6].reshape(3, 2), axis=1), 2)
        size[4:] = max(
            size[4], DOUBT * size[0]
        )  # a level camera's last row is 0, and tilts away from it
        variance = np.zeros(len(self.filter.x))
        variance[:6] = (DOUBT * min(jump, 1.0) * size) ** 2
        self.filter.disturb(variance)
        self.prior = Prior(self.filter.x.copy(), self.filter.information.copy())
        self.doubt = since

    def note(self, pair: tuple[Seen, PathPoint]) -> None:
        """Note where a robot was seen.

        Parameters
        ----------
        pair : (Seen, PathPoint)
            Sighting and what the readings say.
        """
        seen, point = pair
        scale, (u0, v0) = self.image.scale, self.image.centre.tolist()
        c = ((seen.u - u0) * scale, (seen.v - v0) * scale)
        self.coverage.add(c, (seen.u, seen.v), (point.x_dot, point.y_dot))

    # Answers

    @property
    def g(self) -> FloatArray:
        """(3, 2). The estimate, scaled as in eq. 21."""
        return self.image.to_pixels(self.filter.x[:6])

    @property
    def own_covariance(self) -> FloatArray:
        """(6, 6). Of g, row by row, from noise as found."""
        # Readings whose noise is correlated say less than they seem to; the monitor has learnt how much less.
        D = self.image.jacobian()
        own = self.monitor.level * (D @ self.filter.covariance[:6, :6] @ D.T)
        return np.asarray((own + own.T) / 2)

    @property
    def covariance(self) -> FloatArray:
        """(6, 6). The same, and the prior on the speeds' scale."""
        row = self.g.ravel()
        # g goes with the inverse cube root of the speeds' scale (eq. 17).
        return np.asarray(
            self.own_covariance + (self.options.speed_scale_sigma / 3) ** 2 * np.outer(row, row)
        )

    def position(self, robot: int) -> Position | None:
        """How well it is known where a robot is, given g.

        Parameters
        ----------
        robot : int
            Its number.

        Returns
        -------
        position : Position or None
            With its slope by the entries of g in pixels, row by row; None if nothing is known.
        """
        rows = self.filter.rows
        if robot >= len(rows) or rows.before[robot, 7] < 0:
            return None
        into = np.linalg.inv(self.image.jacobian())
        return Position(rows.slope[robot, None, :2, :6] @ into, rows.S[robot, None, :2, :2])

    @property
    def rms_px(self) -> float:
        """Root mean square of the innovations that counted, per coordinate [px]."""
        return math.sqrt(max(self._square, 0.0) / 2) / self.image.scale

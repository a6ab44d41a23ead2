"""Ground velocity of every target that was seen, with its standard deviation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.image_velocity import image_motion
from airground.calibration.local_polynomial import MIN_PARABOLA, noise_level
from airground.calibration.recordings import IntArray, refuse_extremes
from airground.calibration.window_choice import choose_count, gap_limit
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.calibration import Calibration
    from airground.calibration.recordings import Tracks

__all__ = ["Speeds", "measure_speeds"]

OWN_RATE = 8  # sightings from which on a target shows its own rate
ASSUMED_NOISE = 1.0  # px; of tracks too short to show their own noise


@dataclass(frozen=True, slots=True, eq=False)
class Speeds:
    """Ground velocities at sightings, in the order of the tracks."""

    targets: tuple[str, ...]
    """Names of the targets."""

    target_index: IntArray
    """(N,). Which target."""

    t: FloatArray
    """(N,) [s]. Time of the sighting."""

    uv: FloatArray
    """(N, 2) [px]. The sighting, in raw pixels."""

    xy_dot: FloatArray
    """(N, 2) [m/s]. Ground velocity."""

    speed_sigma: FloatArray
    """(N,) [m/s]. Standard deviation of the speed: from pixel noise and the calibration's uncertainty."""

    lonely: int
    """Sightings left out because no other one is near in time."""

    beyond: int
    """Sightings left out because they lie on or beyond the horizon, or where the lens is not modelled."""

    assumed_noise: tuple[str, ...]
    """Targets too short, or too still, to show their noise: taken as one pixel."""

    @property
    def speed(self) -> FloatArray:
        """(N,) [m/s]. Length of the ground velocity."""
        return np.asarray(np.linalg.norm(self.xy_dot, axis=1))

    def by_target(self) -> list[dict[str, str | int | float]]:
        """Sum up each target.

        Returns
        -------
        summary : list of dict
            Target, number of rows, median and largest speed, median deviation; only targets with rows.
        """
        summary: list[dict[str, str | int | float]] = []
        speed = self.speed
        ends = np.searchsorted(self.target_index, np.arange(len(self.targets) + 1))
        for name, first, last in zip(self.targets, ends[:-1], ends[1:], strict=True):
            if first == last:
                continue
            mine = slice(int(first), int(last))
            summary.append(
                {
                    "target": name,
                    "rows": int(last - first),
                    "speed_median_mps": float(np.median(speed[mine])),
                    "speed_max_mps": float(speed[mine].max()),
                    "speed_sigma_median_mps": float(np.median(self.speed_sigma[mine])),
                }
            )
        return summary


def measure_speeds(calibration: Calibration, tracks: Tracks) -> Speeds:
    """Measure the ground velocity of all targets, robots and third parties alike.

    Image velocities come from parabolas over a window of sightings around each, chosen per target from its
    rate and noise; beside a start or a stop, over a window that does not reach over it. They are fitted to raw
    pixels, where the noise is even, and then undistorted.

    Parameters
    ----------
    calibration : Calibration
        Relation between image and ground.
    tracks : Tracks
        Sightings, in raw pixels.

    Returns
    -------
    speeds : Speeds
        One row for each sighting that has neighbours in time and lies on the ground.

    Raises
    ------
    InputError
        If a number of the tracks is too large to compute with.
    """
    refuse_extremes(tracks, "tracks")
    count = len(tracks)
    uv, uv_dot = np.full((2, count, 2), np.nan)
    noise = np.zeros(count)
    usual = _usual_gap_limit(tracks)
    assumed = []
    for name in tracks.targets:
        rows = tracks.rows(name)
        given = None if tracks.sigma is None else tracks.sigma[rows]
        sigma = noise_level(tracks.uv[rows]) if given is None else given
        if given is None and not sigma > 0:  # NaN, or zero: what stands still shows none either
            sigma = ASSUMED_NOISE
            assumed.append(name)
        wanted = choose_count(
            tracks.t[rows],
            tracks.uv[rows],
            sigma=None if given is None else float(np.median(given)),
        )
        # A sighting at the end of a line's window is not where the line's velocity holds; a parabola bends.
        wanted = max(wanted, MIN_PARABOLA)
        limit = gap_limit(tracks.t[rows]) if len(tracks.t[rows]) >= OWN_RATE else usual
        uv[rows], uv_dot[rows], noise[rows] = image_motion(
            tracks.t[rows],
            tracks.uv[rows],
            wanted=wanted,
            limit=limit,
            sigma=np.broadcast_to(sigma, len(tracks.t[rows])),
        )
    lonely = np.isnan(uv_dot).any(axis=1)
    ground = calibration.is_ground(
        np.where(lonely[:, None], tracks.uv, uv)
    ) & calibration.is_ground(tracks.uv)
    keep = ground & ~lonely
    xy_dot, covariance = calibration.ground_velocity(uv[keep], uv_dot[keep])
    per_pixel = calibration.model.ground_velocity(  # rows: of u, of v
        calibration.undistort(uv[keep])[:, None],
        calibration.undistort_velocity(uv[keep][:, None], np.eye(2)),
    )
    covariance = covariance + noise[keep, None, None] ** 2 * (
        np.swapaxes(per_pixel, -1, -2) @ per_pixel
    )
    return Speeds(
        targets=tracks.targets,
        target_index=tracks.target_index[keep],
        t=tracks.t[keep],
        uv=tracks.uv[keep],
        xy_dot=xy_dot,
        speed_sigma=_along(xy_dot, covariance),
        lonely=int(np.sum(lonely)),
        beyond=int(np.sum(~ground & ~lonely)),
        assumed_noise=tuple(assumed),
    )


def _usual_gap_limit(tracks: Tracks) -> float:
    """The gap limit for targets too short to show their own rate: as if all were one track."""
    steps = np.diff(tracks.t)[np.diff(tracks.target_index) == 0]
    return gap_limit(np.concatenate([[0.0], np.cumsum(steps)]))


def _along(xy_dot: FloatArray, covariance: FloatArray) -> FloatArray:
    """Deviation of the speed: along the velocity, or in the worst direction for what hardly moves."""
    worst = np.linalg.eigvalsh(covariance)[:, -1]
    speed = np.linalg.norm(xy_dot, axis=1)
    moving = speed > np.sqrt(worst)
    h = xy_dot / np.where(moving, speed, 1.0)[:, None]
    along = np.einsum("ni,nij,nj->n", h, covariance, h)
    return np.sqrt(np.where(moving, along, worst))

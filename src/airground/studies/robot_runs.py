"""Many calibration drives of the robot in MuJoCo, and what comes of each: for table 2 and figure 7."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import calibrate
from airground.errors import UndeterminedError
from airground.geometry import align_rotation, n_error
from airground.geometry.arrays import FloatArray
from airground.sim3d.canvas import Canvas
from airground.sim3d.options import CameraOptions3d, World3dOptions
from airground.studies.other_speeds import OtherSpeeds, compare_speeds
from airground.studies.robot_run import CAMERA_HZ, calibration_run

if TYPE_CHECKING:
    from airground.studies.simulation import Progress
    from airground.studies.workers import Workers

__all__ = ["LENS", "METHODS", "OPTIONS", "RobotSummary", "robot_summaries", "robot_summary"]

METHODS: dict[str, dict[str, Any]] = {
    "linear": {"method": "linear"},
    "trajectory": {"method": "trajectory", "distortion": "division"},  # a real camera has a lens
}
"""Of calibration, and how it is called; the paper's own knows no lens."""

OPTIONS = World3dOptions(camera=CameraOptions3d(rate_hz=CAMERA_HZ))
"""Of the world."""

LENS = Canvas.of(OPTIONS.camera).lens
"""Of its camera."""


@dataclass(frozen=True, slots=True, eq=False)
class RobotSummary:
    """One calibration drive."""

    seed: int
    """Of the world."""

    g: FloatArray
    """(3, 2). Surveyed."""

    g_hat: dict[str, FloatArray | None]
    """(3, 2) by method, after the best rotation of the ground; None where it refused."""

    relative_sigma: float
    """Stated by the whole-drive method; NaN where it refused."""

    uv: FloatArray
    """(M, 2) [px]. Sightings of the robot, without the lens."""

    xy: FloatArray
    """(M, 2) [m]. The same on the ground, by the survey."""

    others: OtherSpeeds
    """Of vehicles that are not ours, by the whole-drive method; no rows where it refused."""

    def n(self, method: str) -> float:
        """Error of eq. 23.

        Parameters
        ----------
        method : str
            Of `METHODS`.

        Returns
        -------
        n : float
            NaN where it refused.
        """
        g_hat = self.g_hat[method]
        return np.nan if g_hat is None else float(n_error(self.g, g_hat))


def robot_summary(seed: int, camera_hz: float = CAMERA_HZ) -> RobotSummary:
    """Drive, calibrate in both ways, and compare with the survey.

    Parameters
    ----------
    seed : int
        Of the world.
    camera_hz : float
        Pictures per second.

    Returns
    -------
    summary : RobotSummary
        Small enough to be sent from process to process.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    UnreachableError
        If it cannot draw here.
    """
    camera = replace(OPTIONS.camera, rate_hz=camera_hz)
    run = calibration_run(seed, replace(OPTIONS, camera=camera))
    g_hat: dict[str, FloatArray | None] = {}
    sigma, others = np.nan, OtherSpeeds.joined([])
    for method, how in METHODS.items():
        try:
            found = calibrate(run.tracks, run.motion, image_size_px=run.image_size_px, **how)
        except UndeterminedError:
            g_hat[method] = None
            continue
        g_hat[method] = align_rotation(run.truth.g, found.model)[0]
        if method == "trajectory":
            sigma = found.observability.relative_sigma
            others = compare_speeds(found, run.tracks, run.others)
    rows = run.tracks.rows(OPTIONS.robots[0].name)
    uv = LENS.undistort(run.tracks.uv[rows])
    w = np.column_stack([uv, np.ones(len(uv))]) @ np.linalg.inv(run.truth.image_from_plane).T
    return RobotSummary(seed, run.truth.g, g_hat, sigma, uv, w[:, :2] / w[:, 2:], others)


def robot_summaries(
    runs: int,
    seed: int,
    workers: Workers,
    progress: Progress | None = None,
    *,
    camera_hz: float = CAMERA_HZ,
) -> tuple[RobotSummary, ...]:
    """Make several drives.

    Parameters
    ----------
    runs : int
        How many.
    seed : int
        Of the first; the next ones follow.
    workers : Workers
        Who drives.
    progress : callable, optional
        Told how many are done, and of how many.
    camera_hz : float
        Pictures per second.

    Returns
    -------
    summaries : tuple of RobotSummary
        By their seeds.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    UnreachableError
        If it cannot draw here.
    """
    found = []
    tasks = ((seed + k, camera_hz) for k in range(runs))
    for summary in workers.map(robot_summary, tasks, runs, long=True):
        found.append(summary)
        if progress is not None:
            progress(len(found), runs)
    return tuple(found)

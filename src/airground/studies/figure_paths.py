"""The drives of figures 8 and 9 on any stage: along a wave in the image, and along an ellipse on the ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.control import Floor
from airground.control.trajectories.flat_tracker import FlatTracker
from airground.control.trajectories.spline import SplineTrajectory, times_at_speed
from airground.control.trajectories.trajectory import GroundEllipse
from airground.geometry.arrays import FloatArray
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.rig import Drive
from airground.studies.rig_options import LAG_S

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    from airground.studies.driving_world import DrivingWorld
    from airground.studies.stage import Stage

__all__ = [
    "SPEED_MPS",
    "TURNS",
    "Tracked",
    "convergence",
    "drive_ellipse",
    "drive_wave",
    "true_ellipse",
    "wave_line",
]

SPEED_MPS = 0.12
"""Of the robot along a trajectory: that of the paper's calibration drive."""

TURNS = 1.5
"""How often it goes round the ellipse."""

CLOSE_PX = 8.0  # an error below it is one of noise and curves, no longer of the start


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """A drive along a trajectory."""

    drive: Drive
    """What was driven."""

    error_px: FloatArray
    """(N,) [px]. Distance from the trajectory's line at the ticks."""

    error_m: FloatArray
    """(N,) [m]. The same on the ground."""

    def settled_s(self) -> float | None:
        """Tell when it has come close to stay.

        Returns
        -------
        settled : float or None [s]
            Since its start; None where it did not.
        """
        far = np.flatnonzero(self.error_px > CLOSE_PX)
        first = 0 if len(far) == 0 else int(far[-1]) + 1
        if first >= len(self.error_px) - 1:
            return None
        return float(self.drive.t[first] - self.drive.t[0])


def drive_wave(stage: Stage, name: str) -> Tracked:
    """Drive along the wave.

    Parameters
    ----------
    stage : Stage
        Where.
    name : str
        Of what the pilot is told.

    Returns
    -------
    tracked : Tracked
        What was driven, and how far off.
    """
    layout, known = stage.layout, stage.known[name]
    with stage.rig(name, layout.wave_start_uv, layout.wave_heading_rad) as rig:
        trajectory = SplineTrajectory(known.undistort(layout.wave_uv), _wave_times(stage))
        tracker = FlatTracker(rig.floor, trajectory, rig.limits, response_s=LAG_S)
        drive = rig.drive(tracker, most_s=2 * trajectory.duration + 30)
        line = np.stack([trajectory.at(t)[0] for t in np.linspace(0, trajectory.duration, 1500)])
        return _tracked(rig.world, drive, known.distort(line))


def wave_line(stage: Stage) -> FloatArray:
    """The wave as a line.

    Parameters
    ----------
    stage : Stage
        Where.

    Returns
    -------
    uv : (N, 2) array [px]
        In raw pixels.
    """
    truth, times = stage.known["oracle"], _wave_times(stage)
    trajectory = SplineTrajectory(truth.undistort(stage.layout.wave_uv), times)
    return truth.distort(np.stack([trajectory.at(t)[0] for t in np.linspace(0, times[-1], 400)]))


def _wave_times(stage: Stage) -> FloatArray:
    """(N,) [s]. At the wave's points, from the truth: the same for all pilots."""
    truth, layout = stage.known["oracle"], stage.layout
    world = stage.world(layout.wave_start_uv, layout.wave_heading_rad)
    points = truth.undistort(layout.wave_uv)
    return times_at_speed(Floor(truth.model, world.ground_uv), points, SPEED_MPS)


def drive_ellipse(stage: Stage, name: str) -> Tracked:
    """Drive along the ellipse, as far as the pilot knows it.

    Parameters
    ----------
    stage : Stage
        Where.
    name : str
        Of what the pilot is told.

    Returns
    -------
    tracked : Tracked
        What was driven, and how far off the ellipse that the pilot drew.
    """
    layout, known = stage.layout, stage.known[name]
    with stage.rig(name, layout.ellipse_start_uv, layout.ellipse_heading_rad) as rig:
        ellipse = GroundEllipse(
            rig.floor,
            known.undistort(layout.ellipse_centre_uv),
            layout.ellipse_semi_m,
            float(layout.ellipse_length_m / SPEED_MPS),
            layout.ellipse_angle_rad + known.north_rad,
            turns=TURNS,
        )
        tracker = FlatTracker(rig.floor, ellipse, rig.limits, response_s=LAG_S)
        drive = rig.drive(tracker, most_s=1.5 * ellipse.duration + 20)
        line = np.stack([ellipse.at(t)[0] for t in np.linspace(0, ellipse.period, 1500)])
        return _tracked(rig.world, drive, known.distort(line))


def true_ellipse(stage: Stage) -> FloatArray:
    """The wanted ellipse.

    Parameters
    ----------
    stage : Stage
        Where.

    Returns
    -------
    xy : (N, 2) array [m]
        On the ground, in truth.
    """
    layout = stage.layout
    world = stage.world(layout.ellipse_start_uv, layout.ellipse_heading_rad)
    phi = np.linspace(0, 2 * np.pi, 1500)
    (a, b), angle = layout.ellipse_semi_m, layout.ellipse_angle_rad
    cos, sin = np.cos(angle), np.sin(angle)
    flat = np.column_stack([a * np.cos(phi), b * np.sin(phi)])
    centre = world.camera.unproject(world.undistorted(layout.ellipse_centre_uv))
    return np.asarray(centre + flat @ np.array([[cos, sin], [-sin, cos]]))


def _tracked(world: DrivingWorld, drive: Drive, line_uv: FloatArray) -> Tracked:
    return Tracked(
        drive,
        distance_to_line(drive.uv, line_uv),
        distance_to_line(drive.xy, world.camera.unproject(world.undistorted(line_uv))),
    )


def convergence(drives: Mapping[str, Tracked]) -> dict[str, dict[str, Any]]:
    """Figures of drives that start off a trajectory and shall come to it.

    Parameters
    ----------
    drives : mapping of str to Tracked
        By the g they were given.

    Returns
    -------
    figures : dict of dict
        By the same names: error at the start, time until it stays close, and root mean squares from when the last
        of them has come close.
    """
    settle = {name: one.settled_s() for name, one in drives.items()}
    all_s = max((s for s in settle.values() if s is not None), default=0.0)
    figures = {}
    for name, one in drives.items():
        after = one.drive.t - one.drive.t[0] >= all_s
        figures[name] = {
            "start_error_px": float(one.error_px[0]),
            "settled": settle[name] is not None,
            "settle_s": settle[name],
            "path_rms_px": rms(one.error_px[after]) if after.any() else None,
            "path_rms_m": rms(one.error_m[after]) if after.any() else None,
            "stops": len(one.drive.stops),
        }
    return figures

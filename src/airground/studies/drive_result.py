"""What is asked of ``airground drive``, and what comes of it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from airground.records import replacing, write_text

if TYPE_CHECKING:
    from pathlib import Path

    from airground.geometry.arrays import FloatArray
    from airground.records import DrawnPath
    from airground.studies.driving_world import DrivingWorld
    from airground.studies.rig import Drive

__all__ = ["DriveOrder", "DriveResult", "write_drive"]


@dataclass(frozen=True, slots=True, eq=False)
class DriveOrder:
    """What an operator asks for."""

    goals_px: tuple[tuple[float, float], ...] = ()
    """Raw pixels to drive to, in order; or"""

    drawn: DrawnPath | None = None
    """a sketch to follow."""

    heading_deg: float | None = None
    """To end with, at the last goal [degrees]; None for any."""

    speed_mps: float | None = None
    """To hold on the ground [m/s]; None for the world's own."""

    latency_s: float = 0.1
    """From a picture's exposure to its arrival [s]."""

    sight: Literal["images", "points"] | None = None
    """How the robot is seen; None for images where there is a scene."""

    seed: int = 0
    """Of all noise."""


@dataclass(frozen=True, slots=True, eq=False)
class DriveResult:
    """What was driven, and how well."""

    world: DrivingWorld
    """The truth."""

    why: str
    """Which world, and why, in one line."""

    drives: tuple[Drive, ...]
    """What was driven, in order; where there is a path, the last along it."""

    reached: bool
    """Whether the robot got to the end."""

    trouble: str
    """Why not, in one line; empty where it did."""

    goal_px: FloatArray
    """(2,) [px]. Where it should end, in raw pixels."""

    goal_error_px: float
    """Distance in the image of where it stands from there [px]."""

    goal_error_m: float
    """The same on the ground [m]."""

    path_px: FloatArray | None = None
    """(N, 2) [px]. The path as released, in raw pixels; None where there were goals only."""

    sketch_rms_px: float | None = None
    """Distance of the sketch from the path [px]."""

    path_rms_px: float | None = None
    """Distance from the path while following it, in the image [px]."""

    path_rms_m: float | None = None
    """The same on the ground [m]."""

    oracle_path_rms_m: float | None = None
    """The same in a drive that is given the true g [m]."""

    images: bool = False
    """Whether the robot was seen in rendered images."""

    def document(self) -> dict[str, Any]:
        """Give the JSON object.

        Returns
        -------
        document : dict
            Figures by name, with units.
        """
        return {
            "reached": self.reached,
            "trouble": self.trouble,
            "time_s": float(sum(drive.duration for drive in self.drives)),
            "goal_error_px": self.goal_error_px,
            "goal_error_m": self.goal_error_m,
            "path_rms_px": self.path_rms_px,
            "path_rms_m": self.path_rms_m,
            "oracle_path_rms_m": self.oracle_path_rms_m,
            "sketch_rms_px": self.sketch_rms_px,
            "max_speed_mps": float(max(np.abs(drive.v).max() for drive in self.drives)),
            "stops": len(self._stops()),
            "stop_reasons": self._stops(),
            "world": self.world.name,
            "sight": "images" if self.images else "points",
        }

    def lines(self) -> list[str]:
        """Say it to people.

        Returns
        -------
        lines : list of str
            A few.
        """
        d = self.document()
        end = f"{d['goal_error_px']:.1f} px, {100 * d['goal_error_m']:.1f} cm from the goal"
        lines = [
            f"world: {self.why}; seen in {d['sight']}",
            f"arrived after {d['time_s']:.1f} s, {end}"
            if self.reached
            else f"not arrived: {self.trouble}; {end}",
            f"fastest {d['max_speed_mps']:.3f} m/s, {d['stops']} stops for safety",
        ]
        if self.path_rms_m is not None and self.path_rms_px is not None:
            oracle = self.oracle_path_rms_m
            beside = "" if oracle is None else f"; with the true g {100 * oracle:.2f} cm"
            lines.insert(
                2, f"path: {self.path_rms_px:.2f} px, {100 * self.path_rms_m:.2f} cm rms{beside}"
            )
        return lines + [f"  stop at {line}" for line in self._stops()]

    def _stops(self) -> list[str]:
        return [line for drive in self.drives for line in drive.stops]


def write_drive(out: Path, result: DriveResult) -> None:
    """Write ``drive.json``, ``driven.csv`` and ``drive.png``.

    Parameters
    ----------
    out : Path
        Folder, which exists.
    result : DriveResult
        What to write.
    """
    from airground.pictures.driving import DrivenPanel, draw_image_paths

    write_text(out / "drive.json", json.dumps(result.document(), indent=2, allow_nan=False) + "\n")
    names = "t_s,u_px,v_px,x_m,y_m,heading_rad,speed_mps,turn_rate_radps"
    tables = [np.column_stack([d.t, d.uv, d.xy, d.theta, d.v, d.omega]) for d in result.drives]
    rows = [",".join(map(repr, row)) for row in np.concatenate(tables).tolist()]
    write_text(out / "driven.csv", "\n".join([names, *rows]) + "\n")
    driven = np.concatenate([d.uv for d in result.drives])
    first = result.drives[0]
    wanted = result.path_px
    if wanted is None:
        wanted = np.stack([driven[0], result.goal_px])
    reach = 0.5 * result.world.speed_mps / 0.3
    ahead = first.xy[0] + reach * np.array([np.cos(first.theta[0]), np.sin(first.theta[0])])
    with replacing(out / "drive.png") as temporary:
        heading = result.world.distorted(result.world.camera.project(ahead))
        panel = DrivenPanel("", wanted, driven, result.world.camera.image_size_px, heading)
        draw_image_paths(temporary, [panel])

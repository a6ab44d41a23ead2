"""Where the paper's drives are driven: a camera, what pilots are told of it, and where robot and paths lie."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from airground.calibration import Calibration
    from airground.geometry import DivisionLens, LimitedHomography
    from airground.studies.driving_world import DrivingWorld
    from airground.studies.rig import Rig

__all__ = ["Known", "Layout", "Stage"]


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What a pilot is told."""

    model: LimitedHomography
    """The relation between image and ground."""

    covariance: FloatArray | None = None
    """(6, 6). Of that."""

    lens: DivisionLens | None = None
    """Of the camera."""

    time_offset_s: float = 0.0
    """What the robot's clock is ahead of the camera's [s]."""

    north_rad: float = 0.0
    """Angle of the truth's x axis in the ground frame of `model` [rad]: paths on the ground are wanted in the truth's
    frame, as one may draw them beside a line on the floor."""

    @classmethod
    def of(cls, calibration: Calibration) -> Known:
        """What a calibration says.

        Parameters
        ----------
        calibration : Calibration
            By any method.

        Returns
        -------
        known : Known
            The same, for a pilot.
        """
        return cls(
            calibration.model, calibration.covariance, calibration.lens, calibration.time_offset_s
        )

    def undistort(self, uv: FloatArray) -> FloatArray:
        """Take the lens out.

        Parameters
        ----------
        uv : (..., 2) array [px]
            Raw pixels.

        Returns
        -------
        uv : (..., 2) array [px]
            Those of `model`.
        """
        return uv if self.lens is None else self.lens.undistort(uv)

    def distort(self, uv: FloatArray) -> FloatArray:
        """Put the lens in.

        Parameters
        ----------
        uv : (..., 2) array [px]
            Pixels of `model`.

        Returns
        -------
        uv : (..., 2) array [px]
            Raw ones.
        """
        return uv if self.lens is None else self.lens.distort(uv)


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Where robot and paths lie in the raw image."""

    wave_uv: FloatArray
    """(N, 2) [px]. Points of the path of figure 8."""

    wave_start_uv: FloatArray
    """(2,) [px]. Where the robot starts, off it."""

    wave_heading_rad: float
    """How it stands there [rad]."""

    ellipse_centre_uv: FloatArray
    """(2,) [px]. Of the ellipse of figure 9."""

    ellipse_semi_m: tuple[float, float]
    """Its semi-axes [m]."""

    ellipse_angle_rad: float
    """Of the first of them [rad]."""

    ellipse_start_uv: FloatArray
    """(2,) [px]. Where the robot starts, off it."""

    ellipse_heading_rad: float
    """How it stands there [rad]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "wave_uv", readonly(self.wave_uv, (None, 2), "wave_uv"))
        for name in ("wave_start_uv", "ellipse_centre_uv", "ellipse_start_uv"):
            object.__setattr__(self, name, readonly(getattr(self, name), (2,), name))

    @property
    def ellipse_length_m(self) -> float:
        """Once round the ellipse, by Ramanujan's formula [m]."""
        a, b = self.ellipse_semi_m
        return float(np.pi * (3 * (a + b) - np.sqrt((3 * a + b) * (a + 3 * b))))


class Stage(Protocol):
    """A world for the drives of figures 8 to 10."""

    @property
    def layout(self) -> Layout:
        """Where things lie."""
        ...

    @property
    def known(self) -> Mapping[str, Known]:
        """By name: what pilots are told; "oracle" is the truth."""
        ...

    @property
    def errors(self) -> Mapping[str, float]:
        """Error n (eq. 22) of each estimate."""
        ...

    def world(self, start_uv: FloatArray, heading_rad: float) -> DrivingWorld:
        """Place the robot.

        Parameters
        ----------
        start_uv : (2,) array [px]
            Where its mark is seen, in raw pixels.
        heading_rad : float [rad]
            How it stands.

        Returns
        -------
        world : DrivingWorld
            The truth.
        """
        ...

    def rig(
        self, name: str, start_uv: FloatArray, heading_rad: float
    ) -> AbstractContextManager[Rig]:
        """Set up the closed loop.

        Parameters
        ----------
        name : str
            Of what the pilot is told.
        start_uv : (2,) array [px]
            Where the robot's mark is seen, in raw pixels.
        heading_rad : float [rad]
            How it stands.

        Returns
        -------
        rig : context manager of Rig
            At rest, knowing where the robot is.
        """
        ...

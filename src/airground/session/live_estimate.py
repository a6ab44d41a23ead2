"""The online estimator during a calibration drive, fed in batches outside the loop, and asked where to drive next."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import OnlineCalibrator, OnlineOptions, next_leg
from airground.calibration.guidance_types import LegOptions
from airground.errors import UndeterminedError
from airground.session.image_sigma import image_sigma

if TYPE_CHECKING:
    from airground.calibration import Calibration, Leg
    from airground.robots import RobotReading

__all__ = ["ROUGH", "Batch", "LegQuestion", "LiveAnswer", "LiveEstimate"]

CAMERA_LATE_SIGMA_S = 0.1  # how late a camera's stamps may be, before anything is known
COMPASSES_APART_RAD = 0.1
WHEELS = 0.06  # noise density of an odometer that is off by 2 %, slowly changing over 4 s [sqrt(s)]
BORDERS = 1.5  # legs end so far inside, as what ends them is an estimate
ROUGH = 0.3  # relative deviation of the estimate above which it plans no legs
LONGEST_S = 7.0  # of a leg: long ones lead where the others cannot follow
TURN_COST_M = 1.0  # a turn on the spot takes as long as a metre, nearly

Sighted = tuple[float, tuple[str, ...], tuple[tuple[float, float], ...]]


@dataclass(frozen=True, slots=True)
class Batch:
    """What has come in since the last one."""

    readings: tuple[tuple[str, RobotReading], ...]
    """By robot, oldest first."""

    frames: tuple[Sighted, ...]
    """Time as stamped, who was seen, and where [px]."""


@dataclass(frozen=True, slots=True)
class LegQuestion:
    """Where a robot should drive next."""

    robot: str
    """Which."""

    uv: tuple[float, float]
    """Where it is [px]."""

    speed_mps: float
    """How fast it drives."""


@dataclass(frozen=True, slots=True, eq=False)
class LiveAnswer:
    """What is known by now."""

    calibration: Calibration | None
    """None while the motion does not determine one."""

    relative_sigma: float
    """Of ground velocities over the image; infinite while nothing is known."""

    sightings: int
    """That were used."""

    bumped: bool
    """Whether the camera was moved meanwhile."""

    leg: Leg | None = None
    """To be driven next, where that was asked and is known."""

    leg_trouble: str = ""
    """Why there is none, in one line."""


class LiveEstimate:
    """Belongs to one calibration drive; used by one job after the other, never by two at once.

    Parameters
    ----------
    size_px : (int, int) [px]
        Of the image.
    rate_hz : float [Hz]
        Of the camera, about.
    border_px : float [px]
        How far from the image's border legs end.
    """

    def __init__(self, size_px: tuple[int, int], rate_hz: float, border_px: float) -> None:
        self._size_px, self._rate_hz, self._border_px = size_px, rate_hz, border_px
        self._estimator = OnlineCalibrator(
            OnlineOptions(
                time_offset_sigma_s=CAMERA_LATE_SIGMA_S,
                heading_bias_sigma_rad=COMPASSES_APART_RAD,
                speed_noise=WHEELS,
                image_size_px=size_px,
            )
        )

    def advance(self, batch: Batch, question: LegQuestion | None) -> LiveAnswer:
        """Take what came in, and say what is known.

        Parameters
        ----------
        batch : Batch
            Since the last time.
        question : LegQuestion or None
            Where to drive next, if somebody wants to know.

        Returns
        -------
        answer : LiveAnswer
            By now.
        """
        estimator = self._estimator
        for name, one in batch.readings:
            if one.heading is not None and one.speed is not None:
                estimator.reading(one.t, name, heading=one.heading, speed=one.speed)
        for t, names, uv in batch.frames:
            estimator.frame(t, names, np.array(uv).reshape(-1, 2))
        calibration, state = estimator.calibration(), estimator.state
        sigma = inf
        if calibration is not None:
            sigma = image_sigma(calibration, self._size_px, self._border_px)
        leg, trouble = None, ""
        if question is not None and calibration is not None and sigma < ROUGH:
            try:
                leg = next_leg(
                    estimator,
                    question.uv,
                    self._size_px,
                    margin_px=BORDERS * self._border_px,
                    target=question.robot,
                    options=LegOptions(
                        speed_mps=question.speed_mps,
                        sightings_hz=max(self._rate_hz, 1.0),
                        longest_m=LONGEST_S * question.speed_mps,
                        turn_cost_m=TURN_COST_M,
                    ),
                )
            except UndeterminedError as error:
                trouble = str(error)
        return LiveAnswer(
            calibration, sigma, state.counts.used, state.phase == "bumped", leg, trouble
        )

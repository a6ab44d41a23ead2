"""What each straight leg from a place is worth: its information, and that of the best one after it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.guidance_information import Position, leg_information, velocity_weight
from airground.calibration.guidance_types import Leg, LegOptions
from airground.calibration.online_model import ImageFrame, sighting, unproject
from airground.errors import UndeterminedError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.calibration import Calibration
    from airground.calibration.recordings import IntArray

__all__ = ["Planner"]

GRID = (7, 5)
BEAM = 4  # legs of each length to look ahead from
FLATTEST = 0.1  # of the largest scale in the image: ground further away is not asked for


class Planner:
    """Candidates and their worth, for one calibration and one image.

    Parameters
    ----------
    known : Calibration
        What is known.
    low : (2,) array [px]
        Upper left corner of where the robot may be.
    high : (2,) array [px]
        Lower right corner.
    options : LegOptions
        How the robot drives and is seen.
    """

    def __init__(
        self, known: Calibration, low: FloatArray, high: FloatArray, options: LegOptions
    ) -> None:
        self._known, self._low, self._high, self._options = known, low, high, options
        self._image = image = ImageFrame(known.origin_px, 2.0 / float((high - low).max()))
        self._x = x = image.from_pixels(known.model.g)
        places = known.undistort(_places(known, low, high))
        self._ground = unproject(x, image.normalised(places))
        # Without what no leg can tell: dg = g / 3 for the speeds' scale.
        D = image.jacobian()
        into = np.linalg.inv(D)
        covariance = into @ known.covariance @ into.T
        scale = (options.speed_scale_sigma / 3) ** 2 * np.outer(x, x)
        self._now = _information(covariance - scale, covariance)
        weight = D.T @ velocity_weight(known.model.g, places) @ D  # (P, 6, 6)
        fixed = np.einsum("pij,ij->p", weight, scale)
        if options.criterion == "mean":
            weight, fixed = weight.mean(axis=0)[None], fixed.mean(keepdims=True)
        self._weight, self._fixed = weight, float(fixed.max())

    def best(self, at: FloatArray, position: Position | None) -> Leg:
        """Leg to drive from an image point.

        Parameters
        ----------
        at : (2,) array [px]
            Where the robot is.
        position : Position or None
            How well that is known on the ground.

        Returns
        -------
        leg : Leg
            That of the best pair of legs, for each metre.

        Raises
        ------
        UndeterminedError
            If there is none.
        """
        known, image, options = self._known, self._image, self._options
        start = unproject(self._x, image.normalised(known.undistort(at))[None])[0]
        if not np.isfinite(start).all():
            raise UndeterminedError(
                f"the robot at {at[0]:.0f}, {at[1]:.0f} px is not on the ground; is it seen rightly?"
            )
        if position is not None:  # entries of g differ in the two frames by their Jacobian
            position = Position(position.slope @ image.jacobian(), position.S)
        steps, ends = self._candidates(start[None])
        steps, ends = steps[0], ends[0]
        inside = np.isfinite(ends).all(axis=1)
        steps, ends = steps[inside], ends[inside]
        if len(steps) == 0:
            raise UndeterminedError(
                f"no straight leg of {options.shortest_m:g} m leads into the image from {at[0]:.0f}, {at[1]:.0f} px; "
                "make shortest_m or margin_px smaller, or drive towards the image's middle by hand"
            )
        told, after_leg = self._told(start, steps, position)
        before = float(self._variance(self._now[None])[0])
        after = self._variance(self._now + told)
        length = np.linalg.norm(steps, axis=1)
        rate = np.log(before / after) / (length + options.turn_cost_m)
        beam = _beam(length, rate)
        here = Position(after_leg.slope[beam], after_leg.S[beam])
        ahead = self._ahead(start + steps[beam], self._now + told[beam], here, length[beam], before)
        # A leg from whose end nothing leads on is worth what it tells itself.
        best = int(beam[np.argmax(np.fmax(ahead, rate[beam]))])
        return Leg(
            heading_rad=float(np.arctan2(steps[best, 1], steps[best, 0])),
            length_m=float(length[best]),
            start_px=(float(at[0]), float(at[1])),
            end_px=(float(ends[best, 0]), float(ends[best, 1])),
            relative_sigma=math.sqrt(before + self._fixed),
            expected_sigma=math.sqrt(float(after[best]) + self._fixed),
        )

    def _candidates(self, start: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(S, C, 2) steps on the ground [m], and (S, C, 2) their ends [px], NaN outside the margin."""
        options = self._options
        far = np.linalg.norm(self._ground - start[:, None], axis=2)
        longest = options.longest_m or max(float(np.nanmax(far)), options.shortest_m)
        angle = 2 * np.pi * np.arange(options.headings) / options.headings
        unit = np.column_stack([np.cos(angle), np.sin(angle)])
        lengths = np.geomspace(options.shortest_m, longest, options.lengths)
        steps = (lengths[:, None, None] * unit).reshape(-1, 2)
        P = start[:, None] + steps
        c = sighting(self._x, P.reshape(-1, 2)) / self._image.scale + self._image.centre
        ends = self._known.distort(c).reshape(P.shape)
        inside = np.asarray(((ends >= self._low) & (ends <= self._high)).all(axis=2))  # NaN is not
        return np.broadcast_to(steps, P.shape), np.where(inside[..., None], ends, np.nan)

    def _told(
        self, start: FloatArray, steps: FloatArray, position: Position | None
    ) -> tuple[FloatArray, Position]:
        options = self._options
        return leg_information(
            self._x,
            start,
            steps,
            sigma=options.sigma_px * self._image.scale,
            spacing_m=options.speed_mps / options.sightings_hz,
            walk=options.odometry_noise * math.sqrt(options.speed_mps),
            position=position,
        )

    def _variance(self, information: FloatArray) -> FloatArray:
        """(N,). Relative variance of a ground velocity, at the worst of the places or in the mean."""
        covariance = np.asarray(np.linalg.inv(information))
        return np.asarray(np.einsum("nij,pij->np", covariance, self._weight).max(axis=1))

    def _ahead(
        self,
        start: FloatArray,
        known: FloatArray,
        position: Position,
        length: FloatArray,
        before: float,
    ) -> FloatArray:
        """(B,). What each leg and the best one after it bring, for each metre; NaN where none leads on."""
        steps, ends = self._candidates(start)
        first, second = np.nonzero(np.isfinite(ends).all(axis=2))
        rate = np.full(len(start), np.nan)
        if len(first) == 0:
            return rate
        steps = steps[first, second]
        told, _ = self._told(
            start[first], steps, Position(position.slope[first], position.S[first])
        )
        gain = np.log(before / self._variance(known[first] + told))
        way = length[first] + np.linalg.norm(steps, axis=1) + 2 * self._options.turn_cost_m
        np.fmax.at(rate, first, gain / way)
        return rate


def _beam(length: FloatArray, rate: FloatArray) -> IntArray:
    """Legs to look ahead from: the best few of each length, as long ones only pay later."""
    chosen = []
    for one in np.unique(np.round(length, 9)):
        rows = np.flatnonzero(np.abs(length - one) < 1e-6)
        chosen.append(rows[np.argsort(-rate[rows])[:BEAM]])
    return np.concatenate(chosen)


def _information(covariance: FloatArray, whole: FloatArray) -> FloatArray:
    """Inverse of a covariance that rounding, or another prior than was thought, may have made indefinite."""
    variance = np.diag(whole)
    size = np.sqrt(np.where(variance > 0, variance, 1.0))
    values, vectors = np.linalg.eigh(covariance / np.outer(size, size))
    values = np.maximum(values, 1e-9 * max(float(values[-1]), 1e-9))
    return np.asarray((vectors / values) @ vectors.T / np.outer(size, size))


def _places(known: Calibration, low: FloatArray, high: FloatArray) -> FloatArray:
    """Places in the image that show ground, not too far away [px]."""
    u, v = (np.linspace(low[k], high[k], GRID[k]) for k in (0, 1))
    uv = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    uv = uv[known.is_ground(uv)]
    scale = known.model.pixels_per_metre(known.undistort(uv))[:, 0]
    return np.asarray(uv[scale >= FLATTEST * scale.max(initial=0.0)])

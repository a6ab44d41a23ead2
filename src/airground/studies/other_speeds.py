"""Speeds of vehicles that are not ours, as measured with a calibration, beside the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import measure_speeds
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Self

    from airground.calibration import Calibration, Tracks

__all__ = ["OtherSpeeds", "compare_speeds"]

WITHIN = 1.96  # deviations hold 95 %
SAME_S = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class OtherSpeeds:
    """One row for each sighting of a vehicle that is not ours."""

    measured: FloatArray
    """(M,) [m/s]. Speed as measured."""

    sigma: FloatArray
    """(M,) [m/s]. Its standard deviation as stated."""

    true: FloatArray
    """(M,) [m/s]. Speed in truth."""

    def __post_init__(self) -> None:
        for name in ("measured", "sigma", "true"):
            object.__setattr__(self, name, readonly(getattr(self, name), (None,), name))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Put several together.

        Parameters
        ----------
        parts : sequence of OtherSpeeds
            In any number.

        Returns
        -------
        speeds : OtherSpeeds
            All their rows.
        """
        names = ("measured", "sigma", "true")
        columns = [
            np.concatenate([np.empty(0), *(getattr(part, name) for part in parts)])
            for name in names
        ]
        return cls(*columns)

    def faster_than(self, least_mps: float) -> OtherSpeeds:
        """Those of vehicles under way.

        Parameters
        ----------
        least_mps : float [m/s]
            True speed from which on a row stays.

        Returns
        -------
        speeds : OtherSpeeds
            Some of the rows.
        """
        rows = np.abs(self.true) >= least_mps
        return OtherSpeeds(self.measured[rows], self.sigma[rows], self.true[rows])

    def scored(self) -> dict[str, float | int | None]:
        """Sum up.

        Returns
        -------
        figures : dict
            ``sightings``; ``rms_mps``, the root mean square error [m/s]; ``rms_share``, that over the root mean square
            of the true speeds; ``inside_share`` of errors within the stated 95 %. None without rows.
        """
        figures: dict[str, float | int | None] = {"sightings": len(self.true)}
        if not len(self.true):
            return {**figures, "rms_mps": None, "rms_share": None, "inside_share": None}
        error = self.measured - np.abs(self.true)
        rms = float(np.sqrt(np.mean(error**2)))
        return {
            **figures,
            "rms_mps": rms,
            "rms_share": rms / float(np.sqrt(np.mean(self.true**2))),
            "inside_share": float(np.mean(np.abs(error) <= WITHIN * self.sigma)),
        }


def compare_speeds(
    calibration: Calibration, tracks: Tracks, truth: Mapping[str, FloatArray]
) -> OtherSpeeds:
    """Measure the speeds of all vehicles whose truth is known.

    Parameters
    ----------
    calibration : Calibration
        To measure with.
    tracks : Tracks
        Sightings, of these vehicles and of others.
    truth : mapping of str to (K, 2) array [s, m/s]
        True speed by name and time; times are those of the sightings.

    Returns
    -------
    speeds : OtherSpeeds
        At sightings whose time has a true speed.
    """
    speeds = measure_speeds(calibration, tracks)
    parts = []
    for name, table in truth.items():
        if name not in speeds.targets or not len(table):
            continue
        rows = speeds.target_index == speeds.targets.index(name)
        t = speeds.t[rows]
        k = np.clip(np.searchsorted(table[:, 0], t - SAME_S), 0, len(table) - 1)
        known = np.abs(table[k, 0] - t) <= SAME_S
        parts.append(
            OtherSpeeds(
                speeds.speed[rows][known], speeds.speed_sigma[rows][known], table[k, 1][known]
            )
        )
    return OtherSpeeds.joined(parts)

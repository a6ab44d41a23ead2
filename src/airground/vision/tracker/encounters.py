"""How probable it is that things changed places while nobody could see them apart.

Filters and hypotheses know what their model of motion says, and drivers do not keep to it: two that were as one for a
second part as they please. What is stated here rests on how long they were as one, and on who else was away when one
turned up again, and not on how well the answer fits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.options import TrackerOptions
    from airground.vision.tracker.roster import BoolArray, Roster

__all__ = ["Encounters", "exchanged", "mistaken"]

TOGETHER = 6.0  # manoeuvres; two that were as one for as long have nearly forgotten who is who
BLUNT = 1.5  # exponent of that: short meetings are harmless, as things keep their ways
LINGER_S = 0.3  # things that are seen apart for as long have parted [s]
AWAY_S = 0.1  # a thing that was not seen for longer is away [s]; a miss or two are no absence
MISTAKEN = 0.08  # how often one that turns up where another may be as well is that other
FADE = 5.0  # standard deviations from there at which it is that the less by a factor e; more falls off fast
NEAR = 3.0  # standard deviations within which one that is not seen may still be at the other


def exchanged(together_s: FloatArray, manoeuvre_s: float) -> FloatArray:
    """How probable it is that two were exchanged that were as one for some time.

    Parameters
    ----------
    together_s : (...) array [s]
        How long.
    manoeuvre_s : float [s]
        How long an acceleration lasts.

    Returns
    -------
    probability : (...) array
        From 0 to 0.5.
    """
    probability: FloatArray = -0.5 * np.expm1(-((together_s / (TOGETHER * manoeuvre_s)) ** BLUNT))
    return probability


def mistaken(
    uv: FloatArray,
    rows: IntArray,
    away: BoolArray,
    *,
    middle: FloatArray,
    spread: FloatArray,
    px: float,
) -> FloatArray:
    """How probable it is that things that turned up are others that were away, or that these are those.

    Parameters
    ----------
    uv : (K, 2) array [px]
        Where they turned up.
    rows : (K,) array of int
        Rows of the tracks that they were taken for.
    away : (R,) array of bool
        Tracks that were not seen for a while.
    middle : (R, 2) array [px]
        Where tracks were expected.
    spread : (R, 2, 2) array [px2]
        Covariances of that.
    px : float [px]
        Fault of what is expected beside its covariance.

    Returns
    -------
    doubt : (R,) array
        Of all tracks.
    """
    others = np.flatnonzero(away)
    sigma = np.sqrt(np.trace(spread[others], axis1=1, axis2=2) / 2 + px**2)
    off = np.linalg.norm(uv[:, None] - middle[others][None], axis=-1) / sigma
    sure = 1 - np.where(rows[:, None] == others[None], 0.0, MISTAKEN * np.exp(-((off / FADE) ** 2)))
    doubt = np.zeros(len(away))
    doubt[rows] = 1 - sure.prod(axis=1)
    doubt[others] = 1 - (1 - doubt[others]) * sure.prod(axis=0)
    return doubt


class Encounters:
    """Which tracks are as one, and since when.

    Parameters
    ----------
    options : TrackerOptions
        Settings.
    """

    def __init__(self, options: TrackerOptions) -> None:
        self._options = options
        self._since: dict[tuple[int, int], tuple[float, float]] = {}  # first and last time

    def note(
        self,
        roster: Roster,
        partner: IntArray,
        host: IntArray,
        *,
        named: BoolArray,
        t: float,
        dt: float,
        sightings: Sightings,
        middle: FloatArray,
        spread: FloatArray,
    ) -> FloatArray:
        """Take in a frame.

        Parameters
        ----------
        roster : Roster
            R tracks.
        partner : (R,) array of int
            Sighting of each; -1 for none.
        host : (R,) array of int
            Row of the track whose sighting each shares; -1 for none.
        named : (R,) array of bool
            Which were read their label from their sightings.
        t : float [s]
            Time of the frame.
        dt : float [s]
            Time since the last frame.
        sightings : Sightings
            Of the frame.
        middle : (R, 2) array [px]
            Predicted positions.
        spread : (R, 2, 2) array [px2]
            Their covariances.

        Returns
        -------
        doubt : (R,) array
            How much likelier it has become that each is another one.
        """
        shares = host >= 0
        away = self.away(roster, t, dt)
        if not self._since and not shares.any() and not away.any():
            return np.zeros(len(roster))
        shares[host[shares]] = True
        back = np.flatnonzero(away & (partner >= 0) & ~shares & ~named)
        doubt = np.zeros(len(roster))
        if len(back):
            uv, px = sightings.uv[partner[back]], self._options.merge_px / 4
            doubt = mistaken(uv, back, away & ~named, middle=middle, spread=spread, px=px)
        row_of = {int(serial): k for k, serial in enumerate(roster.serial)}
        now = _together(roster.serial, host)
        kept: dict[tuple[int, int], tuple[float, float]] = {}
        for pair in sorted(now | self._since.keys()):
            if pair[0] not in row_of or pair[1] not in row_of:
                continue
            first, last = self._since.get(pair, (t, t))
            rows = [row_of[serial] for serial in pair]
            if pair in now or self._near(rows, partner, middle, spread):
                told, grown = exchanged(
                    np.array([last - first, t - first]), self._options.manoeuvre_s
                )
                doubt[rows] = 1 - (1 - doubt[rows]) * (1 - grown) / (1 - told)
                kept[pair] = first, t
            elif t - last <= LINGER_S:
                kept[pair] = first, last
        self._since = kept
        return doubt

    def away(self, roster: Roster, t: float, dt: float) -> BoolArray:
        """Which things were not seen for a while, not even as one with others.

        Parameters
        ----------
        roster : Roster
            R tracks.
        t : float [s]
            Time.
        dt : float [s]
            Time since the last frame.

        Returns
        -------
        away : (R,) array of bool
            Those.
        """
        away: BoolArray = roster.confirmed & (t - roster.touched > max(AWAY_S, 1.5 * dt))
        return away

    def _near(
        self, rows: list[int], partner: IntArray, middle: FloatArray, spread: FloatArray
    ) -> bool:
        """Whether one of both is not seen and may be where the other is."""
        if (partner[rows] >= 0).all():
            return False
        apart = float(np.linalg.norm(middle[rows[0]] - middle[rows[1]]))
        sigma = float(np.sqrt(np.trace(spread[rows].sum(axis=0))))
        return apart < self._options.merge_px + NEAR * sigma


def _together(serial: IntArray, host: IntArray) -> set[tuple[int, int]]:
    """Pairs that share a sighting."""
    bosses: dict[int, list[int]] = {}
    for k in np.flatnonzero(host >= 0):
        bosses.setdefault(int(host[k]), [int(host[k])]).append(int(k))
    pairs = set()
    for group in bosses.values():
        numbers = sorted(int(serial[k]) for k in group)
        pairs |= {(a, b) for i, a in enumerate(numbers) for b in numbers[i + 1 :]}
    return pairs

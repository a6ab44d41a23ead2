"""What tracks are called, and when a candidate is taken for a thing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.options import TrackerOptions
    from airground.vision.tracker.roster import BoolArray, Roster

__all__ = ["Naming"]

READS = 2  # a label that was read once may have been misread


class Naming:
    """Gives out numbers and names; no number is given twice.

    Parameters
    ----------
    options : TrackerOptions
        When to confirm.
    """

    def __init__(self, options: TrackerOptions) -> None:
        self._options = options
        self._serial = 0
        self._number = 0

    def serials(self, count: int) -> IntArray:
        """Fresh numbers for candidates.

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        serial : (count,) array of int
            Ascending.
        """
        first, self._serial = self._serial + 1, self._serial + count
        return np.arange(first, self._serial + 1, dtype=np.intp)

    def read(self, roster: Roster, partner: IntArray, sightings: Sightings) -> None:
        """Take note of labels.

        A track without a label gets one once it was read twice running, if no other track has it.

        Parameters
        ----------
        roster : Roster
            All tracks; changed.
        partner : (R,) array of int
            Sighting of each; -1 for none.
        sightings : Sightings
            Of the frame.
        """
        reads, swap = roster.reads.copy(), roster.swap.copy()
        for k in np.flatnonzero(partner >= 0):
            label = sightings.labels[partner[k]]
            if label == "":
                continue
            if roster.labels[k] == label:
                reads[k] += 1
                swap[k] = 0.0  # the label says who it is
                if reads[k] == READS:
                    self._rename(roster, int(k))
            elif roster.labels[k] == "":
                roster.labels[k] = label
                reads[k] = 1
        roster.reads, roster.swap = reads, swap

    @staticmethod
    def named(roster: Roster, partner: IntArray, sightings: Sightings) -> BoolArray:
        """Which tracks were read their label from their sightings.

        Parameters
        ----------
        roster : Roster
            All tracks.
        partner : (R,) array of int
            Sighting of each; -1 for none.
        sightings : Sightings
            Of the frame.

        Returns
        -------
        named : (R,) array of bool
            Those.
        """
        read = (sightings.labels[k] if k >= 0 else "" for k in partner.tolist())
        return np.array([a == b != "" for a, b in zip(read, roster.labels, strict=True)], np.bool_)

    def ready(self, roster: Roster) -> BoolArray:
        """Candidates whose odds are good.

        Parameters
        ----------
        roster : Roster
            All tracks.

        Returns
        -------
        ready : (R,) array of bool
            Which may be taken for things.
        """
        options = self._options
        ready: BoolArray = (
            ~roster.confirmed
            & (roster.hits >= options.confirm_hits)
            & (roster.score >= np.log(options.confirm_odds))
        )
        return ready

    def confirm(self, roster: Roster, rows: IntArray) -> None:
        """Take candidates for things.

        Parameters
        ----------
        roster : Roster
            All tracks; changed.
        rows : (K,) array of int
            Which.
        """
        roster.confirmed = roster.confirmed.copy()
        roster.confirmed[rows] = True
        for k in rows[np.lexsort((roster.serial[rows], roster.born[rows]))]:
            self._rename(roster, int(k))

    def _rename(self, roster: Roster, k: int) -> None:
        """Name a confirmed track by its label, or by the next number."""
        if not roster.confirmed[k]:
            return
        label = roster.labels[k]
        if label and roster.reads[k] >= READS:
            taken = {name for j, name in enumerate(roster.names) if j != k}
            roster.names[k] = _free(label, taken)
        elif roster.number[k] == 0:
            self._number += 1
            number = roster.number.copy()
            number[k] = self._number
            roster.number = number
            roster.names[k] = f"track-{self._number}"

    def superseded(self, roster: Roster) -> BoolArray:
        """Tracks whose label has turned up elsewhere, on a track that is seen while they are not.

        A thing that was carried away, or a track that had gone wrong, ends here; the other takes over its name.

        Parameters
        ----------
        roster : Roster
            All tracks; changed: names of tracks that bear one label.

        Returns
        -------
        gone : (R,) array of bool
            Tracks to end.
        """
        gone = np.zeros(len(roster), dtype=np.bool_)
        bearers: dict[str, list[int]] = {}
        for k in np.flatnonzero(roster.confirmed):
            if roster.labels[k]:
                bearers.setdefault(roster.labels[k], []).append(int(k))
        for label, rows in bearers.items():
            if len(rows) < 2:
                continue
            latest = max(float(roster.seen[k]) for k in rows)
            away = [k for k in rows if roster.seen[k] < latest]
            gone[away] = True
            stay = [k for k in rows if k not in away]
            if len(stay) == 1:
                taken = {name for j, name in enumerate(roster.names) if j not in rows}
                roster.names[stay[0]] = _free(label, taken)
            else:  # two tags alike: nobody can tell which is meant
                roster.swap = roster.swap.copy()
                roster.swap[stay] = np.maximum(roster.swap[stay], 1 - 1 / len(stay))
        return gone


def _free(label: str, taken: set[str]) -> str:
    """The label itself, or with a number where the name is taken."""
    name, number = label, 2
    while name in taken:
        name, number = f"{label}#{number}", number + 1
    return name

"""Tracks of a whole recording, for calibration.

What goes into a calibration are the sightings as they were seen, not the tracker's estimates: the errors of sightings
are independent of each other, as a calibration takes them to be, and those of filtered or smoothed positions are not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.recordings import Tracks
from airground.errors import InputError
from airground.vision.tracker.options import TrackerOptions
from airground.vision.tracker.smoother import Smoothed, smooth

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.state import TrackerState

__all__ = ["TrackRecorder"]


class TrackRecorder:
    """Collects which sighting was whose, and forgets what turns out to be nothing.

    Only tracks that were confirmed count, with their sightings from before that. When the tracker changes its mind
    about earlier frames, so does the recorder. Sightings that several tracks share are left out: they are where none
    of them is. A track of a label is named by the label.

    Parameters
    ----------
    shortest_s : float [s]
        Tracks that last less are left out.
    fewest : int
        Tracks of fewer sightings are left out.
    least_travel_px : float [px]
        Tracks that never get farther than this from where they began are left out; zero keeps what stands still.
    options : TrackerOptions, optional
        Of the tracker, for smoothing.
    """

    def __init__(
        self,
        *,
        shortest_s: float = 0.5,
        fewest: int = 5,
        least_travel_px: float = 0.0,
        options: TrackerOptions | None = None,
    ) -> None:
        self.shortest_s = shortest_s
        self.fewest = fewest
        self.least_travel_px = least_travel_px
        self.options = options or TrackerOptions()
        self._frames: dict[float, tuple[FloatArray, FloatArray]] = {}
        self._rows: dict[int, dict[float, int]] = {}
        self._names: dict[int, str] = {}
        self._last = -np.inf

    def add(self, sightings: Sightings, state: TrackerState) -> None:
        """Take in a frame.

        Parameters
        ----------
        sightings : Sightings
            What was seen.
        state : TrackerState
            What the tracker made of it.

        Raises
        ------
        InputError
            If the two are not of one time, or that is not after the last one.
        """
        t = sightings.t
        if state.t != t or not t > self._last:
            raise InputError(
                f"sightings at {t:.6g} s, tracks at {state.t:.6g} s, last frame at {self._last:.6g} s: "
                "give each frame's sightings with the tracker's answer, in order"
            )
        self._last = t
        self._frames[t] = (sightings.uv, sightings.covariance)
        for back, track in state.joined:
            self._rows.setdefault(track, {}).update(self._rows.pop(back, {}))
        for revision in state.revisions:
            mine = self._rows.setdefault(revision.serial, {})
            for when, row in revision.rows:
                mine.pop(when, None)
                if row >= 0:
                    mine[when] = row
        for k in np.flatnonzero(state.sighting >= 0):
            serial = int(state.serial[k])
            mine = self._rows.setdefault(serial, {})
            if state.merged_with[k]:
                mine.pop(t, None)
            else:
                mine[t] = int(state.sighting[k])
        for k in np.flatnonzero(state.confirmed):
            self._names[int(state.serial[k])] = state.names[k]
        alive = {int(serial) for serial in state.serial}
        for serial in [s for s in self._rows if s not in self._names and s not in alive]:
            del self._rows[serial]

    def _collected(self) -> dict[str, tuple[FloatArray, FloatArray, FloatArray]]:
        """Times, positions and covariances of each track that is worth keeping, by name."""
        merged: dict[str, dict[float, int]] = {}
        owner: dict[tuple[float, int], str] = {}
        for serial in sorted(self._names):  # of two tracks of a label the later one knows better
            name = self._names[serial]
            merged.setdefault(name, {}).update(self._rows.get(serial, {}))
        for name, rows in merged.items():
            for t, row in rows.items():
                owner[t, row] = name  # a sighting is one thing's only
        kept = {}
        for name, rows in merged.items():
            times = sorted(t for t, row in rows.items() if owner[t, row] == name)
            if len(times) < max(self.fewest, 1) or times[-1] - times[0] < self.shortest_s:
                continue
            uv = np.array([self._frames[t][0][rows[t]] for t in times])
            if np.linalg.norm(uv - uv[0], axis=1).max() < self.least_travel_px:
                continue
            covariance = np.array([self._frames[t][1][rows[t]] for t in times])
            kept[name] = (np.array(times), uv, covariance)
        return kept

    def tracks(self) -> Tracks:
        """The sightings of all tracks that are worth keeping.

        Returns
        -------
        tracks : Tracks
            Named as the tracker named them last.

        Raises
        ------
        InputError
            If there is none.
        """
        kept = self._collected()
        if not kept:
            raise InputError(
                f"no track of {self.fewest} sightings in {self.shortest_s} s was found in "
                f"{len(self._frames)} frames; look at what the detector sees, or ask for less"
            )
        names = [name for name, (t, _, _) in kept.items() for _ in t]
        covariance = np.concatenate([c for _, _, c in kept.values()])
        return Tracks.from_rows(
            np.concatenate([t for t, _, _ in kept.values()]),
            names,
            np.concatenate([uv for _, uv, _ in kept.values()]),
            np.sqrt(0.5 * np.trace(covariance, axis1=1, axis2=2)),
        )

    def smoothed(self) -> dict[str, Smoothed]:
        """Positions and velocities of the same tracks, each given all of its sightings.

        For pictures and for reading off speeds, not for calibration: the errors of neighbouring rows are alike.

        Returns
        -------
        smoothed : dict of str to Smoothed
            By name.
        """
        return {
            name: smooth(t, uv, covariance, self.options)
            for name, (t, uv, covariance) in self._collected().items()
        }

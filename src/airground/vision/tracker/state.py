"""What a tracker knows after a frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.tracker.roster import BoolArray

__all__ = ["AMBIGUOUS", "Revision", "Track", "TrackerState"]

AMBIGUOUS = 0.02
"""A track that is likelier than this to be another one is called ambiguous."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One thing that is followed."""

    name: str
    """Its label, once that was read; else `track-1` and so on, as they are confirmed; `candidate-1` before."""

    label: str
    """What tells it from all others: the number of its tag; empty where nothing does."""

    serial: int
    """Number of the track: never changes and is never used again, whatever becomes of the name."""

    t: float
    """Time of all that follows [s]."""

    uv: FloatArray
    """(2,) [px]. Position; (0, 0) is the centre of the top-left pixel, and v points down."""

    uv_dot: FloatArray
    """(2,) [px/s]. Velocity of that."""

    covariance: FloatArray
    """(4, 4). Of position and velocity: u, v, u_dot, v_dot."""

    angle: float
    """Heading in the image [rad], from u towards v, within -pi..pi; NaN where it was never seen."""

    angle_sigma: float
    """Its standard deviation [rad]; NaN where it was never seen."""

    confirmed: bool
    """Whether it is taken for a thing; a candidate may be clutter."""

    lost_for: float
    """Time since its last sighting [s]; a sighting that it shares with another track does not count."""

    sighting: int | None
    """Row of this frame's sightings that belongs to it; None where it was not seen."""

    age_s: float
    """Time since its first sighting [s]."""

    quality: float
    """Share of recent frames that it was seen in, alone: 1 is best."""

    merged_with: tuple[str, ...]
    """Names of tracks that share its sighting, as they are too near to each other to be seen apart."""

    swap_probability: float
    """How probable it is that the thing is not the one that had this name before."""

    @property
    def ambiguous(self) -> bool:
        """Whether its identity is in doubt: a robot that is steered by it had better stop."""
        return self.swap_probability > AMBIGUOUS


@dataclass(frozen=True, slots=True, eq=False)
class Revision:
    """A change of mind about whose sightings those of the last frames were."""

    serial: int
    """Track."""

    rows: tuple[tuple[float, int], ...]
    """Times [s] and rows of their sightings that are the track's after all; -1 where none is."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """All tracks at one time, as columns; `tracks` has them one by one."""

    t: float
    """Time [s]."""

    names: tuple[str, ...]
    """(N). Each once."""

    labels: tuple[str, ...]
    """(N). Empty for tracks without."""

    serial: IntArray
    """(N,). Numbers of the tracks, ascending."""

    uv: FloatArray
    """(N, 2) [px]. Positions."""

    uv_dot: FloatArray
    """(N, 2) [px/s]. Velocities."""

    covariance: FloatArray
    """(N, 4, 4). Of position and velocity."""

    angle: FloatArray
    """(N,) [rad]. Headings in the image; NaN where never seen."""

    angle_sigma: FloatArray
    """(N,) [rad]. Their standard deviations; NaN where never seen."""

    confirmed: BoolArray
    """(N,). Whether it is taken for a thing."""

    lost_for: FloatArray
    """(N,) [s]. Since the last sighting of its own."""

    sighting: IntArray
    """(N,). Row of this frame's sightings; -1 for none."""

    age_s: FloatArray
    """(N,) [s]. Since the first sighting."""

    quality: FloatArray
    """(N,). Share of recent frames that it was seen in, alone."""

    swap_probability: FloatArray
    """(N,). How probable it is that the thing is not the one that had this name before."""

    merged_with: tuple[tuple[str, ...], ...]
    """(N). Names of tracks that share the sighting."""

    revisions: tuple[Revision, ...] = field(default=())
    """What was decided otherwise about earlier frames; for recordings."""

    joined: tuple[tuple[int, int], ...] = field(default=())
    """Numbers of candidates that turned out to be tracks that had been lost, and of those tracks."""

    def __len__(self) -> int:
        return len(self.names)

    @property
    def tracks(self) -> tuple[Track, ...]:
        """One by one."""
        return tuple(self.track(k) for k in range(len(self)))

    @property
    def confirmed_tracks(self) -> tuple[Track, ...]:
        """Those that are taken for things."""
        return tuple(self.track(int(k)) for k in np.flatnonzero(self.confirmed))

    def track(self, which: int | str) -> Track:
        """One of them.

        Parameters
        ----------
        which : int or str
            Its row, or its name.

        Returns
        -------
        track : Track
            That one.

        Raises
        ------
        KeyError
            If there is no track of that name.
        """
        if isinstance(which, str):
            if which not in self.names:
                raise KeyError(which)
            which = self.names.index(which)
        k = which
        sighting = int(self.sighting[k])
        return Track(
            name=self.names[k],
            label=self.labels[k],
            serial=int(self.serial[k]),
            t=self.t,
            uv=self.uv[k],
            uv_dot=self.uv_dot[k],
            covariance=self.covariance[k],
            angle=float(self.angle[k]),
            angle_sigma=float(self.angle_sigma[k]),
            confirmed=bool(self.confirmed[k]),
            lost_for=float(self.lost_for[k]),
            sighting=None if sighting < 0 else sighting,
            age_s=float(self.age_s[k]),
            quality=float(self.quality[k]),
            merged_with=self.merged_with[k],
            swap_probability=float(self.swap_probability[k]),
        )

"""What is known of one robot without any calibration: what it said, and where its mark was seen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.robots import RobotReading
    from airground.session.inputs import Seen
    from airground.session.options import RobotOptions
    from airground.vision.tracker import Track

__all__ = ["Member"]


class Member:
    """One robot of ours.

    Parameters
    ----------
    options : RobotOptions
        What it is.
    """

    def __init__(self, options: RobotOptions) -> None:
        self.options = options
        self.heard_t: float | None = None
        self.reading: RobotReading | None = None
        self.track: Track | None = None
        self.seen_t: float | None = None
        self.seen_uv: FloatArray | None = None
        self.speed_mps = options.speed_mps or options.limits.speed_mps

    @property
    def name(self) -> str:
        """What it is called."""
        return self.options.name

    def hear(self, t: float, readings: tuple[RobotReading, ...]) -> None:
        """Take its readings.

        Parameters
        ----------
        t : float [s]
            Now.
        readings : tuple of RobotReading
            One or more.
        """
        self.heard_t = t
        self.reading = readings[-1]

    def see(self, seen: Seen, tracks: list[Track]) -> FloatArray | None:
        """Find it among the tracks of a frame.

        Parameters
        ----------
        seen : Seen
            The frame.
        tracks : list of Track
            Those of the frame.

        Returns
        -------
        uv : (2,) array or None [px]
            Where its mark was seen; None where it was not, or where it is in doubt whose mark it was.
        """
        mine = [k for k in tracks if self.options.track in (k.label, k.name)]
        self.track = mine[0] if mine else None
        if self.track is None or self.track.sighting is None or self.track.ambiguous:
            return None
        uv: FloatArray = seen.sightings.uv[self.track.sighting]
        self.seen_t, self.seen_uv = seen.t, uv
        return uv

    def seen_covariance(self, seen: Seen) -> FloatArray:
        """Of where it was seen in that frame.

        Parameters
        ----------
        seen : Seen
            The frame in which it was seen.

        Returns
        -------
        covariance : (2, 2) array [px2]
            As the detector states it.
        """
        assert self.track is not None
        assert self.track.sighting is not None
        return np.asarray(seen.sightings.covariance[self.track.sighting])

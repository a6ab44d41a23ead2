"""From a camera's frame to what the session is told of it: stamps brought onto one clock, then the eyes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from airground.robots.stamp_clock import StampClock
from airground.session.inputs import Seen

if TYPE_CHECKING:
    from airground.session.clock import SessionClock
    from airground.vision.eyes import Look, Looks
    from airground.vision.frame import Frame

__all__ = ["VisionStage"]

LEAST_STEP_S = 1e-6


class VisionStage:
    """Looks at one frame after the other.

    Parameters
    ----------
    eyes : Looks
        Fresh: have seen no frame.
    clock : SessionClock
        Of the session.
    """

    def __init__(self, eyes: Looks, clock: SessionClock) -> None:
        self._eyes = eyes
        self._clock = clock
        self._stamps = StampClock()
        self._segment = -1
        self._last_t = -1e18

    def look(self, frame: Frame, arrived_s: float) -> tuple[Seen, Look]:
        """Look at a frame.

        Parameters
        ----------
        frame : Frame
            The newest.
        arrived_s : float [s]
            When it was in memory, on the session's clock.

        Returns
        -------
        seen : Seen
            For the session.
        look : Look
            All that was made of it.
        """
        if frame.segment != self._segment:
            self._stamps = StampClock()
            self._segment, self._last_t = frame.segment, -1e18
        if frame.clock == "world":
            t = frame.t
        elif frame.clock == "arrival":
            t = frame.t - self._clock.began_s
        else:
            t = self._stamps.take(frame.t, arrived_s)
        t = max(t, self._last_t + LEAST_STEP_S)  # a tracker's time only goes forwards
        self._last_t = t
        look = self._eyes.look(replace(frame, t=t))
        seen = Seen(
            t=t,
            arrived_s=arrived_s,
            index=frame.index,
            size_px=frame.size_px,
            sightings=look.sightings,
            tracks=look.state,
            segment=frame.segment,
        )
        return seen, look

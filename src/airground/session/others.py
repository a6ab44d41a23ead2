"""What else is in view: vehicles that are not ours."""

from __future__ import annotations

from typing import TYPE_CHECKING

from airground.session.views import other_view

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from airground.calibration import Calibration
    from airground.session.tick import OtherView
    from airground.vision.tracker import Track

__all__ = ["Others"]

SHOWN_S = 1.0  # what was not seen for so long is not shown any more


class Others:
    """Tracks of the newest frame that are not of our robots, and what a person is told of them."""

    def __init__(self) -> None:
        self.tracks: list[Track] = []
        """As they are."""
        self._views: tuple[OtherView, ...] = ()
        self._fresh = False  # tracks whose views are not made yet

    def see(self, tracks: Sequence[Track], ours: Collection[int]) -> None:
        """Take a frame's tracks.

        Parameters
        ----------
        tracks : sequence of Track
            All of them.
        ours : collection of int
            Serial numbers of those of our robots.
        """
        self.tracks = [
            k for k in tracks if k.confirmed and k.serial not in ours and k.lost_for < SHOWN_S
        ]
        self._fresh = True

    def views(self, calibration: Calibration | None) -> tuple[OtherView, ...]:
        """Tell a person of them; worked out once for each frame.

        Parameters
        ----------
        calibration : Calibration or None
            The one in force.

        Returns
        -------
        views : tuple of OtherView
            In the order of the tracks.
        """
        if self._fresh:
            self._views = tuple(other_view(k, calibration) for k in self.tracks)
            self._fresh = False
        return self._views

"""How far a robot has come and where it heads, from compass and odometer readings that come late."""

from __future__ import annotations

from math import exp, isfinite, nan
from typing import TYPE_CHECKING

from airground.control.drive_laws import wrapped

if TYPE_CHECKING:
    from airground.control.legs.types import LegInput

__all__ = ["Gauge"]

WINDOW_S = 0.1  # of the turn rate, where only headings tell it
AHEAD_S = 0.2  # readings are carried on by as much at most
LARGEST, FASTEST_MPS = 1e6, 100.0  # of what is believed
GAP_S = 0.5  # nothing is known of what lies in a longer one


class Gauge:
    """Distance, heading, speed and turn rate by dead reckoning."""

    def __init__(self) -> None:
        self.read_t = nan
        """Of the newest reading [s]."""
        self.speed = 0.0
        """Newest [m/s]."""
        self.turn_rate = 0.0
        """Told, or by the headings [rad/s]."""
        self._distance = 0.0
        self._heading = nan
        self._now = nan

    @property
    def known(self) -> bool:
        """Whether anything was ever read."""
        return isfinite(self._heading)

    @property
    def age_s(self) -> float:
        """Of the newest reading [s]; NaN where there is none."""
        return self._now - self.read_t

    @property
    def distance_m(self) -> float:
        """Driven until now, reverse taken off [m]."""
        return self._distance + self.speed * self._ahead

    @property
    def heading_rad(self) -> float:
        """Now [rad]; NaN where it is not known."""
        return self._heading + self.turn_rate * self._ahead

    @property
    def _ahead(self) -> float:
        return min(max(self.age_s, 0.0), AHEAD_S)

    def take(self, now: LegInput) -> None:
        """Go on to a tick.

        Parameters
        ----------
        now : LegInput
            With what was read; what is not a number is as if it had not been.
        """
        self._now = now.t
        heading, speed = now.heading_rad, now.speed_mps
        t = now.t if now.reading_t is None else now.reading_t
        if heading is None or speed is None:
            return
        if not (abs(heading) < LARGEST and abs(speed) < FASTEST_MPS and isfinite(t)):
            return
        if not self.known:
            self.read_t, self._heading, self.speed = t, heading, speed
            return
        dt = t - self.read_t
        if not dt > 0:
            return
        if dt < GAP_S:
            self._distance += (self.speed + speed) / 2 * dt
            told = now.turn_radps
            if told is None or not abs(told) < LARGEST:
                rate = wrapped(heading - self._heading) / dt
                self.turn_rate += (rate - self.turn_rate) * (1 - exp(-dt / WINDOW_S))
            else:
                self.turn_rate = told
        else:
            self.turn_rate = 0.0
        self.read_t, self._heading, self.speed = t, heading, speed

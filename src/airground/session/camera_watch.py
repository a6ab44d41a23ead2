"""How the camera stands, from the frames that come and what its source says."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from airground.session.tick import CameraView

if TYPE_CHECKING:
    from airground.session.inputs import CameraNews, Seen

__all__ = ["CameraWatch"]

FRAMES = 20  # over which the rate is taken
FROZEN_S = 0.3  # one and the same picture for longer is no picture of what is there now
SILENT_S = 0.5
BAD = ("lost", "frozen", "late", "ended")


class CameraWatch:
    """Keeps what is known of the camera."""

    def __init__(self) -> None:
        self.newest: Seen | None = None
        self._news: CameraNews | None = None
        self._arrived: deque[float] = deque(maxlen=FRAMES)
        self._fresh_t: float | None = None
        self._state = ""

    @property
    def size_px(self) -> tuple[int, int] | None:
        """Of the image [px]; None before the first."""
        return None if self.newest is None else self.newest.size_px

    @property
    def frozen(self) -> bool:
        """Whether it sends one and the same picture."""
        return self._news is not None and self._news.frozen_s > FROZEN_S

    def see(self, seen: Seen) -> None:
        """Take a frame.

        Parameters
        ----------
        seen : Seen
            The newest.
        """
        self.newest = seen
        self._arrived.append(seen.arrived_s)
        if not self.frozen:
            self._fresh_t = seen.t

    def hear(self, news: CameraNews) -> None:
        """Take what its source says.

        Parameters
        ----------
        news : CameraNews
            Of its health.
        """
        self._news = news

    def fresh_t(self, offset_s: float) -> float | None:
        """When the newest picture was taken that is known to show what is there.

        Parameters
        ----------
        offset_s : float [s]
            To be added to the camera's stamps.

        Returns
        -------
        t : float or None [s]
            None before the first.
        """
        fresh = self._fresh_t
        if fresh is not None and self.frozen and self._news is not None and self.newest is not None:
            fresh = min(fresh, self.newest.t - self._news.frozen_s)  # when it last changed
        return None if fresh is None else fresh + offset_s

    def view(self, t: float, offset_s: float) -> CameraView:
        """Say how it stands.

        Parameters
        ----------
        t : float [s]
            Now.
        offset_s : float [s]
            To be added to the camera's stamps.

        Returns
        -------
        view : CameraView
            For a person.
        """
        news, newest = self._news, self.newest
        state = "opening" if newest is None else "live"
        line = "" if news is None else news.line
        age = None if newest is None else t - newest.t - offset_s
        if news is not None and news.state in ("lost", "ended"):
            state = news.state
        elif self.frozen and news is not None:
            state = "frozen"
            line = line or f"the same picture for {news.frozen_s:.1f} s: is the camera stuck?"
        elif newest is not None and age is not None and age > SILENT_S:
            silent = t - newest.arrived_s
            late = silent <= SILENT_S and age - silent > SILENT_S
            state = "late" if late else "lost"
            line = line or (
                f"pictures are {age:.1f} s old" if late else f"no picture for {silent:.1f} s"
            )
        rate = 0.0
        if len(self._arrived) > 1 and self._arrived[-1] > self._arrived[0] and state != "lost":
            rate = (len(self._arrived) - 1) / (self._arrived[-1] - self._arrived[0])
        return CameraView(
            state=state,
            line=line,
            age_s=age,
            rate_hz=rate,
            index=-1 if newest is None else newest.index,
            size_px=self.size_px,
        )

    def changes(self, t: float, offset_s: float) -> list[tuple[str, str]]:
        """Say how it stands, if that is not how it stood when one last asked.

        Parameters
        ----------
        t : float [s]
            Now.
        offset_s : float [s]
            To be added to the camera's stamps.

        Returns
        -------
        changes : list of (str, str)
            Level and line; one at most.
        """
        view = self.view(t, offset_s)
        before, self._state = self._state, view.state
        if before in ("", view.state):
            return []
        line = f"camera: {view.state}" + (f": {view.line}" if view.line else "")
        return [("warning" if view.state in BAD else "info", line)]

"""Whether somebody is at the controls, and whether STOP is pressed."""

from __future__ import annotations

__all__ = ["OperatorWatch"]


class OperatorWatch:
    """Keeps who holds the controls and when that was last heard, and STOP, which holds until it is released.

    Parameters
    ----------
    silence_s : float [s]
        After which an operator is taken to be gone.
    """

    def __init__(self, silence_s: float) -> None:
        self._silence_s = silence_s
        self.client = ""
        self.heard_t: float | None = None
        self.stopped = False
        self.why = ""
        self.stop_heard = 0

    def hear(self, t: float, client: str) -> None:
        """Note that somebody at the controls was heard.

        Parameters
        ----------
        t : float [s]
            Now.
        client : str
            Who.
        """
        self.client, self.heard_t = client, t

    def leave(self) -> None:
        """Note that nobody is at the controls."""
        self.client, self.heard_t = "", None

    def silent(self, t: float) -> bool:
        """Tell whether who was at the controls is not heard any more.

        Parameters
        ----------
        t : float [s]
            Now.

        Returns
        -------
        silent : bool
            False where nobody was there.
        """
        return self.heard_t is not None and t - self.heard_t > self._silence_s

    def press(self, why: str) -> None:
        """Press STOP.

        Parameters
        ----------
        why : str
            In one line.
        """
        if not self.stopped:
            self.why = why
        self.stopped = True

    def release(self) -> None:
        """Release STOP."""
        self.stopped, self.why = False, ""

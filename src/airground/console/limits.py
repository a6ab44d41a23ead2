"""How much a client may ask for."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["ConsoleLimits", "TokenBucket"]


@dataclass(frozen=True, slots=True)
class ConsoleLimits:
    """Bounds on what clients do. Hand driving, acknowledged images and a sketch being dragged stay well within."""

    message_bytes: int = 256_000
    """Longest message; a sketch of 4000 points is 80 kB."""

    messages_per_s: float = 120.0
    """From one client, in the long run; a page sends about 60 at most."""

    burst_messages: int = 240
    """At once."""

    bytes_per_s: float = 2e6
    """From one client, in the long run."""

    burst_bytes: int = 4_000_000
    """At once."""

    faults_per_s: float = 10.0
    """Messages that are refused or dropped, in the long run; beyond it the conversation ends."""

    burst_faults: int = 100
    """At once."""

    depth: int = 8
    """Of brackets within brackets; a list of fences has six."""

    clients: int = 32
    """At the same time; as many again may be about to say hello."""

    hello_s: float = 3.0
    """Within which a client must say who it is [s]."""

    silence_s: float = 1.0
    """After which whoever holds the controls is taken for gone [s]; a page says `alive` five times a second."""

    state_hz: float = 20.0
    """Rate of state messages, and the most of images."""

    replies: int = 256
    """Most that may wait for a client that does not read."""

    events: int = 100
    """That are kept for clients that come later."""


class TokenBucket:
    """So much at once, and so much a second in the long run.

    Parameters
    ----------
    rate : float [1/s]
        In the long run.
    burst : float
        At once.
    """

    def __init__(self, rate: float, burst: float) -> None:
        self._rate = rate
        self._burst = burst
        self._left = burst
        self._then: float | None = None

    def take(self, now: float, amount: float = 1.0) -> bool:
        """Take some, if it is there.

        Parameters
        ----------
        now : float [s]
            Any clock that does not go back.
        amount : float
            How much.

        Returns
        -------
        granted : bool
            Nothing is taken where False.
        """
        passed = 0.0 if self._then is None else max(now - self._then, 0.0)
        self._then = now
        self._left = min(self._left + passed * self._rate, self._burst)
        if amount > self._left:
            return False
        self._left -= amount
        return True

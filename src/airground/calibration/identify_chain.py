"""At every instant one fragment for a robot, and one robot for a fragment."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Span", "chained"]

HANDOVER_S = 0.5
"""Two fragments of one robot may overlap by so much: a tracker lets go of the old one late."""


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of a fragment that follows a robot."""

    robot: int
    """Which robot."""

    part: int
    """Which fragment."""

    first: int
    """Its first window."""

    stop: int
    """One after its last window."""

    first_s: float
    """Where it begins [s]."""

    last_s: float
    """Where it ends [s]."""

    gain: float
    """Log likelihood ratio to a vehicle on its own."""

    counted: float
    """Independent velocities in it."""


def chained(spans: list[Span]) -> tuple[Span, ...]:
    """Choose spans that do not contradict each other, with the greatest gain.

    Parameters
    ----------
    spans : list of Span
        Candidates.

    Returns
    -------
    spans : tuple of Span
        By robot and time.
    """
    # A stretch of a fragment that two robots claim goes to the one that it follows better.
    free: list[Span] = []
    for span in sorted(spans, key=lambda s: -s.gain):
        if not any(
            o.part == span.part and min(o.stop, span.stop) > max(o.first, span.first) for o in free
        ):
            free.append(span)
    kept: list[Span] = []
    for robot in sorted({s.robot for s in free}):
        kept += _heaviest([s for s in free if s.robot == robot])
    return tuple(kept)


def _heaviest(spans: list[Span]) -> list[Span]:
    """Weighted interval scheduling: the chain in time whose gains add up to most."""
    spans = sorted(spans, key=lambda s: (s.last_s, s.first_s, s.part))
    worth = [0.0] * len(spans)
    before = [-1] * len(spans)
    for k, span in enumerate(spans):
        for j in range(k):
            apart = spans[j].last_s - HANDOVER_S < span.first_s
            if apart and spans[j].first_s < span.first_s and worth[j] > _gain_of(worth, before[k]):
                before[k] = j
        worth[k] = span.gain + _gain_of(worth, before[k])
    k = max(range(len(spans)), key=lambda i: worth[i], default=-1)
    chain: list[Span] = []
    while k >= 0:
        chain.append(spans[k])
        k = before[k]
    return chain[::-1]


def _gain_of(worth: list[float], k: int) -> float:
    """Gain of a chain that ends at a span; of none, 0."""
    return worth[k] if k >= 0 else 0.0

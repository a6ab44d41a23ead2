"""What a state filter did not take, by reason."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["StateCounts"]


@dataclass(frozen=True, slots=True)
class StateCounts:
    """What a filter did not take, since it was made. Data refused here cost nothing else."""

    sightings_refused: int = 0
    """Sightings too far from where the robot was expected: another's mark, a glint."""

    readings_doubted: int = 0
    """Readings so far from what was expected that they hardly count: wheels slip or are held."""

    unusable: int = 0
    """NaN, infinite, impossibly fast, beyond the horizon."""

    late: int = 0
    """Older than `StateOptions.window_s` behind the newest."""

    early: int = 0
    """Further ahead than `StateOptions.future_s`: a wrong clock."""

    jumps: int = 0
    """New beginnings because refused sightings agreed: the robot was carried elsewhere."""

    losses: int = 0
    """New beginnings after too long a dropout."""

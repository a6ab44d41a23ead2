"""Which headings were driven, and what to drive next."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["advise", "distinct_headings_deg"]

SECTOR_DEG = 15
"""Headings closer than this count as one."""

APART_DEG = 30
"""Headings within this of each other fix their vanishing points too badly to count as two."""

ENOUGH = 3
"""Headings whose vanishing points, two constraints each, give the five that eq. 16 needs."""

MIN_SHARE = 0.02
"""A heading counts if at least this share of the way was driven along it."""


def distinct_headings_deg(xy_dot: FloatArray) -> tuple[float, ...]:
    """Distinct ground headings, modulo 180 degrees, as a line is driven both ways.

    Parameters
    ----------
    xy_dot : (N, 2) array [m/s]
        Ground velocities.

    Returns
    -------
    headings : tuple of float [deg]
        Means of the peaks, in 0..180.
    """
    length = np.linalg.norm(xy_dot, axis=1)
    if not length.sum() > 0:
        return ()
    doubled = 2 * np.arctan2(xy_dot[:, 1], xy_dot[:, 0])  # modulo 180 degrees
    bins = np.floor(np.degrees(doubled) / 2 % 180).astype(int) % 180  # of one degree
    share = np.bincount(bins, length, 180) / length.sum()
    way = np.bincount(bins, length * np.cos(doubled), 180) + 1j * np.bincount(
        bins, length * np.sin(doubled), 180
    )
    sector = (np.arange(180)[:, None] + np.arange(SECTOR_DEG)) % 180
    headings: list[float] = []
    # The heaviest sector first, wherever it starts, so that no fixed border cuts a line in two.
    while (weight := share[sector].sum(axis=1)).max() >= MIN_SHARE:
        rows = sector[int(np.argmax(weight))]
        mean = float(np.degrees(np.angle(way[rows].sum())) / 2 % 180) % 180.0
        share[rows] = way[rows] = 0.0
        if all(abs((mean - h + 90) % 180 - 90) > SECTOR_DEG / 2 for h in headings):
            headings.append(mean)
    return tuple(sorted(headings))


def advise(headings_deg: tuple[float, ...], *, enough: int = ENOUGH) -> str:
    """Say what to drive next.

    Parameters
    ----------
    headings_deg : tuple of float [deg]
        Distinct headings so far, modulo 180.
    enough : int
        How many, well apart, the estimator needs.

    Returns
    -------
    advice : str
        One clause.
    """
    if not headings_deg:
        return "drive: the readings show no motion"
    apart = _well_apart(headings_deg)
    if len(apart) < enough:
        gaps = np.diff([*apart, apart[0] + 180.0])
        widest = int(np.argmax(gaps))
        parts = 1 + enough - len(apart)
        new = sorted((apart[widest] + gaps[widest] * k / parts) % 180 for k in range(1, parts))
        wanted = " and ".join(f"{h:.0f}" for h in new)
        return f"drive also at about {wanted} degrees, in different parts of the image"
    return "drive the same headings again in other parts of the image, or in curves that fill it"


def _well_apart(headings_deg: tuple[float, ...]) -> list[float]:
    """Headings, those that are too near to each other to help taken as one in their middle."""
    start = int(
        np.argmax(np.diff([headings_deg[-1] - 180.0, *headings_deg]))
    )  # after the widest gap
    turned = [*headings_deg[start:], *(h + 180.0 for h in headings_deg[:start])]
    groups: list[list[float]] = []
    for heading in turned:
        if groups and heading - groups[-1][0] < APART_DEG:
            groups[-1].append(heading)
        else:
            groups.append([heading])
    return sorted((group[0] + group[-1]) / 2 % 180 for group in groups)

"""What the paper could not do: each ability on simulated drives, the paper's method beside the whole drive.

The truth is the simulation's; what calibrates sees tracks and readings only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.studies.beyond_drives import ABILITIES, Ability, one_drive
from airground.studies.item import Document, Item, Outcome, Work
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["BEYOND", "DRIVES"]

DRIVES = 5
"""Of each row; as many as trials where these are fewer."""

DIFFERS = (
    "The paper drives eight headings, takes every sighting as right, both clocks as one and the camera as a pinhole, "
    "and shows one robot. Here each of these is broken on purpose, one at a time, in simulated drives of 40 s with "
    "1 px of noise and slow slip. The linear method is given one clock, as in the paper; that it refuses is our "
    "check: n in brackets is what eqs. 16 and 17 give all the same."
)
NOTE = (
    "n (eq. 22), median of {drives} drives, refused ones left out; in brackets: eqs. 16 and 17 all the same; without "
    "it: the whole drive told that there is one clock, no lens, or that names are right as they come; moving camera: "
    "item moving; other vehicles' speeds: item others"
)


def _compute(work: Work) -> Outcome:
    drives = min(DRIVES, work.trials)
    tasks = [(key, work.seed, k) for key in ABILITIES for k in range(drives)]
    found: list[dict[str, float | None]] = []
    for done, one in enumerate(work.workers.map(one_drive, tasks, len(tasks), long=True), start=1):
        found.append(one)
        if work.progress is not None:
            work.progress(done, len(tasks))
    document: Document = {"paper": {key: ability.paper for key, ability in ABILITIES.items()}}
    for row, (key, ability) in enumerate(ABILITIES.items()):
        document[key] = _summary(ability, found[row * drives : (row + 1) * drives])
    document["drives"] = drives
    return Outcome(document)


def _summary(ability: Ability, found: Sequence[Mapping[str, float | None]]) -> Document:
    """Medians over the drives of a row, and how many were refused."""
    summary: Document = {}
    for method in ("linear", "trajectory", *(["without"] if ability.without is not None else [])):
        known = _known(found, f"{method}_n")
        summary[f"{method}_n_median"] = _median(known)
        summary[f"{method}_refused"] = len(found) - len(known)
    summary["equations_n_median"] = _median(_known(found, "equations_n"))
    if ability.beside:
        values = _known(found, ability.beside)
        summary[f"{ability.beside}_true"] = ability.truth
        summary[f"{ability.beside}_median"] = _median(values)
        summary[f"{ability.beside}_error_median"] = _median(np.abs(values - ability.truth))
    if not ability.named:
        for share in ("right", "wrong"):
            summary[f"{share}_share"] = float(np.mean(_known(found, share)))
    return summary


def _known(found: Sequence[Mapping[str, float | None]], key: str) -> FloatArray:
    return np.array([value for one in found if (value := one.get(key)) is not None])


def _median(values: FloatArray) -> float | None:
    return float(np.median(values)) if len(values) else None


def _sheet(document: Mapping[str, Any]) -> Sheet:
    drives = document["drives"]
    rows = []
    for key, ability in ABILITIES.items():
        one = document[key]
        without = "-" if ability.without is None else _cell(one, "without", drives)
        linear = _cell(one, "linear", drives, one["equations_n_median"])
        ours = _cell(one, "trajectory", drives)
        rows.append((ability.words, linear, ours, without, _beside(ability, one)))
    return Sheet(
        title="What the paper could not do: n, one thing wrong at a time",
        header=(
            "what",
            "paper's method (linear)",
            "ours (whole drive)",
            "without it",
            "also found",
        ),
        rows=tuple(rows),
        note=NOTE.format(drives=drives),
    )


def _cell(one: Mapping[str, Any], method: str, drives: int, anyway: float | None = None) -> str:
    n, refused = one[f"{method}_n_median"], one[f"{method}_refused"]
    if not refused:
        return f"{n:.4f}"
    told = "refused" if refused == drives else f"{n:.4f}, {refused} of {drives} refused"
    return told if anyway is None else f"{told} ({anyway:.4f})"


def _beside(ability: Ability, one: Mapping[str, Any]) -> str:
    if not ability.named:
        wrong = one["wrong_share"]
        return f"{one['right_share']:.0%} named right" + (f", {wrong:.0%} wrong" if wrong else "")
    error = one[f"{ability.beside}_error_median"] if ability.beside else None
    if error is None:
        return "-"
    if ability.beside == "time_offset_s":
        return f"offset to {1000 * error:.1f} ms"
    if ability.beside == "k1":
        return f"k1 to {error:.3f}"
    return f"{one[f'{ability.beside}_median']:.1%} followed"


BEYOND = Item(_compute, _sheet, DIFFERS)
"""Abilities that the paper's method lacks."""

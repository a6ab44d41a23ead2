"""How the figures of section 3.1 depend on what the paper leaves open.

    python -m airground.studies.sweep --trials 1000 --seed 0

prints the table that docs/paper.md quotes.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace
from math import radians
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import AirgroundError
from airground.geometry.metrics import n_error
from airground.sim.unicycle import SegmentDrive
from airground.studies.bound import drive_bound
from airground.studies.fig5 import delta
from airground.studies.measurements import (
    Measure,
    measure_differences,
    measure_exactly,
    measure_fits,
)
from airground.studies.sheet import Sheet, markdown
from airground.studies.simulation import PAPER, PaperSimulation, measure_end_points, run_trials

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["Choice", "choices", "main", "sweep"]


@dataclass(frozen=True, slots=True)
class Choice:
    """One way to fill in what the paper leaves open."""

    measured: str
    """How the image velocity is measured, in words."""

    readings: str
    """How often the ground velocity is read, in words."""

    measure: Measure
    """The same, as a function."""

    simulation: PaperSimulation = PAPER
    """Duration of a segment, first heading, and place in the image."""


def choices() -> Iterator[Choice]:
    """What the sweep tries.

    Yields
    ------
    choice : Choice
        Durations first, then headings, places in the image, and ways to measure.
    """
    per_segment, ends = "1 per segment", "end points"
    for duration in (2.0, 3.0, 4.0, 4.5, 5.0, 6.0, 7.0):
        varied = replace(PAPER, drive=SegmentDrive(duration_s=duration))
        yield Choice(ends, per_segment, measure_end_points, varied)
    for degrees in (60, 120, 180, 240, 300):
        varied = replace(PAPER, drive=SegmentDrive(heading_rad=radians(degrees)))
        yield Choice(ends, per_segment, measure_end_points, varied)
    for shift in ((-160.0, 0.0), (160.0, 0.0), (0.0, -120.0), (0.0, 80.0)):
        yield Choice(ends, per_segment, measure_end_points, replace(PAPER, shift_px=shift))
    yield Choice("exact velocity", per_segment, measure_exactly)
    for rate, words in ((1.0, "1 s differences"), (30.0, "30 fps differences")):
        for once in (True, False):
            readings = per_segment if once else "1 per sample"
            yield Choice(words, readings, measure_differences(rate, one_reading=once))
    for once in (True, False):
        readings = per_segment if once else "1 per frame"
        yield Choice("line fit at 30 fps", readings, measure_fits(30.0, one_reading=once))


def sweep(tried: Sequence[Choice], *, trials: int, seed: int) -> Sheet:
    """Run the simulation for every choice.

    Parameters
    ----------
    tried : sequence of Choice
        What to try.
    trials : int
        Of each.
    seed : int
        Of each.

    Returns
    -------
    sheet : Sheet
        One row per choice.
    """
    rows = []
    for choice in tried:
        simulation = choice.simulation
        outcome = run_trials(simulation, trials=trials, seed=seed, measure=choice.measure)
        n = n_error(outcome.g, outcome.g_hat)
        linear, ideal = delta(outcome, outcome.g_hat), delta(outcome, outcome.g)
        drive, shift = simulation.drive, simulation.shift_px
        ends = choice.measure is measure_end_points  # what the bound is for
        rows.append(
            (
                choice.measured,
                choice.readings,
                f"{drive.duration_s:g}",
                f"{np.degrees(drive.heading_rad):.0f}",
                f"{shift[0]:.0f}, {shift[1]:.0f}",
                f"{np.mean(n):.3f}",
                f"{np.median(n):.3f}",
                f"{np.mean(linear):.2f}",
                f"{np.mean(ideal):.2f}",
                f"{drive_bound(simulation).n_rms:.3f}" if ends else "",
                str(outcome.unobservable),
            )
        )
    return Sheet(
        title=f"What the paper leaves open, {trials} trials",
        header=(
            "image velocity",
            "ground velocity",
            "segment [s]",
            "first heading [deg]",
            "shift [px]",
            "n mean",
            "n median",
            "δ mean [px/s]",
            "δ mean, ideal g [px/s]",
            "bound, n rms",
            "no estimate",
        ),
        rows=tuple(rows),
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Print the sweep as a Markdown table.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process where not given.

    Returns
    -------
    code : int
        Exit code.
    """
    parser = argparse.ArgumentParser(prog="python -m airground.studies.sweep")
    parser.add_argument("--trials", type=int, default=1000, help="of each row (default: 1000)")
    parser.add_argument("--seed", type=int, default=0, help="of each row (default: 0)")
    args = parser.parse_args(argv)
    try:
        print(markdown(sweep(list(choices()), trials=args.trials, seed=args.seed)))
    except AirgroundError as error:
        print(f"sweep: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())

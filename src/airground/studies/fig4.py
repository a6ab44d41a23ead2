"""Figure 4: the error n of g over the trials of the simulation (eq. 22)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.geometry.metrics import n_error
from airground.studies.bound import drive_bound
from airground.studies.item import Document, Item, Outcome, Work, unobservable_note
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["FIG4", "PAPER_N"]

DIFFERS = (
    "The linear method is the paper's, and agrees with it in size; the paper leaves open how long a segment "
    "takes, where in the image it is driven, its first heading and how image velocity is measured, and these "
    "change n by more than a hundred trials scatter. The whole drive and the bound are not in the paper: the same "
    "points and velocities in one least-squares problem, weighted by their noise, and the smallest error that "
    "those measurements allow."
)

PAPER_N = {"n_mean": 0.2519, "n_median": 0.2292}
"""Section 3.1, 100 trials."""


def _compute(work: Work) -> Outcome:
    outcome = work.simulation
    n = n_error(outcome.g, outcome.g_hat)
    whole = n_error(outcome.g, work.whole_drive.g_hat)
    bound = drive_bound().n_rms
    document: Document = {
        "paper": dict(PAPER_N),
        "linear": {"n_mean": float(np.mean(n)), "n_median": float(np.median(n))},
        "trajectory": {"n_mean": float(np.mean(whole)), "n_median": float(np.median(whole))},
        "bound": {"n_rms": bound},
        "trials": outcome.trials,
    }
    if outcome.unobservable:  # means are over the others
        document["unobservable_trials"] = outcome.unobservable

    def draw(path: Path) -> None:
        from airground.pictures.histogram import Series, draw_histograms

        draw_histograms(
            path,
            [Series("Linear method (eqs. 16, 17)", n), Series("Whole drive", whole)],
            xlabel="error of g,  n = ‖g − ĝ‖ / ‖g‖  [1]",
            paper_mean=PAPER_N["n_mean"],
            paper_median=PAPER_N["n_median"],
            mark=("whole-drive bound, rms", bound),
        )

    return Outcome(document, draw)


def _sheet(document: Mapping[str, Any]) -> Sheet:
    columns = [document[key] for key in ("paper", "linear", "trajectory")]
    rows = [
        (name, *(f"{column[key]:.4f}" for column in columns), "")
        for name, key in (("mean of n", "n_mean"), ("median of n", "n_median"))
    ]
    rows.append(("root mean square of n", "", "", "", f"{document['bound']['n_rms']:.4f}"))
    return Sheet(
        title=f"Figure 4: error n of g (eq. 22), {document['trials']} trials",
        header=("", "paper", "linear", "whole drive", "bound"),
        rows=tuple(rows),
        note=unobservable_note(document),
    )


FIG4 = Item(_compute, _sheet, DIFFERS)
"""Figure 4."""

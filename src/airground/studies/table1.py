"""Table 1: g as it is, and as a typical trial of the simulation recovers it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from airground.geometry.metrics import n_error
from airground.studies.item import Document, Item, Outcome, Work, unobservable_note
from airground.studies.paper_camera import G_IDEAL, G_PAPER_SIM
from airground.studies.sheet import Sheet

__all__ = ["TABLE1", "typical_trial"]

DIFFERS = (
    "The paper calls its column typical, but its n is far below the median that it states: it is one of the "
    "better trials. Ours is the trial with the median n. The noise is drawn anew, so that only the size of the "
    "error can agree."
)


def typical_trial(n: np.ndarray[Any, np.dtype[np.float64]]) -> int:
    """Pick the trial whose error is the median, the lower one of two.

    Parameters
    ----------
    n : (M,) array
        Errors.

    Returns
    -------
    k : int
        Index of a trial, not a mixture of two.
    """
    return int(np.argsort(n, kind="stable")[(len(n) - 1) // 2])


def _compute(work: Work) -> Outcome:
    outcome = work.simulation
    n = n_error(outcome.g, outcome.g_hat)
    k = typical_trial(n)
    document: Document = {
        "ideal": G_IDEAL.tolist(),
        "paper_sim": G_PAPER_SIM.tolist(),
        "linear": outcome.g_hat[k].tolist(),
        "n": {"paper_sim": float(n_error(G_IDEAL, G_PAPER_SIM)), "linear": float(n[k])},
        "trials": outcome.trials,
    }
    if outcome.unobservable:
        document["unobservable_trials"] = outcome.unobservable
    return Outcome(document)


def _sheet(document: Mapping[str, Any]) -> Sheet:
    names = ("ideal", "paper_sim", "linear")
    rows = [
        (
            f"g{i + 1}{j + 1}",
            *(
                f"{document[name][i][j]:.4f}" if i < 2 else f"{document[name][i][j]:.5f}"
                for name in names
            ),
        )
        for j in range(2)
        for i in range(3)
    ]
    rows.append(("n", "", f"{document['n']['paper_sim']:.4f}", f"{document['n']['linear']:.4f}"))
    return Sheet(
        title=f"Table 1: g of the typical trial, the one with the median n of {document['trials']}",
        header=("", "ideal", "paper, sim", "linear"),
        rows=tuple(rows),
        note=unobservable_note(document),
    )


TABLE1 = Item(_compute, _sheet, DIFFERS)
"""Table 1."""

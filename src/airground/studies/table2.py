"""Table 2 and section 3.2: the error of g over 20 calibration drives of a robot with wheels that slip (eq. 23)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.errors import AirgroundError
from airground.studies.item import Document, Item, Outcome, Work
from airground.studies.robot_runs import METHODS
from airground.studies.sheet import Sheet
from airground.studies.table1 import typical_trial

if TYPE_CHECKING:
    from airground.studies.robot_runs import RobotSummary

__all__ = ["PAPER_NE", "TABLE2", "typical_run"]

PAPER_NE = {"n_e_mean": 0.0563, "n_e_median": 0.0540, "runs": 20}
"""Section 3.2."""

PAPER_G = {
    "ideal": [[-8.8347, -2.0486], [-0.2190, 3.3972], [-0.00064, -0.0048]],
    "exp": [[-8.9873, -2.1911], [-0.4488, 3.3299], [-0.0008, -0.0049]],
}
WORDS = {"linear": "linear method", "trajectory": "whole drive"}
DIFFERS = (
    "The paper drove a real ER-1 under a real camera; this one drives in MuJoCo, with wheels that slip, motors that "
    "lag, encoders, a compass that is swung before the drive, and a rendered camera with a lens and noise, seen by our "
    "detector. The truth is surveyed in both. A wheel that is not as large as it is taken for makes all speeds wrong "
    "by a share that no calibration from odometry can see: it is part of n_e."
)


def typical_run(runs: tuple[RobotSummary, ...]) -> RobotSummary:
    """Pick the drive whose whole-drive error is the median.

    Parameters
    ----------
    runs : tuple of RobotSummary
        Drives.

    Returns
    -------
    run : RobotSummary
        One of them.
    """
    n = np.array([run.n("trajectory") for run in runs])
    return runs[typical_trial(np.where(np.isfinite(n), n, np.inf))]


def _compute(work: Work) -> Outcome:
    try:
        runs = work.robot_runs
    except AirgroundError as error:  # MuJoCo is missing, or cannot draw: said, and the rest goes on
        return Outcome({"paper": dict(PAPER_NE), "none": str(error)})
    document: Document = {"paper": dict(PAPER_NE)}
    for method in METHODS:
        n = np.array([run.n(method) for run in runs])
        known = n[np.isfinite(n)]
        document[method] = {
            "n_e_mean": float(np.mean(known)) if len(known) else None,
            "n_e_median": float(np.median(known)) if len(known) else None,
            "runs": len(known),
            "refused": len(n) - len(known),
        }
    sigma = np.array([run.relative_sigma for run in runs])
    document["trajectory"]["relative_sigma_median"] = (
        float(np.nanmedian(sigma)) if np.isfinite(sigma).any() else None
    )
    run = typical_run(runs)
    document["typical"] = {
        "seed": run.seed,
        "ideal": run.g.tolist(),
        **{m: None if (g := run.g_hat[m]) is None else g.tolist() for m in METHODS},
    }
    document["paper_typical"] = PAPER_G
    document["runs"] = len(runs)
    return Outcome(document)


def _sheet(document: Mapping[str, Any]) -> Sheet:
    if "none" in document:
        return Sheet("Table 2: no robot was driven", ("",), (), document["none"])
    columns = [document["paper"], *(document[method] for method in METHODS)]
    rows = [
        (words, "", *(_number(one[key], 4) for one in columns))
        for words, key in (("mean of n_e", "n_e_mean"), ("median of n_e", "n_e_median"))
    ]
    typical = document["typical"]
    for j in range(2):
        for i in range(3):
            digits = 4 if i < 2 else 5
            cells = (typical[m][i][j] if typical[m] else None for m in METHODS)
            rows.append(
                (
                    f"g{i + 1}{j + 1} of the typical drive",
                    _number(typical["ideal"][i][j], digits),
                    "",
                    *(_number(value, digits) for value in cells),
                )
            )
    refused = sum(document[method]["refused"] for method in METHODS)
    sigma = document["trajectory"]["relative_sigma_median"]
    notes = [f"stated deviation of the whole drive, median: {sigma:.1%}"] if sigma else []
    notes += (
        [f"{refused} calibrations were refused; figures are over the others"] if refused else []
    )
    return Sheet(
        title=f"Table 2: g from {document['runs']} drives of a robot in MuJoCo",
        header=("", "surveyed", "paper, its robot", *(WORDS[method] for method in METHODS)),
        rows=tuple(rows),
        note="; ".join(notes),
    )


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"  # no -0.000


TABLE2 = Item(_compute, _sheet, DIFFERS)
"""Table 2, with the figures of section 3.2."""

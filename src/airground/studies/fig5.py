"""Figure 5: the error delta of image velocities over the trials of the simulation.

The paper computes image velocities "as represented in equation (17) for each of these simulation tests in the
presence of noise", and takes the norm of their difference from those "in the absence of all noise". It leaves open
which g stands in eq. 17, and how the samples of a trial become one number. Here delta is the mean, over the 8 samples
of a trial, of the length of the difference vector, with eq. 17 at the noisy positions and noisy ground velocities:

- "linear": with the g_hat that the trial itself estimated, which is what the words say;
- "ideal_g": with the true g, so that only the measurements are noisy;
- "trajectory": with all that the whole-drive estimate says: its g, its positions and its velocities.

The second gives the paper's figures, 2.70 and 2.66 px/s, and the first does not: see docs/paper.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.geometry.velocity import image_velocity
from airground.studies.item import Document, Item, Outcome, Work, unobservable_note
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from pathlib import Path

    from airground.geometry.arrays import FloatArray
    from airground.studies.simulation import Trials

__all__ = ["FIG5", "PAPER_DELTA", "delta"]

DIFFERS = (
    "The paper leaves open which g stands in eq. 17, and how samples become one number. Its figures come out when "
    "noisy measurements go through the ideal g, so that they show the noise and say little about the calibration; "
    "through each trial's own g, which is what its words say, the error is larger. The whole drive corrects the "
    "measurements too, and comes below the noise."
)

PAPER_DELTA = {"delta_mean_pxps": 2.7016, "delta_median_pxps": 2.6592}
"""Section 3.1, 100 trials."""


def delta(trials: Trials, g: FloatArray) -> FloatArray:
    """Error of the image velocities of each trial, by eq. 17 at its noisy measurements.

    Parameters
    ----------
    trials : Trials
        Measurements, and true image velocities.
    g : (3, 2) or (M, 3, 2) array
        What stands in eq. 17, scaled; one for all trials, or one for each.

    Returns
    -------
    delta : (M,) array [px/s]
        Mean length of the error over the trial's samples.
    """
    uv = np.stack([samples.uv for samples in trials.samples])
    xy_dot = np.stack([samples.xy_dot for samples in trials.samples])
    error = image_velocity(g[..., None, :, :], uv, xy_dot) - trials.ideal_uv_dot
    return np.asarray(np.linalg.norm(error, axis=-1).mean(axis=-1))


def _compute(work: Work) -> Outcome:
    outcome = work.simulation
    linear, ideal = delta(outcome, outcome.g_hat), delta(outcome, outcome.g)
    error = work.whole_drive.uv_dot - outcome.ideal_uv_dot
    whole = np.linalg.norm(error, axis=-1).mean(axis=-1)
    document: Document = {
        "paper": dict(PAPER_DELTA),
        "linear": _figures(linear),
        "trajectory": _figures(whole),
        "ideal_g": _figures(ideal),
        "trials": outcome.trials,
    }
    if outcome.unobservable:
        document["unobservable_trials"] = outcome.unobservable

    def draw(path: Path) -> None:
        from airground.pictures.histogram import Series, draw_histograms

        draw_histograms(
            path,
            [
                Series("Noisy measurements through the estimated g", linear),
                Series("Noisy measurements through the ideal g", ideal),
                Series("Whole drive: its g, positions and velocities", whole),
            ],
            xlabel="error of image velocities,  δ  [px/s]",
            paper_mean=PAPER_DELTA["delta_mean_pxps"],
            paper_median=PAPER_DELTA["delta_median_pxps"],
        )

    return Outcome(document, draw)


def _figures(values: FloatArray) -> dict[str, float]:
    return {
        "delta_mean_pxps": float(np.mean(values)),
        "delta_median_pxps": float(np.median(values)),
    }


def _sheet(document: Mapping[str, Any]) -> Sheet:
    columns = [document[key] for key in ("paper", "linear", "ideal_g", "trajectory")]
    return Sheet(
        title=f"Figure 5: error δ of image velocities [px/s], {document['trials']} trials",
        header=("", "paper", "linear", "ideal g", "whole drive"),
        rows=tuple(
            (name, *(f"{column[key]:.4f}" for column in columns))
            for name, key in (
                ("mean of δ", "delta_mean_pxps"),
                ("median of δ", "delta_median_pxps"),
            )
        ),
        note=unobservable_note(document),
    )


FIG5 = Item(_compute, _sheet, DIFFERS)
"""Figure 5."""

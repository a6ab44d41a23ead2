"""Starting the recursive estimator: from nothing, or anew from what is known by now."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.online_model import ImageFrame
from airground.calibration.online_start import refine, start
from airground.calibration.online_tracker import Prior, Tracker

if TYPE_CHECKING:
    from airground.calibration.online_intake import Intake
    from airground.calibration.online_recent import Recent
    from airground.calibration.online_state import OnlineOptions
    from airground.geometry.arrays import FloatArray

__all__ = ["begin", "begin_again"]


def begin(recent: Recent, intake: Intake, options: OnlineOptions) -> Tracker | None:
    """Start from nothing but recent data.

    Parameters
    ----------
    recent : Recent
        Sightings.
    intake : Intake
        That has the readings.
    options : OnlineOptions
        Noise and priors.

    Returns
    -------
    tracker : Tracker or None
        None while the data do not determine g.
    """
    recordings = recent.recordings(intake)
    if recordings is None:
        return None
    g = start(*recordings, sigma_px=options.sigma_px, time_offset_s=options.time_offset_s)
    if g is None:
        return None
    # Wrong sightings may be anywhere: the median is on the ground that was driven.
    uv = recent.uv()
    centre = np.median(uv, axis=0)
    spread = float(np.median(np.abs(uv - centre))) * 1.5
    image = ImageFrame(centre, 1.0 / max(spread, 1e-9))
    x = image.from_pixels(g)
    prior = np.zeros((6, 6))
    if options.time_offset_sigma_s > 0:
        x = np.append(x, options.time_offset_s)
        prior = np.diag(np.append(np.zeros(6), options.time_offset_sigma_s**-2))
    return _tracker(image, x, Prior(x, prior), recent=recent, intake=intake, options=options)


def begin_again(tracker: Tracker, recent: Recent, intake: Intake) -> Tracker | None:
    """Start anew from recent data at the present estimate, where the model is linearised better.

    Parameters
    ----------
    tracker : Tracker
        The estimator so far.
    recent : Recent
        All data since its prior, if no more came than it holds.
    intake : Intake
        That has the readings.

    Returns
    -------
    tracker : Tracker or None
        None if it would not converge.
    """
    return _tracker(
        tracker.image,
        tracker.filter.x,
        tracker.prior,
        recent=recent,
        intake=intake,
        options=tracker.options,
        covariance=tracker.filter.covariance,
    )


def _tracker(
    image: ImageFrame,
    x: FloatArray,
    prior: Prior,
    *,
    recent: Recent,
    intake: Intake,
    options: OnlineOptions,
    covariance: FloatArray | None = None,
) -> Tracker | None:
    offset = float(x[6]) if len(x) == 7 else options.time_offset_s
    pairs = recent.with_points(intake, offset)
    if not pairs:
        return None
    refined = refine(
        x,
        lambda later: recent.frames(intake, image, offset + later),
        prior.information,
        mean=prior.mean,
        covariance=covariance,
        bias_sigma=options.heading_bias_sigma_rad,
        bias_drift=options.heading_drift_rad_per_sqrt_s,
    )
    if refined is None:
        return None
    tracker = Tracker(refined, image, options, recent.last_times(), prior)
    tracker.used = round(refined.share * len(recent))
    tracker.refused = len(recent) - tracker.used
    for pair in pairs:
        tracker.note(pair)
    return tracker

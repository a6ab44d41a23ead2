"""From the state of the recursive estimator to a calibration."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.calibration import Calibration, Fit, TargetFit
from airground.calibration.linear import linear_system, null_vector
from airground.calibration.observability import judge, relative_sigma
from airground.errors import UnobservableMotionError
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    from airground.calibration.online_state import OnlineOptions
    from airground.calibration.online_tracker import Tracker

__all__ = ["as_calibration", "uncertainty"]

MOST = 200  # places to ask at


def uncertainty(tracker: Tracker, *, scale: bool = True) -> float:
    """Relative standard deviation of a ground velocity, where robots were seen, over all headings.

    Parameters
    ----------
    tracker : Tracker
        The estimator.
    scale : bool
        Whether to count the prior on the speeds' scale.

    Returns
    -------
    sigma : float
        Infinite where nothing can be said.
    """
    uv = tracker.coverage.uv()
    if len(uv) == 0:
        return math.inf
    covariance = tracker.covariance if scale else tracker.own_covariance
    sigma = relative_sigma(tracker.g, covariance, uv[:: 1 + len(uv) // MOST])
    return sigma if math.isfinite(sigma) else math.inf


def as_calibration(
    tracker: Tracker, names: list[str], options: OnlineOptions
) -> Calibration | None:
    """Give the calibration that the estimator stands for.

    Parameters
    ----------
    tracker : Tracker
        The estimator.
    names : list of str
        Of the robots.
    options : OnlineOptions
        What it was told.

    Returns
    -------
    calibration : Calibration or None
        None if a velocity computed from it would be a guess.
    """
    region = tracker.coverage.region
    if region is None or len(tracker.coverage) == 0:
        return None
    samples = tracker.coverage.samples(tracker.g)
    _, singular = null_vector(linear_system(samples)[0])
    try:
        observability = judge(tracker.g, tracker.covariance, samples, singular, 0.0)
    except UnobservableMotionError:
        return None
    filter_ = tracker.filter
    clock = len(filter_.x) == 7
    biased = options.heading_bias_sigma_rad > 0 or options.heading_drift_rad_per_sqrt_s > 0
    bias = [filter_.bias(k) if biased else (None, None) for k in range(len(names))]
    return Calibration(
        model=LimitedHomography(tracker.g),
        covariance=tracker.covariance,
        origin_px=tracker.image.centre,
        fit=Fit(
            method="trajectory",
            rms_px=tracker.rms_px,
            sightings=tracker.used,
            inlier_fraction=tracker.used / max(tracker.used + tracker.refused, 1),
            region_px=region if options.lens is None else None,
            nuisances=("clock",) * clock + ("heading_bias",) * biased,
        ),
        observability=observability,
        time_offset_s=float(filter_.x[6]) if clock else options.time_offset_s,
        time_offset_sigma_s=float(np.sqrt(filter_.covariance[6, 6])) if clock else 0.0,
        image_size_px=options.image_size_px,
        targets={
            name: TargetFit(
                sightings=None, heading_bias_rad=bias[k][0], heading_bias_sigma_rad=bias[k][1]
            )
            for k, name in enumerate(names)
        },
        lens=options.lens,
    )

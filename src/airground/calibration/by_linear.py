"""A calibration by the paper's linear method (eqs. 16 and 17), from recordings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.alignment import LinearFit, fit_linear, unexplained
from airground.calibration.calibration import Calibration, Fit, TargetFit
from airground.calibration.clock import ASSUMED_SIGMA, REACH, ClockFit, find_offset
from airground.calibration.correspondences import Correspondences, Pairing, pair_recordings
from airground.calibration.headings import advise, distinct_headings_deg
from airground.calibration.jackknife import jackknife_covariance
from airground.calibration.linear import RANK, require_rank
from airground.calibration.observability import judge
from airground.errors import InputError, UnobservableMotionError
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.calibration.recordings import Motion, Tracks
    from airground.calibration.samples import MotionSamples
    from airground.geometry.arrays import FloatArray

__all__ = ["calibrate_linear", "require_overlap"]

CLOCK_STEP = 0.05  # s; over which g's dependence on the clock is taken as a parabola
MAX_JACKKNIFE = 20_000  # samples
MIN_SAMPLES = 7  # leaving one out must still leave one more than the five that eq. 16 needs


def calibrate_linear(
    tracks: Tracks,
    motion: Motion,
    *,
    time_offset_s: float | None,
    image_size_px: tuple[int, int] | None,
    speed_scale_sigma: float,
    say: Callable[[str], None],
) -> Calibration:
    """Calibrate by eqs. 16 and 17 on velocities over short windows.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    time_offset_s : float or None [s]
        Clock offset; searched for where None.
    image_size_px : (int, int) or None [px]
        Kept with the calibration.
    speed_scale_sigma : float
        Relative standard deviation of the speeds' scale.
    say : callable
        Is given one-line remarks.

    Returns
    -------
    calibration : Calibration
        With its covariance and a verdict.

    Raises
    ------
    UnobservableMotionError
        If the motion does not determine g.
    InputError
        If tracks and motion do not belong together.
    """
    pairing = pair_recordings(tracks, motion)
    clock = find_offset(pairing) if time_offset_s is None else ClockFit(time_offset_s, found=False)
    data = pairing.at_offset(clock.offset)
    _enough(data, pairing, motion, clock.offset)
    fit = fit_linear(data)
    samples = fit.samples
    require_rank(fit.singular, samples)
    model = LimitedHomography(fit.g)

    # Neighbouring windows overlap, so a deviation does not need all of a long drive.
    few = pairing.thinned(MAX_JACKKNIFE)
    covariance, offset_sigma = _uncertainty(few, clock, fit, given=time_offset_s is not None)
    # g goes with the inverse cube root of the speeds' scale (eq. 17).
    row = model.g.ravel()
    covariance = covariance + (speed_scale_sigma / 3) ** 2 * np.outer(row, row)
    left_over = unexplained(model.g, samples)
    observability = judge(model.g, covariance, samples, fit.singular, left_over)

    if time_offset_s is None and not clock.found:
        say(
            f"the data do not show the clocks' offset within {REACH:g} s: taken as 0 with a deviation of "
            f"{ASSUMED_SIGMA:g} s; give --time-offset-s if you know it"
        )
    turned = fit.reference >= 0
    if not (turned or data.one_frame) and sum(count > 0 for count in data.sightings.values()) > 1:
        say(
            "the headings of all targets are taken as counted from one zero: no drive alone can tell"
        )
    origin = samples.uv.mean(axis=0)
    beyond = int(np.sum(~model.same_side(samples.uv, origin)))
    if beyond:
        say(
            f"{beyond} of {len(samples)} samples lie beyond the estimated horizon: look for wrong sightings"
        )
    used = {
        name: TargetFit(sightings=count, heading_bias_rad=-float(fit.turns[k]) if turned else None)
        for k, (name, count) in enumerate(data.sightings.items())
        if count
    }
    return Calibration(
        model=model,
        covariance=covariance,
        origin_px=origin,
        fit=Fit(
            method="linear",
            rms_px=_rms_px(model, samples, data.span),
            sightings=sum(data.sightings.values()),
            inlier_fraction=1.0,
            window_s=float(np.median(data.span)),
            region_px=_region(samples.uv),
        ),
        observability=observability,
        time_offset_s=clock.offset,
        time_offset_sigma_s=offset_sigma,
        image_size_px=image_size_px,
        targets=used,
    )


def _enough(data: Correspondences, pairing: Pairing, motion: Motion, offset: float) -> None:
    """Refuse what cannot be an estimate with an uncertainty."""
    count = len(data.samples)
    if count == 0:
        require_overlap(pairing, motion, offset)
    if count < MIN_SAMPLES:
        headings = distinct_headings_deg(data.samples.xy_dot)
        raise UnobservableMotionError(
            f"there are {count} motion samples, and {MIN_SAMPLES} are needed to state an uncertainty",
            rank=min(count, RANK),
            headings_deg=headings,
            advice=advise(headings),
        )


def require_overlap(pairing: Pairing, motion: Motion, offset: float) -> None:
    """Say why no velocities could be had.

    Parameters
    ----------
    pairing : Pairing
        Sightings and readings.
    motion : Motion
        Readings.
    offset : float [s]
        Clock offset.

    Raises
    ------
    InputError
        Always: the reason.
    """
    name = pairing.targets[pairing.pairs[0].index]
    seen, read = pairing.pairs[0].t, motion.t[motion.rows(name)]
    if seen[0] + offset <= read[-1] and seen[-1] + offset >= read[0]:
        raise InputError(
            f"no two sightings of {name} fall into one unbroken stretch of its readings: they are too far apart, "
            "or it turned by more than 90 degrees from one reading to the next; record them more often"
        )
    raise InputError(
        f"no sightings of {name} fall between its readings: tracks {seen[0]:g}..{seen[-1]:g} s, "
        f"motion {read[0]:g}..{read[-1]:g} s, offset {offset:g} s; both files need one clock"
    )


def _uncertainty(
    pairing: Pairing, clock: ClockFit, fit: LinearFit, *, given: bool
) -> tuple[FloatArray, float]:
    """Covariance of g with the clock's uncertainty in it, and the clock's deviation."""
    data = pairing.at_offset(clock.offset)
    shifted = None if given else _shifted(pairing, data, clock.offset)
    if shifted is None:
        return jackknife_covariance(data, fit)[:6, :6], 0.0 if given else ASSUMED_SIGMA
    middle, earlier, later = shifted
    if clock.found:
        joint = jackknife_covariance(middle, fit, (earlier, later), CLOCK_STEP)
        return joint[:6, :6], float(np.sqrt(joint[6, 6]))
    alone = jackknife_covariance(data, fit)[:6, :6]
    slope = (fit_linear(later, like=fit).g - fit_linear(earlier, like=fit).g).ravel() / (
        2 * CLOCK_STEP
    )
    return alone + ASSUMED_SIGMA**2 * np.outer(slope, slope), ASSUMED_SIGMA


def _shifted(
    pairing: Pairing, data: Correspondences, offset: float
) -> tuple[Correspondences, Correspondences, Correspondences] | None:
    """Windows that have readings at the offset, a step before and a step after it."""
    three = (data, pairing.at_offset(offset - CLOCK_STEP), pairing.at_offset(offset + CLOCK_STEP))
    common = three[0].window
    for other in three[1:]:
        common = np.intersect1d(common, other.window, assume_unique=True)
    if len(common) < MIN_SAMPLES:
        return None
    middle, earlier, later = (c.take(np.isin(c.window, common)) for c in three)
    return middle, earlier, later


def _rms_px(model: LimitedHomography, samples: MotionSamples, span: FloatArray) -> float:
    """How far from the prediction targets moved within a window, per coordinate."""
    predicted = model.image_velocity(samples.uv, samples.xy_dot)
    return float(np.sqrt(np.mean(((samples.uv_dot - predicted) * span[:, None]) ** 2)))


def _region(uv: FloatArray) -> tuple[float, float, float, float]:
    (u0, v0), (u1, v1) = uv.min(axis=0), uv.max(axis=0)
    return float(u0), float(v0), float(u1), float(v1)

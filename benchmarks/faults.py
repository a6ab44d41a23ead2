"""How often the whole-drive calibration is right, refused or wrong on spoiled recordings, by fault and drive.

A wrong answer is one whose error its own covariance does not cover: a Mahalanobis distance beyond the quantile of
chance 1e-4 (chi-square, 6 degrees of freedom), or n of more than five stated deviations. `wrong` is with the usual
prior on the speed's scale, `strict` with a scale that is known exactly, so that the data alone must be honest;
`spread` is the root mean square of the whitened error with that, 1 where the covariance is the truth. Headings that
have no zero of their own (drift, biases) are compared up to a turn of the ground.
"""

from __future__ import annotations

import argparse
import os
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import chi2  # type: ignore[import-untyped,unused-ignore]

from airground.calibration import Motion, calibrate
from airground.errors import AirgroundError, UnobservableMotionError
from airground.geometry import align_rotation, n_error
from airground.sim.recordings import Recording, RecordingNoise, RecordingPlan, record

if TYPE_CHECKING:
    from airground.calibration import Calibration
    from airground.geometry import FloatArray

__all__ = ["DRIVES", "FAULTS", "Fault", "Outcome", "outcome", "spoiled"]

DURATION_S = 40.0
NOISE = RecordingNoise(
    tracks_hz=20.0,
    motion_hz=20.0,
    pixel_px=1.0,
    speed_share=0.05,
    heading_rad=0.03,
    time_offset_s=0.1,
)
DRIVES = {"figure_eight": 35.0, "rectangle": 55.0, "random_turns": 20.0, "lawn_mower": 65.0}
"""Tilt of the camera over each [deg]."""

QUANTILE = float(chi2.isf(1e-4, 6))
MOST_DEVIATIONS = 5.0
USUAL_SCALE = 0.02 / 3  # the default prior's deviation of g, along g


@dataclass(frozen=True)
class Fault:
    """One way to spoil a recording."""

    noise: dict[str, Any] = field(default_factory=dict)
    """Beside `NOISE`."""

    plan: dict[str, Any] = field(default_factory=dict)
    """Beside drive, tilt and duration."""

    options: dict[str, Any] = field(default_factory=dict)
    """Of `calibrate`."""

    lost: tuple[tuple[float, float], ...] = ()
    """From when to when there are no readings [s]."""

    turns: bool = False
    """Whether the ground frame may be turned."""


def without(motion: Motion, *spans: tuple[float, float]) -> Motion:
    """Give the readings outside some spans of time [s]."""
    keep = np.ones(len(motion), dtype=bool)
    for start, end in spans:
        keep &= (motion.t < start) | (motion.t >= end)

    def some(column: FloatArray | None) -> FloatArray | None:
        return None if column is None else column[keep]

    return Motion(
        motion.targets,
        motion.target_index[keep],
        motion.t[keep],
        xy_dot=some(motion.xy_dot),
        heading=some(motion.heading),
        speed=some(motion.speed),
        distance=some(motion.distance),
        sigma_speed=some(motion.sigma_speed),
        sigma_heading=some(motion.sigma_heading),
    )


PAIR = {"robots": 2}
FAULTS = {
    "none": Fault(),
    "outliers 20 %": Fault({"outlier_share": 0.2}),
    "outliers 50 %": Fault({"outlier_share": 0.5}),
    "swapped 30 %": Fault({"swapped_s": (10.0, 22.0)}, PAIR),
    "stuck 4 s": Fault({"stuck_s": (12.0, 16.0)}),
    "duplicates 20 %": Fault({"duplicate_share": 0.2}),
    "whole pixels": Fault({"whole_pixels": True, "pixel_px": 0.0}),
    "dropouts 30 %": Fault({"dropout_share": 0.3, "dropout_s": 1.0}),
    "gaps in readings": Fault(lost=((6.0, 9.0), (18.0, 20.0), (30.0, 31.0))),
    "late readings": Fault(lost=((-10.0, 15.0),)),
    "two zeros, scales": Fault(
        {"heading_bias_rad": (0.0, 1.2), "speed_scale": (0.99, 1.02)}, PAIR, turns=True
    ),
    "zeros 6 deg apart": Fault({"heading_bias_rad": (0.0, 0.1)}, PAIR, turns=True),
    "offset -0.3 s": Fault({"time_offset_s": -0.3}),
    "offset +0.5 s": Fault({"time_offset_s": 0.5}),
    "lens": Fault({"lens_k1": -0.1}),
    "lens ignored": Fault({"lens_k1": -0.1}, options={"distortion": "none"}),
    "lever": Fault({"lever_m": (0.2, 0.05)}),
    "drift": Fault({"heading_drift": 0.01}, turns=True),
    "slip": Fault({"slip": 0.05}),
    "all mild": Fault(
        {
            "outlier_share": 0.05,
            "duplicate_share": 0.05,
            "dropout_share": 0.1,
            "slip": 0.03,
            "heading_drift": 0.005,
            "whole_pixels": True,
            "lens_k1": -0.05,
        },
        turns=True,
    ),
}


@dataclass(frozen=True)
class Outcome:
    """What became of one recording."""

    verdict: str
    """ok, weak or refused; crash for an error that is not about observability."""

    n: float = np.nan
    """Error (eq. 22)."""

    stated: float = np.nan
    """Its stated deviation, with the usual prior on the scale."""

    squared: float = np.nan
    """Squared Mahalanobis distance, with the usual prior."""

    strict: float = np.nan
    """The same, with the scale known."""

    seconds: float = np.nan
    """Processor time [s]."""

    told: str = ""
    """The error's message."""

    @property
    def wrong(self) -> bool:
        """Whether the stated covariance does not cover the error."""
        return self.squared > QUANTILE or self.n > MOST_DEVIATIONS * self.stated


def spoiled(fault: Fault, drive: str, seed: int) -> Recording:
    """Record a drive with a fault."""
    plan = RecordingPlan(drive=drive, tilt_deg=DRIVES[drive], duration_s=DURATION_S)
    found = record(replace(plan, **fault.plan), replace(NOISE, **fault.noise), seed=seed)
    return replace(found, motion=without(found.motion, *fault.lost)) if fault.lost else found


def truth_for(recording: Recording, result: Calibration) -> FloatArray:
    """Give the truth in the ground frame that the reference robot's headings span."""
    names = [
        name for name, fit in result.targets.items() if not fit.heading_bias_sigma_rad
    ]  # of those not estimated the frame is
    angle = -float(recording.truth.heading_bias[int(names[0].removeprefix("robot-")) - 1])
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(recording.truth.g @ np.array([[cos, -sin], [sin, cos]]))


def nearest_turn(truth: FloatArray, g: FloatArray, covariance: FloatArray) -> FloatArray:
    """Turn the truth's ground frame so that the estimate's whitened error is least."""
    _, angle = align_rotation(g, truth)
    weight = np.linalg.inv(covariance)
    for _ in range(5):
        cos, sin = np.cos(angle), np.sin(angle)
        error = (truth @ np.array([[cos, -sin], [sin, cos]]) - g).ravel()
        slope = (truth @ np.array([[-sin, -cos], [cos, -sin]])).ravel()
        angle -= float(slope @ weight @ error) / float(slope @ weight @ slope)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(truth @ np.array([[cos, -sin], [sin, cos]]))


def outcome(fault: Fault, drive: str, seed: int) -> Outcome:
    """Calibrate on one spoiled recording."""
    recording = spoiled(fault, drive, seed)
    scale = 0.02 if "speed_scale" in fault.noise else 0.0
    started = time.process_time()
    try:
        result = calibrate(
            recording.tracks,
            recording.motion,
            image_size_px=recording.plan.image_size_px,
            speed_scale_sigma=scale,
            **fault.options,
        )
    except (AirgroundError, ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
        verdict = "refused" if isinstance(error, UnobservableMotionError) else "crash"
        return Outcome(verdict, seconds=time.process_time() - started, told=repr(error))
    g, own = result.model.g, result.covariance
    usual = own if scale else own + USUAL_SCALE**2 * np.outer(g.ravel(), g.ravel())
    truth = truth_for(recording, result)
    if fault.turns:
        truth = nearest_turn(truth, g, usual)
    off = (g - truth).ravel()
    return Outcome(
        result.observability.verdict,
        float(n_error(truth, g)),
        float(np.sqrt(np.trace(usual)) / np.linalg.norm(truth)),
        float(off @ np.linalg.solve(usual, off)),
        float(off @ np.linalg.solve(own, off)),
        time.process_time() - started,
    )


def row(found: list[Outcome]) -> str:
    """Sum up one fault on one drive."""
    answers = [o for o in found if np.isfinite(o.n)]
    refused = np.mean([o.verdict == "refused" for o in found])
    crashed = np.mean([o.verdict == "crash" for o in found])
    if not answers:
        return f"{refused:8.0%}{crashed:8.0%}" + "       -" * 7
    weak = np.mean([o.verdict == "weak" for o in found])
    n, stated = (np.median([getattr(o, k) for o in answers]) for k in ("n", "stated"))
    spread = np.sqrt(np.median([o.strict for o in answers]) / chi2.median(6))
    wrong = np.mean([o.wrong for o in found])
    strict = np.mean([o.strict > QUANTILE for o in found])
    seconds = np.mean([o.seconds for o in found])
    return (
        f"{refused:8.0%}{crashed:8.0%}{weak:8.0%}{n:8.4f}{stated:8.4f}{max(o.n for o in answers):8.3f}"
        f"{spread:8.2f}{wrong:8.0%}{strict:8.0%}{seconds:8.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="recordings for each row")
    parser.add_argument("--fault", action="append", choices=FAULTS, help="only these")
    parser.add_argument("--drive", action="append", choices=DRIVES, help="only these")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    parser.add_argument("--verbose", action="store_true", help="name the wrong ones")
    args = parser.parse_args()
    columns = (
        "refused",
        "crash",
        "weak",
        "n",
        "stated",
        "worst n",
        "spread",
        "wrong",
        "strict",
        "s",
    )
    print(f"{'fault':18}{'drive':13}" + "".join(f"{c:>8}" for c in columns))
    with ProcessPoolExecutor(args.jobs) as pool:
        for name in args.fault or FAULTS:
            for drive in args.drive or DRIVES:
                found = list(
                    pool.map(
                        outcome,
                        [FAULTS[name]] * args.seeds,
                        [drive] * args.seeds,
                        range(args.seeds),
                    )
                )
                print(f"{name:18}{drive:13}{row(found)}", flush=True)
                for seed, o in enumerate(found):
                    if args.verbose and (o.wrong or o.strict > QUANTILE or o.told):
                        print(f"    seed {seed}: {o}", flush=True)


if __name__ == "__main__":
    main()

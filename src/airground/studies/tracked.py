"""The paper's drive, tracked at 30 fps and calibrated from recordings: ``python -m airground.studies.tracked``.

Noise as in section 3.1, drawn anew for every frame and every reading. Nothing is told to `calibrate` but the
recordings: noise levels and the clocks' offset are estimated.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from airground.calibration.calibrate import calibrate
from airground.calibration.recordings import Motion, Tracks
from airground.errors import UnobservableMotionError
from airground.geometry.arrays import FloatArray
from airground.geometry.metrics import n_error
from airground.studies.simulation import PAPER, PaperSimulation, trial_generators
from airground.studies.tracked_bound import tracked_bound

__all__ = ["main", "tracked_errors", "tracked_recording"]

RATES_HZ = (30.0, 20.0, 10.0)
MARGIN_S = (
    0.5  # readings begin before the tracks and end after them, as the clocks are not known to agree
)


def tracked_recording(
    rng: np.random.Generator,
    simulation: PaperSimulation = PAPER,
    *,
    tracks_hz: float = 30.0,
    motion_hz: float = 30.0,
) -> tuple[Tracks, Motion]:
    """Record the paper's drive.

    Parameters
    ----------
    rng : Generator
        Where the noise comes from.
    simulation : PaperSimulation
        Drive and noise.
    tracks_hz : float
        Sightings a second.
    motion_hz : float
        Readings a second.

    Returns
    -------
    tracks : Tracks
        Sightings with uniform noise.
    motion : Motion
        Ground velocities with uniform noise.
    """
    drive, bound = simulation.drive, simulation.speed_bound_mps
    t = np.arange(round(drive.total_s * tracks_hz) + 1) / tracks_hz
    uv = simulation.camera().project(drive.at(t)[0])
    uv = uv + rng.uniform(-simulation.pixel_bound_px, simulation.pixel_bound_px, uv.shape)
    margin = round(MARGIN_S * motion_hz)
    read = np.arange(-margin, round(drive.total_s * motion_hz) + margin + 1) / motion_hz
    segment = np.clip(np.floor(read / drive.duration_s).astype(int), 0, drive.segments - 1)
    xy_dot = drive.xy_dot[segment]
    xy_dot = xy_dot + rng.uniform(-bound, bound, xy_dot.shape)
    names = np.full(max(len(t), len(read)), "robot")
    return (
        Tracks.from_rows(t, names[: len(t)], uv),
        Motion.from_rows(read, names[: len(read)], xy_dot=xy_dot),
    )


def tracked_errors(
    trials: int, seed: int = 0, *, motion_hz: float = 30.0, method: str = "trajectory"
) -> FloatArray:
    """Error n of g (eq. 22), trial by trial.

    Parameters
    ----------
    trials : int
        How many.
    seed : int
        Of all of them.
    motion_hz : float
        Readings a second.
    method : str
        As `calibrate` takes it.

    Returns
    -------
    n : (M,) array
        Infinite where a calibration was refused.
    """
    truth = PAPER.camera().g
    found = []
    for rng in trial_generators(seed, trials):
        tracks, motion = tracked_recording(rng, motion_hz=motion_hz)
        try:
            calibration = calibrate(tracks, motion, method=method, speed_scale_sigma=0.0)  # type: ignore[arg-type]
        except UnobservableMotionError:
            found.append(np.inf)
        else:
            found.append(float(n_error(truth, calibration.model)))
    return np.array(found)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table.

    Parameters
    ----------
    arguments : sequence of str, optional
        Command line.
    """
    parser = argparse.ArgumentParser(description="The paper's drive, tracked at 30 fps")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(arguments)
    print(f"{'readings':>10} {'n_mean':>8} {'median':>8} {'linear':>8} {'bound':>8}")
    for rate in RATES_HZ:
        n = tracked_errors(args.trials, args.seed, motion_hz=rate)
        linear = tracked_errors(args.trials, args.seed, motion_hz=rate, method="linear")
        bound = tracked_bound(motion_hz=rate).n_rms
        known = linear[np.isfinite(linear)]
        mean = f"{np.mean(known):8.4f}" if len(known) else " refused"
        print(
            f"{rate:7.0f} Hz {np.mean(n):8.4f} {np.median(n):8.4f} {mean} {bound:8.4f}", flush=True
        )


if __name__ == "__main__":
    main()

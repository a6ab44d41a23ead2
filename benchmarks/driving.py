"""What a calibration costs in driving, and what latency costs: the same sketch with an estimated and with the true g.

For each tilt of the camera, several calibration drives of the paper's length (eight segments of 5 s at 0.12 m/s,
tracked at 30 Hz with 1 px of noise, odometry with 2 % slip), then a sketch across the driven region, followed in closed
loop: sightings at 20 Hz with 1 px of white noise, 10 % slow noise on the odometry, 50 ms to the wheels. Each drive is
done with the estimated g and with the true one, 100 ms late and not late at all, all with the same noise; and with the
delay but without allowing for it. Distances are from the path as released, by brute force. Goals: from the end of the
path to three pixels.

Run: python benchmarks/driving.py [--seeds 4]
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from multiprocessing import Pool

import numpy as np

from airground.calibration import calibrate
from airground.control import PointToPoint
from airground.geometry import LimitedHomography, n_error
from airground.geometry.arrays import FloatArray
from airground.sim.recording_noise import RecordingNoise
from airground.sim.recording_plan import RecordingPlan
from airground.sim.recordings import Recording, record
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.driving_world import DrivingWorld
from airground.studies.path_drive import followed, released
from airground.studies.rig import Rig
from airground.studies.rig_options import LAG_S, RigOptions, limits_for

TILTS = (0, 15, 30, 45, 60)
LATE = RigOptions(sigma_px=1.0)
PROMPT = replace(LATE, latency_s=0.0, actuation_s=0.0)
BLIND = replace(LATE, predict=False)
NOISE = RecordingNoise(
    pixel_px=1.0, speed_mps=0.003, heading_rad=0.02, slip=0.02, time_offset_s=0.05
)


@dataclass(frozen=True)
class Case:
    """What one calibration and its drives gave."""

    tilt: int
    n: float
    estimated_m: float
    true_m: float
    prompt_m: float
    blind_m: float
    estimated_px: float
    goals_px: tuple[float, ...]
    goals_m: tuple[float, ...]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4, help="calibration drives for each tilt")
    seeds = parser.parse_args().seeds
    with Pool() as pool:
        cases = pool.map(case, [(tilt, seed) for tilt in TILTS for seed in range(seeds)], 1)
    print(
        "tilt       n   estimated g   true g  ratio   not late  ratio   not predicted   goals: worst"
    )
    for tilt in TILTS:
        show(f"{tilt:4d}", [one for one in cases if one.tilt == tilt])
    show(" all", cases)


def show(name: str, cases: list[Case]) -> None:
    """Root mean squares over the drives, as drives with the same noise are compared."""
    n = np.median([one.n for one in cases])
    est, true, prompt, blind = (
        100 * rms(np.array([getattr(one, key) for one in cases]))
        for key in ("estimated_m", "true_m", "prompt_m", "blind_m")
    )
    px = max(max(one.goals_px) for one in cases)
    m = max(max(one.goals_m) for one in cases)
    print(
        f"{name}  {n:.4f}   {est:7.3f} cm {true:6.3f} cm {est / true:6.3f}  {prompt:6.3f} cm "
        f"{est / prompt:6.2f}   {blind:9.3f} cm   {px:5.2f} px {100 * m:5.2f} cm"
    )


def case(job: tuple[int, int]) -> Case:
    tilt, seed = job
    plan = RecordingPlan(
        drive="eight_segments",
        tilt_deg=float(tilt),
        duration_s=None,
        speed_mps=0.12,
        height_m=3.0,
        image_size_px=(1024, 768),
    )
    recording = record(plan, NOISE, seed=np.random.default_rng([seed, tilt]))
    calibration = calibrate(recording.tracks, recording.motion, image_size_px=plan.image_size_px)
    world, truth = world_of(recording), LimitedHomography(recording.truth.camera.g)
    sketch = sketch_in(recording)
    offset = NOISE.time_offset_s
    runs = {
        "estimated": (calibration.model, calibration.covariance, LATE, calibration.time_offset_s),
        "true": (truth, None, LATE, offset),
        "prompt": (truth, None, PROMPT, offset),
        "blind": (truth, None, BLIND, offset),
    }
    off: dict[str, tuple[float, float]] = {}
    goals: list[tuple[float, float]] = []
    for name, (model, covariance, options, clock) in runs.items():
        rig = Rig(
            world,
            model,
            covariance,
            limits=limits_for(0.15),
            options=options,
            seed=seed,
            time_offset_s=clock,
        )
        path = released(rig, sketch)
        drives, _, _ = followed(rig, path, lambda _: None)
        assert len(drives) == 2, drives[0].trouble
        line = world.camera.unproject(path.uv)
        off[name] = (
            rms(distance_to_line(drives[1].xy, line)),
            rms(distance_to_line(drives[1].uv, path.uv)),
        )
        if name == "estimated":
            goals = to_goals(rig, sketch)
    return Case(
        tilt,
        float(n_error(truth, calibration.model)),
        off["estimated"][0],
        off["true"][0],
        off["prompt"][0],
        off["blind"][0],
        off["estimated"][1],
        tuple(px for px, _ in goals),
        tuple(m for _, m in goals),
    )


def world_of(recording: Recording) -> DrivingWorld:
    """The camera of the recording, and the robot where its drive has ended."""
    truth = recording.truth
    x, y = truth.axle.xy[-1].tolist()
    return DrivingWorld(
        "paper",
        camera=truth.camera,
        lens=None,
        ground_uv=recording.tracks.uv[-1],
        start_m=(x, y),
        heading_rad=float(truth.axle.theta[-1]),
        speed_mps=0.12,
        clock_offset_s=NOISE.time_offset_s,
    )


def sketch_in(recording: Recording) -> FloatArray:
    """A wave across the driven region, drawn by hand."""
    low, high = recording.tracks.uv.min(axis=0), recording.tracks.uv.max(axis=0)
    share = np.linspace(0.0, 1.0, 90)
    u = low[0] + (0.1 + 0.8 * share) * (high[0] - low[0])
    v = (low + high)[1] / 2 + 0.25 * (high - low)[1] * np.sin(3 * np.pi * share)
    tremble = np.random.default_rng(0).normal(0.0, 1.0, (90, 2))
    return np.asarray(np.column_stack([u, v]) + tremble)


def to_goals(rig: Rig, sketch: FloatArray) -> list[tuple[float, float]]:
    """Errors in the image and on the ground at three goals."""
    found = []
    for goal in (sketch[30], sketch[60], sketch[5]):
        drive = rig.drive(
            PointToPoint(rig.floor, goal[None], rig.limits, response_s=LAG_S), most_s=60
        )
        assert drive.done, drive.trouble
        found.append(rig.stands_off(goal))
    return found


if __name__ == "__main__":
    main()

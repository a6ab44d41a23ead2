"""The recursive estimator: time of a sighting, a hundred robots on one core, and agreement with the batch.

Run with OMP_NUM_THREADS=1. Times are of the processor, as the machine may be shared; the start's cost is in them.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from airground.calibration import calibrate
from airground.calibration.online import OnlineCalibrator
from airground.calibration.online_state import OnlineOptions
from airground.sim.recordings import RecordingNoise, RecordingPlan, record

NOISE = RecordingNoise(pixel_px=1.0, speed_share=0.05, heading_rad=0.05)
OPTIONS = OnlineOptions(speed_scale_sigma=0.0)


def one_robot() -> None:
    recording = record(RecordingPlan(duration_s=120.0), NOISE, seed=1)
    tracks, motion = recording.tracks, recording.motion
    assert motion.heading is not None
    assert motion.speed is not None
    rows = [(float(t), 0, i) for i, t in enumerate(motion.t)]
    rows += [(float(t), 1, i) for i, t in enumerate(tracks.t)]
    calibrator = OnlineCalibrator(OPTIONS)
    spent = []
    for t, sighting, i in sorted(rows):
        started = time.process_time()
        if sighting:
            calibrator.sighting(t, "robot-1", tracks.uv[i])
        else:
            calibrator.reading(
                t, "robot-1", heading=float(motion.heading[i]), speed=float(motion.speed[i])
            )
        spent.append((sighting, time.process_time() - started))
    of_sighting = np.array([s for kind, s in spent if kind]) * 1e6
    of_reading = np.array([s for kind, s in spent if not kind]) * 1e6
    late = of_sighting[
        len(of_sighting) // 2 :
    ]  # a call uses what the calls before left, so means count
    print(
        f"one robot: sighting {late.mean():.0f} us, {of_sighting.mean():.0f} us with the start's cost in it, "
        f"longest {of_sighting.max() / 1e3:.0f} ms; reading median {np.median(of_reading):.0f} us"
    )


def many_robots(count: int = 100, hz: float = 50.0, duration_s: float = 10.0) -> None:
    plan = RecordingPlan(drive="figure_eight", robots=count, speed_mps=0.5, duration_s=duration_s)
    recording = record(plan, replace(NOISE, tracks_hz=hz, motion_hz=hz), seed=1)
    tracks, motion = recording.tracks, recording.motion
    assert motion.heading is not None
    assert motion.speed is not None
    names = [motion.targets[k] for k in motion.target_index]
    readings: dict[float, list[int]] = {}
    for i, t in enumerate(np.round(motion.t, 6)):
        readings.setdefault(float(t), []).append(i)
    frames: dict[float, list[int]] = {}
    for i, t in enumerate(np.round(tracks.t, 6)):
        frames.setdefault(float(t), []).append(i)
    calibrator = OnlineCalibrator(OPTIONS)
    per_second = [0.0]
    for t in sorted({*readings, *frames}):
        while t >= len(per_second):
            per_second.append(0.0)
        started = time.process_time()
        for i in readings.get(t, ()):
            calibrator.reading(
                t, names[i], heading=float(motion.heading[i]), speed=float(motion.speed[i])
            )
        if t in frames:
            rows = frames[t]
            calibrator.frame(
                t, [tracks.targets[tracks.target_index[i]] for i in rows], tracks.uv[rows]
            )
        per_second[-1] += time.process_time() - started
    calmed = per_second[len(per_second) // 2 :]
    print(
        f"{count} robots at {hz:g} Hz: {np.mean(calmed):.2f} of real time, the worst second {max(per_second):.2f} "
        f"({calibrator.state.counts.used} sightings used)"
    )


def agreement(trials: int = 5) -> None:
    print(
        "distance from the batch estimate, in its deviations (root mean square of six), and n of both"
    )
    for drive, tilt in (("figure_eight", 20.0), ("rectangle", 45.0), ("random_turns", 65.0)):
        off, n_online, n_batch = [], [], []
        for seed in range(trials):
            plan = RecordingPlan(drive=drive, tilt_deg=tilt, duration_s=90.0)
            recording = record(plan, replace(NOISE, tracks_hz=15.0), seed=seed)
            calibrator = OnlineCalibrator(OPTIONS)
            tracks, motion = recording.tracks, recording.motion
            assert motion.heading is not None
            assert motion.speed is not None
            for t, heading, speed in zip(motion.t, motion.heading, motion.speed, strict=True):
                calibrator.reading(t, "robot-1", heading=heading, speed=speed)
            for t, uv in zip(tracks.t, tracks.uv, strict=True):
                calibrator.sighting(t, "robot-1", uv)
            found = calibrator.calibration()
            if found is None:
                print(f"  {drive}, seed {seed}: no calibration")
                continue
            batch = calibrate(
                tracks, motion, time_offset_s=0.0, distortion="none", speed_scale_sigma=0.0
            )
            e = (found.model.g - batch.model.g).ravel()
            size = np.sqrt(np.diag(batch.covariance))
            C = batch.covariance / np.outer(size, size)
            off.append(np.sqrt(e / size @ np.linalg.solve(C, e / size) / 6))
            g = recording.truth.g
            n_online.append(np.linalg.norm(found.model.g - g) / np.linalg.norm(g))
            n_batch.append(np.linalg.norm(batch.model.g - g) / np.linalg.norm(g))
        print(
            f"  {drive:14} tilt {tilt:2.0f}: median {np.median(off):.2f}, largest {max(off):.2f}; "
            f"n {np.median(n_online):.5f} and {np.median(n_batch):.5f}"
        )


if __name__ == "__main__":
    one_robot()
    many_robots()
    agreement()

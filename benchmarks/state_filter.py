"""What the state filter knows when a command takes effect, by the age of sightings and by what else is measured.

A robot drives loops of changing speed and curvature in the demo's view for 14 s, and stands for one of them. Sightings,
30 a second with 1 px of noise, arrive late by the latency and up to 10 ms of jitter. Readings, 30 a second, have 10 %
of noise and an unknown scale (10 %); the compass has 3 degrees of noise and an unknown bias (3 degrees). Commands take
effect after 50 ms, the vehicle lags behind them by 150 ms in speed and 100 ms in turn rate, and strays by 8 %.

Errors are rms at the time when the command takes effect, from 3 s on, over all seeds. `lagging` is the same filter's
position at its newest sighting, taken as if it were now, as a controller without prediction would. NEES is 1 where the
covariance is right, and below where it says too much. Ready is when position and heading are known. Times are medians
over a drive's ticks of the least in 7 runs: of a tick (all that arrived, a prediction, a command sent), and of another
prediction alone.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from airground.control.estimation.options import StateOptions
from airground.control.estimation.state_filter import StateFilter
from late_drive import FLOOR, TICK, Event, LateDrive, nees, position_error

SEEDS = 6
REPEATS = 7
SOURCES = {
    "compass+odometry": ("compass", "odometry"),
    "odometry": ("odometry",),
    "image only": (),
}


def main() -> None:
    print(f"{SEEDS} drives each; actuation 50 ms in addition to the latency")
    print(
        f"{'sources':>17} {'latency':>8} {'lagging':>9} {'position':>9} {'heading':>8} {'speed':>9} "
        f"{'turn':>8} {'NEES':>5} {'ready':>6} {'tick':>8} {'predict':>8}"
    )
    for name, sources in SOURCES.items():
        for latency in (0.0, 0.05, 0.1, 0.2):
            rows: list[list[float]] = []
            ready = []
            for seed in range(SEEDS):
                drive = LateDrive(np.random.default_rng(seed), latency_s=latency, sources=sources)
                told, first = _drive(drive)
                rows += told
                ready.append(first)
            tick, predict = _timed(latency, sources)
            rms = np.sqrt(np.mean(np.square(rows), axis=0))
            print(
                f"{name:>17} {latency * 1e3:5.0f} ms {rms[0] * 100:6.2f} cm {rms[1] * 100:6.2f} cm "
                f"{np.degrees(rms[2]):4.2f} deg {rms[3] * 100:4.2f} cm/s {np.degrees(rms[4]):4.1f} d/s "
                f"{np.mean(np.array(rows)[:, 5]):5.2f} {np.median(ready):4.1f} s "
                f"{tick * 1e6:5.0f} us {predict * 1e6:5.0f} us",
                flush=True,
            )


def _drive(drive: LateDrive) -> tuple[list[list[float]], float]:
    rows, first = [], np.inf
    for now, state_filter, state in drive.driven(StateOptions()):
        if not state_filter.ready:
            continue
        first = min(first, now)
        if now < 3.0:
            continue
        truth = drive.at(now + drive.actuation_s)
        turned = np.angle(np.exp(1j * (state.theta - truth[2])))
        rows.append(
            [
                position_error(state_filter.predict(state.seen_t), truth),
                position_error(state, truth),
                turned,
                state.v - truth[3],
                state.omega - truth[4],
                nees(state, truth),
            ]
        )
    return rows, first


def _timed(latency: float, sources: tuple[str, ...]) -> tuple[float, float]:
    """Median over the ticks of a drive, of the least time that each took when repeated."""
    drive = LateDrive(np.random.default_rng(0), latency_s=latency, sources=sources, duration_s=4.0)
    events = drive.events()
    runs = np.array([_clocked(drive, events) for _ in range(REPEATS)])
    tick, predict = np.median(runs.min(axis=0)[45:], axis=0)
    return float(tick), float(predict)


def _clocked(drive: LateDrive, events: list[Event]) -> list[tuple[float, float]]:
    state_filter, done, spent = StateFilter(FLOOR), 0, []
    for k in range(round(drive.duration_s / TICK)):
        now = k * TICK
        command = drive.program(now)
        times = [time.perf_counter()]
        while done < len(events) and events[done][0] <= now:
            _, what, arguments = events[done]
            getattr(state_filter, what)(**arguments)
            done += 1
        state_filter.predict(now + drive.actuation_s)
        state_filter.sent(now, command)
        times.append(time.perf_counter())
        state_filter.predict(now + drive.actuation_s)
        times.append(time.perf_counter())
        spent.append((times[1] - times[0], times[2] - times[1]))
    return spent


if __name__ == "__main__":
    main()

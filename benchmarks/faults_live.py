"""The fault table of docs/faults.md, in simulated time: how long until a robot is told to stand, and until it stands.

    python benchmarks/faults_live.py [phases of each fault]

A robot of the embedded world is on its way to a goal at 0.3 m/s, pictures come at 20 Hz with 60 ms of latency, commands
go out at 50 Hz. Each fault comes at another phase of camera and control loop, with other noise. Median and worst, in
seconds after the fault; a dash where that does not happen.
"""

from __future__ import annotations

import sys
from math import inf, isfinite
from multiprocessing import Pool
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from session_faults import FAULTS, with_fault


def times(task: tuple[str, int]) -> tuple[str, float, float, float]:
    name, k = task
    fault = FAULTS[name]
    _, answer = with_fault(fault, 0.02 * (7 * k % 11), 100 + k)
    still_s = answer.still_s if isfinite(fault.still_s) else inf
    return name, answer.rest_s, still_s, answer.stop_s


def shown(values: list[float]) -> str:
    if not any(map(isfinite, values)):
        return "-"
    worst = max(values)
    return f"{np.median(values):.2f} / " + (f"{worst:.2f}" if isfinite(worst) else "never")


def main() -> None:
    phases = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    tasks = [(name, k) for name in FAULTS for k in range(phases)]
    with Pool() as pool:
        found = pool.map(times, tasks, chunksize=4)
    head = ("fault", "told to stand", "stands", "all stopped", "once it is over")
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for name, fault in FAULTS.items():
        rows = [row[1:] for row in found if row[0] == name]
        columns = [shown(list(column)) for column in zip(*rows, strict=True)]
        print(f"| {fault.what} | {' | '.join(columns)} | {fault.then} |", flush=True)


if __name__ == "__main__":
    main()

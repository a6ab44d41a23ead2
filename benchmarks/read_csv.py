"""Read a large tracks.csv, and read it with pandas where that is installed.

Each reader runs in a process of its own, so that its peak memory is its own: the high-water mark
of the process (Linux only) above what it held when the libraries were loaded. `read_tracks` also
checks every cell, sorts, and refuses contradictions; pandas only parses.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

READERS = ("airground", "pandas")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--repeat", type=int, default=3, help="the fastest run counts")
    parser.add_argument("--read", nargs=2, metavar=("READER", "FILE"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.read:
        print(json.dumps(measure(*args.read)))
        return
    with tempfile.TemporaryDirectory() as folder:
        for decimals in (3, 17):
            path = Path(folder) / f"tracks_{decimals}.csv"
            write_rows(path, args.rows, decimals)
            print(
                f"{args.rows} rows, numbers of {decimals} digits, {path.stat().st_size / 1e6:.0f} MB"
            )
            print(
                f"  float() alone {float_seconds(path):4.2f} s, the floor of a reader in plain Python"
            )
            for reader in READERS:
                report(reader, path, args.rows, args.repeat)


def write_rows(path: Path, count: int, decimals: int) -> None:
    """Ten targets at 30 Hz on smooth paths; 3 decimals as detectors write, or all 17 digits."""
    form = "{:.3f}" if decimals == 3 else "{!r}"
    line = f"{form},robot-{{}},{form},{form}\n"
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write("t_s,target,u_px,v_px\n")
        for i in range(count):
            t, k = i // 10 / 30, i % 10
            u, v = 960 + 800 * (t * (k + 1) * 0.0137 % 1), 540 + 400 * (t * (k + 2) * 0.0071 % 1)
            stream.write(line.format(t, k, u, v))


def float_seconds(path: Path) -> float:
    """Time to convert the file's numbers one by one, once they are cells."""
    with path.open(encoding="utf-8") as stream:
        next(stream)
        rows = [line.rstrip().split(",") for line in stream]
    cells = [cell for t, _, u, v in rows for cell in (t, u, v)]
    started = time.perf_counter()
    list(map(float, cells))
    return time.perf_counter() - started


def report(reader: str, path: Path, rows: int, repeat: int) -> None:
    command = [sys.executable, __file__, "--read", reader, str(path)]
    runs = []
    for _ in range(repeat):
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        runs.append(json.loads(done.stdout))
    if runs[0] is None:
        print(f"  {reader:10} not installed")
        return
    seconds = min(run["seconds"] for run in runs)
    peak = min(run["peak_mb"] for run in runs)
    print(f"  {reader:10} {seconds:6.2f} s  {rows / seconds:10,.0f} rows/s  peak {peak:6.0f} MB")


def measure(reader: str, path: str) -> dict[str, float] | None:
    if reader == "pandas":
        try:
            import pandas as pd  # type: ignore[import-not-found,import-untyped,unused-ignore]
        except ImportError:
            return None
        read = pd.read_csv
    else:
        from airground.records import read_tracks as read
    before, start = high_water_mb(), time.perf_counter()
    table = read(path)
    seconds = time.perf_counter() - start
    peak = high_water_mb() - before
    assert len(table) > 0
    return {"seconds": seconds, "peak_mb": peak}


def high_water_mb() -> float:
    """Largest resident memory of this process so far; NaN where Linux does not tell."""
    status = Path("/proc/self/status")
    if not status.exists():
        return float("nan")
    line = next(s for s in status.read_text("ascii").splitlines() if s.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


if __name__ == "__main__":
    main()

"""The real recordings, by our whole-drive estimator and its peers; part of `trajectory.py`.

The peers get the clocks' offset at which a homography of the whole drive fits best, and the generic solver starts at
that homography, with white noise levels that are typical for these recordings.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from benchmarks import peers
from benchmarks.path_cost import Levels

from airground.calibration import calibrate
from airground.errors import AirgroundError
from airground.geometry import align_rotation, n_error, velocity_map_error
from airground.records import read_motion, read_tracks
from airground.studies.recordings import find_recordings

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.calibration import Tracks
    from airground.geometry import FloatArray

__all__ = ["real_drives"]

LEVELS = Levels(
    pixel_px=2.0, speed_share=0.1, heading_rad=0.1
)  # slip is not white: more than a reading's own scatter


def real_drives(ours: Callable[..., Any] | None) -> None:
    """Print errors of all methods on all recordings under AIRGROUND_DATA."""
    folder = Path(os.environ.get("AIRGROUND_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        print(f"no recordings at {folder}; set AIRGROUND_DATA to their folder")
        return
    variants = ("LS", "RANSAC 10 px", "RANSAC 30 px", "MAGSAC 10 px", "MAGSAC 30 px")
    print(
        "\nRecordings: n and relative error of ground velocities, after the best rotation of the ground;"
    )
    print(
        "in brackets the deviation that our methods state; peers of one target only, as origins differ"
    )
    print(
        f"{'recording':46} {'ours':>24} {'linear':>24} "
        + "".join(f"{name:>18}" for name in (*variants, "SciPy"))
    )
    for path in find_recordings(folder):
        name = path.relative_to(folder).as_posix()
        print(f"{name:46} {_row(path, ours, variants)}", flush=True)


def _row(folder: Path, ours: Callable[..., Any] | None, variants: tuple[str, ...]) -> str:
    tracks, motion = read_tracks(folder / "tracks.csv"), read_motion(folder / "motion.csv")
    told = json.loads((folder / "truth.json").read_text())
    truth = np.array(told["g"]) if told.get("g") is not None else None
    width, height = told["image_size_px"] or np.ceil(tracks.uv.max(axis=0)) + 1
    size = (int(width), int(height))  # which a user knows of the camera
    cells = [
        _stated(truth, tracks, (lambda: ours(tracks, motion, size)) if ours else None),
        _stated(truth, tracks, lambda: calibrate(tracks, motion, method="linear")),
    ]
    if len(tracks.targets) > 1:
        return " ".join(f"{cell:>24}" for cell in cells)
    offset = peers.homography_clock(tracks, motion)
    found = [peers.homography(tracks, motion, offset, variant) for variant in variants]
    start = found[0]
    found.append(
        None
        if start is None
        else peers.solved(
            tracks, motion, offset, size, solver="SciPy, analytic", g_start=start, levels=LEVELS
        )
    )
    return " ".join(f"{cell:>24}" for cell in cells) + "".join(
        f"{'-' if g is None else _errors(truth, g, tracks):>18}" for g in found
    )


def _stated(truth: FloatArray | None, tracks: Tracks, work: Callable[[], Any] | None) -> str:
    if work is None:
        return "-"
    try:
        result = work()
    except AirgroundError as error:
        return f"refused ({type(error).__name__[:12]})"
    seen = result.observability
    mark = "" if seen.verdict == "ok" else f" {seen.verdict}"
    return f"{_errors(truth, result.model.g, tracks)} ({seen.relative_sigma:.3g}){mark}"


def _errors(truth: FloatArray | None, g: FloatArray, tracks: Tracks) -> str:
    if truth is None:
        return "no truth"
    aligned, _ = align_rotation(truth, g)
    with np.errstate(all="ignore"):  # nonsense is a result too
        return f"{float(n_error(truth, aligned)):.3g}, {velocity_map_error(truth, aligned, tracks.uv):.3g}"

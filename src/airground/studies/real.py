"""Figure 4's table on real recordings: the linear method, odometry with findHomography, and the whole drive.

Recordings are looked for below the folder that AIRGROUND_DATA names. A recording of a heading's sensor has a zero of
its own, so that g is compared after the best rotation of the ground.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import calibrate
from airground.errors import AirgroundError
from airground.geometry.metrics import align_rotation, n_error, velocity_map_error
from airground.studies.item import Document, Item, Outcome, Work
from airground.studies.recordings import (
    Recording,
    find_recordings,
    odometry_homography,
    read_recording,
)
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.geometry.limited import LimitedHomography

__all__ = ["METHODS", "REAL", "VARIABLE", "compare"]

VARIABLE = "AIRGROUND_DATA"
"""Environment variable with the recordings' folder."""

METHODS = {
    "linear": "linear method",
    "homography": "odometry + findHomography",
    "trajectory": "whole drive",
}
"""Keys of a recording's object, and what they are in words."""

DIFFERS = (
    "The paper has one robot and no other method. Here the truth is surveyed, every heading has a zero of its "
    "own, so that g is compared after a rotation of the ground, and what is filmed is not what was meant to "
    "calibrate: where a drive does not determine g, the linear method and the whole drive refuse, and "
    "findHomography answers all the same."
)


def compare(recording: Recording) -> Document:
    """Calibrate one recording in three ways.

    Parameters
    ----------
    recording : Recording
        Sightings, readings and truth.

    Returns
    -------
    document : dict
        For each of `METHODS` an object: `n` and `map_error` where the truth is known, `relative_sigma` where the
        method states one, or why it is `refused`.
    """
    tracks, motion, size = recording.tracks, recording.motion, recording.image_size_px
    offsets: list[float] = []

    def ours(method: Any) -> tuple[LimitedHomography, float]:
        found = calibrate(tracks, motion, method=method, image_size_px=size)
        offsets.append(found.time_offset_s)
        return found.model, found.observability.relative_sigma

    def theirs() -> tuple[LimitedHomography, None]:
        # The clocks' offset is a present: the whole drive's, else the linear method's.
        return odometry_homography(tracks, motion, offsets[-1] if offsets else 0.0), None

    linear = _judged(recording, lambda: ours("linear"))
    whole = _judged(recording, lambda: ours("trajectory"))
    return {"linear": linear, "homography": _judged(recording, theirs), "trajectory": whole}


def _judged(
    recording: Recording, work: Callable[[], tuple[LimitedHomography, float | None]]
) -> Document:
    try:
        model, relative_sigma = work()
    except AirgroundError as error:
        return {"refused": str(error)}
    document: Document = {}
    if recording.g is not None:
        aligned, _ = align_rotation(recording.g, model)
        with np.errstate(all="ignore"):  # nonsense is a result too
            off = velocity_map_error(recording.g, aligned, recording.tracks.uv)
        document["n"] = float(n_error(recording.g, aligned))
        document["map_error"] = float(off) if np.isfinite(off) else None
    if relative_sigma is not None:
        document["relative_sigma"] = float(relative_sigma)
    return document


def _compute(work: Work) -> Outcome:
    named = os.environ.get(VARIABLE, "")
    if not named:
        return _nothing(f"no recordings: {VARIABLE} is not set; it names their folder")
    if not Path(named).is_dir():
        return _nothing(f"no recordings: {VARIABLE} names {named}, which is no folder")
    folder = Path(named)
    folders = find_recordings(folder)
    if not folders:
        wanted = "tracks.csv, motion.csv and a truth.json with g"
        return _nothing(f"no recordings below {named}: no folder there holds {wanted}")
    found: list[Document] = []
    for k, path in enumerate(folders, start=1):
        name = path.relative_to(folder).as_posix()
        try:
            found.append({"name": name, **compare(read_recording(path))})
        except AirgroundError as error:
            found.append({"name": name, **{key: {"refused": str(error)} for key in METHODS}})
        if work.progress is not None:
            work.progress(k, len(folders))
    known = [one for one in found if any("n" in one[method] for method in METHODS)]
    return Outcome({"recordings": found}, (lambda path: _draw(path, known)) if known else None)


def _nothing(why: str) -> Outcome:
    return Outcome({"recordings": [], "none": why})


def _draw(path: Path, known: list[Document]) -> None:
    from airground.pictures.bars import draw_bars

    draw_bars(
        path,
        [one["name"] for one in known],
        {words: [one[method].get("n") for one in known] for method, words in METHODS.items()},
        title="Error n of g on real recordings; no bar: refused",
        xlabel="n = ‖g − ĝ‖ / ‖g‖ after the best rotation of the ground  [1]",
    )


def _sheet(document: Mapping[str, Any]) -> Sheet:
    recordings = document["recordings"]
    rows = [(one["name"], *(_cell(one[method]) for method in METHODS)) for one in recordings]
    reasons = [
        f"{one['name']}, {words}, refused: {one[method]['refused'].split('; ')[0]}"
        for one in recordings
        for method, words in METHODS.items()
        if "refused" in one[method]
    ]
    return Sheet(
        title="Recordings: n, error of ground velocities, (stated deviation)",
        header=("recording", *METHODS.values()),
        rows=tuple(rows),
        note="\n".join(reasons) if recordings else document["none"],
    )


def _cell(one: Mapping[str, Any]) -> str:
    if "refused" in one:
        return "refused"
    error = one.get("map_error")
    parts = (
        [f"{one['n']:.4f}", "-" if error is None else f"{error:.1%}"]
        if "n" in one
        else ["no truth"]
    )
    stated = f" ({one['relative_sigma']:.1%})" if "relative_sigma" in one else ""
    return ", ".join(parts) + stated


REAL = Item(_compute, _sheet, DIFFERS)
"""Real recordings."""

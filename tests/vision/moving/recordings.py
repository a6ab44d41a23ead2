"""Two drone recordings: boxes around vehicles in raw pixels, and the homographies that their authors published.

The published homographies come from image features of the ground, by other software, and are not exact either. So they
are compared with ours, and both are judged by vehicles that stand still and were held out: how far these wander.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from airground.vision.moving import PointStabilizer, Stabilization

Array = NDArray[np.float64]

NAMES = ("geotrax", "stabilo")
SIZE = (3840, 2160)
CUT_PX = 4.0  # a box nearer to the image's border than this is cut: its middle is not the vehicle's
FPS = 30.0
HOLD_OUT = 3  # every third parked vehicle is kept from the stabiliser


@dataclass
class Recording:
    """Rows of boxes, sorted by frame, and homographies frame -> first frame."""

    frame: NDArray[np.intp]
    ids: NDArray[np.intp]
    uv: Array
    published: dict[int, Array]
    parked: frozenset[int]
    """By the published homographies: those that hardly move."""

    def of(self, frame: int) -> NDArray[np.intp]:
        return np.flatnonzero(self.frame == frame)


@dataclass
class Judgement:
    frames: int
    ok: int
    fixed: int
    rms_px: float
    apart_px: float
    """Our homographies from the published ones, at the fixed points."""
    stated_px: float
    rest_px: float
    """How far parked vehicles that were held out wander about their own mean, by ours."""
    published_rest_px: float
    ms: float
    results: list[Stabilization]
    apart: Array
    stated: Array


def load(folder: Path, name: str) -> Recording:
    if name == "geotrax":
        boxes = np.loadtxt(folder / "geotrax/U_video_cut_boxes.txt", delimiter=",")
        rows = np.loadtxt(folder / "geotrax/U_video_cut_vid_transf.txt", delimiter=",")
    else:
        boxes = np.loadtxt(folder / "stabilo/video.txt", delimiter=",")
        rows = np.load(folder / "stabilo/frame_to_ref_homographies.npy")
    published = {0: np.eye(3)} | {int(r[0]): r[1:].reshape(3, 3) for r in rows}
    uv, half = boxes[:, 2:4], boxes[:, 4:6] / 2
    whole = ((uv - half > CUT_PX) & (uv + half < np.array(SIZE) - 1 - CUT_PX)).all(axis=1)
    known = np.array([int(f) in published for f in boxes[:, 0]])
    boxes = boxes[whole & known]
    frame, ids, uv = boxes[:, 0].astype(np.intp), boxes[:, 1].astype(np.intp), boxes[:, 2:4]
    still = np.empty_like(uv)
    for f in np.unique(frame):
        still[frame == f] = project(published[int(f)], uv[frame == f])
    parked = []
    for name_ in np.unique(ids):
        mine = ids == name_
        if mine.sum() < 40:
            continue
        slope = np.polyfit(frame[mine], still[mine], 1)[0]
        if np.hypot(*slope) < 0.1 and still[mine].std(axis=0).max() < 8.0:
            parked.append(int(name_))
    return Recording(frame, ids, uv, published, frozenset(parked))


def judge(recording: Recording, stabilizer: PointStabilizer) -> Judgement:
    held = frozenset(sorted(recording.parked)[::HOLD_OUT])
    ours: dict[int, list[Array]] = {}
    theirs: dict[int, list[Array]] = {}
    results, apart, stated, seconds = [], [], [], 0.0
    frames = np.unique(recording.frame)
    for frame in frames:
        rows = recording.of(int(frame))
        out = np.isin(recording.ids[rows], list(held))
        given = rows[~out]
        names = recording.ids[given].tolist()
        started = time.process_time()
        result = stabilizer.update(frame / FPS, names, recording.uv[given])
        seconds += time.process_time() - started
        results.append(result)
        H = recording.published[int(frame)]
        if result.stable_from_image is not None:
            uv = recording.uv[rows[out]]
            still = zip(project(result.stable_from_image, uv), project(H, uv), strict=True)
            for name, (our, their) in zip(recording.ids[rows[out]].tolist(), still, strict=True):
                ours.setdefault(name, []).append(our)
                theirs.setdefault(name, []).append(their)
        known = stabilizer.fixed
        fixed = [k for k in given if recording.ids[k] in known]
        if result.stable_from_image is None or len(fixed) < 4:
            apart.append(np.nan)
            stated.append(np.nan)
            continue
        uv = recording.uv[fixed]
        gap = project(result.stable_from_image, uv) - project(H, uv)
        apart.append(float(np.sqrt(np.mean(gap**2))))
        C = result.point_covariance(uv)
        stated.append(float(np.sqrt(np.trace(C, axis1=1, axis2=2).mean() / 2)))
    return Judgement(
        frames=len(frames),
        ok=sum(r.ok for r in results),
        fixed=len(stabilizer.fixed),
        rms_px=float(np.median([r.rms_px for r in results if r.ok])),
        apart_px=_rms(apart),
        stated_px=_rms(stated),
        rest_px=_wander(ours),
        published_rest_px=_wander(theirs),
        ms=1e3 * seconds / len(frames),
        results=results,
        apart=np.array(apart),
        stated=np.array(stated),
    )


def project(matrix: Array, uv: Array) -> Array:
    w = np.column_stack([uv, np.ones(len(uv))]) @ matrix.T
    return np.asarray(w[:, :2] / w[:, 2:])


def _wander(tracks: dict[int, list[Array]]) -> float:
    off = [np.array(p) - np.mean(p, axis=0) for p in tracks.values() if len(p) > 5]
    return float(np.sqrt(np.mean(np.concatenate(off) ** 2))) if off else float("nan")


def _rms(values: list[float]) -> float:
    array = np.array(values)
    return float(np.sqrt(np.nanmean(array**2)))

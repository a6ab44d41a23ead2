"""Things that drive about in an image, and what a detector would see of them: truth for tests and benchmarks.

Shares no code with the tracker: positions are integrated here, from turns and thrusts that change at random.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from airground.vision.sightings import Sightings

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


@dataclass(frozen=True)
class Scene:
    """What is seen, and what is true."""

    t: FloatArray  # (T,) [s]
    uv: FloatArray  # (T, K, 2) [px]
    uv_dot: FloatArray  # (T, K, 2) [px/s]
    sightings: list[Sightings]
    owner: list[IntArray]  # of each sighting: which thing, -1 clutter, -2 several as one
    shared: NDArray[np.bool_]  # (T, K): seen as one with another
    alive: NDArray[np.bool_]  # (T, K)


@dataclass(frozen=True)
class Detector:
    """How badly one sees."""

    sigma_px: float = 0.5
    miss: float = 0.1
    clutter: float = 5.0
    merge_px: float = 20.0
    dropouts_per_minute: float = 3.0
    dropout_s: float = 1.0
    size_px: tuple[int, int] = (1280, 720)
    labels: tuple[str, ...] = field(default=())


def drive(
    count: int,
    t: FloatArray,
    rng: np.random.Generator,
    *,
    size_px: tuple[int, int] = (1280, 720),
    speed_pxps: float = 120.0,
    turn_radps: float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """Unicycles whose turn rate and speed wander; they stop now and then and turn back at the border."""
    size = np.array(size_px, dtype=float)
    uv = rng.uniform(0.1, 0.9, (count, 2)) * size
    heading = rng.uniform(-np.pi, np.pi, count)
    turn, wanted = rng.normal(0, turn_radps, count), rng.uniform(0.5, 1.2, count) * speed_pxps
    speed = wanted.copy()
    out, rate = np.empty((len(t), count, 2)), np.empty((len(t), count, 2))
    fine = 8  # steps between frames
    for k, dt in enumerate(np.diff(t, prepend=t[0])):
        h = dt / fine
        for _ in range(fine if dt > 0 else 0):
            turn += -turn * h / 0.7 + turn_radps * np.sqrt(2 * h / 0.7) * rng.normal(size=count)
            change = rng.random(count) < h / 3.0
            fresh = rng.uniform(0.5, 1.2, count) * speed_pxps * (rng.random(count) > 0.2)
            wanted = np.where(change, fresh, wanted)
            speed += np.clip(wanted - speed, -2 * speed_pxps * h, 2 * speed_pxps * h)
            home = size / 2 - uv
            lost = (np.abs(home) > 0.45 * size).any(axis=1)
            off = np.arctan2(home[:, 1], home[:, 0]) - heading
            off = (off + np.pi) % (2 * np.pi) - np.pi
            heading += h * np.where(lost, 2.0 * np.sign(off), turn)
            uv = uv + h * speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
        out[k] = uv
        rate[k] = speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return out, rate


def watch(
    t: FloatArray,
    uv: FloatArray,
    uv_dot: FloatArray,
    detector: Detector,
    rng: np.random.Generator,
    *,
    alive: NDArray[np.bool_] | None = None,
) -> Scene:
    """Sightings of what drives, in no order."""
    frames, count = uv.shape[:2]
    alive = np.ones((frames, count), dtype=bool) if alive is None else alive
    dark = np.full(count, -np.inf)
    sightings, owners = [], []
    shared = np.zeros((frames, count), dtype=bool)
    step = float(np.median(np.diff(t)))
    for k in range(frames):
        begins = rng.random(count) < detector.dropouts_per_minute / 60 * step
        dark = np.where(begins & (dark < t[k]), t[k] + detector.dropout_s, dark)
        seen = np.flatnonzero(alive[k] & (dark < t[k]) & (rng.random(count) >= detector.miss))
        group = groups(uv[k, seen], detector.merge_px)
        rows, owner = [], []
        for g in range(group.max(initial=-1) + 1):
            members = seen[group == g]
            rows.append(uv[k, members].mean(axis=0))
            owner.append(int(members[0]) if len(members) == 1 else -2)
            shared[k, members] = len(members) > 1
        false = rng.poisson(detector.clutter)
        places = np.concatenate(
            [np.reshape(rows, (-1, 2)), rng.uniform(0, 1, (false, 2)) * np.array(detector.size_px)]
        )
        owner += [-1] * false
        noisy = places + rng.normal(0, detector.sigma_px, places.shape)
        order = rng.permutation(len(noisy))
        owned = np.array(owner, dtype=np.intp)[order]
        labels = (
            tuple(detector.labels[j] if j >= 0 else "" for j in owned) if detector.labels else ()
        )
        sightings.append(
            Sightings.round(float(t[k]), noisy[order], detector.sigma_px, labels=labels)
        )
        owners.append(owned)
    return Scene(t, uv, uv_dot, sightings, owners, shared, alive)


def groups(uv: FloatArray, near_px: float) -> IntArray:
    """Number of the heap that each point lies in, when points nearer than that lie in one."""
    near = np.linalg.norm(uv[:, None] - uv[None], axis=-1) < near_px
    reach = near | np.eye(len(uv), dtype=bool)
    for _ in range(len(uv).bit_length()):
        reach = (reach.astype(int) @ reach.astype(int)) > 0
    first = reach.argmax(axis=1) if len(uv) else np.empty(0, dtype=int)
    return np.unique(first, return_inverse=True)[1].astype(np.intp)


def robots(
    seed: int, count: int = 20, seconds: float = 60.0, detector: Detector | None = None
) -> Scene:
    """A scene of robots that cross each other's ways."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / 30)
    detector = detector or Detector()
    uv, uv_dot = drive(count, t, rng, size_px=detector.size_px)
    return watch(t, uv, uv_dot, detector, rng)

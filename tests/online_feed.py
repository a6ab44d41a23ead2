"""Feeds recordings to the recursive estimator, in the order in which they would arrive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration import Motion, Tracks
    from airground.calibration.online import OnlineCalibrator


def feed(
    calibrator: OnlineCalibrator,
    tracks: Tracks,
    motion: Motion,
    *,
    frames: bool = False,
    until: float = np.inf,
    after: float = -np.inf,
) -> None:
    """Readings first where times are equal; by frames, or sighting by sighting."""
    order = np.lexsort(
        (
            np.concatenate([np.zeros(len(motion)), np.ones(len(tracks))]),
            np.concatenate([motion.t, tracks.t]),
        )
    )
    names_m = [motion.targets[k] for k in motion.target_index]
    names_t = [tracks.targets[k] for k in tracks.target_index]
    waiting: list[int] = []

    def flush() -> None:
        if waiting:
            calibrator.frame(
                float(tracks.t[waiting[0]]), [names_t[i] for i in waiting], tracks.uv[waiting]
            )
            waiting.clear()

    for row in order.tolist():
        t = float(motion.t[row] if row < len(motion) else tracks.t[row - len(motion)])
        if not after < t <= until:
            continue
        if row < len(motion):
            if motion.xy_dot is not None:
                calibrator.reading(t, names_m[row], xy_dot=motion.xy_dot[row])
            else:
                assert motion.heading is not None
                assert motion.speed is not None
                calibrator.reading(
                    t, names_m[row], heading=motion.heading[row], speed=motion.speed[row]
                )
            continue
        i = row - len(motion)
        if not frames:
            calibrator.sighting(t, names_t[i], tracks.uv[i])
        else:
            if waiting and t != tracks.t[waiting[0]]:
                flush()
            waiting.append(i)
    flush()

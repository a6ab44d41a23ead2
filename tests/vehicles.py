"""What a vehicle's own sensors say, for tests on real recordings."""

from __future__ import annotations

import numpy as np

from airground.calibration import Motion


def read_speed(motion: Motion, target: str, t: np.ndarray) -> np.ndarray:
    """Speed that the vehicle's own sensors read, between readings by a line; NaN outside."""
    rows = motion.rows(target)
    if motion.xy_dot is not None:
        speed = np.linalg.norm(motion.xy_dot[rows], axis=1)
    else:
        assert motion.speed is not None
        speed = np.abs(motion.speed[rows])
    return np.asarray(np.interp(t, motion.t[rows], speed, left=np.nan, right=np.nan))

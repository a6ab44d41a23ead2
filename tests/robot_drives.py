"""Drives of the robot in MuJoCo that nobody drove: their errors are as told."""

from __future__ import annotations

import numpy as np

from airground.studies.other_speeds import OtherSpeeds
from airground.studies.robot_runs import RobotSummary

G = np.array([[-8.8347, -2.0486], [-0.2190, 3.3972], [-0.00064, -0.0048]])


def made_up(seed: int, linear: float | None, trajectory: float | None) -> RobotSummary:
    """A drive whose errors are as told."""
    errors = {"linear": linear, "trajectory": trajectory}
    g_hat = {name: None if e is None else G * (1 + e) for name, e in errors.items()}
    others = OtherSpeeds(np.array([0.19, 0.21, 0.01]), np.full(3, 0.006), np.array([0.2, 0.2, 0.0]))
    path = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]])
    return RobotSummary(seed, G, g_hat, 0.01, 100 * path, path, others)

"""Drives that mostly stand: robots that wait for each other, and whose odometers read noise meanwhile."""

from __future__ import annotations

import numpy as np
import pytest

from airground.calibration import Motion, Tracks, calibrate
from airground.geometry import n_error, velocity_map_error
from airground.sim import SimCamera

CAMERA = SimCamera.looking_down(
    focal_length_px=1000.0, tilt_rad=0.8, height_m=4.0, image_size_px=(1280, 720)
)
LEGS, LEG_S, TURN_S, SPEED_MPS = 8, 4.0, 1.5, 0.3


def mostly_standing(
    rng: np.random.Generator, standing: float, noise_mps: float
) -> tuple[Tracks, Motion]:
    """Legs to and fro over the ground, a turn on the spot after each, and then a long rest."""
    moving_s = LEG_S + TURN_S
    cycle_s = moving_s / (1 - standing)
    t = np.arange(0.0, LEGS * cycle_s, 0.01)
    leg, phase = np.divmod(t, cycle_s)
    v = np.where(phase < LEG_S, SPEED_MPS, 0.0)
    turns = np.cumsum([0.0, *rng.permutation([2.2, -2.6, 1.9, 2.8, -2.1, 2.4, -1.8, 2.9])])
    share = np.clip((phase - LEG_S) / TURN_S, 0.0, 1.0)
    theta = turns[leg.astype(int)] + share * np.diff(turns)[leg.astype(int)]
    xy = np.cumsum(np.column_stack([v * np.cos(theta), v * np.sin(theta)]) * 0.01, axis=0)
    middle = CAMERA.unproject(np.array([640.0, 400.0]))
    xy += middle - xy.mean(axis=0)
    seen, read = slice(None, None, 5), slice(None, None, 2)
    uv = CAMERA.project(xy[seen])
    uv += rng.normal(0.0, 0.3, uv.shape)
    tracks = Tracks.from_rows(t[seen], ["red"] * len(uv), uv)
    motion = Motion.from_rows(
        t[read],
        ["red"] * len(t[read]),
        heading=theta[read] + rng.normal(0.0, 0.01, len(t[read])),
        speed=v[read] + rng.normal(0.0, noise_mps, len(t[read])),
    )
    return tracks, motion


@pytest.mark.parametrize("noise_mps", [0.003, 0.01])
@pytest.mark.parametrize("standing", [0.3, 0.7, 0.85])
def test_rests_are_no_reason_to_refuse_a_drive(
    standing: float, noise_mps: float, rng: np.random.Generator
) -> None:
    """Where noise counted as speed, nothing seemed to agree with anything, and a good drive was refused.

    Where the noise at rest was taken to be less than it is, ground velocities came out half again too large.
    """
    tracks, motion = mostly_standing(rng, standing, noise_mps)
    found = calibrate(tracks, motion, image_size_px=CAMERA.image_size_px, distortion="none")
    assert found.fit.method == "trajectory"
    assert n_error(found.model.g, CAMERA.g) < 0.03
    assert found.observability.relative_sigma < 0.05
    grid = np.stack(np.meshgrid([500.0, 640.0, 780.0], [300.0, 400.0, 500.0]), axis=-1)
    assert velocity_map_error(CAMERA.g, found.model, grid) < 0.05

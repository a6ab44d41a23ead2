"""Robots whose headings count from different zeros."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from airground.calibration import Calibration, Motion, Tracks, calibrate
from airground.geometry import align_rotation, n_error
from drives import Drive, fit_drive, read, see
from scenes import scene

SCENE = scene(tilt_deg=45)
A = fit_drive(SCENE, period=40.0)
B = fit_drive(SCENE, period=27.0, ratio=3)
T = np.arange(0, 60, 1 / 25)
READINGS = np.arange(-1.5, 61.5, 0.05)


def two(
    first: Drive, second: Drive, bias: float, rng: np.random.Generator, *, noise: float = 1.0
) -> tuple[Tracks, Motion]:
    a = see(SCENE, first, T, noise=0.5 * noise, rng=rng)
    b = see(SCENE, second, T, noise=0.5 * noise, rng=rng)
    names = ["a"] * len(T) + ["b"] * len(T)
    tracks = Tracks.from_rows(np.tile(T, 2), names, np.concatenate([a.uv, b.uv]))
    ra, rb = (
        read(
            d, READINGS, form="speed", speed_noise=0.05 * noise, heading_noise=0.03 * noise, rng=rng
        )
        for d in (first, second)
    )
    assert ra.heading is not None
    assert rb.heading is not None
    assert ra.speed is not None
    assert rb.speed is not None
    motion = Motion.from_rows(
        np.tile(READINGS, 2),
        ["a"] * len(READINGS) + ["b"] * len(READINGS),
        heading=np.concatenate([ra.heading, rb.heading + bias]),
        speed=np.concatenate([ra.speed, rb.speed]),
    )
    return tracks, motion


def bias_of(found: Calibration) -> float:
    a, b = (found.targets[name].heading_bias_rad for name in ("a", "b"))
    assert a is not None
    assert b is not None
    assert 0.0 in {a, b}  # one of them is the reference
    return b - a


@pytest.mark.parametrize("method", ["trajectory", "linear"])
@pytest.mark.parametrize("bias", [0.0, 0.02, -0.5, 1.7, 3.1])
def test_the_bias_is_found_and_does_not_matter(
    bias: float, method: Literal["trajectory", "linear"], rng: np.random.Generator
) -> None:
    notes: list[str] = []
    found = calibrate(*two(A, B, bias, rng), method=method, note=notes.append)
    aligned, _ = align_rotation(SCENE.g, found.model)
    assert n_error(SCENE.g, aligned) < 0.02
    if method == "trajectory" and abs(bias) < 0.1:
        # Headings that agree are taken as counted from one zero, and that is said.
        assert [t.heading_bias_rad for t in found.targets.values()] == [None, None]
        assert any("one zero" in note for note in notes)
        return
    off = (bias_of(found) - bias + np.pi) % (2 * np.pi) - np.pi
    assert abs(off) < 0.01
    assert found.observability.verdict == "ok"


def test_velocities_are_in_one_frame_and_are_not_turned(rng: np.random.Generator) -> None:
    tracks, motion = two(A, B, 0.0, rng)
    assert motion.heading is not None
    assert motion.speed is not None
    velocity = motion.speed[:, None] * np.column_stack(
        [np.cos(motion.heading), np.sin(motion.heading)]
    )
    as_velocity = Motion.from_rows(
        motion.t, [motion.targets[k] for k in motion.target_index], xy_dot=velocity
    )
    found = calibrate(tracks, as_velocity)
    assert [t.heading_bias_rad for t in found.targets.values()] == [None, None]
    aligned, _ = align_rotation(SCENE.g, found.model)
    assert n_error(SCENE.g, aligned) < 0.02


def test_robots_that_determine_g_only_together_are_taken_as_one_frame(
    rng: np.random.Generator,
) -> None:
    # Thin ellipses across each other: neither alone determines g well enough to turn the other by it.
    first = Drive(A.centre, (A.size[0], 0.15 * A.size[1]), 40.0, ratio=1)
    second = Drive(A.centre, (0.15 * A.size[0], A.size[1]), 40.0, ratio=1)
    notes: list[str] = []
    found = calibrate(*two(first, second, 0.0, rng, noise=0.5), note=notes.append)
    aligned, _ = align_rotation(SCENE.g, found.model)
    assert n_error(SCENE.g, aligned) < 0.1
    assert [t.heading_bias_rad for t in found.targets.values()] == [None, None]
    assert any("one zero" in note for note in notes)


def test_the_stated_deviation_holds_with_biases(rng: np.random.Generator) -> None:
    ratio = []
    for _ in range(6):
        found = calibrate(*two(A, B, 1.0, rng), speed_scale_sigma=0.0)
        aligned, _ = align_rotation(SCENE.g, found.model)
        deviation = np.sqrt(np.trace(found.covariance)) / np.linalg.norm(SCENE.g)
        ratio.append(float(n_error(SCENE.g, aligned)) / deviation)
    assert (
        0.3 < np.sqrt(np.mean(np.square(ratio))) < 1.6
    )  # the turn itself is gauge, so less than one is fine

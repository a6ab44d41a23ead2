"""Sightings of a point: exact without noise, late, missing and wrong by the stated shares."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import VelocityCommand
from airground.errors import InputError
from airground.sim import Lens, demo_world
from airground.sim.body_poses import parked
from airground.sim.point_eye import EyeOptions, PointEye
from airground.sim.vehicle_plant import VehiclePlant

CAMERA = demo_world().camera
HERE = (0.3, 4.1)


def test_without_noise_it_is_the_projected_mark_each_once(rng: np.random.Generator) -> None:
    plant = VehiclePlant(HERE, 0.7)
    lens = Lens.of_image(-0.1, CAMERA.image_size_px)
    eye = PointEye(
        CAMERA,
        plant.pose,
        EyeOptions(rate_hz=25, latency_s=0.09, sigma_px=0.0, mark_m=(0.2, -0.1)),
        rng,
        lens=lens,
    )
    found = []
    for k in range(100):
        plant.command(k / 100, VelocityCommand(0.4, 1.0))
        plant.advance((k + 1) / 100)
        new = eye.sightings((k + 1) / 100)
        assert all(k / 100 < s.arrives_t + 1e-9 <= (k + 1) / 100 + 1e-6 for s in new)
        found += new
    t = np.array([s.t for s in found])
    assert_allclose(t, np.arange(23) / 25)
    assert eye.frames == 23
    assert_allclose([s.arrives_t for s in found], t + 0.09)
    xy, theta = plant.pose(t)
    turn = np.exp(1j * theta) * (0.2 - 0.1j)
    seen = CAMERA.project(xy + np.column_stack([turn.real, turn.imag]))
    assert_allclose([s.uv for s in found], lens.distort(seen), atol=1e-9)


def test_noise_dropouts_and_outliers_have_their_size(rng: np.random.Generator) -> None:
    options = EyeOptions(
        sigma_px=2.0, dropout_share=0.25, dropout_s=0.2, outlier_share=0.1, jitter_s=0.01
    )
    eye = PointEye(CAMERA, parked(*HERE), options, rng)
    found = eye.sightings(120.0)
    off = np.array([s.uv for s in found]) - CAMERA.project(HERE)
    far = np.hypot(*off.T) > 12
    assert eye.frames == pytest.approx(3598, abs=2)
    assert len(found) / eye.frames == pytest.approx(0.75, abs=0.06)  # 450 dropouts of 0.2 s
    assert far.mean() == pytest.approx(0.1, abs=0.02)
    assert_allclose(off[~far].std(axis=0), 2.0, rtol=0.08)
    gaps = np.diff([s.t for s in found])
    assert gaps[gaps > 0.04].mean() == pytest.approx(0.2 + 1.5 / 30, abs=0.06)
    late = np.array([s.arrives_t - s.t for s in found]) - 0.08
    assert late.min() >= -1e-9
    assert late.mean() == pytest.approx(0.01, rel=0.15)
    assert (np.diff([s.arrives_t for s in found]) >= 0).all()


def test_what_is_hidden_or_outside_is_not_seen(rng: np.random.Generator) -> None:
    hidden = EyeOptions(hidden_s=((1.0, 2.0), (3.0, 9.0)), rate_hz=10)
    t = [s.t for s in PointEye(CAMERA, parked(*HERE), hidden, rng).sightings(5.0)]
    assert_allclose(t, np.r_[0:10, 20:30] / 10)
    for outside in ((0.0, -5.0), (40.0, 4.0)):  # behind the camera, beside the image
        eye = PointEye(CAMERA, parked(*outside), EyeOptions(), rng)
        assert eye.sightings(1.0) == []
        assert eye.frames > 20


@pytest.mark.parametrize(
    "change",
    [
        {"rate_hz": np.inf},
        {"latency_s": -0.1},
        {"sigma_px": np.nan},
        {"dropout_share": 1.0},
        {"outlier_share": -0.1},
        {"start_s": np.nan},
        {"hidden_s": ((2.0, 1.0),)},
    ],
)
def test_senseless_options_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(change))):
        EyeOptions(**change)

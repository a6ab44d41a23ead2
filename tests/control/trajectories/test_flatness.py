"""Flat outputs to inputs, against finite differences of a pinhole camera; see benchmarks/drive_peers.py too."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control.trajectories.flatness import flat_inputs, flat_outputs
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import demo_world
from airground.sim.unicycle import arc

CAMERA = demo_world().camera
MODEL = LimitedHomography(CAMERA.g)
H = 1e-3  # s: rounding of 1e-13 px over H^2 against errors of order H^2


def test_inputs_are_those_that_drove_it(rng: np.random.Generator) -> None:
    xy = rng.uniform([-2.0, 2.6], [2.0, 5.6], (40, 2))
    theta, omega = rng.uniform(-3, 3, 40), rng.uniform(-1.5, 1.5, 40)
    v = rng.uniform(0.1, 0.5, 40)
    for gear in (1.0, -1.0):
        uv = CAMERA.project(xy)
        ahead, back = (CAMERA.project(xy + arc(theta, gear * v, omega, s * H)) for s in (1, -1))
        uv_dot, uv_ddot = (ahead - back) / (2 * H), (ahead - 2 * uv + back) / H**2
        found = flat_inputs(MODEL, uv, uv_dot, uv_ddot, reverse=gear < 0)
        assert_allclose(np.exp(1j * found.theta), np.exp(1j * theta), atol=1e-5)
        assert_allclose(found.v, gear * v, atol=1e-5)
        assert_allclose(found.omega, omega, atol=1e-4)
        assert_allclose(found.v_dot, 0.0, atol=1e-4)
        again = flat_outputs(MODEL, uv, theta, gear * v, omega)
        assert_allclose(again[0], uv_dot, atol=1e-3)
        assert_allclose(again[1], uv_ddot, atol=1e-2)


def test_speeding_up_is_seen(rng: np.random.Generator) -> None:
    uv = CAMERA.project([0.5, 4.0])
    uv_dot, uv_ddot = flat_outputs(MODEL, uv, 0.7, -0.3, 0.4, v_dot=0.2)
    found = flat_inputs(MODEL, uv, uv_dot, uv_ddot, reverse=True)
    assert_allclose([found.theta, found.v, found.omega, found.v_dot], [0.7, -0.3, 0.4, 0.2])
    # Straight on, the displacement is known in full.
    t = np.array([H, 0.0, -H])
    s = -0.3 * t + 0.1 * t**2
    uvs = CAMERA.project([0.5, 4.0] + s[:, None] * [np.cos(0.7), np.sin(0.7)])
    straight = flat_outputs(MODEL, uv, 0.7, -0.3, 0.0, v_dot=0.2)
    assert_allclose((uvs[0] - uvs[2]) / (2 * H), straight[0], atol=1e-4)
    assert_allclose((uvs[0] - 2 * uvs[1] + uvs[2]) / H**2, straight[1], atol=1e-2)


def test_at_rest_there_is_no_heading() -> None:
    uv = CAMERA.project([0.5, 4.0])
    found = flat_inputs(MODEL, uv, [0.0, 0.0], [10.0, 0.0])
    assert found.v == 0
    assert np.isnan([found.theta, found.omega]).all()
    assert found.v_dot > 0


def test_shapes_broadcast_or_are_refused() -> None:
    uv = CAMERA.project(np.ones((3, 1, 2)) * [0.5, 4.0])
    assert flat_inputs(MODEL, uv, np.ones((4, 2)), [0.0, 0.0]).theta.shape == (3, 4)
    with pytest.raises(InputError, match="broadcast"):
        flat_outputs(MODEL, uv[:, 0], np.ones(2), np.ones(3), 0.0)
    with pytest.raises(InputError, match="uv_dot"):
        flat_inputs(MODEL, uv, np.ones(3), [0.0, 0.0])

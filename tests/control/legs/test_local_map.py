"""What is learned of the image, against a camera's own Jacobian."""

from __future__ import annotations

from math import atan2, cos, nan, radians, remainder, sin, tau

import numpy as np
import pytest

from airground.control.legs import LocalMap
from airground.sim import SimCamera
from leg_loop import ceiling, jacobian, mirrored, tilted


def drive(
    found: LocalMap,
    camera: SimCamera,
    at: tuple[float, float],
    heading: float,
    rng: np.random.Generator,
    *,
    noise: float = 5.0,
) -> tuple[float, float]:
    """Give where it ends, 0.4 m further."""
    xy = camera.unproject(np.array(at))
    step = np.array([cos(heading), sin(heading)])
    for k in range(60):
        place = xy + 0.2 * k / 30 * step
        uv_dot = camera.project_velocity(place, 0.2 * step) + noise * rng.normal(size=2)
        u, v = camera.project(place).tolist()
        found.take((u, v), tuple(uv_dot.tolist()), heading, 0.2)
    return u, v


@pytest.mark.parametrize("camera", [tilted(), ceiling(), mirrored(tilted())])
def test_two_headings_give_the_map(camera: SimCamera, rng: np.random.Generator) -> None:
    found = LocalMap()
    at = (700.0, 420.0)
    assert found.rank(at) == 0
    assert found.px_per_m(at, 0.0) is None
    assert found.guesses(at) == ()
    assert found.clockwise is None
    assert found.inward(at, (1280, 720)) is None
    at = drive(found, camera, at, 0.4, rng)
    assert found.rank(at) == 1
    assert found.matrix(at) is None
    truth = jacobian(camera, camera.unproject(np.array(at)))
    ahead = truth @ [cos(0.4), sin(0.4)]
    assert found.px_per_m(at, 0.4) == pytest.approx(tuple(ahead), rel=0.15, abs=15)
    assert found.px_per_m(at, 0.4 + 3.14159) == pytest.approx(tuple(-ahead), rel=0.15, abs=15)
    assert found.px_per_m(at, 2.0) is None
    at = drive(found, camera, at, 1.9, rng)
    assert found.rank(at) == 2
    truth = jacobian(camera, camera.unproject(np.array(at)))
    M = found.matrix(at)
    assert M is not None
    assert np.abs(M - truth).max() < 0.2 * np.linalg.norm(truth)
    assert found.clockwise == (np.linalg.det(truth) > 0)
    # A hint for a person or a script: nearly straight to the middle.
    inward = found.inward(at, (1280, 720))
    middle = camera.unproject(np.array([639.5, 359.5])) - camera.unproject(np.array(at))
    assert inward is not None
    assert abs(remainder(inward - atan2(middle[1], middle[0]), tau)) < radians(25)


@pytest.mark.parametrize("camera", [ceiling(), mirrored(ceiling())])
def test_one_heading_leaves_two_guesses_of_which_one_is_right(
    camera: SimCamera, rng: np.random.Generator
) -> None:
    found = LocalMap()
    at = drive(found, camera, (500.0, 300.0), -2.0, rng)
    truth = jacobian(camera, camera.unproject(np.array(at)))
    guesses = [np.array(one).reshape(2, 2) for one in found.guesses(at)]
    off = sorted(float(np.abs(one - truth).max()) for one in guesses)
    assert len(off) == 2
    assert off[0] < 0.1 * np.linalg.norm(truth) < off[1]
    to = np.array([639.5, 359.5]) - at
    inward = found.inward(at, (1280, 720))
    assert inward is not None
    assert truth @ [cos(inward), sin(inward)] @ to > 0


def test_near_places_count_more_than_far_ones(rng: np.random.Generator) -> None:
    camera = tilted()
    found = LocalMap()
    for at in ((300.0, 250.0), (900.0, 650.0)):
        for heading in (0.3, 1.4):
            drive(found, camera, at, heading, rng, noise=1.0)
    near, far = found.matrix((900.0, 600.0)), found.matrix((300.0, 250.0))
    assert near is not None
    assert far is not None
    assert np.linalg.norm(near) > 1.5 * np.linalg.norm(far)


def test_nothing_is_learned_from_what_tells_nothing() -> None:
    found = LocalMap()
    for _ in range(100):
        found.take((600.0, 300.0), (3.0, 2.0), 0.0, 0.01)  # at rest
        found.take((600.0, 300.0), (30.0, 2.0), 0.0, 0.3, 1.0)  # turning
        found.take((nan, 300.0), (30.0, 2.0), 0.0, 0.3)
        found.take((600.0, 300.0), (30.0, 2.0), nan, 0.3)
    assert found.rank((600.0, 300.0)) == 0


def test_it_remembers_a_bounded_number_of_places() -> None:
    found = LocalMap()
    for k in range(1000):
        found.take((30.0 * k, 0.0), (40.0, 2.0), 0.0, 0.2)
    assert found.px_per_m((29970.0, 0.0), 0.0) == pytest.approx((200.0, 10.0))
    assert found._bins.shape == (128, 9)

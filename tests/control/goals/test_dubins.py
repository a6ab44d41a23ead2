"""Shortest ways: known ones, none shorter among sampled ones, and lengths that shrink as they are driven."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control.goals.dubins import shortest_way
from airground.sim.unicycle import arc


@pytest.mark.parametrize(
    ("pose", "turn", "length"),
    [
        ((-3.0, 0.0, 0.0), 0.0, 3.0),
        ((0.0, 0.0, np.pi), np.pi / 3, 7 * np.pi / 3),  # three turns
        ((0.0, 2.0, np.pi), np.pi, np.pi),
        ((-1.0, -1.0, np.pi / 2), -np.pi / 2, np.pi / 2),
        ((3.0, 0.0, 0.0), np.pi, 2 * np.pi + 3.0),
    ],
)
def test_known_ways(pose: tuple[float, float, float], turn: float, length: float) -> None:
    for radius in (1.0, 0.4):
        found = shortest_way(pose[0] * radius, pose[1] * radius, pose[2], radius)
        assert_allclose(found[1], length * radius, atol=1e-9)
        # Left and right are alike where the pose is its own mirror image.
        assert_allclose(abs(found[0]), abs(turn), atol=1e-9)


def test_what_is_driven_of_the_first_piece_is_gone(rng: np.random.Generator) -> None:
    step = 0.05
    seen = 0
    for _ in range(200):
        (x, y), phi = rng.uniform(-4, 4, 2), rng.uniform(-np.pi, np.pi)
        turn, said = shortest_way(x, y, phi, 1.0)
        assert said >= np.hypot(x, y)
        if 0 < abs(turn) < step:
            continue
        dx, dy = arc(phi, 1.0, np.sign(turn), step)
        left = shortest_way(x + dx, y + dy, phi + np.sign(turn) * step, 1.0)[1]
        assert_allclose(left, said - step, atol=1e-9)
        seen += 1
    assert seen > 150


def test_no_sampled_way_is_shorter(rng: np.random.Generator) -> None:
    """Random ways of three pieces, driven backwards from the goal: none beats what is said of where it began."""
    for _ in range(300):
        kinds = rng.choice([-1.0, 0.0, 1.0], 3)
        lengths = rng.uniform(0, 5, 3)
        xy, phi = np.zeros(2), 0.0
        for kind, length in zip(kinds, lengths, strict=True):
            xy, phi = xy + arc(phi, -1.0, kind, length), phi + kind * length
        # Driven backwards with turn rate `kind`, hence with -kind when driven forward.
        assert shortest_way(float(xy[0]), float(xy[1]), phi, 1.0)[1] <= lengths.sum() + 1e-6

"""Where the cart drives, and what stands in the warehouse."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from airground.sim.body_poses import parked
from airground.sim.live_options import EmbeddedOptions, robot_places
from airground.sim.live_scene import live_bodies, racetrack


def test_a_racetrack_is_smooth_closed_and_driven_at_its_speed() -> None:
    pose = racetrack((1.0, 2.0), 3.0, 0.5, 0.4)
    lap = (6 + np.pi) / 0.4
    t = np.linspace(-lap, 2 * lap, 6001)
    xy, theta = pose(t)
    dt = t[1] - t[0]
    velocity = np.diff(xy, axis=0) / dt
    assert_allclose(np.hypot(*velocity.T), 0.4, rtol=1e-3)
    middle = (theta[1:] + theta[:-1]) / 2
    along = velocity[:, 0] * np.cos(middle) + velocity[:, 1] * np.sin(middle)
    assert_allclose(along, 0.4, rtol=1e-3)  # it looks where it goes, also from lap to lap
    assert_allclose(pose(np.array([0.0]))[0], [[1.0, 1.5]])
    assert_allclose(pose(np.array([0.3 + lap]))[0], pose(np.array([0.3]))[0], atol=1e-9)
    assert_allclose(xy.min(axis=0), [-1.0, 1.5], atol=1e-3)
    assert_allclose(xy.max(axis=0), [3.0, 2.5], atol=1e-3)


def test_bodies_carry_their_tags_in_one_plane() -> None:
    places = robot_places(EmbeddedOptions(robots=4))

    def still(_: str) -> object:
        return parked(0.0, 4.0)

    bodies = {
        body.name: body
        for body in live_bodies(places, still, still, cart=True)  # type: ignore[arg-type]
    }
    tags = {name: body.tags[0] for name, body in bodies.items() if body.tags}
    numbers = {name: tag.number for name, (tag, _) in tags.items()}
    assert numbers == {"red": 0, "blue": 1, "green": 2, "yellow": 3, "cart": 9}
    assert {height for _, height in tags.values()} == {0.24}
    assert {bodies[name].moves for name in ("pillar", "box-1", "box-2", "box-3")} == {False}
    assert "cart" not in [body.name for body in live_bodies(places, still, still, cart=False)]  # type: ignore[arg-type]

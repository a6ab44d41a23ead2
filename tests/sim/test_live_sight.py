"""Sightings without pictures agree with pictures about what is hidden."""

from __future__ import annotations

import numpy as np

from airground.sim.body import Tag
from airground.sim.body_kinds import box, pillar, robot
from airground.sim.body_poses import parked
from airground.sim.live_pictures import Picture
from airground.sim.live_sight import LiveSight
from airground.sim.scene_camera import Pinhole
from airground.sim.world import demo_world

PICTURE = Picture(0, 1.0, 1.06, 1.06, 0, 0.0, False)


def labels(*places: tuple[float, float], covered: tuple[str, ...] = ()) -> tuple[str, ...]:
    robots = tuple(
        robot(f"r{k}", parked(*place), Tag("36h11", k, 0.4), size_m=(0.64, 0.54, 0.24))
        for k, place in enumerate(places)
    )
    around = (
        pillar("pillar", parked(0.0, 4.0), radius_m=0.2, height_m=1.6),
        box("box", parked(-1.5, 4.0), (0.5, 0.5, 0.1)),
    )
    sight = LiveSight((*around, *robots), Pinhole.of_world(demo_world()), 0.1, 0)
    return sight.look(PICTURE, frozenset(covered)).labels


def test_what_is_behind_a_pillar_is_hidden() -> None:
    assert labels((0.0, 3.0), (0.0, 5.0), (1.0, 5.0)) == ("0", "2")


def test_what_is_lower_hides_nothing() -> None:
    assert labels((-1.5, 4.7), (-1.5, 5.6)) == ("0", "1")


def test_what_is_not_wholly_in_the_image_is_not_seen() -> None:
    assert labels((0.0, 1.9), (20.0, 4.0), (0.0, -5.0), (0.5, 5.0)) == ("3",)
    assert labels((0.0, -5.0)) == ()


def test_cloths_cover() -> None:
    assert labels((1.0, 3.0), (1.0, 5.0), covered=("r0",)) == ("1",)


def test_noise_depends_on_the_pictures_number_only() -> None:
    body = robot("r", parked(0.5, 4.0), Tag("36h11", 0, 0.4))
    sight = LiveSight((body,), Pinhole.of_world(demo_world()), 0.5, 7)
    one, other = (Picture(k, 1.0, 1.0, 1.0, 0, 0.0, False) for k in (4, 5))
    nothing = frozenset[str]()
    first = sight.look(one, nothing).uv
    second = sight.look(other, nothing).uv
    assert np.array_equal(sight.look(one, nothing).uv, first)
    assert not np.array_equal(first, second)

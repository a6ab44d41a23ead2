"""Where the positions start, against the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration.trajectory.positions import first_robot, resampled
from airground.calibration.trajectory.state import Robot
from airground.geometry.limited import LimitedHomography
from arcs import Drive, arcs_under, drive
from scenes import scene


def one(*, turn: float = 0.0, scale: float = 0.0, count: int = 200, **more: object) -> Drive:
    camera = scene(tilt_deg=40.0, heading_deg=25.0)
    arcs = arcs_under(camera, 1, turn=(turn,), scale=(scale,))
    return drive(camera, arcs, count=count, hz=10.0, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("share", [0.0, 0.4])
@pytest.mark.parametrize("turn", [0.0, 2.1])
def test_positions_are_close_to_the_truth(
    share: float, turn: float, rng: np.random.Generator
) -> None:
    case = one(turn=turn, offset=0.3, pixel=1.0, rng=rng)
    (chain,), (truth,) = case.chains, case.truth.robots
    wrong = rng.random(len(chain)) < share
    uv = np.where(wrong[:, None], rng.uniform((0, 0), (1279, 719), chain.uv.shape), chain.uv)
    found = first_robot(
        case.view, LimitedHomography(case.camera.g), replace(chain, uv=uv), 0.3, turn
    )
    off = np.linalg.norm(found.xy - truth.xy, axis=1)
    size = case.arcs[0].radius
    # Of 31 sightings more than half are wrong now and then, so not all positions are good.
    assert np.quantile(off, 1.0 if share == 0 else 0.75) < 0.01 * size
    assert (found.turn, found.scale, found.lever) == (turn, 0.0, (0.0, 0.0))
    assert not found.drift.any()
    assert not found.slip.any()


def test_each_unbroken_stretch_is_moved_by_itself(rng: np.random.Generator) -> None:
    case = one()
    (chain,), (truth,) = case.chains, case.truth.robots
    path = chain.path
    jump = np.where(np.arange(len(path.t)) < len(path.t) // 2, 0.0, 50.0)
    link = np.ones(len(chain) - 1, dtype=bool)
    broken = int(np.searchsorted(chain.t, path.t[len(path.t) // 2]))
    link[broken - 1] = False
    # The odometry begins anew, 50 m away.
    torn = replace(chain, link=link, path=replace(path, xy=path.xy + jump[:, None]))
    found = first_robot(case.view, LimitedHomography(case.camera.g), torn, 0.0, 0.0)
    off = np.linalg.norm(found.xy - truth.xy, axis=1)
    inside = np.abs(np.arange(len(chain)) - broken) > 1
    assert off[inside].max() < 0.02 * case.arcs[0].radius


def test_a_stretch_without_any_ground_under_it_stays_finite() -> None:
    case = one(count=20)
    (chain,) = case.chains
    sky = replace(chain, uv=np.full_like(chain.uv, -5000.0))
    found = first_robot(case.view, LimitedHomography(case.camera.g), sky, 0.0, 0.0)
    assert np.isfinite(found.xy).all()


@pytest.mark.parametrize("every", [1, 3, 7])
def test_resampled_positions_are_those_of_the_few_and_on_the_path_between(every: int) -> None:
    case = one(turn=0.7, scale=0.05, offset=0.1)
    (many,), (truth,) = case.chains, case.truth.robots
    rows = np.arange(0, len(many), every)
    few = many.take(rows)
    t = few.t
    robot = Robot(
        truth.xy[rows] + np.column_stack([0.3 * t, np.sin(t)]),
        drift=np.sin(t),
        slip=0.1 * t,
        turn=truth.turn,
        scale=truth.scale,
        lever=(0.1, 0.2),
    )
    found = resampled(robot, few, many, 0.1)
    assert_allclose(found.xy[rows], robot.xy, atol=1e-9)
    assert_allclose(found.drift[rows], robot.drift, atol=1e-12)
    assert_allclose(found.slip[rows], robot.slip, atol=1e-12)
    assert (found.turn, found.scale, found.lever) == (robot.turn, robot.scale, robot.lever)
    # Between them: the drive itself, and straight lines between what was added to it.
    last = rows[-1] + 1
    added = np.column_stack([np.interp(many.t, t, 0.3 * t), np.interp(many.t, t, np.sin(t))])
    assert_allclose(found.xy[:last], (truth.xy + added)[:last], atol=1e-5 * case.arcs[0].radius)


def test_where_the_odometry_began_does_not_matter(rng: np.random.Generator) -> None:
    case = one(pixel=0.5, rng=rng)
    (chain,) = case.chains
    moved = replace(chain, path=replace(chain.path, xy=chain.path.xy + (17.0, -8.0)))
    model = LimitedHomography(case.camera.g)
    one_way = first_robot(case.view, model, chain, 0.0, 0.0)
    other_way = first_robot(case.view, model, moved, 0.0, 0.0)
    assert_allclose(one_way.xy, other_way.xy, atol=1e-9)

"""Ways against Dijkstra on a fine grid, and what is said where there is none."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely  # type: ignore[import-untyped]
from numpy.testing import assert_allclose
from scipy.sparse import coo_array  # type: ignore[import-untyped]
from scipy.sparse.csgraph import dijkstra  # type: ignore[import-untyped]

from airground.control import Floor
from airground.control.separation.fence import Fence
from airground.control.separation.planner import WayPlanner, plan_way
from airground.errors import NoWayError
from airground.geometry import LimitedHomography
from airground.sim import demo_world

CAMERA = demo_world().camera
FLOOR = Floor(LimitedHomography(CAMERA.g), np.array([640.0, 400.0]))
RADIUS = 0.2


def px(xy: object) -> np.ndarray:
    return FLOOR.pixel(np.asarray(xy, dtype=float))


def drawn(*rings: object) -> tuple[np.ndarray, ...]:
    return tuple(px(ring) for ring in rings)


SQUARE = [[-2, -1], [2, -1], [2, 3], [-2, 3]]
WALL = [[-1.5, 0.8], [1.0, 0.6], [1.0, 0.9], [-1.5, 1.1]]
LUMP = [[0.6, 1.5], [1.3, 1.6], [1.2, 2.3], [0.9, 2.0], [0.5, 2.2]]
CROSS = [[-2.5, 0.8], [2.5, 0.8], [2.5, 1.0], [-2.5, 1.0]]


def grid_length(shapes: tuple[object, ...], start: object, goal: object, step: float) -> float:
    """Shortest way over a grid whose points are joined to all within 3 steps: 1 % too long at most."""
    free = shapely.Polygon(SQUARE).buffer(-RADIUS)
    for shape in shapes:
        free = free.difference(shapely.Polygon(shape).buffer(RADIUS, quad_segs=64))
    x, y = np.meshgrid(np.arange(-2, 2 + step / 2, step), np.arange(-1, 3 + step / 2, step))
    ok = shapely.contains_xy(free, x, y)
    index = np.arange(x.size).reshape(x.shape)
    rows, columns, lengths = [], [], []
    hops = [(0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1)]
    hops += [(1, 3), (3, 1), (2, 3), (3, 2), (1, -3), (3, -1), (2, -3), (3, -2)]
    for down, right in hops:
        a = np.s_[: x.shape[0] - down, max(0, -right) : x.shape[1] - max(0, right)]
        b = np.s_[down:, max(0, right) : x.shape[1] - max(0, -right)]
        both = ok[a] & ok[b]
        rows.append(index[a][both])
        columns.append(index[b][both])
        lengths.append(np.full(both.sum(), step * np.hypot(down, right)))
    graph = coo_array(
        (np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))), (x.size, x.size)
    )
    ends = [int(np.argmin(np.hypot(x - p[0], y - p[1]))) for p in np.array([start, goal])]
    return float(dijkstra(graph.tocsr(), directed=False, indices=ends[0])[ends[1]])


@pytest.mark.parametrize(
    ("shapes", "start", "goal"),
    [
        ((WALL, LUMP), [-1.0, -0.5], [-0.8, 2.0]),
        ((WALL, LUMP), [1.0, 0.0], [0.2, 2.6]),
        ((LUMP,), [0.2, 1.5], [1.6, 2.6]),
        ((), [-1.0, 0.0], [1.0, 2.0]),
    ],
)
def test_ways_are_as_short_as_those_over_a_fine_grid(
    shapes: tuple[object, ...], start: list[float], goal: list[float]
) -> None:
    planner = WayPlanner(Fence(FLOOR, drawn(SQUARE), drawn(*shapes)), RADIUS)
    way = planner.way(px(start), px(goal))
    grid = grid_length(shapes, start, goal, 0.05)
    assert_allclose(way[[0, -1]], px([start, goal]), atol=1e-6)
    assert 0.97 * grid < planner.length_m(way) < 1.005 * grid
    xy = FLOOR.position(way)
    share = np.linspace(0, 1, 50)[:, None]
    dense = shapely.points(np.concatenate([a + share * (b - a) for a, b in pairwise(xy)]))
    rings = [shapely.Polygon(ring).exterior for ring in (SQUARE, *shapes)]
    assert min(shapely.distance(ring, dense).min() for ring in rings) > RADIUS - 1e-6


def test_no_way_through_a_wall_gives_the_nearest_place() -> None:
    fence = Fence(FLOOR, drawn(SQUARE), drawn(CROSS))
    with pytest.raises(NoWayError, match="no gap that is wide enough") as caught:
        plan_way(px([-1, 0]), px([0.5, 2.0]), fence=fence, radius_m=RADIUS)
    assert caught.value.nearest_uv is not None
    assert_allclose(FLOOR.position(caught.value.nearest_uv), [0.5, 0.6], atol=2e-3)
    narrow = Fence(FLOOR, drawn(SQUARE), drawn([[-1.7, 0.8], [2.5, 0.8], [2.5, 1.0], [-1.7, 1.0]]))
    with pytest.raises(NoWayError, match="wide enough"):
        plan_way(px([-1, 0]), px([0.5, 2.0]), fence=narrow, radius_m=0.16)
    assert len(plan_way(px([-1, 0]), px([0.5, 2.0]), fence=narrow, radius_m=0.14)) > 3


@pytest.mark.parametrize("goal", [[0.0, 0.85], [0.0, 0.55], [5.0, 0.0]])
def test_a_goal_where_no_robot_may_be_gives_the_nearest_place(goal: list[float]) -> None:
    fence = Fence(FLOOR, drawn(SQUARE), drawn(WALL))
    with pytest.raises(NoWayError, match="goal_uv has less than 0.2 m") as caught:
        plan_way(px([-1, 0]), px(goal), fence=fence, radius_m=RADIUS)
    assert caught.value.nearest_uv is not None
    near = FLOOR.position(caught.value.nearest_uv)
    assert fence.clearance(near) == pytest.approx(RADIUS, abs=3e-3)
    offsets = np.random.default_rng(0).uniform(-0.5, 0.5, (2000, 2))
    others = near + offsets
    others = others[fence.clearance(others) > RADIUS + 2e-3]
    assert np.hypot(*(near - goal)) < np.hypot(*(others - goal).T).min() + 1e-3
    assert len(plan_way(px([-1, 0]), caught.value.nearest_uv, fence=fence, radius_m=RADIUS))


def test_a_start_in_the_margin_first_leaves_it() -> None:
    fence = Fence(FLOOR, drawn(SQUARE), drawn(WALL))
    way = FLOOR.position(plan_way(px([0.0, 0.6]), px([0.5, -0.5]), fence=fence, radius_m=RADIUS))
    assert_allclose(way[0], [0.0, 0.6], atol=1e-9)
    assert fence.clearance(way[1]) == pytest.approx(RADIUS, abs=3e-3)
    assert np.hypot(*(way[1] - way[0])) < RADIUS
    with pytest.raises(NoWayError, match="start_uv lies where no robot may be") as caught:
        plan_way(px([0.0, 0.85]), px([0.5, -0.5]), fence=fence, radius_m=RADIUS)
    assert caught.value.nearest_uv is not None
    assert fence.clearance(FLOOR.position(caught.value.nearest_uv)) > RADIUS - 1e-6


def test_a_robot_too_large_for_the_fence_has_no_way() -> None:
    fence = Fence(FLOOR, drawn(SQUARE))
    with pytest.raises(NoWayError):
        plan_way(px([-1, 0]), px([1, 1]), fence=fence, radius_m=2.5)


def test_without_a_fence_ways_lead_round_obstacles_in_view() -> None:
    fence = Fence(FLOOR, (), drawn(CROSS))
    way = FLOOR.position(plan_way(px([0, 0]), px([0, 2]), fence=fence, radius_m=RADIUS))
    assert np.abs(way[:, 0]).max() == pytest.approx(2.5 + RADIUS, abs=0.01)
    assert len(plan_way(px([0, 0]), px([0, 2]), fence=Fence(FLOOR), radius_m=RADIUS)) == 2


@pytest.mark.parametrize("uv", [[640.0, -2000.0]])
def test_places_beyond_the_horizon_are_refused(uv: list[float]) -> None:
    fence = Fence(FLOOR, drawn(SQUARE))
    with pytest.raises(NoWayError, match="horizon"):
        plan_way(px([0, 0]), uv, fence=fence, radius_m=RADIUS)
    with pytest.raises(ValueError, match="NaN"):
        plan_way([np.nan, 3.0], px([0, 0]), fence=fence, radius_m=RADIUS)
    with pytest.raises(ValueError, match="radius_m"):
        WayPlanner(fence, -1.0)

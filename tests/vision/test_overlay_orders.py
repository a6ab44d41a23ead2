"""Paths and goals appear where they are, and nowhere else."""

from __future__ import annotations

import numpy as np

from airground.vision.overlay_orders import draw_goal, draw_path


def canvas() -> np.ndarray[tuple[int, int, int], np.dtype[np.uint8]]:
    return np.zeros((100, 200, 3), dtype=np.uint8)


def test_a_path_runs_through_its_points_and_leaves_out_what_is_missing() -> None:
    image = canvas()
    uv = np.array([[20.0, 50], [60, 50], [np.nan, 50], [120, 50], [160, 50], [1e9, 50]])
    draw_path(image, uv)
    lit = image[50].max(axis=1) > 0
    assert lit[21:59].all()
    assert lit[121:159].all()
    assert not lit[65:115].any()
    assert not image[:40].any()


def test_slow_and_fast_differ() -> None:
    slow, fast = canvas(), canvas()
    uv = np.array([[20.0, 50], [60, 50]])
    draw_path(slow, uv, np.zeros(2))
    draw_path(fast, uv, np.ones(2))
    assert slow[50, 40, 2] > slow[50, 40, 1]  # orange: more red than green
    assert fast[50, 40, 1] > fast[50, 40, 2]


def test_a_goal_is_a_ring_about_its_pixel() -> None:
    image, reached = canvas(), canvas()
    draw_goal(image, np.array([100.0, 50.0]))
    rows, columns = np.nonzero(image.max(axis=2))
    assert abs(rows.mean() - 50) < 0.1
    assert abs(columns.mean() - 100) < 0.1
    draw_goal(reached, np.array([100.0, 50.0]), reached=True)
    assert (image != reached).any()
    for uv in ([np.nan, 3.0], [1e9, 3.0]):
        away = canvas()
        draw_goal(away, np.array(uv))
        assert not away.any()

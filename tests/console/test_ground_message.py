"""Horizon, grid and the view from above: judged by the pinhole of the tests, which shares no code."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from airground.console.ground_message import ground_bounds, ground_document, simplified
from airground.console.messages import message_text
from airground.geometry import DivisionLens
from console.fake_session import SIZE, calibration_for

K1 = -2e-7


def with_lens() -> Any:
    return replace(calibration_for(), lens=DivisionLens(K1, np.array([640.0, 360.0])))


def ground(document: dict[str, Any], uv: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Ground point of a raw pixel, by what a page is told and nothing else."""
    rectify = document["rectify"]
    if rectify["lens"] is not None:
        center = np.array(rectify["lens"]["center_px"])
        offset = uv - center
        uv = center + offset / (1 + rectify["lens"]["k1"] * np.sum(offset**2))
    x, y, w = np.reshape(rectify["ground_from_image"], (3, 3)) @ [*uv, 1.0]
    return np.array([x / w, y / w])


@pytest.mark.parametrize("calibration", [calibration_for(), with_lens()], ids=["pinhole", "lens"])
def test_lines_of_the_grid_lie_on_whole_multiples_of_the_step(calibration: Any) -> None:
    document = ground_document(calibration, SIZE)
    step = document["step_m"]
    checked = 0
    for line in document["grid"]:
        corners = np.array(line["points"])
        shares = np.linspace(0, len(corners) - 1, 20 * len(corners))
        uv = np.stack([np.interp(shares, range(len(corners)), c) for c in corners.T], axis=-1)
        uv = uv[((uv >= 0) & (uv < SIZE)).all(axis=1)]
        points = np.array([ground(document, one) for one in uv]).reshape(-1, 2)
        near = points[np.abs(points).max(axis=1, initial=0.0) < 10]  # far off, a pixel is metres
        off = np.abs(near / step - np.round(near / step)).max(axis=0, initial=0.0)
        assert off.min() < 0.05
        if line["axis"]:
            assert np.abs(near).max(axis=0, initial=0.0).min() < 0.05 * step
        checked += len(near) > 1
    assert checked > 8
    assert sum(line["axis"] for line in document["grid"]) >= 2


def test_a_pinhole_needs_two_points_a_line_and_a_lens_more() -> None:
    straight = [len(line["points"]) for line in ground_document(calibration_for(), SIZE)["grid"]]
    bent = [len(line["points"]) for line in ground_document(with_lens(), SIZE)["grid"]]
    assert max(straight) == 2
    assert 2 < max(bent) < 40


def test_it_is_short() -> None:
    for calibration in (calibration_for(), with_lens(), calibration_for(80.0)):
        assert len(message_text(ground_document(calibration, SIZE))) < 12_000


def test_the_origin_is_at_zero() -> None:
    document = ground_document(calibration_for(), SIZE)
    assert np.abs(ground(document, np.array([640.0, 400.0]))).max() < 1e-6


def test_the_horizon_is_positive_on_the_ground_and_vanishes_at_nadir() -> None:
    a, b, c = ground_document(calibration_for(70.0), SIZE)["horizon"]
    assert np.hypot(a, b) == pytest.approx(1)
    assert a * 640 + b * 700 + c > 0
    nadir = ground_document(calibration_for(0.0), SIZE)
    assert nadir["horizon"] is None
    assert nadir["rectify"] is not None


def test_bounds_leave_out_what_is_too_far() -> None:
    calibration = calibration_for(85.0)  # the horizon is in the image
    bounds = ground_bounds(calibration, SIZE)
    assert bounds is not None
    x0, y0, x1, y1 = bounds
    assert x0 < x1
    assert y0 < y1
    assert max(x1 - x0, y1 - y0) < 200  # camera height is 6 m
    nadir = ground_bounds(calibration_for(0.0), SIZE)
    assert nadir is not None
    corners = [[0, 0], [1279, 0], [0, 719], [1279, 719]]
    xy = calibration_for(0.0).model.ground_position(corners, [640.0, 400.0])
    assert nadir[0] == pytest.approx(xy[:, 0].min(), rel=0.01)
    assert nadir[3] == pytest.approx(xy[:, 1].max(), rel=0.01)


def test_without_ground_in_view_there_is_nothing_to_draw() -> None:
    calibration = replace(
        calibration_for(85.0), origin_px=np.array([640.0, 4000.0]), image_size_px=None
    )
    document = ground_document(calibration, (1280, 20))
    assert document["grid"] == []
    assert document["rectify"] is None


def test_simplified_keeps_within_its_tolerance(rng: np.random.Generator) -> None:
    s = np.linspace(0, 6, 300)
    line = np.stack([100 * s, 80 * np.sin(s)], axis=-1)
    simple = simplified(line, 0.5)
    assert 5 < len(simple) < 60
    back = np.interp(line[:, 0], simple[:, 0], simple[:, 1])
    assert np.abs(back - line[:, 1]).max() < 0.9  # measured upright, not across
    closed = np.array([[0.0, 0.0], [5.0, 5.0], [0.0, 0.0]])
    assert len(simplified(closed)) == 3

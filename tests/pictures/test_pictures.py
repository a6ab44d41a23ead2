"""Pictures: drawn whole, the same bytes each time, with what they must show in them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import cv2
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from airground.calibration import Calibration, calibrate
from airground.calibration.inspection import inspect_calibration
from airground.calibration.metric_grid import grid_spacing
from airground.geometry import DivisionLens, LimitedHomography
from airground.pictures.inspection import _round_levels, draw_grid, draw_inspection
from drives import fit_drive, read, see
from scenes import Scene, scene
from warp import Warp

HORIZON_BGR = np.array([0x00, 0x5E, 0xD5])


def calibrated(here: Scene) -> Calibration:
    drive = fit_drive(here)
    found = calibrate(
        see(here, drive, np.arange(0, 60, 1 / 20)),
        read(drive, np.arange(-1, 61, 0.05)),
        time_offset_s=0.0,
        image_size_px=here.image_size,
    )
    return dataclasses.replace(found, model=LimitedHomography(here.g))


def horizon_pixels(path: Path) -> np.ndarray:
    image = cv2.imread(str(path))
    assert image is not None
    return np.asarray((np.abs(image.astype(int) - HORIZON_BGR) < 12).all(axis=2))


@pytest.mark.parametrize(
    ("tilt_deg", "shown"), [(0, False), (30, False), (60, True), (75, True), (80, True)]
)
def test_the_horizon_is_drawn_where_it_is_near(
    tmp_path: Path, tilt_deg: float, shown: bool
) -> None:
    calibration = calibrated(scene(tilt_deg=tilt_deg, roll_deg=8))
    path = tmp_path / "view.png"
    draw_inspection(path, calibration, inspect_calibration(calibration))
    drawn = horizon_pixels(path)
    # The line in the picture, not only its entry in the legend.
    assert bool(drawn.sum() > 1000) is shown
    first = path.read_bytes()
    draw_inspection(path, calibration, inspect_calibration(calibration))
    assert path.read_bytes() == first


def test_without_an_image_size_the_driven_region_is_drawn(tmp_path: Path) -> None:
    calibration = dataclasses.replace(calibrated(scene(tilt_deg=40)), image_size_px=None)
    draw_inspection(tmp_path / "view.png", calibration, inspect_calibration(calibration))
    assert cv2.imread(str(tmp_path / "view.png")) is not None


def test_grid_lines_are_straight_and_a_spacing_apart() -> None:
    here = scene(tilt_deg=50)
    calibration = calibrated(here)
    figure = Figure()
    FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    spacing = draw_grid(ax, calibration, (0.0, 0.0, 1279.0, 719.0))
    origin = here.unproject(calibration.origin_px)
    constant = []
    for line in ax.lines:
        uv = np.column_stack([np.asarray(x, dtype=float) for x in line.get_data()])
        uv = uv[np.isfinite(uv).all(axis=1) & here.in_image(uv)]
        if len(uv) < 3:
            continue
        xy = (here.unproject(uv) - origin) / spacing  # by the scene's own rays
        along = int(np.argmin(np.ptp(xy, axis=0)))
        assert np.ptp(xy[:, along]) < 1e-6
        constant.append((along, xy[0, along]))
    assert {axis for axis, _ in constant} == {0, 1}
    values = np.array([value for _, value in constant])
    np.testing.assert_allclose(values, np.round(values), atol=1e-6)
    assert len(constant) > 8


def bent(here: Scene, warp: Warp) -> Calibration:
    return dataclasses.replace(
        calibrated(here),
        lens=DivisionLens(warp.k1, np.array(warp.center)),
        image_size_px=(1280, 720),
    )


@pytest.mark.parametrize("k1", [-7e-7, 4e-7])
def test_a_bent_horizon_is_drawn_where_the_far_ground_is(tmp_path: Path, k1: float) -> None:
    here = scene(tilt_deg=66)
    warp = Warp(k1, here.principal_point)
    calibration = bent(here, warp)
    figure_of = tmp_path / "view.png"
    draw_inspection(figure_of, calibration, inspect_calibration(calibration))
    drawn = horizon_pixels(figure_of)
    rows = [np.flatnonzero(column) for column in drawn.T]
    across = [k for k, row in enumerate(rows) if len(row)]
    # From the picture's left edge to its right: high in the middle for a barrel, low for a pincushion.
    line = np.array([rows[k][0] for k in across if len(rows[k])], dtype=float)
    ends, middle = (line[5] + line[-5]) / 2, line[len(line) // 2]
    assert (middle < ends - 10) if k1 < 0 else (middle > ends + 10)


def test_grid_lines_are_those_of_the_ground_through_the_lens() -> None:
    here = scene(tilt_deg=50)
    warp = Warp(-6e-7, here.principal_point)
    calibration = bent(here, warp)
    figure = Figure()
    FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    spacing = draw_grid(ax, calibration, (0.0, 0.0, 1279.0, 719.0))
    origin = here.unproject(calibration.origin_px)
    constant, bow = [], 0.0
    for line in ax.lines:
        uv = np.column_stack([np.asarray(x, dtype=float) for x in line.get_data()])
        uv = uv[np.isfinite(uv).all(axis=1) & here.in_image(uv)]
        if len(uv) < 3:
            continue
        bow = max(bow, float(np.linalg.svd(uv - uv.mean(axis=0), compute_uv=False)[1]))
        xy = (here.unproject(warp.straighten(uv)) - origin) / spacing
        along = int(np.argmin(np.ptp(xy, axis=0)))
        assert np.ptp(xy[:, along]) < 1e-6
        constant.append((along, xy[0, along]))
    assert {axis for axis, _ in constant} == {0, 1}
    values = np.array([value for _, value in constant])
    np.testing.assert_allclose(values, np.round(values), atol=1e-6)
    assert bow > 50  # px, summed over a line: they are not straight in the picture


@pytest.mark.parametrize(
    ("extent", "spacing"), [(14.0, 1.0), (7.0, 0.5), (30.0, 2.0), (1400.0, 100.0), (0.7, 0.05)]
)
def test_spacing_is_round(extent: float, spacing: float) -> None:
    assert grid_spacing(extent) == pytest.approx(spacing)


@pytest.mark.parametrize(
    ("low", "high"), [(417.4, 487.0), (4.8, 59.8), (0.1, 900.0), (99.0, 101.0), (1.0, 2.9)]
)
def test_scale_lines_are_a_few_round_numbers_inside(low: float, high: float) -> None:
    levels = _round_levels(low, high)
    assert 2 <= len(levels) <= 8
    assert all(low < level < high for level in levels)
    assert all(len(f"{level:g}") <= 5 for level in levels)

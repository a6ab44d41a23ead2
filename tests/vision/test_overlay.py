"""What is drawn: where it should be, and nothing else is changed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from airground.calibration import calibrate
from airground.vision.frame import Frame
from airground.vision.overlay import Overlay, OverlayOptions, colour_of
from airground.vision.sightings import Sightings
from airground.vision.tracker import Track, Tracker
from drives import fit_drive, read, see
from scenes import scene

GREY = np.full((240, 320, 3), 90, dtype=np.uint8)
BARE = OverlayOptions(grid=False)


def follow(uv: np.ndarray[Any, Any], hz: float = 30.0) -> list[tuple[Frame, tuple[Track, ...]]]:
    """Tracks of one labelled thing that is seen at the given places; NaN where it is not."""
    tracker = Tracker()
    out = []
    for k, place in enumerate(uv):
        t = k / hz
        seen = (
            Sightings.round(t, [place], 0.5, labels=["7"])
            if np.isfinite(place).all()
            else Sightings.none(t)
        )
        out.append((Frame(GREY, t, index=k), tracker.update(seen).tracks))
    return out


def changed(image: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Pixels that are not the background's, without the line at the top left."""
    where: np.ndarray[Any, Any] = (image != 90).any(axis=-1)
    where[:30, :200] = False
    return where


def test_a_track_is_drawn_where_it_is_and_the_frame_is_left_alone() -> None:
    uv = np.column_stack([np.linspace(100, 160, 30), np.full(30, 120.0)])
    overlay = Overlay(BARE)
    for frame, tracks in follow(uv):
        image = overlay.draw(frame, tracks)
    assert (GREY == 90).all()
    assert (image[120, 160] == colour_of("7")).all()
    rows, columns = np.nonzero(changed(image))
    assert columns.min() < 105  # the trail goes back to where it began
    assert rows.max() < 135


def test_a_trail_ends_after_its_time() -> None:
    uv = np.column_stack([np.linspace(20, 300, 60), np.full(60, 120.0)])
    overlay = Overlay(OverlayOptions(grid=False, trail_s=0.5))
    for frame, tracks in follow(uv):
        image = overlay.draw(frame, tracks)
    _, columns = np.nonzero(changed(image)[116:125])
    assert columns.min() > 300 - 0.6 * 140 - 10


def test_what_was_lost_for_long_is_not_drawn() -> None:
    uv = np.full((90, 2), [160.0, 120.0])
    uv[30:] = np.nan
    overlay = Overlay(BARE)
    drawn = [changed(overlay.draw(frame, tracks)).any() for frame, tracks in follow(uv)]
    assert drawn[29]
    assert drawn[40]  # for a while it is, as lost
    assert not drawn[89]


def test_a_moving_camera_moves_the_drawing_with_the_ground() -> None:
    uv = np.full((20, 2), [100.0, 100.0])
    shift = np.array([[1.0, 0.0, 60.0], [0.0, 1.0, 40.0], [0.0, 0.0, 1.0]])
    overlay = Overlay(BARE)
    for frame, tracks in follow(uv):
        image = overlay.draw(frame, tracks, image_from_stable=shift)
    assert (image[140, 160] == colour_of("7")).all()
    assert not changed(image)[95:106, 95:106].any()


def test_points_that_cannot_be_drawn_are_left_out() -> None:
    uv = np.full((20, 2), [100.0, 100.0])
    horizon = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.01, -1.0]])  # through v = 100
    overlay = Overlay(BARE)
    for frame, tracks in follow(uv):
        image = overlay.draw(frame, tracks, image_from_stable=horizon)
    assert not changed(image).any()


@pytest.mark.parametrize("tilt_deg", [50.0, 75.0])
def test_horizon_and_grid_are_those_of_the_ground(tilt_deg: float) -> None:
    here = scene(tilt_deg=tilt_deg)
    drive = fit_drive(here)
    tracks = see(here, drive, np.arange(0, 60, 1 / 30))
    motion = read(drive, np.arange(-1.5, 62, 0.05), form="speed")
    calibration = calibrate(tracks, motion, method="linear", image_size_px=(1280, 720))
    dark = np.zeros((720, 1280), dtype=np.uint8)
    image = Overlay(calibration=calibration).draw(Frame(dark, 0.0), ())
    image[:30, :200] = 0
    lit = image.max(axis=-1) > 30
    red = lit & (image[..., 2].astype(int) > image[..., 0].astype(int) + 60)
    G1, G2 = here.g.T
    a, b, c = np.cross(G1, G2)
    v = -(a * 640 + c) / b  # the horizon's row in the middle of the image
    if 0 < v < 720:
        rows = np.flatnonzero(red[:, 640])
        assert len(rows)
        assert abs(rows.mean() - v) < 3
    else:
        assert not red.any()
    assert lit[max(int(v) + 50, 0) :].mean() > 0.01  # there are lines on the ground
    assert not lit[: max(int(v) - 5, 0)].any()  # and none in the sky


def test_a_grey_image_becomes_a_colour_one_with_text() -> None:
    frame = Frame(np.zeros((240, 320), dtype=np.uint8), 12.5)
    image = Overlay(BARE).draw(frame, (), status="NOT HELD: blurred", alarm=True)
    assert image.shape == (240, 320, 3)
    corner = image[:30].astype(int)
    assert (corner[..., 2] > corner[..., 0] + 100).any()  # in red
    assert not image[40:].any()

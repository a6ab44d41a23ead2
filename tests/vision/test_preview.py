"""A preview takes as long as what it shows, whatever the camera's rate; read back by another library."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from airground.vision.eyes import Eyes
from airground.vision.frame import Frame
from airground.vision.overlay import Overlay
from airground.vision.preview import Preview
from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from pathlib import Path


class Blind:
    """Sees nothing."""

    def detect(self, frame: Frame) -> Sightings:
        return Sightings.none(frame.t)


def shown(path: Path, t: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[list[float], float]:
    """Brightness of each picture of the preview of frames at times t, and its rate; frame k has brightness k."""
    eyes = Eyes(Blind(), Tracker())
    with Preview(path, Overlay()) as preview:
        for k, time in enumerate(t):
            preview.add(eyes.look(Frame(np.full((64, 256), 2 * k, dtype=np.uint8), float(time))))
    video = cv2.VideoCapture(str(path))
    rate = float(video.get(cv2.CAP_PROP_FPS))
    levels: list[float] = []
    while True:
        ok, image = video.read()
        if not ok:
            return levels, rate
        levels.append(float(image[40:].mean()) / 2)


@pytest.mark.parametrize("count", [1, 2, 5, 12, 13, 40])
def test_every_frame_is_shown_once_at_a_steady_rate(tmp_path: Path, count: int) -> None:
    levels, rate = shown(tmp_path / "p.mkv", 5.0 + np.arange(count) / 20)
    assert levels == pytest.approx(list(range(count)), abs=0.51)
    if count > 1:
        assert rate == pytest.approx(20, rel=0.02)


def test_a_frame_is_shown_until_the_next_one_comes(tmp_path: Path) -> None:
    t = np.concatenate([np.arange(20) / 20, 2.0 + np.arange(10) / 20])  # a gap of 1.05 s
    levels, _ = shown(tmp_path / "p.mkv", t)
    assert len(levels) == 50
    assert sum(abs(level - 19) < 0.51 for level in levels) == 21


def test_frames_that_come_faster_than_the_rate_are_left_out(tmp_path: Path) -> None:
    t = np.concatenate([np.arange(20) / 10, 2.0 + np.arange(40) / 40])
    levels, rate = shown(tmp_path / "p.mkv", t)
    assert rate == pytest.approx(10, rel=0.02)
    assert len(levels) == pytest.approx(30, abs=1)


def test_a_gap_of_hours_is_not_shown_in_full(tmp_path: Path) -> None:
    t = np.concatenate([np.arange(20) / 10, 7200 + np.arange(20) / 10])
    levels, _ = shown(tmp_path / "p.mkv", t)
    assert len(levels) == pytest.approx(40 + 50, abs=2)


def test_without_frames_there_is_no_video(tmp_path: Path) -> None:
    with Preview(tmp_path / "p.mp4", Overlay()):
        pass
    assert not (tmp_path / "p.mp4").exists()

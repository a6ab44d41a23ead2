from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import pytest

from airground.errors import InputError, UnreachableError
from airground.vision.sources import FrameSource, ImageFolder, VideoFile, live_source, open_source
from vision.sources.films import record

if TYPE_CHECKING:
    from pathlib import Path


def test_names_open_what_they_mean(tmp_path: Path) -> None:
    video = record(tmp_path / "1.5.mp4", [0, 3600])
    with open_source(str(video)) as source:
        assert isinstance(source, VideoFile)
        assert isinstance(source, FrameSource)
        assert source.name == str(video)
    import cv2

    from vision.sources.films import numbered

    cv2.imwrite(str(tmp_path / "1.5.png"), numbered(0))
    with open_source(tmp_path) as source:
        assert isinstance(source, ImageFolder)
        assert isinstance(source, FrameSource)


def test_settings_are_checked(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="backend must be one of auto, opencv, pyav"):
        open_source(tmp_path, backend="vlc")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="size can be asked only of a camera"):
        open_source(tmp_path, size_px=(640, 480))
    with pytest.raises(InputError, match="size can be asked only of a camera"):
        live_source("rtsp://host/a", size_px=(640, 480))
    with pytest.raises(InputError, match="expected a camera or the address of a stream"):
        live_source("a.mp4")
    settings: list[dict[str, Any]] = [{"patience_s": 0.0}, {"stall_s": float("nan")}]
    for setting in settings:
        with pytest.raises(InputError, match="seconds above zero"):
            live_source("rtsp://host/a", **setting)


def test_pyav_may_be_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    video = record(tmp_path / "a.mp4", [0, 3600])
    monkeypatch.setitem(sys.modules, "av", None)  # importing it fails
    with open_source(video) as source:
        assert len(list(source)) == 2
    with pytest.raises(InputError, match=r"pip install 'airground\[video\]'"):
        open_source(video, backend="pyav")


@pytest.mark.skipif(sys.platform != "linux", reason="device files are Linux's")
def test_a_camera_that_is_not_plugged_in_is_said_at_once() -> None:
    with pytest.raises(UnreachableError, match="cannot reach usb:977: there is no /dev/video977"):
        open_source("usb:977", patience_s=1000)


def test_a_live_source_is_not_started() -> None:
    source = live_source("rtsp://me:secret@127.0.0.1:9/a")
    assert source.name == "rtsp://127.0.0.1:9/a"
    assert source.health.state == "opening"
    assert not source.running
    source.close()

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from airground.errors import FileError
from airground.vision.sources import ImageFolder, open_source
from airground.vision.sources.folder import read_image
from vision.sources.films import number_of, numbered

if TYPE_CHECKING:
    from pathlib import Path

SUFFIXES = [".png", ".jpg", ".bmp", ".tif", ".PNG", ".jpeg", ".tiff"]


def fill(folder: Path, names: list[str]) -> Path:
    for k, name in enumerate(names):
        cv2.imwrite(str(folder / name), numbered(k))
    return folder


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_images_in_natural_order_at_a_rate(tmp_path: Path, suffix: str) -> None:
    fill(tmp_path, [f"frame{k}{suffix}" for k in range(12)])
    (tmp_path / ".hidden.png").write_bytes(b"")
    (tmp_path / "readme.md").write_text("not an image")
    (tmp_path / "more.png").mkdir()
    with open_source(tmp_path, rate_hz=4.0) as source:
        frames = list(source)
    assert isinstance(source, ImageFolder)
    assert [frame.t for frame in frames] == [k / 4 for k in range(12)]
    assert [number_of(frame.image) for frame in frames] == list(range(12))
    assert {frame.clock for frame in frames} == {"rate"}
    assert source.frame_count == 12
    assert source.health.notes == ()


def test_times_from_names(tmp_path: Path) -> None:
    fill(tmp_path, ["1403636579763555584.png", "1403636579813555456.png"])
    with open_source(str(tmp_path)) as source:
        frames = list(source)
    assert [frame.t for frame in frames] == [1403636579.763555584, 1403636579.813555456]
    assert {frame.clock for frame in frames} == {"name"}


def test_names_are_ordered_by_their_times(tmp_path: Path) -> None:
    fill(tmp_path, ["b_1.50.png", "a_2.25.png"])
    with open_source(tmp_path) as source:
        assert [number_of(frame.image) for frame in source] == [0, 1]


def test_a_table_beside_comes_before_names(tmp_path: Path) -> None:
    fill(tmp_path, ["1.5.png", "2.5.png", "3.5.png"])
    (tmp_path / "times.csv").write_text("file,t_s\n2.5.png,10\n1.5.png,20\n")
    with open_source(tmp_path) as source:
        frames = list(source)
    assert [(frame.t, number_of(frame.image)) for frame in frames] == [(10.0, 1), (20.0, 0)]
    assert source.health.notes == ("1 images are not named in times.csv and were left out",)


def test_a_list_beside_follows_the_names(tmp_path: Path) -> None:
    fill(tmp_path, ["9.png", "10.png"])
    (tmp_path / "times.txt").write_text("0.5\n0.75\n")
    with open_source(tmp_path) as source:
        assert [(frame.t, number_of(frame.image)) for frame in source] == [(0.5, 0), (0.75, 1)]


def test_without_times_the_user_is_told_what_to_give(tmp_path: Path) -> None:
    fill(tmp_path, ["000000.png", "000001.png"])
    with pytest.raises(
        FileError, match="000000.png holds no time; give the frame rate, or the times in times.csv"
    ):
        open_source(tmp_path)


def test_one_time_twice_is_refused(tmp_path: Path) -> None:
    fill(tmp_path, ["a_1.5.png", "b_1.50.png"])
    with pytest.raises(FileError, match="a_1.5.png and b_1.50.png have one time"):
        open_source(tmp_path)


def test_an_empty_folder_says_what_it_looked_for(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"has no images \(.png, .jpg"):
        open_source(tmp_path)


def test_sizes_must_be_one(tmp_path: Path) -> None:
    fill(tmp_path, ["0.png"])
    cv2.imwrite(str(tmp_path / "1.png"), numbered(1, (32, 48)))
    with open_source(tmp_path, rate_hz=1.0) as source:
        with pytest.raises(
            FileError, match="has 32x48 pixels where those before have 64x48"
        ) as caught:
            list(source)
        assert caught.value.path == str(tmp_path / "1.png")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".bmp", ".tif"])
@pytest.mark.parametrize("keep", [0.0, 0.5])
def test_broken_images_are_left_out_and_counted(tmp_path: Path, suffix: str, keep: float) -> None:
    fill(tmp_path, [f"{k}{suffix}" for k in range(4)])
    broken = tmp_path / f"1{suffix}"
    data = broken.read_bytes()
    broken.write_bytes(data[: int(len(data) * keep)])
    with open_source(tmp_path, rate_hz=1.0) as source:
        frames = list(source)
    assert [(frame.t, frame.index) for frame in frames] == [(0.0, 0), (2.0, 2), (3.0, 3)]
    assert source.health.corrupt == 1
    assert f"1{suffix} is not an image" in source.health.notes[0]


def test_a_folder_of_broken_images_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "0.png").write_bytes(b"no image")
    with (
        open_source(tmp_path, rate_hz=1.0) as source,
        pytest.raises(FileError, match="none of its"),
    ):
        list(source)


def test_deep_grey_and_clear_images_become_ordinary_ones(tmp_path: Path) -> None:
    sixteen = np.array([[0, 0x8000, 0xFFFF]], np.uint16)
    clear = np.zeros((1, 3, 4), np.uint8)
    clear[..., 0] = 200
    cv2.imwrite(str(tmp_path / "deep.png"), sixteen)
    cv2.imwrite(str(tmp_path / "clear.png"), clear)
    deep_back, clear_back = read_image(tmp_path / "deep.png"), read_image(tmp_path / "clear.png")
    assert deep_back is not None
    assert clear_back is not None
    assert_array_equal(deep_back, np.repeat(np.array([[[0], [128], [255]]]), 3, axis=2))
    assert_array_equal(clear_back, clear[..., :3])


def test_a_missing_image_is_none(tmp_path: Path) -> None:
    assert read_image(tmp_path / "a.png") is None

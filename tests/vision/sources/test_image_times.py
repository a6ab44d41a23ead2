from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.errors import FileError
from airground.vision.sources.image_times import natural_key, time_in_name, times_beside

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(
    ("stem", "t"),
    [
        ("1403636579763555584", 1403636579.763555584),  # EuRoC: nanoseconds
        ("1305031102.175304", 1305031102.175304),  # TUM: seconds
        ("1700000000123", 1700000000.123),
        ("1700000000123456", 1700000000.123456),
        ("1700000000", 1700000000.0),
        ("0000000000033333333", 0.033333333),
        ("left_1403636579763555584", 1403636579.763555584),
        ("frame12_3.25", 3.25),
        ("000017", None),  # only counts
        ("frame0001", None),
        ("20240131_093000", None),  # a date is not guessed at
        ("image", None),
        ("1700000000123_left", None),
        ("", None),
    ],
)
def test_times_in_names(stem: str, t: float | None) -> None:
    assert time_in_name(stem) == t


@given(st.integers(10**18, 9 * 10**18))
def test_nanoseconds_are_rounded_once(stamp: int) -> None:
    assert time_in_name(str(stamp)) == float(Fraction(stamp, 10**9))


def test_ten_comes_after_nine() -> None:
    names = ["a10.png", "a9.png", "a1.png", "A2.png", "a09.png", "b.png", "10.png", "2.png"]
    ordered = sorted(names, key=natural_key)
    assert ordered == [
        "2.png",
        "10.png",
        "A2.png",
        "a1.png",
        "a09.png",
        "a9.png",
        "a10.png",
        "b.png",
    ]


def test_there_may_be_no_file_with_times(tmp_path: Path) -> None:
    assert times_beside(tmp_path, ["a.png"]) is None


def test_a_table_names_images(tmp_path: Path) -> None:
    (tmp_path / "times.csv").write_text("t_s,camera,file\n2.5,x,b.png\n\n1e0,y,a.png\n")
    assert times_beside(tmp_path, ["a.png", "b.png", "c.png"]) == {"a.png": 1.0, "b.png": 2.5}


@pytest.mark.parametrize("name", ["timestamps.txt", "times.txt"])
def test_a_list_has_a_line_for_each_image(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("# seconds\n0.000000e+00\n1.036224e-01\n\n")
    assert times_beside(tmp_path, ["a.png", "b.png"]) == {"a.png": 0.0, "b.png": 0.1036224}


@pytest.mark.parametrize(
    ("name", "text", "problem", "line"),
    [
        ("times.csv", "", "columns file and t_s", 1),
        ("times.csv", "file,time\na.png,1\n", "columns file and t_s", 1),
        ("times.csv", "file,t_s\na.png,1\nx.png,2\n", "no image x.png", 3),
        ("times.csv", "file,t_s\na.png,1\na.png,2\n", "named twice", 3),
        ("times.csv", "file,t_s\na.png,nan\n", "a time in seconds", 2),
        ("times.csv", "file,t_s\na.png,soon\n", "a time in seconds", 2),
        ("times.csv", "file,t_s\na.png\n", "expected 2 cells", 2),
        ("times.txt", "1\n", "1 times for 2 images", None),
        ("times.txt", "1\n2011-09-26 13:02:25\n", "a time in seconds", 2),
        ("timestamps.txt", "1\ninf\n", "a time in seconds", 2),
    ],
)
def test_what_is_wrong_is_said_with_its_line(
    tmp_path: Path, name: str, text: str, problem: str, line: int | None
) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(FileError, match=problem) as caught:
        times_beside(tmp_path, ["a.png", "b.png"])
    assert caught.value.line == line


def test_binary_files_hold_no_times(tmp_path: Path) -> None:
    (tmp_path / "times.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileError, match="UTF-8"):
        times_beside(tmp_path, ["a.png"])

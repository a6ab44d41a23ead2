"""speeds.csv as other programs read it."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.errors import FileError, InputError
from airground.records import write_speeds

if TYPE_CHECKING:
    from pathlib import Path

GOOD: dict[str, object] = {
    "t": [1.0, 0.5],
    "targets": ("a", "b"),
    "target_index": [1, 0],
    "uv": [[1, 2], [3, 4]],
    "xy_dot": [[3, 4], [-0.1, 0]],
    "speed_sigma": [0.1, 0],
}


def write(path: Path, **changed: object) -> None:
    write_speeds(path, **{**GOOD, **changed})  # type: ignore[arg-type]


def test_columns_and_rows(tmp_path: Path) -> None:
    write(tmp_path / "speeds.csv")
    assert (tmp_path / "speeds.csv").read_bytes() == (
        b"t_s,target,u_px,v_px,x_dot_mps,y_dot_mps,speed_mps,speed_sigma_mps\n"
        b"1.0,b,1.0,2.0,3.0,4.0,5.0,0.1\n"
        b"0.5,a,3.0,4.0,-0.1,0.0,0.1,0.0\n"
    )


def test_numbers_read_back_bit_for_bit(tmp_path: Path, rng: np.random.Generator) -> None:
    count = 25_000
    xy_dot = rng.normal(size=(count, 2)) * 10.0 ** rng.integers(-9, 9, size=(count, 1))
    write(
        tmp_path / "speeds.csv",
        t=rng.normal(size=count),
        target_index=rng.integers(0, 2, size=count),
        uv=rng.normal(size=(count, 2)),
        xy_dot=xy_dot,
        speed_sigma=rng.exponential(size=count),
    )
    with (tmp_path / "speeds.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    read = np.array([[float(row["x_dot_mps"]), float(row["y_dot_mps"])] for row in rows])
    assert read.tobytes() == xy_dot.tobytes()
    speed = np.array([float(row["speed_mps"]) for row in rows])
    np.testing.assert_allclose(speed, np.hypot(*xy_dot.T), rtol=1e-15)


def test_no_rows_is_a_file_with_a_header(tmp_path: Path) -> None:
    nothing = np.empty((0, 2))
    write(tmp_path / "s.csv", t=[], target_index=[], uv=nothing, xy_dot=nothing, speed_sigma=[])
    assert (tmp_path / "s.csv").read_bytes().count(b"\n") == 1


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"t": [np.nan, 1]}, "t has NaN"),
        ({"uv": [[1, 2], [np.inf, 4]]}, "uv has NaN or infinite"),
        ({"xy_dot": [[np.nan, np.nan], [1, 1]]}, "xy_dot has NaN"),
        ({"xy_dot": [[1e308, 1e308], [1, 1]]}, "the speed has NaN or infinite"),
        ({"speed_sigma": [np.nan, 1]}, "speed_sigma has NaN"),
        ({"speed_sigma": [-1, 1]}, "speed_sigma must not be negative"),
        ({"uv": [[1, 2]]}, "uv must have shape"),
        ({"target_index": [0]}, "target_index must be integers of shape"),
        ({"target_index": [0.0, 1.0]}, "target_index must be integers of shape"),
        ({"target_index": [0, 2]}, r"target_index must lie in 0\.\.1"),
        ({"target_index": [-1, 0]}, r"target_index must lie in 0\.\.1"),
        ({"targets": ("a", " b")}, "target name ' b' must have 1 to 1000 characters"),
    ],
)
def test_what_is_refused_leaves_no_file(
    tmp_path: Path, changed: dict[str, object], problem: str
) -> None:
    with pytest.raises(InputError, match=problem):
        write(tmp_path / "speeds.csv", **changed)
    assert list(tmp_path.iterdir()) == []


def test_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="does not exist"):
        write(tmp_path / "none" / "speeds.csv")

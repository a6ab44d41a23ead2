"""Readings in their two forms, and what does not make up a form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from numpy.testing import assert_array_equal

from airground.errors import FileError
from airground.records import read_motion

if TYPE_CHECKING:
    from pathlib import Path

    from airground.calibration.recordings import Motion

OPTIONAL = ("xy_dot", "heading", "speed", "distance", "sigma_speed", "sigma_heading")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "motion.csv"


def present(motion: Motion) -> set[str]:
    return {name for name in OPTIONAL if getattr(motion, name) is not None}


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ("x_dot_mps,y_dot_mps", {"xy_dot": [[1, 2], [3, 4]]}),
        ("y_dot_mps,x_dot_mps", {"xy_dot": [[2, 1], [4, 3]]}),
        ("heading_rad,speed_mps", {"heading": [1, 3], "speed": [2, 4]}),
        ("distance_m,heading_rad", {"distance": [1, 3], "heading": [2, 4]}),
        (
            "heading_rad,speed_mps,distance_m",
            {"heading": [1, 3], "speed": [2, 4], "distance": [5, 6]},
        ),
        (
            "x_dot_mps,y_dot_mps,sigma_speed_mps",
            {"xy_dot": [[1, 2], [3, 4]], "sigma_speed": [5, 6]},
        ),
        (
            "heading_rad,speed_mps,sigma_heading_rad",
            {"heading": [1, 3], "speed": [2, 4], "sigma_heading": [5, 6]},
        ),
    ],
)
def test_forms(path: Path, columns: str, expected: dict[str, object]) -> None:
    extra = columns.count(",") == 2
    rows = ["1,a,3,4" + ",6" * extra, "0.5,a,1,2" + ",5" * extra]
    path.write_text(f"t_s,target,{columns}\n" + "\n".join(rows) + "\n")
    notes: list[str] = []
    motion = read_motion(path, note=notes.append)
    assert notes == []
    assert_array_equal(motion.t, [0.5, 1])
    assert present(motion) == set(expected)
    for name, value in expected.items():
        assert_array_equal(getattr(motion, name), value)


def test_velocity_is_preferred_and_the_rest_is_not_even_checked(path: Path) -> None:
    path.write_text("t_s,target,heading_rad,x_dot_mps,speed_mps,y_dot_mps\n0,a,,1,nan,2\n")
    notes: list[str] = []
    motion = read_motion(path, note=notes.append)
    assert present(motion) == {"xy_dot"}
    assert notes == [f"{path}: used x_dot_mps and y_dot_mps, not heading_rad, speed_mps"]


@pytest.mark.parametrize(
    ("columns", "problem"),
    [
        ("x_dot_mps", "x_dot_mps needs y_dot_mps beside it"),
        ("y_dot_mps,heading_rad,speed_mps", "y_dot_mps needs x_dot_mps beside it"),
        ("heading_rad", "heading_rad needs speed_mps or distance_m beside it"),
        ("speed_mps", "speed_mps needs heading_rad beside it"),
        ("distance_m,sigma_heading_rad", "distance_m needs heading_rad beside it"),
        (
            "sigma_speed_mps",
            "expected x_dot_mps and y_dot_mps, or heading_rad with speed_mps or distance_m",
        ),
        (
            "u_px,v_px",
            "expected x_dot_mps and y_dot_mps, or heading_rad with speed_mps or distance_m",
        ),
    ],
)
def test_incomplete_forms(path: Path, columns: str, problem: str) -> None:
    path.write_text(f"\nt_s,target,{columns}\n0,a" + ",1" * (columns.count(",") + 1) + "\n")
    with pytest.raises(FileError) as caught:
        read_motion(path)
    assert str(caught.value) == f"{path}:2: {problem}"


@pytest.mark.parametrize("column", ["sigma_speed_mps", "sigma_heading_rad"])
def test_sigma_must_be_positive(path: Path, column: str) -> None:
    path.write_text(f"t_s,target,heading_rad,speed_mps,{column}\n0,a,1,2,0.1\n1,a,1,2,0\n")
    with pytest.raises(FileError) as caught:
        read_motion(path)
    assert (caught.value.line, caught.value.column) == (3, column)


def test_repeated_rows(path: Path) -> None:
    path.write_text("t_s,target,heading_rad,distance_m\n0,a,1,2\n0,a,1,2\n1,a,0,0\n")
    notes: list[str] = []
    assert len(read_motion(path, note=notes.append)) == 2
    assert len(notes) == 1
    path.write_text(path.read_text() + "0,a,1,3\n")
    with pytest.raises(FileError, match="two different readings at") as caught:
        read_motion(path)
    assert caught.value.line == 5


def test_columns_that_are_not_used_do_not_contradict(path: Path) -> None:
    path.write_text("t_s,target,x_dot_mps,y_dot_mps,heading_rad\n0,a,1,2,3\n0,a,1,2,4\n")
    assert len(read_motion(path)) == 1

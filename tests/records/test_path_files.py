"""Sketched paths from files, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from airground.errors import FileError
from airground.records import DrawnPath, read_path, write_path

if TYPE_CHECKING:
    from pathlib import Path


def test_a_path_reads_back_bit_for_bit(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "path.csv"
    uv, speed = rng.normal(size=(30, 2)) * 500, rng.uniform(0.1, 2.0, 30)
    for drawn in (DrawnPath(uv), DrawnPath(uv, speed)):
        write_path(path, drawn)
        back = read_path(path)
        assert_array_equal(back.uv, uv)
        assert (back.speed is None) == (drawn.speed is None)
    assert back.speed is not None
    assert_array_equal(back.speed, speed)


def test_order_is_kept_and_other_columns_are_told(tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    path.write_text("t_s,v_px,u_px\n9,2,1\n3,4,3\n")
    notes: list[str] = []
    assert_array_equal(read_path(path, note=notes.append).uv, [[1, 2], [3, 4]])
    assert len(notes) == 1
    assert "t_s" in notes[0]


@pytest.mark.parametrize(
    ("text", "line", "column", "match"),
    [
        ("u_px,v_px\n1,2\n", None, None, "two points or more, found 1"),
        ("u_px,v_px\n1,2\nnan,3\n", 3, "u_px", "finite|number"),
        ("u_px,v_px,speed_mps\n1,2,0.3\n2,3,0\n", 3, "speed_mps", "greater than 0"),
        ("u_px,v\n1,2\n2,3\n", 1, None, "missing column v_px"),
        ("u_px,v_px\n1,2\n3\n", 3, None, "cell"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(
    tmp_path: Path, text: str, line: int | None, column: str | None, match: str
) -> None:
    path = tmp_path / "path.csv"
    path.write_text(text)
    with pytest.raises(FileError, match=match) as caught:
        read_path(path)
    assert (caught.value.line, caught.value.column) == (line, column)

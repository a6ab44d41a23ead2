"""Sightings from files as people and programs write them."""

from __future__ import annotations

import tracemalloc
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from airground.errors import FileError
from airground.records import read_tracks

if TYPE_CHECKING:
    from pathlib import Path

HEADER = "t_s,target,u_px,v_px\n"
GOOD = HEADER + "0,a,1,2\n0.5,b,3.5,4\n1,a,5,-6e-1\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tracks.csv"


def assert_good(path: Path) -> list[str]:
    """Read what GOOD holds, and give the notes."""
    notes: list[str] = []
    tracks = read_tracks(path, note=notes.append)
    assert tracks.targets == ("a", "b")
    assert_array_equal(tracks.target_index, [0, 0, 1])
    assert_array_equal(tracks.t, [0, 1, 0.5])
    assert_array_equal(tracks.uv, [[1, 2], [5, -0.6], [3.5, 4]])
    assert tracks.sigma is None
    assert all("\n" not in note and note.startswith(f"{path}: ") for note in notes)
    return [note.removeprefix(f"{path}: ") for note in notes]


@pytest.mark.parametrize(
    "content",
    [
        GOOD,
        "\ufeff" + GOOD,
        GOOD.replace("\n", "\r\n"),
        "\ufeff" + GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", "\r"),
        GOOD.replace("\n", "\n\n"),
        GOOD.replace("\n", "\r\r\n"),  # text mode on Windows, twice
        "\n \n" + GOOD + "\n\n",
        GOOD.replace(",", " , ").replace("\n", " \n"),
        '"t_s","target","u_px","v_px"\n"0","a","1","2"\n0.5,"b",3.5, "4"\n1,a,5,-6e-1\n',
        "v_px,u_px,target,t_s\n2,1,a,0\n4,3.5,b,0.5\n-0.6,5,a,1\n",
        HEADER + "1,a,5,-.6\n0,a,+1,2.\n0.5,b,3.5,4\n",
    ],
)
def test_forms_of_the_same_file(path: Path, content: str) -> None:
    path.write_bytes(content.encode())
    assert assert_good(path) == []


def test_path_may_be_text_and_notes_may_be_dropped(path: Path) -> None:
    path.write_bytes(GOOD.rstrip().encode())
    assert len(read_tracks(str(path))) == 3


def test_last_line_without_end_is_noted(path: Path) -> None:
    path.write_bytes(GOOD.rstrip().encode())
    notes = assert_good(path)
    assert notes == ["the last line has no line end; the file may have been truncated"]


def test_blanks_after_the_last_line_are_no_truncation(path: Path) -> None:
    path.write_bytes(GOOD.encode() + b"  ")
    assert assert_good(path) == []


def test_unknown_columns_are_noted(path: Path) -> None:
    rows = ["t_s,frame,target,u_px,v_px,,x_dot_mps", "0,7,a,1,2,,", "0.5,,b,3.5,4,oh,no"]
    path.write_text("\n".join([*rows, "1,8,a,5,-0.6,nan,x"]) + "\n")
    assert assert_good(path) == ["ignored unknown columns: 'frame', '', 'x_dot_mps'"]


def test_sigma(path: Path) -> None:
    path.write_text("sigma_px,t_s,target,u_px,v_px\n0.5,1,a,1,2\n0.25,0,a,1,2\n")
    sigma = read_tracks(path).sigma
    assert sigma is not None
    assert_array_equal(sigma, [0.25, 0.5])


@pytest.mark.parametrize(
    ("cell", "name"),
    [
        (' "a, b" ' + "x", None),
        ('"a, b"', "a, b"),
        ('"say ""hi"""', 'say "hi"'),
        (' "a" ', None),
        ('" a "', "a"),
        ("two words", "two words"),
        ("näme 🤖", "näme 🤖"),
        ("1_000", "1_000"),
        ("nan", "nan"),
        ('a"b', 'a"b'),
        ("a\u2028b\x1cc\x0bd", "a\u2028b\x1cc\x0bd"),  # line ends for str.splitlines, not for us
    ],
)
def test_names_of_targets(path: Path, cell: str, name: str | None) -> None:
    path.write_text(f"{HEADER}0,{cell},1,2\n", encoding="utf-8")
    if name is None:
        with pytest.raises(FileError, match="cannot be split"):
            read_tracks(path)
    else:
        assert read_tracks(path).targets == (name,)


def test_blanks_around_a_name_do_not_make_it_another(path: Path) -> None:
    path.write_text(HEADER + "0,a,1,2\n1, a,1,2\n2,a ,1,2\n")
    assert read_tracks(path).targets == ("a",)


# Rows that repeat


@pytest.mark.parametrize(
    ("extra", "note"),
    [
        (["0,a,1,2"], "1 row repeats one of the same target and time; it was dropped"),
        (
            ["0,a,1,2", "1.0,a,5,-0.6", "0e0,a,1.00,2"],
            "3 of the sightings repeat one of the same target and time; they were dropped",
        ),
    ],
)
def test_identical_rows_are_kept_once(path: Path, extra: list[str], note: str) -> None:
    path.write_text(GOOD + "\n".join(extra) + "\n")
    assert assert_good(path) == [note]


def test_rows_that_differ_only_in_unknown_columns_are_identical(path: Path) -> None:
    path.write_text("t_s,target,u_px,v_px,note\n0,a,1,2,x\n0,a,1,2,y\n")
    assert len(read_tracks(path)) == 1


def test_two_targets_at_one_time_are_no_conflict(path: Path) -> None:
    path.write_text(HEADER + "0,a,1,2\n0,b,3,4\n")
    assert len(read_tracks(path)) == 2


def test_conflict_names_both_lines(path: Path) -> None:
    path.write_text(
        HEADER + "\n0,a,1,2\n1.5,b,9,9\n\n1.5,a,3,4\n2,a,5,6\n\n1.5,a,3,4\n2,a,5,7\n1.50,a,3,4.5\n"
    )
    with pytest.raises(FileError) as caught:  # on lines 10 and 11; the earlier one is told
        read_tracks(path)
    assert caught.value.line == 10
    assert caught.value.problem == (
        "target 'a' has two different sightings at t_s = 2.0 (first on line 7); keep one"
    )


def test_conflict_after_identical_rows_names_the_first(path: Path) -> None:
    path.write_text(HEADER + "1.5,a,1,2\n0,a,1,2\n1.5,a,1,2\n1.5,a,1,3\n")
    with pytest.raises(FileError, match=r"t_s = 1\.5 \(first on line 2\)") as caught:
        read_tracks(path)
    assert caught.value.line == 5


def test_conflict_in_sigma(path: Path) -> None:
    path.write_text("t_s,target,u_px,v_px,sigma_px\n0,a,1,2,1\n0,a,1,2,2\n")
    with pytest.raises(FileError, match="first on line 2") as caught:
        read_tracks(path)
    assert caught.value.line == 3


# Large files


def test_many_blocks_with_blank_lines_and_quotes_read_like_one(path: Path) -> None:
    count = 40_000
    t = np.arange(count) / 30
    lines = [
        f"{time!r},{'plain' if i < 20_000 else chr(34) + 'a,b' + chr(34)},{i},2"
        for i, time in enumerate(t.tolist())
    ]
    for i in range(5_000, count, 5_000):
        lines[i] = f"\n{lines[i]}\n"
    lines[30_000] = lines[30_000].replace(",2\n", ",bad\n")
    path.write_text(HEADER + "\n".join(lines) + "\n")
    with pytest.raises(FileError) as caught:
        read_tracks(path)
    # 30 000 rows, 2 blank lines at each of 5 earlier places, one just before, and the header
    assert (caught.value.line, caught.value.column) == (30_000 + 2 * 5 + 1 + 2, "v_px")

    text = path.read_text().replace(",bad\n", ",2\n")
    path.write_text(text)
    tracks = read_tracks(path)
    assert tracks.targets == ("plain", "a,b")
    assert_array_equal(tracks.t, t)
    assert_array_equal(tracks.uv[:, 0], np.arange(count))

    path.write_text(text + lines[30_000].strip().replace(",bad", ",3") + "\n")
    with pytest.raises(FileError, match=r"\(first on line 30013\)"):
        read_tracks(path)


def test_memory_is_the_arrays_and_one_block(path: Path) -> None:
    count = 200_000
    rows = (f"{i / 30!r},robot-{i % 7},{i % 1920}.25,{i % 1080}.5" for i in range(count))
    path.write_text(HEADER + "\n".join(rows) + "\n")
    tracemalloc.start()
    try:
        tracks = read_tracks(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    arrays = tracks.t.nbytes + tracks.target_index.nbytes + tracks.uv.nbytes
    assert arrays == 32 * count
    # The columns as read, sorted, and the copy that Tracks takes; and a block as Python strings.
    # A Python string for each cell would take six times as much.
    assert peak < 3.0 * arrays + 1e6

"""A wrong file is refused in one line that names the file, the line and the column."""

from __future__ import annotations

import csv
import gzip
import os
from typing import TYPE_CHECKING

import pytest

from airground.errors import FileError
from airground.records import read_tracks
from airground.records.text_blocks import BLOCK_BYTES

if TYPE_CHECKING:
    from pathlib import Path

HEADER = "t_s,target,u_px,v_px\n"
GOOD = HEADER + "0,a,1,2\n1,a,2,3\n"


def refused(path: Path, content: str | bytes) -> FileError:
    """Write content, read it as tracks, and give the error."""
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return refused_path(path)


def refused_path(path: Path) -> FileError:
    with pytest.raises(FileError) as caught:
        read_tracks(path)
    error = caught.value
    assert "\n" not in str(error)
    assert str(error).startswith(str(path))
    assert error.path == str(path)
    assert error.exit_code == 2
    return error


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tracks.csv"


@pytest.mark.parametrize(
    ("cell", "problem"),
    [
        ("", "the cell is empty, expected a decimal number"),
        ("   ", "the cell is empty, expected a decimal number"),
        ("nan", "found 'nan', expected a decimal number"),
        ("-inf", "found '-inf', expected a decimal number"),
        ("1e999", "found '1e999', expected a decimal number"),
        ("1_000", "found '1_000', expected a decimal number"),
        ("0x10", "found '0x10', expected a decimal number"),
        ("١٢", "found '١٢', expected a decimal number"),
        ("1\u00a0", "found '1', expected a decimal number"),
        ("12,5", None),
        ("1.2.3", "found '1.2.3', expected a decimal number"),
        ("1 2", "found '1 2', expected a decimal number"),
        ("abc", "found 'abc', expected a decimal number"),
        ("x" * 90, f"found '{'x' * 37}...', expected a decimal number"),
        ("a\tb\u2028c", r"found 'a\tb\u2028c', expected a decimal number"),
    ],
)
def test_bad_number_is_located(path: Path, cell: str, problem: str | None) -> None:
    error = refused(path, f"{HEADER}0,a,1,2\n1,a,{cell},3\n2,a,2,3\n")
    if problem is None:  # a decimal comma is one cell too many
        assert (error.line, error.column) == (3, None)
        assert error.problem == "the row has 5 cells, the header has 4"
    else:
        assert (error.line, error.column, error.problem) == (3, "u_px", problem)


def test_first_bad_cell_of_the_file_is_told(path: Path) -> None:
    error = refused(path, HEADER + "0,a,1,2\n1,a,2,bad\nworse,a,1,2\n")
    assert (error.line, error.column) == (3, "v_px")


def test_bad_cell_far_down_keeps_its_line(path: Path) -> None:
    rows = [f"{i},a,1.0,2.0" for i in range(60_000)]
    assert len("\n".join(rows)) > 2 * BLOCK_BYTES
    rows[100] = ""  # a blank line counts as a line
    rows[54_321] = "x,a,1.0,2.0"
    error = refused(path, HEADER + "\n".join(rows) + "\n")
    assert (error.line, error.column) == (54_323, "t_s")


@pytest.mark.parametrize("sigma", ["0", "-1", "-0.0", "nan"])
def test_sigma_must_be_positive(path: Path, sigma: str) -> None:
    error = refused(path, f"t_s,target,u_px,v_px,sigma_px\n0,a,1,2,1\n1,a,1,2,{sigma}\n")
    assert (error.line, error.column) == (3, "sigma_px")
    assert error.problem == f"found '{sigma}', expected a number greater than 0"


@pytest.mark.parametrize("name", ["", "  ", '""', '" "'])
def test_target_needs_a_name(path: Path, name: str) -> None:
    error = refused(path, f"{HEADER}0,a,1,2\n1,{name},1,2\n")
    assert (error.line, error.column) == (3, "target")
    assert error.problem == "the cell is empty, expected a name"


def test_target_name_has_a_longest(path: Path) -> None:
    error = refused(path, f"{HEADER}0,{'a' * 1001},1,2\n")
    assert (error.line, error.column) == (2, "target")
    assert "longer than 1000 characters" in error.problem


# Rows


def test_row_too_short_in_the_middle(path: Path) -> None:
    error = refused(path, HEADER + "0,a,1,2\n1,a\n2,a,1,2\n")
    assert (error.line, error.column) == (3, None)
    assert error.problem == "the row has 2 cells, the header has 4"


@pytest.mark.parametrize("end", ["", "\n", "\n\n"])
def test_last_row_too_short_may_be_truncation(path: Path, end: str) -> None:
    error = refused(path, HEADER + "0,a,1,2\n1" + end)
    assert error.line == 3
    assert error.problem == "the row has 1 cell, the header has 4; the file may be truncated"


def test_row_too_long(path: Path) -> None:
    error = refused(path, HEADER + "0,a,1,2\n1,a,1,2,3\n")
    assert (error.line, error.problem) == (3, "the row has 5 cells, the header has 4")


def test_short_and_long_row_do_not_make_up_for_each_other(path: Path) -> None:
    error = refused(path, HEADER + "0,a,1\n1,a,1,2,3\n2,a,1,2\n")
    assert error.line == 2


def test_row_that_would_fit_one_cell_further_on(path: Path) -> None:
    error = refused(path, "t_s,target,u_px,v_px,more\n0,a,1,2\n9,1,a,1,2,x\n")
    assert (error.line, error.problem) == (2, "the row has 4 cells, the header has 5")


# Quotes


@pytest.mark.parametrize(
    "row",
    [
        '1,"a,1,2\n2,b,1,2',  # never closes
        '1,"a\nb",1,2',  # spans lines
        '1,"a\r\nb",1,2',
        '1,a,1,"2',
    ],
)
def test_quoted_cell_must_end_on_its_line(path: Path, row: str) -> None:
    error = refused(path, f"{HEADER}0,a,1,2\n{row}\n3,a,1,2\n")
    assert error.line == 3
    assert error.problem == 'a quoted cell does not end on its line, expected a closing "'


def test_text_after_a_closing_quote(path: Path) -> None:
    error = refused(path, HEADER + '0,"a"b,1,2\n')
    assert (error.line, error.column) == (2, None)
    assert "cannot be split into cells" in error.problem


def test_bad_cell_beside_quotes(path: Path) -> None:
    error = refused(path, HEADER + '0,"a,b",1,2\n1,"a,b",1,"x"\n')
    assert (error.line, error.column, error.problem[:9]) == (3, "v_px", "found 'x'")


# Very long


def test_very_long_line(path: Path) -> None:
    error = refused(path, GOOD + "2,a,1," + "9" * (3 * BLOCK_BYTES))
    assert error.line == 4
    assert error.problem.startswith(f"the line is longer than {BLOCK_BYTES} bytes")


def test_very_long_quoted_cell(path: Path) -> None:
    limit = csv.field_size_limit()
    error = refused(path, GOOD + f'2,"{"a" * (limit + 1)}",1,2\n')
    assert error.line == 4
    assert error.problem == f"a cell is longer than {limit} characters"


# The header


@pytest.mark.parametrize("content", ["", "\n\n \n", "\ufeff", "\ufeff\r\n"])
def test_empty_file(path: Path, content: str) -> None:
    error = refused(path, content)
    assert error.problem == "the file is empty, expected a header with t_s,target,u_px,v_px"


@pytest.mark.parametrize("end", ["", "\n", "\n\n  \n"])
def test_header_only(path: Path, end: str) -> None:
    error = refused(path, "\n" + HEADER.strip() + end)
    assert (error.line, error.problem) == (2, "there are no rows below the header")


def test_missing_columns_are_listed_with_what_was_found(path: Path) -> None:
    error = refused(path, "t_s,name,u_px\n0,a,1\n")
    assert error.line == 1
    assert error.problem == ("missing columns target, v_px; the header has 't_s', 'name', 'u_px'")
    assert "missing column v_px;" in refused(path, "t_s,target,u_px\n0,a,1\n").problem


def test_a_wide_header_is_not_listed_without_end(path: Path) -> None:
    error = refused(path, ",".join(f"column_{i}" for i in range(300)) + "\n")
    assert error.problem.endswith("'column_7' and 292 more")


@pytest.mark.parametrize(("mark", "name"), [(";", "semicolons"), ("\t", "tabs")])
def test_other_separators(path: Path, mark: str, name: str) -> None:
    error = refused(path, GOOD.replace(",", mark))
    assert error.line == 1
    assert error.problem == f"columns must be separated by commas, found {name}"


def test_duplicate_column(path: Path) -> None:
    error = refused(path, "t_s,target,u_px,v_px, u_px \n0,a,1,2,3\n")
    assert (error.line, error.column, error.problem) == (1, "u_px", "the header has it twice")


def test_no_header(path: Path) -> None:
    error = refused(path, "0,a,1,2\n1,a,2,3\n")
    assert error.line == 1
    assert error.problem == (
        "the header is missing; the first line must name the columns, with t_s, target, u_px, v_px"
    )


def test_broken_quotes_in_the_header(path: Path) -> None:
    error = refused(path, '"t_s,target,u_px,v_px\n0,a,1,2\n')
    assert error.line == 1
    assert "closing" in error.problem


# Not text


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_utf_16(path: Path, encoding: str) -> None:
    error = refused(path, ("\ufeff" + GOOD).encode(encoding))
    assert error.problem == "is in UTF-16; save it as UTF-8"


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_utf_16_without_its_mark(path: Path, encoding: str) -> None:
    error = refused(path, GOOD.encode(encoding))
    assert (error.line, error.problem[:9]) == (1, "found a z")


def test_zero_byte(path: Path) -> None:
    error = refused(path, GOOD.encode() + b"2,a\0,1,2\n")
    assert error.line == 4
    assert "zero byte" in error.problem


def test_invalid_utf_8(path: Path) -> None:
    error = refused(path, GOOD.encode() + "2,café,1,2\n".encode("latin-1"))
    assert (error.line, error.problem) == (4, "byte 0xe9 is not UTF-8; save the file as UTF-8")


def test_invalid_utf_8_far_down_with_carriage_returns(path: Path) -> None:
    rows = b"".join(b"%d,a,1.0,2.0\r\n" % i for i in range(40_000))
    error = refused(path, HEADER.encode() + rows + b"40000,\xff,1,2\r\n")
    assert error.line == 40_002


def test_a_picture(path: Path) -> None:
    assert refused(path, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR").line in {1, 3}


def test_gzip(path: Path) -> None:
    error = refused(path, gzip.compress(GOOD.encode()))
    assert error.problem == "is a gzip file; unpack it first"


def test_spreadsheet(path: Path) -> None:
    assert "spreadsheet; save it as CSV" in refused(path, b"PK\x03\x04" + bytes(40)).problem


# Not a file


def test_missing_file(tmp_path: Path) -> None:
    assert refused_path(tmp_path / "none.csv").problem == "there is no such file"
    assert refused_path(tmp_path / "none" / "none.csv").problem == "there is no such file"


def test_folder(tmp_path: Path) -> None:
    assert refused_path(tmp_path).problem == "is a folder, expected a file"


def test_file_in_a_file(path: Path) -> None:
    path.write_text(GOOD)
    assert refused_path(path / "x.csv").problem == f"{path} is not a folder"


def test_no_permission(own_folder: Path) -> None:
    path = own_folder / "tracks.csv"
    path.write_text(GOOD)
    path.chmod(0)
    assert refused_path(path).problem == "no permission to read it"


def test_zero_in_the_name(tmp_path: Path) -> None:
    name = os.fspath(tmp_path / "a\0b.csv")
    with pytest.raises(FileError, match="cannot read it"):
        read_tracks(name)

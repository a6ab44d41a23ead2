"""Whole columns and single cells are judged alike."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from airground.errors import FileError
from airground.records.cells import LONGEST_NAME, Codes, cell_problem, number_column
from airground.records.csv_table import Column, read_table

cells = st.one_of(
    st.text(max_size=8),
    st.text("0123456789+-._eEnaif xX\t", max_size=8),
    st.floats().map(repr),
    st.integers().map(str),
)


def accepts(cell: str, *, positive: bool) -> bool:
    try:
        number_column(["1", cell], positive=positive)
    except ValueError:
        return False
    return True


@given(cell=cells, positive=st.booleans())
@example(cell="1_000", positive=False)
@example(cell="١", positive=False)
@example(cell="-0.0", positive=True)
@example(cell="1e999", positive=True)
@example(cell=" 1 ", positive=False)
def test_number(cell: str, positive: bool) -> None:
    problem = cell_problem(cell, text=False, positive=positive)
    assert accepts(cell, positive=positive) == (problem is None)
    assert problem is None or "\n" not in problem


@given(name=st.one_of(st.text(), st.sampled_from(["", " ", "a" * LONGEST_NAME, "a" * 1001])))
def test_name(name: str) -> None:
    codes = Codes()
    if cell_problem(name, text=True) is None:
        assert codes.column([name, f" {name} "]).tolist() == [0, 0]
        assert codes.names == [name.strip()]
    else:
        with pytest.raises(ValueError, match=r"^$"):  # cell_problem has the words
            codes.column([name])


@given(rows=st.lists(st.text('ab1.," \n', max_size=12), min_size=1, max_size=6))
def test_any_text_is_read_or_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, rows: list[str]
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_text("name,number\n" + "\n".join(rows), encoding="utf-8", newline="\n")
    refused = None
    try:
        table = read_table(path, [Column("name", text=True), Column("number")])
    except FileError as error:
        refused = error
    if refused:
        assert refused.line is not None
        assert "\n" not in str(refused)
        assert "cannot be read" not in refused.problem  # said where no cause was found
    else:
        lines = path.read_text(encoding="utf-8").split("\n")
        for row, number in enumerate(table.numbers["number"]):
            last = lines[table.line(row) - 1].rpartition(",")[2]
            assert float(last.strip(' "')) == number

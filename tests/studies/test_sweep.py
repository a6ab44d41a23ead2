"""The sweep over what the paper leaves open, and the page that quotes it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from airground.studies.sweep import choices, main, sweep

if TYPE_CHECKING:
    from pathlib import Path


def test_longer_segments_and_fewer_differences_are_better() -> None:
    tried = list(choices())
    rows = sweep(tried, trials=60, seed=0).rows
    ends = {row[2]: float(row[5]) for row in rows[:7]}
    assert ends["2"] > ends["3"] > ends["4"] > ends["5"] > ends["7"]
    by_words = {(row[0], row[1]): float(row[5]) for row in rows}
    assert by_words["30 fps differences", "1 per sample"] > 1.5
    assert by_words["line fit at 30 fps", "1 per frame"] < 0.05


def test_main_prints_one_row_per_choice(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--trials", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 + len(list(choices()))
    assert len({line.count("|") for line in lines}) == 1


def test_main_refuses_no_trials_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--trials", "0"]) == 2
    assert capsys.readouterr().err == "sweep: trials must be 1 or more, not 0\n"


def test_the_paper_page_quotes_this_sweep(root: Path) -> None:
    sheet = sweep(list(choices()), trials=1, seed=0)
    page = (root / "docs" / "paper.md").read_text("utf-8")
    quoted = [line.split(" | ") for line in page.splitlines() if line.startswith("| ")]
    told = [tuple(line[:5]) for line in quoted]
    assert "| " + " | ".join(sheet.header) + " |" in page
    for row in sheet.rows:
        assert (f"| {row[0]}", *row[1:5]) in told

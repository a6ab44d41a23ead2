"""Table 2 and figure 7 from drives that are made up; the drives themselves are tested with the robot."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from airground.errors import UnreachableError
from airground.studies.fig7 import FIG7
from airground.studies.item import Work
from airground.studies.robot_runs import METHODS, RobotSummary, robot_summaries
from airground.studies.table2 import PAPER_NE, TABLE2, typical_run
from airground.studies.workers import HERE
from robot_drives import made_up

RUNS = (made_up(0, 0.02, 0.01), made_up(1, 0.04, 0.03), made_up(2, None, 0.005))


@dataclass(frozen=True)
class Told(Work):
    """Work whose drives are told."""

    runs: tuple[RobotSummary, ...] = RUNS

    @property
    def robot_runs(self) -> tuple[RobotSummary, ...]:
        return self.runs


class Blind(Told):
    """Nothing can be drawn."""

    @property
    def robot_runs(self) -> tuple[RobotSummary, ...]:
        raise UnreachableError("MuJoCo cannot draw here: set MUJOCO_GL")


def test_errors_are_those_of_the_drives_and_refusals_are_counted() -> None:
    document = TABLE2.compute(Told(20, 0)).document
    assert document["linear"]["n_e_mean"] == pytest.approx(0.03)
    assert document["linear"]["runs"] == 2
    assert document["linear"]["refused"] == 1
    assert document["trajectory"]["n_e_mean"] == pytest.approx(0.015)
    assert document["trajectory"]["n_e_median"] == pytest.approx(0.01)
    assert document["paper"] == PAPER_NE
    assert document["typical"]["seed"] == 0
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    sheet = TABLE2.sheet(document)
    assert all(len(row) == len(sheet.header) for row in sheet.rows)
    assert sheet.rows[1][2:] == ("0.0540", "0.0300", "0.0100")
    assert "1 calibrations were refused" in sheet.note


def test_a_typical_drive_has_the_median_error_even_where_some_have_none() -> None:
    assert typical_run(RUNS).seed == 0
    refused = replace(RUNS[0], g_hat=dict.fromkeys(METHODS, None))
    assert typical_run((refused, *RUNS[1:])).seed == 1
    document = TABLE2.compute(Told(20, 0, runs=(refused,))).document
    assert document["trajectory"]["n_e_median"] is None
    assert TABLE2.sheet(document).rows[1][-1] == "-"


def test_where_nothing_can_be_drawn_that_is_said() -> None:
    for item in (TABLE2, FIG7):
        outcome = item.compute(Blind(20, 0))
        assert "set MUJOCO_GL" in item.sheet(outcome.document).note
        assert outcome.draw is None


def test_drives_have_the_seeds_that_follow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "airground.studies.robot_runs.robot_summary", lambda seed, _: made_up(seed, 0.1, 0.1)
    )
    told: list[tuple[int, int]] = []
    runs = robot_summaries(3, 7, HERE, lambda done, of: told.append((done, of)))
    assert [run.seed for run in runs] == [7, 8, 9]
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_figure_7_is_drawn(tmp_path: Path) -> None:
    outcome = FIG7.compute(Told(20, 0))
    if "none" in outcome.document:
        pytest.skip(outcome.document["none"])
    assert outcome.document["length_m"] == pytest.approx(6.0)
    assert outcome.draw is not None
    outcome.draw(tmp_path / "fig7.png")
    assert (tmp_path / "fig7.png").stat().st_size > 10_000

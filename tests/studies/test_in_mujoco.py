"""The paper's robot experiments, really driven in MuJoCo: a short version of each, from one call."""

from __future__ import annotations

import json
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import pytest

from airground.studies.reproduce import ITEMS, reproduce

if TYPE_CHECKING:
    from pathlib import Path

NAMES = ("table2", "fig7", "fig8", "fig9", "fig10", "fig11", "moving", "others")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all of them were written once."""
    if find_spec("mujoco") is None:
        pytest.skip("MuJoCo is not installed: pip install airground[sim3d]")
    out = tmp_path_factory.mktemp("robot")
    given = reproduce(NAMES, trials=1, seed=3, out=out)
    for name in NAMES:
        robot = given[name]
        assert isinstance(robot, dict)
        if "none" in robot.get("mujoco", robot):
            pytest.skip(robot.get("mujoco", robot)["none"])
    return out


@pytest.fixture(scope="module")
def result(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "reproduce.json").read_text("utf-8")))


def test_table_2_is_better_than_the_papers(result: dict[str, Any]) -> None:
    table2 = result["table2"]
    assert table2["runs"] == 1
    assert table2["trajectory"]["n_e_median"] < 0.025
    assert table2["trajectory"]["n_e_median"] < table2["linear"]["n_e_median"] < 0.06


def test_the_robot_comes_to_both_paths_and_follows_them(result: dict[str, Any]) -> None:
    for figure in ("fig8", "fig9"):
        robot = result[figure]["mujoco"]["trajectory"]
        assert robot["settled"], figure
        assert robot["start_error_px"] > 50
        assert robot["path_rms_px"] < 3.0
        assert robot["path_rms_m"] < 0.015
        assert robot["stops"] == 0
    assert result["fig9"]["mujoco"]["ellipse_rms_m"]["trajectory"] < 0.025


def test_velocities_settle_to_what_the_ellipse_asks(result: dict[str, Any]) -> None:
    robot = result["fig10"]["mujoco"]
    assert robot["settled_v_mps"] == pytest.approx(0.12, rel=0.06)
    assert robot["v_max_mps"] < 0.22


def test_goals_are_reached_within_3_px_and_2_cm(result: dict[str, Any]) -> None:
    goals = result["fig11"]["mujoco"]["goals"]
    assert len(goals) == 2
    for goal in goals:
        assert goal["reached"]
        assert goal["goal_error_px"] < 3.0
        assert goal["goal_error_m"] < 0.02


def test_a_drone_calibrates_and_drives_as_a_camera_that_stands(result: dict[str, Any]) -> None:
    moving = result["moving"]
    assert moving["moved_m"] > 0.3, "or it was no moving camera"
    assert moving["placed_share"] > 0.98
    # One flight: the ratio over several is that of the full run.
    assert moving["moving"]["n_rms"] < max(2 * moving["still"]["n_rms"], 0.02)
    assert moving["moving"]["n_rms"] < 0.5 * moving["flat"]["n_rms"], "the height of the mark"
    assert moving["goals"]["reached"] == moving["goals"]["driven"] == 1
    assert moving["goals"]["off_px_max"] < 3.0
    assert moving["goals"]["off_m_max"] < 0.02


def test_another_vehicle_is_measured(result: dict[str, Any]) -> None:
    others = result["others"]
    assert others["at_speed"]["sightings"] > 100
    assert others["at_speed"]["rms_share"] < 0.03
    assert others["at_speed"]["inside_share"] > 0.85
    assert others["all"]["sightings"] > others["under_way"]["sightings"]


def test_all_are_told_and_drawn(result: dict[str, Any], folder: Path) -> None:
    for name in NAMES:
        sheet = ITEMS[name].sheet(result[name])
        assert sheet.rows, name
        assert all(len(row) == len(sheet.header) for row in sheet.rows), name
    for name in ("fig7", "fig8", "fig9", "fig10", "fig11", "moving"):
        assert (folder / f"{name}.png").stat().st_size > 10_000

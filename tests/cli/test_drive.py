"""`airground drive`: in the demo's world, seen as noisy points to be quick; one test looks at rendered images."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from airground.calibration import Calibration, calibrate
from airground.cli import main
from airground.records import DrawnPath, write_path
from airground.sim import calibration_drive, demo_world
from commands import fails

if TYPE_CHECKING:
    from pathlib import Path

GOAL = ["drive", "--calibration", "c.json", "--sight", "points", "--goal", "600,400"]
PATH = ["drive", "--calibration", "c.json", "--sight", "points", "--path", "path.csv"]
KEYS = {
    "reached",
    "time_s",
    "goal_error_px",
    "goal_error_m",
    "path_rms_px",
    "path_rms_m",
    "oracle_path_rms_m",
    "max_speed_mps",
    "stops",
}


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    drive = calibration_drive(demo_world(), np.random.default_rng(0), duration_s=60.0)
    return calibrate(drive.tracks, drive.motion, image_size_px=(1280, 720), distortion="none")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calibration: Calibration) -> Path:
    monkeypatch.chdir(tmp_path)
    calibration.save("c.json")
    u = np.linspace(520.0, 760.0, 30)
    write_path("path.csv", DrawnPath(np.column_stack([u, 440 + 40 * np.sin(u / 50)])))
    return tmp_path


def answer(capsys: pytest.CaptureFixture[str], argv: list[str]) -> dict[str, Any]:
    assert main([*argv, "--json"]) == 0
    result: dict[str, Any] = json.loads(capsys.readouterr().out)
    return result


def test_to_a_goal(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    result = answer(capsys, [*GOAL, "--out", "out"])
    assert result.keys() >= KEYS
    assert result["reached"]
    assert result["goal_error_px"] < 2
    assert result["goal_error_m"] < 0.01
    assert result["stops"] == 0
    assert result["max_speed_mps"] < 0.33  # told 0.3; it overshoots a little
    assert result["path_rms_m"] is None  # there was no path
    assert json.loads((folder / "out" / "drive.json").read_text()) == result
    driven = np.loadtxt(folder / "out" / "driven.csv", delimiter=",", skiprows=1)
    assert np.hypot(*(driven[-1, 1:3] - [600, 400])) < 6  # its last row is before it has rolled out
    assert (folder / "out" / "drive.png").stat().st_size > 10_000


def test_along_a_path_as_well_as_with_the_true_g(capsys: pytest.CaptureFixture[str]) -> None:
    result = answer(capsys, [*PATH, "--speed-mps", "0.25"])
    assert result["reached"]
    assert result["path_rms_m"] < 0.01
    assert result["path_rms_m"] < 1.1 * result["oracle_path_rms_m"]
    assert result["sketch_rms_px"] < 3
    assert result["max_speed_mps"] < 0.28


def test_seen_in_rendered_images(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["drive", "--calibration", "c.json", "--goal", "600,400"]  # images are the default here
    result = answer(capsys, argv)
    assert result["sight"] == "images"
    assert result["reached"]
    assert result["goal_error_px"] < 2


def test_the_same_seed_drives_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    first, again = answer(capsys, GOAL), answer(capsys, GOAL)
    other = answer(capsys, [*GOAL, "--seed", "1"])
    assert first == again
    assert first["goal_error_m"] != other["goal_error_m"]


def test_another_camera_gets_a_world_of_its_own_and_that_is_said(
    capsys: pytest.CaptureFixture[str], calibration: Calibration
) -> None:
    g = calibration.model.g * 0.5  # seen from far: all is larger
    replace(
        calibration, model=type(calibration.model)(g), covariance=calibration.covariance / 4
    ).save("c.json")
    assert main([*GOAL, "--json"]) == 0
    out, err = capsys.readouterr()
    assert "drawn from the calibration" in err
    result = json.loads(out)
    assert result["world"] == "calibration"
    assert result["reached"]
    assert result["goal_error_px"] < 3


def test_people_get_a_few_lines(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(GOAL) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "arrived after" in out
    assert len(out.splitlines()) == 3


@pytest.mark.parametrize(
    ("extra", "match"),
    [
        (["--goal", "640,-10"], "outside the image of 1280x720"),
        (["--goal", "nan,3"], "expected U,V"),
        (["--goal", "6,3", "--path", "path.csv"], "not allowed"),
        ([], "--goal --path"),
        (["--goal", "640,400", "--site", "none.toml"], "none.toml"),
        (["--path", "path.csv", "--heading-deg", "3"], "--heading-deg"),
        (["--path", "none.csv"], "none.csv"),
        (["--goal", "640,400", "--speed-mps", "0"], "above 0"),
        (["--goal", "640,400", "--latency-s", "2"], "0 to 1 s"),
    ],
)
def test_what_cannot_be_asked(
    capsys: pytest.CaptureFixture[str], extra: list[str], match: str
) -> None:
    assert match in fails(capsys, ["drive", "--calibration", "c.json", *extra], 2)


def test_a_path_that_leaves_the_image_is_refused_with_its_place(
    capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    write_path("away.csv", DrawnPath(np.array([[600.0, 400], [600, 600], [620, 760], [700, 900]])))
    line = fails(
        capsys, ["drive", "--calibration", "c.json", "--path", "away.csv", "--out", "out"], 2
    )
    assert "cannot be driven" in line
    assert "along the path" in line


def test_a_goal_in_the_sky_is_refused(
    capsys: pytest.CaptureFixture[str], calibration: Calibration
) -> None:
    n = calibration.model.horizon
    above = -(n[0] * 600 + n[2]) / n[1] - 50.0
    replace(calibration, image_size_px=None).save("c.json")
    argv = ["drive", "--calibration", "c.json", "--goal", f"600,{above:.0f}"]
    assert "horizon" in fails(capsys, argv, 2)


def test_a_goal_that_the_calibration_knows_nothing_of_is_refused(
    capsys: pytest.CaptureFixture[str], calibration: Calibration
) -> None:
    replace(calibration, covariance=2e4 * calibration.covariance).save("c.json")
    assert "calibrate with a drive that comes nearer" in fails(capsys, GOAL, 3)

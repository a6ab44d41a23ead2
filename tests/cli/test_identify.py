"""``airground identify`` as a user runs it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from airground.calibration import Tracks
from airground.cli import main
from airground.records import read_tracks, write_motion, write_tracks
from commands import DRIVE, SCENE, T, fails
from drives import read, see

IDENTIFY = ["identify", "--tracks", "seen.csv", "--motion", "motion.csv", "--out", "tracks.csv"]


@pytest.fixture
def seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> Path:
    """A robot under the tracker's name, and something parked; two robots' readings, one of which stands."""
    robot = see(SCENE, DRIVE, T[::3], noise=0.3, rng=rng)
    t = np.concatenate([robot.t, robot.t])
    parked = 300 + rng.normal(0, 0.3, robot.uv.shape)
    names = ["track-4"] * len(robot.t) + ["track-9"] * len(robot.t)
    write_tracks(tmp_path / "seen.csv", Tracks.from_rows(t, names, [*robot.uv, *parked]))
    write_motion(
        tmp_path / "motion.csv", read(DRIVE, np.arange(-1.5, 62, 0.05), form="speed", offset=0.1)
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_identify(seen: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(IDENTIFY) == 0
    out = capsys.readouterr().out
    assert "tracks.csv: 1 of 1 robots identified among 2 tracks" in out
    assert "robot: track-4 (0.0 to 59.9 s); confidence 0.99" in out  # never 1
    assert set(read_tracks(seen / "tracks.csv").targets) == {"robot", "track-9"}
    assert (
        main(["calibrate", "--tracks", "tracks.csv", "--motion", "motion.csv", "--out", "c.json"])
        == 0
    )


def test_json(seen: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*IDENTIFY, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    robot = document["robots"]["robot"]
    assert robot["identified"] is True
    assert robot["confidence"] > 0.95
    assert [s["track"] for s in robot["spans"]] == ["track-4"]
    assert document["time_offset_s"] == pytest.approx(0.1, abs=0.05)


def test_nobody_there_is_exit_code_3(seen: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tracks = read_tracks(seen / "seen.csv")
    rows = tracks.rows("track-9")
    write_tracks(
        seen / "seen.csv",
        Tracks.from_rows(tracks.t[rows], ["a"] * len(tracks.t[rows]), tracks.uv[rows]),
    )
    line = fails(capsys, IDENTIFY, 3)
    assert "no robot was identified: robot: no track moves" in line
    assert not (seen / "tracks.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["--time-offset-s", "soon"], "auto or a number"),
        (["--reach-s", "-1"], "reach_s"),
        (["--least-confidence", "2"], "least_confidence"),
    ],
)
def test_wrong_options(
    seen: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], match: str
) -> None:
    assert match in fails(capsys, [*IDENTIFY, *arguments], 2)


def test_inputs_are_not_overwritten(seen: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "--out names an input" in fails(capsys, [*IDENTIFY[:-1], "seen.csv"], 2)

"""Sightings and readings out of the log of a session, and a calibration on them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.calibration import Calibration
from airground.cli import main
from airground.errors import FileError
from airground.geometry import n_error
from airground.records.session_log import SessionLog
from airground.records.session_recording import read_recording
from commands import DRIVE, READINGS, SCENE, T, fails
from drives import read, see
from records.session_files import HEADER, heard, inputs, seen

if TYPE_CHECKING:
    from collections.abc import Iterable


def log(path: Path, told: Iterable[tuple[float, dict[str, Any]]], header: Any = HEADER) -> Path:
    with SessionLog(path, header) as writer:
        for number, (t, one) in enumerate(told):
            writer.step(t, number, [one], {})
    return path


def test_rows_are_those_of_the_drive(tmp_path: Path, rng: np.random.Generator) -> None:
    tracks = see(SCENE, DRIVE, T[:300], noise=0.3, rng=rng)
    motion = read(DRIVE, READINGS[:300], form="speed")
    drive = read_recording(log(tmp_path / "s.mcap", inputs(tracks, motion)))
    assert drive.image_size_px == (1280, 720)
    assert drive.tracks.targets == drive.motion.targets == ("robot",)
    assert_array_equal(drive.tracks.t, tracks.t)
    assert_array_equal(drive.tracks.uv, tracks.uv)
    assert drive.tracks.sigma is not None
    assert_allclose(drive.tracks.sigma, 0.3, rtol=1e-12)
    assert_array_equal(drive.motion.t, motion.t)
    assert drive.motion.heading is not None
    assert drive.motion.speed is not None
    assert motion.heading is not None
    assert_allclose(np.cos(drive.motion.heading - motion.heading), 1.0, atol=1e-12)
    assert_array_equal(drive.motion.speed, motion.speed)


def test_what_the_tracker_is_not_sure_of_is_left_out(tmp_path: Path) -> None:
    told = [
        (0.0, seen(0.0, (0, 0))),
        (0.1, seen(0.1, (1, 0), confirmed=[False])),
        (0.2, seen(0.2, (2, 0), sighting=[-1])),
        (0.3, seen(0.3, (3, 0), merged_with=[["track-1"]])),
        (0.4, seen(0.4, (4, 0), swap_probability=[0.03])),
        (0.5, seen(0.0, (5, 0))),  # the same time again
        (0.6, seen(0.6, (6, 0), names=["track-4"])),  # by its label
        (0.7, seen(0.7, (7, 0), labels=[""])),  # by its name
        (0.8, seen(0.8, (8, 0), names=["cart"], labels=[""])),
        (0.9, heard(0.9, 0.1, 0.2)),
    ]
    drive = read_recording(log(tmp_path / "s.mcap", told))
    assert drive.tracks.targets == ("robot", "cart")
    assert_array_equal(drive.tracks.uv[drive.tracks.rows("robot"), 0], [0, 6, 7])
    assert_array_equal(drive.tracks.uv[drive.tracks.rows("cart"), 0], [8])


def test_headings_and_speeds_may_be_told_apart(tmp_path: Path) -> None:
    """A heading is interpolated for each speed, not over gaps, and the right way round."""
    told = [
        (0.0, seen(0.0, (0, 0))),
        (0.0, heard(0.0, 3.1, None)),
        (0.1, heard(0.1, -3.1, None)),  # over pi
        (0.2, heard(0.05, None, 0.5)),
        (0.3, heard(0.1, None, 0.6)),
        (0.3, heard(0.1, None, 0.6)),  # again
        (0.4, heard(2.0, -3.1, None)),
        (0.4, heard(1.0, None, 0.7)),  # in a gap
        (0.4, heard(2.1, None, 0.7)),  # after all headings
        (0.4, heard(2.0, None, 0.8)),
    ]
    motion = read_recording(log(tmp_path / "s.mcap", told)).motion
    assert_array_equal(motion.t, [0.05, 0.1, 2.0])
    assert_array_equal(motion.speed, [0.5, 0.6, 0.8])
    assert motion.heading is not None
    assert_allclose(np.mod(motion.heading, 2 * np.pi), [np.pi, 2 * np.pi - 3.1, 2 * np.pi - 3.1])


@pytest.mark.parametrize(
    ("told", "match"),
    [
        ([heard(0.0, 1.0, 1.0)], "holds no sightings of confirmed tracks"),
        ([seen(0.0, (1, 2))], "holds no readings of heading and speed"),
        ([seen(0.0, (1, 2)), heard(0.0, 1.0, None)], "holds no readings of heading and speed"),
        (
            [seen(0.0, (1, 2), names=["9"], labels=["9"]), heard(0.0, 1.0, 1.0)],
            r"no robot that told its motion \(robot\) was seen; tracks are 9",
        ),
        ([{"kind": "seen"}], r"step 0: an input cannot be read \(KeyError\('t'\)\)"),
        ([{"t": 1}], "step 0: an input cannot be read"),
        ([seen(0.0, (1, 2), names=["1", "2"])], "step 0: an input cannot be read"),
    ],
)
def test_what_cannot_be_calibrated_on_is_said(
    tmp_path: Path, told: list[dict[str, Any]], match: str
) -> None:
    path = log(tmp_path / "s.mcap", [(0.0, one) for one in told])
    with pytest.raises(FileError, match=match) as caught:
        read_recording(path)
    assert "\n" not in str(caught.value)


def test_a_header_without_robots_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="does not list the robots"):
        read_recording(log(tmp_path / "s.mcap", [], header={}))


def test_calibrate_on_a_session_that_was_cut_off(
    tmp_path: Path,
    rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A recording that a power cut has ended is used as far as it goes, and that is said."""
    monkeypatch.chdir(tmp_path)
    tracks = see(SCENE, DRIVE, T[::6], noise=0.3, rng=rng)
    motion = read(DRIVE, READINGS[::3], form="speed", offset=0.1)
    path = log(tmp_path / "s.mcap", inputs(tracks, motion))
    with path.open("r+b") as stream:
        stream.truncate(path.stat().st_size - 20)
    assert main(["calibrate", "s.mcap", "--out", "c.json"]) == 0
    out, err = capsys.readouterr()
    assert "c.json: ok" in out
    assert err.count("\n") == 1
    assert "note: s.mcap: cut off" in err
    calibration = Calibration.load("c.json")
    assert n_error(SCENE.g, calibration.model.g) < 0.05
    assert calibration.time_offset_s == pytest.approx(0.1, abs=0.02)
    assert calibration.image_size_px == (1280, 720)
    assert [name for name, _ in calibration.provenance.inputs] == ["s.mcap"]


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["--out", "c.json"], "--tracks and --motion must be given, or the log of a live session"),
        (["--tracks", "t.csv", "--out", "c.json"], "--motion must be given, or the log"),
        (["s.mcap", "--tracks", "t", "--out", "c.json"], "either s.mcap or --tracks, not both"),
        (["s.mcap", "--tracks", "t", "--motion", "m", "--out", "c.json"], "--tracks and --motion"),
        (["s.mcap", "--out", "s.mcap"], "--out names an input"),
        (["none.mcap", "--out", "c.json"], "none.mcap: there is no such file"),
        (["t.csv", "--out", "c.json"], "t.csv: is not an MCAP file"),
        (["s.mcap"], "--out"),
    ],
)
def test_calibrate_says_what_is_wrong(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    argv: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    log(tmp_path / "s.mcap", [])
    (tmp_path / "t.csv").write_text("t_s,target,u_px,v_px\n")
    assert message in fails(capsys, ["calibrate", *argv], 2)
    assert not (tmp_path / "c.json").exists()

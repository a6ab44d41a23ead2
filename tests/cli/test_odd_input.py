"""What people give to commands by mistake: links, pipes, the same file twice, numbers of odd forms and sizes."""

from __future__ import annotations

import json
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from airground.calibration import Calibration
from airground.cli import main
from airground.records import read_tracks
from commands import CALIBRATE, SPEED, fails


@pytest.fixture
def calibrated(recording: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    assert main([*CALIBRATE, "--image-size", "1280x720"]) == 0
    capsys.readouterr()
    return recording


def test_loops_of_links(calibrated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("loop").symlink_to("pool")
    Path("pool").symlink_to("loop")
    for argv in (
        [*CALIBRATE[:-1], "loop"],
        [*CALIBRATE, "--tracks", "loop"],
        [*SPEED[:-1], "loop"],
        [*SPEED, "--calibration", "loop"],
        ["inspect", "loop"],
        ["demo", "--out", "loop"],
    ):
        assert "loop" in fails(capsys, argv, 2)


def test_an_input_is_not_overwritten_by_any_name(
    calibrated: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("link.csv").symlink_to("tracks.csv")
    Path("twin.csv").hardlink_to("tracks.csv")
    Path("c.png").symlink_to("c.json")
    before = {p.name: p.read_bytes() for p in calibrated.iterdir()}
    for argv, option in (
        ([*CALIBRATE[:-1], "link.csv"], "--out"),
        ([*SPEED[:-1], "twin.csv"], "--out"),
        ([*SPEED[:-1], "c.json"], "--out"),
        (["inspect", "c.json", "--picture", "c.png"], "--picture"),
    ):
        assert f"{option} names an input file" in fails(capsys, argv, 2)
    assert {p.name: p.read_bytes() for p in calibrated.iterdir()} == before


def test_a_pipe_has_no_checksum_that_would_be_its_data_s(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    read_end, write_end = os.pipe()
    os.write(write_end, b"t_s,target,u_px,v_px\n0,robot,1,2\n")
    os.close(write_end)
    argv = [*CALIBRATE, "--tracks", f"/dev/fd/{read_end}"]
    assert "save it to a file first" in fails(capsys, argv, 2)
    os.close(read_end)
    assert not Path("c.json").exists()


@pytest.mark.parametrize("number", ["-1e-3", "-.5", "-0.1"])
def test_negative_numbers_are_not_options(recording: Path, number: str) -> None:
    assert main([*CALIBRATE, "--time-offset-s", number]) == 0
    assert Calibration.load("c.json").time_offset_s == float(number)


def test_negative_points_are_not_options(calibrated: Path) -> None:
    assert main(["inspect", "c.json", "--principal-point", "-5,3"]) == 0


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["demo", "--seed", "9" * 5000], "--seed: expected a whole number from 0 on"),
        (["demo", "--seed", "²"], "--seed: expected a whole number from 0 on"),
        (["reproduce", "--seed", "-1"], "--seed: expected a whole number from 0 on, not '-1'"),
        (["reproduce", "--seed", "x"], "--seed: expected a whole number from 0 on, not 'x'"),
        (["reproduce", "--trials", "9" * 5000], "--trials: expected a whole number from 1 on"),
        (["reproduce", "--trials", "10000001"], "--trials: expected at most 10000000"),
        ([*CALIBRATE, "--time-offset-s", "1e300"], "time_offset_s: found 1e+300"),
        ([*CALIBRATE, "--speed-scale-sigma", "1e300"], "speed_scale_sigma must lie in 0..1"),
        (["inspect", "c.json", "--focal-length-px", "1e300"], "--focal-length-px"),
        (["inspect", "c.json", "--focal-length-px", "1e-300"], "--focal-length-px"),
    ],
)
def test_numbers_out_of_all_proportion(
    recording: Path, capsys: pytest.CaptureFixture[str], argv: list[str], message: str
) -> None:
    line = fails(capsys, argv, 2)
    assert message in line
    assert len(line) < 200


def test_recordings_in_impossible_units(
    calibrated: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    header, first, *rows = Path("tracks.csv").read_text().splitlines()
    t, target, _, v = first.split(",")
    Path("tracks.csv").write_text("\n".join([header, f"{t},{target},1e200,{v}", *rows]) + "\n")
    assert "tracks, uv: found 1e+200" in fails(capsys, CALIBRATE, 2)
    assert "tracks, uv: found 1e+200" in fails(capsys, SPEED, 2)
    assert len(read_tracks("tracks.csv")) == 1 + len(rows)  # reading it is not wrong


def test_sparse_readings_are_told_from_clocks_apart(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = "".join(f"{t},robot,{h},1\n" for t, h in ((-2, 0.0), (30, 3.0), (63, 0.0)))
    Path("motion.csv").write_text(f"t_s,target,heading_rad,speed_mps\n{rows}")
    assert "record them more often" in fails(capsys, CALIBRATE, 2)
    rows = "".join(f"{t},robot,0.1,1\n" for t in range(1000, 1010))
    Path("motion.csv").write_text(f"t_s,target,heading_rad,speed_mps\n{rows}")
    assert "both files need one clock" in fails(capsys, CALIBRATE, 2)


@pytest.mark.parametrize("more", [[], ["--json"], ["--picture", "view.png"]])
def test_an_image_without_ground(
    calibrated: Path, capsys: pytest.CaptureFixture[str], more: list[str]
) -> None:
    document = json.loads(Path("c.json").read_text())
    document["origin_px"][1] -= 5000  # beyond the horizon: now the sky is ground, and the image sky
    Path("c.json").write_text(json.dumps(document))
    assert "check the image's size" in fails(capsys, ["inspect", "c.json", *more], 2)
    assert not Path("view.png").exists()


def test_a_calibration_by_hand_with_the_contract_s_keys_only(
    calibrated: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = json.loads(Path("c.json").read_text())
    for key in ("window_s", "region_px"):
        del document["fit"][key]
    # A camera that looks straight down on one pixel per centimetre: no horizon to draw, no region either.
    g = [[100.0 ** (1 / 3), 0.0], [0.0, -(100.0 ** (1 / 3))], [0.0, 0.0]]
    Path("c.json").write_text(json.dumps({**document, "g": g, "origin_px": [640, 360]}))
    assert main(["inspect", "c.json", "--picture", "view.png"]) == 0
    assert "looks straight down" in capsys.readouterr().out


def test_a_path_that_is_markup_to_rich(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "airground.studies.demo.run_demo", lambda *_, **__: SimpleNamespace(elapsed_s=1.0)
    )
    monkeypatch.setattr("airground.studies.report.figure_rows", lambda _: [("what", "1", "2", "")])
    assert main(["demo", "--out", "d[/bold]:smile:"]) == 0
    assert f"open {Path('d[', 'bold]:smile:', 'report.html')}" in capsys.readouterr().out

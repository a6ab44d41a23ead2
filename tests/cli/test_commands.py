"""Commands as a user runs them: output, exit codes, one line for each error, nothing half-written."""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airground import __version__
from airground.calibration import Calibration
from airground.cli import main
from airground.cli.parser import build_parser
from airground.geometry import n_error
from airground.records import write_motion, write_tracks
from commands import CALIBRATE, DRIVE, READINGS, SCENE, SPEED, T, fails, shorten_demo
from drives import Drive, read, see


def test_version_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"airground {__version__}\n"
    for command in ("demo", "track", "identify", "calibrate", "inspect", "speed", "reproduce"):
        assert main([command, "--help"]) == 0
        assert f"airground {command}" in capsys.readouterr().out


def test_calibrate_inspect_speed(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*CALIBRATE, "--image-size", "1280x720"]) == 0
    assert "c.json: ok" in capsys.readouterr().out
    calibration = Calibration.load("c.json")
    assert n_error(SCENE.g, calibration.model) < 0.01
    assert calibration.image_size_px == (1280, 720)
    assert calibration.time_offset_s == pytest.approx(0.1, abs=0.02)

    assert main(["inspect", "c.json", "--picture", "view.png"]) == 0
    text = capsys.readouterr().out
    assert "tilt 45." in text or "tilt 44." in text
    assert (recording / "view.png").read_bytes().startswith(b"\x89PNG")

    assert main(SPEED) == 0
    assert "robot: median" in capsys.readouterr().out
    header, *rows = (recording / "s.csv").read_text().splitlines()
    assert header == "t_s,target,u_px,v_px,x_dot_mps,y_dot_mps,speed_mps,speed_sigma_mps"
    assert len(rows) == len(T)
    assert sorted(p.name for p in recording.iterdir()) == [
        "c.json",
        "motion.csv",
        "s.csv",
        "tracks.csv",
        "view.png",
    ]


def test_calibrate_json_is_the_file_and_the_time(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*CALIBRATE, "--json"]) == 0
    out, _ = capsys.readouterr()
    assert out.count("\n") == 1
    printed: dict[str, Any] = json.loads(out)
    assert printed.pop("elapsed_s") > 0
    assert printed == json.loads((recording / "c.json").read_text())
    assert printed["provenance"]["command"] == "airground " + " ".join([*CALIBRATE, "--json"])
    digests = {i["name"]: i["sha256"] for i in printed["provenance"]["inputs"]}
    for name in ("tracks.csv", "motion.csv"):
        assert digests[name] == hashlib.sha256((recording / name).read_bytes()).hexdigest()


def test_inspect_json(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    del recording
    assert main([*CALIBRATE, "--image-size", "1280x720"]) == 0
    capsys.readouterr()
    assert main(["inspect", "c.json", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["tilt_deg"] == pytest.approx(45, abs=3 * found["tilt_sigma_deg"] + 0.5)
    assert found["height_m"] == pytest.approx(10, rel=0.1)
    assert found["focal_length_px"] == pytest.approx(900, rel=0.1)
    assert found["ground_frame"] == "right"
    assert (
        len(found["scale"]["uv_px"])
        == len(found["scale"]["min_px_per_m"])
        == len(found["scale"]["relative_sigma"])
    )
    # Without the image's size there is no principal point to assume, and that is said.
    assert main(CALIBRATE) == 0
    capsys.readouterr()
    assert main(["inspect", "c.json", "--json"]) == 0
    blind = json.loads(capsys.readouterr().out)
    assert blind["focal_length_px"] is None
    assert "--image-size" in blind["camera_problem"]


def test_inspect_says_the_lens(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*CALIBRATE, "--image-size", "1280x720"]) == 0
    capsys.readouterr()
    assert main(["inspect", "c.json", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["lens"] is None
    path = recording / "c.json"
    document = json.loads(path.read_text())
    center, k1, sigma = [639.5, 359.5], -2e-7, 1e-8
    document["distortion"] = {"model": "division", "k1": k1, "center_px": center}
    path.write_text(json.dumps(document))
    assert main(["inspect", "c.json"]) == 0
    assert "lens k1 -2e-07 per px^2 (taken as exact), barrel" in capsys.readouterr().out
    document["distortion"]["k1_covariance"] = [0.0] * 6 + [sigma**2]
    path.write_text(json.dumps(document))
    assert main(["inspect", "c.json", "--picture", "view.png"]) == 0
    out = capsys.readouterr().out
    assert "lens k1 -2e-07 per px^2 (deviation 1e-08), barrel" in out
    assert "for square pixels, in the undistorted image:" in out
    assert main(["inspect", "c.json", "--json"]) == 0
    lens = json.loads(capsys.readouterr().out)["lens"]
    assert (lens["model"], lens["k1"], lens["center_px"]) == ("division", k1, center)
    assert lens["k1_sigma"] == pytest.approx(sigma)
    r2 = 640**2 + 360**2
    assert lens["bend_frame_px"] == pytest.approx(r2**0.5 * (1 / (1 + k1 * r2) - 1))
    assert lens["bend_frame_sigma_px"] == pytest.approx(r2**1.5 / (1 + k1 * r2) ** 2 * sigma)
    assert 0 < lens["bend_region_px"] < lens["bend_frame_px"]
    assert main(SPEED) == 0
    # A lens that does not reach the corners: said, and no number.
    document["distortion"] = {"model": "division", "k1": -2.1e-6, "center_px": center}
    path.write_text(json.dumps(document))
    capsys.readouterr()
    assert main(["inspect", "c.json", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["lens"]["bend_frame_px"] is None
    assert main(["inspect", "c.json", "--picture", "view.png"]) == 0
    assert "beyond what the lens's model reaches" in capsys.readouterr().out


def test_speed_json(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    del recording
    assert main(CALIBRATE) == 0
    capsys.readouterr()
    assert main([*SPEED, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["rows"] == len(T)
    assert found["targets"][0]["target"] == "robot"


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        ([], "COMMAND"),
        (["fly"], "fly"),
        (["calibrate"], "--out"),
        ([*CALIBRATE, "--method", "magic"], "magic"),
        ([*CALIBRATE, "--nonsense"], "--nonsense"),
        ([*CALIBRATE, "--image-size", "big"], "1280x720"),
        ([*CALIBRATE, "--time-offset-s", "soon"], "soon"),
        ([*CALIBRATE, "--time-offset-s", "nan"], "nan"),
        ([*CALIBRATE, "--method", "linear", "--distortion", "division"], "linear"),
        ([*CALIBRATE, "--speed-scale-sigma", "-1"], "speed_scale_sigma"),
        ([*CALIBRATE[:-1], "tracks.csv"], "--out names an input"),
        ([*CALIBRATE[:-1], "nowhere/c.json"], "nowhere"),
        (
            ["calibrate", "--tracks", "none.csv", "--motion", "motion.csv", "--out", "c.json"],
            "none.csv",
        ),
        (["inspect", "none.json"], "none.json"),
        (["inspect", "tracks.csv"], "tracks.csv"),
        (["inspect", "c.json", "--picture", "view.jpg"], ".png"),
        (
            ["speed", "--calibration", "tracks.csv", "--tracks", "tracks.csv", "--out", "s.csv"],
            "tracks.csv",
        ),
        (["reproduce", "table9"], "table9"),
        (["reproduce", "fig4", "--trials", "0"], "trials"),
        (["demo", "--seed", "x"], "seed"),
    ],
)
def test_wrong_commands_exit_2(
    recording: Path, capsys: pytest.CaptureFixture[str], argv: list[str], message: str
) -> None:
    assert message in fails(capsys, argv, 2)
    assert sorted(p.name for p in recording.iterdir()) == ["motion.csv", "tracks.csv"]


def test_a_bad_cell_is_reported_with_file_line_and_column(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = (recording / "tracks.csv").read_text().splitlines()
    lines[41] = "1.0,robot,abc,2.0"
    (recording / "tracks.csv").write_text("\n".join(lines) + "\n")
    line = fails(capsys, CALIBRATE, 2)
    assert "tracks.csv:42" in line
    assert "u_px" in line
    assert "abc" in line


def test_unobservable_motion_exits_3_with_advice(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    straight = Drive(DRIVE.centre, (DRIVE.size[0], 0.0), 40.0)
    write_tracks("tracks.csv", see(SCENE, straight, T, noise=0.3, rng=rng))
    write_motion(
        "motion.csv", read(straight, READINGS, form="distance", heading_noise=0.02, rng=rng)
    )
    line = fails(capsys, [*CALIBRATE, "--json"], 3)
    assert "drive also at about" in line
    assert sorted(p.name for p in tmp_path.iterdir()) == ["motion.csv", "tracks.csv"]


def test_an_existing_calibration_survives_a_failure(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (recording / "c.json").write_text("precious")
    (recording / "motion.csv").write_text("t_s,target\n")
    fails(capsys, CALIBRATE, 2)
    assert (recording / "c.json").read_text() == "precious"


def test_notes_go_to_stderr(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (recording / "tracks.csv").read_text().replace("v_px", "v_px,colour", 1)
    head, *rows = text.splitlines()
    (recording / "tracks.csv").write_text("\n".join([head, *(f"{row},red" for row in rows)]) + "\n")
    assert main([*CALIBRATE, "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["format"] == "airground.calibration/1"
    assert "colour" in err


def airground(*argv: str, **options: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "airground", *argv],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_interrupted_exits_130_and_leaves_nothing(tmp_path: Path, number: signal.Signals) -> None:
    process = airground("reproduce", "fig4", "--trials", "5000000", "--out", str(tmp_path / "out"))
    for _ in range(300):  # the folder is made before the long work
        if (tmp_path / "out").exists():
            break
        time.sleep(0.1)
    time.sleep(0.5)
    process.send_signal(number)
    try:
        _, err = process.communicate(timeout=30)
    finally:
        process.kill()  # or five million trials go on
    assert process.returncode == 130
    assert err == "airground: interrupted\n"
    assert not [p for p in tmp_path.rglob("*") if p.is_file()]


def test_a_reader_that_goes_away_is_no_bug(recording: Path) -> None:
    del recording
    read_end, write_end = os.pipe()
    os.close(read_end)
    process = subprocess.run(
        [sys.executable, "-m", "airground", *CALIBRATE, "--json"],
        stdout=write_end,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(write_end)
    assert process.returncode == 141
    assert process.stderr == ""


def test_a_bug_is_a_traceback_and_exit_1(recording: Path) -> None:
    del recording
    code = (
        "import sys, airground.cli.calibrate as c; c.read_tracks = None; "
        "from airground.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    process = subprocess.run(
        [sys.executable, "-c", code, *CALIBRATE], capture_output=True, text=True, check=False
    )
    assert process.returncode == 1
    assert "Traceback" in process.stderr


def test_every_option_stands_on_the_docs_page(root: Path) -> None:
    page = (root / "docs" / "cli.md").read_text(encoding="utf-8")
    parser = build_parser()
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    for name, command in commands.choices.items():
        section = page.split(f"## airground {name}\n")[1].split("\n## ")[0]
        for action in command._actions:
            for option in action.option_strings:
                assert option in section, f"{name} {option}: run make docs"


def test_demo_writes_everything_and_prints_its_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    shorten_demo(monkeypatch, rate_hz=6.0)
    out = tmp_path / "deep" / "demo"
    assert main(["demo", "--out", str(out), "--seed", "7", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["n"] < 0.03
    assert figures["map_error"] < 3 * figures["relative_sigma"]
    assert figures["elapsed_s"] > 0
    offset = figures["time_offset_s"] - figures["time_offset_true_s"]
    assert abs(offset) < 4 * figures["time_offset_sigma_s"]
    assert figures["path_rms_m"] < 0.02
    assert figures["path_rms_m"] < 1.2 * figures["oracle_path_rms_m"]  # a short drive, few pictures
    (goal,) = figures["goals"]
    assert goal["reached"]
    assert goal["goal_error_px"] < 3
    assert goal["goal_error_m"] < 0.015
    assert figures["stops"] == 0
    assert sorted(p.name for p in out.iterdir()) == [
        "calibration.json",
        "demo.mp4",
        "drive-frame.png",
        "drive.mp4",
        "drive.png",
        "frame.png",
        "ground.png",
        "motion.csv",
        "overview.png",
        "path.csv",
        "report.html",
        "speeds.csv",
        "speeds.png",
        "tracks.csv",
        "view.png",
    ]
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 6
    assert f"{figures['n']:.4f}" in page
    # The same seed gives the same recording, and the same calibration to the bit.
    again = tmp_path / "again"
    assert main(["demo", "--out", str(again), "--seed", "7"]) == 0
    assert "error of g" in capsys.readouterr().out
    for name in ("tracks.csv", "motion.csv", "speeds.csv", "view.png", "drive.png"):
        assert (again / name).read_bytes() == (out / name).read_bytes()
    assert (
        Calibration.load(again / "calibration.json").model.g
        == Calibration.load(out / "calibration.json").model.g
    ).all()

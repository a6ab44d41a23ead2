"""Commands where streams are closed, full or narrow-minded, and the environment is hostile."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from airground.cli import main
from commands import CALIBRATE, fails

FULL = Path("/dev/full")
MODULE = [sys.executable, "-m", "airground"]


def run(*argv: str, shell: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command with its streams redirected by `shell`; both are captured where it says nothing."""
    return subprocess.run(
        ["/bin/sh", "-c", f'exec "$@" {shell}', "sh", *MODULE, *argv],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
@pytest.mark.parametrize("argv", [[*CALIBRATE, "--json"], ["reproduce", "table1", "--trials", "1"]])
def test_a_full_disk_behind_stdout_is_one_line(recording: Path, argv: list[str]) -> None:
    done = run(*argv, shell=f">{FULL}")
    assert done.returncode == 2
    assert (
        done.stderr == "airground: cannot write to the standard output: No space left on device\n"
    )


def test_a_reader_that_goes_away_from_a_table_is_no_bug(recording: Path) -> None:
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = subprocess.run(
        [*MODULE, "reproduce", "table1", "--trials", "1"],
        stdout=write_end,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(write_end)
    assert (done.returncode, done.stderr) == (141, "")


def test_closed_streams_change_nothing_but_what_is_seen(recording: Path) -> None:
    assert run(*CALIBRATE, "--json", shell=">&- 2>&-").returncode == 0
    assert json.loads((recording / "c.json").read_text())["fit"]["sightings"] > 0
    done = run("inspect", "none.json", "--json", shell="2>&-")
    assert (done.returncode, done.stdout) == (
        2,
        "",
    )  # the error has no place to go, least of all stdout


def test_a_name_that_the_terminal_cannot_show_is_escaped(recording: Path) -> None:
    done = run(*CALIBRATE[:-1], "cü.json", PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(r"c\xfc.json: ok")
    assert (recording / "cü.json").exists()


def test_control_characters_of_a_file_do_not_reach_the_terminal(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("tracks.csv", "motion.csv"):
        text = (recording / name).read_text().replace(",robot,", ",\x1b[2Jrobot,")
        (recording / name).write_text(text)
    assert main(CALIBRATE) == 0
    assert (
        main(["speed", "--calibration", "c.json", "--tracks", "tracks.csv", "--out", "s.csv"]) == 0
    )
    out, _ = capsys.readouterr()
    assert "\x1b" not in out
    assert out.count(r"\x1b[2Jrobot") == 2
    (recording / "motion.csv").write_text("t_s,target,x_dot_mps,y_dot_mps\n0,\x1b[2Jother,1,1\n")
    assert r"\x1b[2Jother" in fails(capsys, CALIBRATE, 2)


@pytest.mark.parametrize(
    "environment",
    [
        {"MPLBACKEND": "nonsense"},
        {"MPLCONFIGDIR": "/proc/none", "HOME": "/proc/none"},
        {"PYTHONWARNINGS": "error"},
        {"PYTHONOPTIMIZE": "1"},
        {"LC_ALL": "C", "TERM": "dumb", "NO_COLOR": "1"},
    ],
)
def test_pictures_come_silently_in_any_environment(
    recording: Path, environment: dict[str, str]
) -> None:
    assert main([*CALIBRATE, "--image-size", "1280x720"]) == 0
    done = run("inspect", "c.json", "--json", "--picture", "view.png", **environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["verdict"] == "ok"
    assert (recording / "view.png").stat().st_size > 0


def test_no_progress_in_a_pipe_whatever_forces_colour(recording: Path) -> None:
    done = run("reproduce", "table1", "--trials", "1", "--json", FORCE_COLOR="1")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["table1"]

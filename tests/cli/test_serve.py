"""`airground serve`, `record`, `replay` and `drive --site`: a whole live system in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest

from airground.cli import main
from airground.sim import EmbeddedOptions, EmbeddedWorld
from commands import fails
from session_runs import known_calibration
from waiting import until

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SITE = """\
format = "airground.site/1"
name = "try"

[[cameras]]
source = "embedded"

[[robots]]
name = "red"
track = "0"
link = "embedded"
radius_m = 0.42
speed_mps = 0.3
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "site.toml").write_text(SITE, "utf-8")
    return tmp_path


@contextmanager
def start(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Run it; nothing of it is left, however the test ends."""
    command = [sys.executable, "-m", "airground", *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8"
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def first_line(process: subprocess.Popen[str]) -> dict[str, Any]:
    assert process.stdout is not None
    document: dict[str, Any] = json.loads(process.stdout.readline())
    return document


def healthy(url: str) -> bool:
    try:
        with urllib.request.urlopen(f"{url}health", timeout=30) as health:
            return bool(json.loads(health.read())["status"] == "ok")
    except urllib.error.HTTPError:  # no step yet
        return False


def test_it_serves_records_and_ends_in_order(folder: Path) -> None:
    site = ("--site", "site.toml", "--record", "s.mcap")
    with start("serve", "--port", "0", "--json", *site) as process:
        document = first_line(process)
        assert document["recording"] == "s.mcap"
        with urllib.request.urlopen(document["url"], timeout=30) as page:
            assert b"airground" in page.read()
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "airground: interrupted"
    assert main(["replay", "s.mcap"]) == 0  # the file was closed


def test_a_recording_gives_the_same_when_replayed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["record", "--out", "r.mcap", "--seconds", "2", "--port", "0"]) == 0
    capsys.readouterr()
    assert main(["replay", "r.mcap", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["same"] is True
    assert document["cut"] == ""
    assert document["steps"] > 50


def test_drive_drives_a_robot_of_a_site(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    known_calibration(EmbeddedWorld(EmbeddedOptions(robots=1))).save(folder / "c.json")
    command = ["drive", "--calibration", "c.json", "--site", "site.toml", "--goal", "600,400"]
    assert main([*command, "--json", "--out", "out"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["reached"] is True, document
    assert document["goal_error_px"] < 3
    assert document["world"] == "site"
    assert json.loads((folder / "out" / "drive.json").read_text("utf-8")) == document


@pytest.mark.parametrize(
    ("arguments", "code", "word"),
    [
        (["serve", "--site", "none.toml"], 2, "none.toml"),
        (["serve", "--site", "site.toml", "--robots", "2"], 2, "--robots"),
        (["serve", "--robots", "7"], 2, "robots must be 1 to 6"),
        (["serve", "--port", "70000"], 2, "port"),
        (["record"], 2, "--out"),
        (["record", "--out", "site.toml"], 2, "site.toml"),
        (["replay", "none.mcap"], 2, "none.mcap"),
        (["replay", "site.toml"], 2, "site.toml"),
        (["drive", "--calibration", "c.json", "--goal", "1,1", "--robot", "red"], 2, "--robot"),
    ],
)
def test_what_is_wrong_is_one_line(
    arguments: list[str],
    code: int,
    word: str,
    folder: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert word in fails(capsys, arguments, code)


def test_each_mistake_of_a_site_is_a_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = SITE.replace("radius_m = 0.42", 'radius_m = "wide"\ncolour = "red"')
    (folder / "site.toml").write_text(wrong, "utf-8")
    assert main(["serve", "--site", "site.toml"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert len(lines) == 2, err
    assert all(line.startswith("airground: site.toml:") for line in lines)
    assert "radius_m" in lines[0]
    assert "colour" in lines[1]


def test_a_port_in_use_is_said_and_nothing_runs(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert "in use" in fails(capsys, ["serve", "--site", "site.toml", "--port", port], 4)


def test_a_camera_that_is_not_there_is_shown_not_fatal(folder: Path) -> None:
    site = SITE.replace(
        'source = "embedded"', 'source = "rtsp://127.0.0.1:9/none"\ndetector = "tag"'
    )
    site = site.replace('link = "embedded"', 'link = "udp://127.0.0.1:9"')
    (folder / "site.toml").write_text(site, "utf-8")
    with start("serve", "--port", "0", "--json", "--site", "site.toml") as process:
        url = first_line(process)["url"]
        until(lambda: healthy(url), 60)
        assert process.poll() is None
        os.kill(process.pid, signal.SIGTERM)
        process.communicate(timeout=60)
    assert process.returncode == 130

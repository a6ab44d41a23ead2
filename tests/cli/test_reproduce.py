"""`airground reproduce`: several processes, and their end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

from airground.cli import main

if TYPE_CHECKING:
    from pathlib import Path

MODULE = [sys.executable, "-m", "airground", "reproduce"]


def test_the_numbers_are_the_same_for_any_number_of_processes(
    capsys: pytest.CaptureFixture[str],
) -> None:
    printed = []
    for jobs in ("1", "2"):
        assert main(["reproduce", "table1", "--trials", "450", "--jobs", jobs, "--json"]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1]
    assert json.loads(printed[0])["table1"]["trials"] == 450


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="sends Ctrl-C to a whole group")
@pytest.mark.parametrize("seconds", [0.1, 2.5])  # while processes start, and while they work
def test_control_c_ends_all_processes_in_a_line(tmp_path: Path, seconds: float) -> None:
    out = tmp_path / "out"
    process = subprocess.Popen(
        [*MODULE, "fig4", "--trials", "5000000", "--jobs", "2", "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    for _ in range(300):  # the folder is made before the long work
        if out.exists():
            break
        time.sleep(0.1)
    time.sleep(seconds)
    os.killpg(process.pid, signal.SIGINT)
    try:
        shown, err = process.communicate(
            timeout=30
        )  # ends when the last process closes its streams
    finally:
        process.kill()  # or five million trials go on
    assert (process.returncode, shown, err) == (130, "", "airground: interrupted\n")
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("jobs", ["0", "-1", "two", "1025"])
def test_impossible_jobs_are_refused(jobs: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "table1", "--trials", "1", "--jobs", jobs]) == 2
    assert "--jobs: expected" in capsys.readouterr().err

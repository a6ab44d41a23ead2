"""README, versions, and what must not stand in any file."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from airground._version import __version__
from airground.records import write_motion, write_tracks
from airground.sim import calibration_drive, demo_world

ROOT = Path(__file__).resolve().parents[2]

# In pieces, so that this file does not hold them.
FORBIDDEN = [
    "/wor" + "k/",
    "/far" + "m/",
    "pypi" + ".org",
    "registry." + "npmjs",
    "files.python" + "hosted",
]


def python_blocks(text: str) -> list[tuple[int, str]]:
    """Line and code of each block fenced as python."""
    pattern = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
    return [(text[: m.start(1)].count("\n") + 1, m.group(1)) for m in pattern.finditer(text)]


def test_blocks_are_found() -> None:
    assert python_blocks("a\n```python\nx = 1\n```\n```sh\nls\n```\n") == [(3, "x = 1\n")]


DOCUMENTS = [
    path
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
    if path.exists() and python_blocks(path.read_text("utf-8"))
]


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_python_in_documents_runs(path: Path, tmp_path: Path) -> None:
    drive = calibration_drive(demo_world(), np.random.default_rng(0))
    write_tracks(tmp_path / "tracks.csv", drive.tracks)
    write_motion(tmp_path / "motion.csv", drive.motion)
    code = "\n".join(block for _, block in python_blocks(path.read_text("utf-8")))
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_the_readme_has_python() -> None:
    assert ROOT / "README.md" in DOCUMENTS


def listed() -> list[Path]:
    """Files that git tracks or would track."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    names = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=True,
    ).stdout.split("\0")
    return [ROOT / name for name in names if name and (ROOT / name).is_file()]


def test_no_file_names_a_registry_or_a_place_on_one_machine() -> None:
    found = []
    for path in listed():
        data = path.read_bytes()
        found += [f"{path.relative_to(ROOT)}: {w}" for w in FORBIDDEN if w.encode() in data]
    assert found == []


def test_citation_has_the_version() -> None:
    path = ROOT / "CITATION.cff"
    versions = re.findall(r"^version: *[\"']?([^\"'\n]+)", path.read_text("utf-8"), re.MULTILINE)
    assert versions == [__version__]


def test_changelog_opens_with_the_version() -> None:
    path = ROOT / "CHANGELOG.md"
    headings = re.findall(r"^## \[?v?(\d[^\s\]]*)", path.read_text("utf-8"), re.MULTILINE)
    assert headings[:1] == [__version__]

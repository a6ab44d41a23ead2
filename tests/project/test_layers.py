"""Imports only go down (pyproject.toml, tool.importlinter), and a breach is noticed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

LINT = "from importlinter.cli import lint_imports_command; lint_imports_command()"


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    env = os.environ | {"PYTHONPATH": str(folder / "src"), "COLUMNS": "200"}
    return subprocess.run(
        [sys.executable, "-c", LINT, "--no-cache"],
        cwd=folder,
        env=env,
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )


def test_contracts_are_kept(root: Path) -> None:
    done = lint(root)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " 0 broken" in done.stdout


LAYERS = "imports only go down BROKEN"
FILES = "no files, clocks, logs or screens BROKEN"
DRAWS = "only pictures draws BROKEN"

# file, line to put into it, contract that must break
BREACHES = {
    "up": ("geometry/velocity.py", "from airground.calibration import samples", LAYERS),
    "up from the bottom": ("errors.py", "import airground.geometry.arrays", LAYERS),
    "within a function": ("geometry/arrays.py", "def f():\n    import airground.cli", LAYERS),
    "sideways": ("records/extra.py", "import airground.pictures", LAYERS),
    "a part without a row": ("misc.py", "X = 1", LAYERS),
    "a file": ("geometry/velocity.py", "from pathlib import Path", FILES),
    "a clock": ("calibration/samples.py", "import time", FILES),
    "chance": ("calibration/samples.py", "import random", FILES),
    "MuJoCo": ("sim/live.py", "import mujoco", "only sim3d imports MuJoCo BROKEN"),
    "a figure": ("cli/__init__.py", "from matplotlib import pyplot", DRAWS),
}


@pytest.mark.parametrize("name", BREACHES)
def test_a_breach_is_noticed(name: str, root: Path, tmp_path: Path) -> None:
    file, line, contract = BREACHES[name]
    package = tmp_path / "src" / "airground"
    shutil.copytree(
        root / "src" / "airground", package, ignore=shutil.ignore_patterns("__pycache__")
    )
    shutil.copy(root / "pyproject.toml", tmp_path)
    for part in ("cli", "pictures", "records"):  # breaches need both sides
        (package / part).mkdir(exist_ok=True)
        (package / part / "__init__.py").touch()
    path = package / file
    before = path.read_text("utf-8") if path.exists() else ""
    path.write_text(f"{before}\n{line}\n", "utf-8")
    done = lint(tmp_path)
    assert done.returncode != 0
    assert contract in done.stdout, done.stdout + done.stderr

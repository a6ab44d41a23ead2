"""A recording to run commands on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from commands import record

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np


@pytest.fixture
def recording(tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder with tracks.csv and motion.csv, which is the current one."""
    record(tmp_path, rng)
    monkeypatch.chdir(tmp_path)
    return tmp_path

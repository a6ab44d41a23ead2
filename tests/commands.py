"""What tests of the command line share: a recording, the command that calibrates on it, and how a command must fail."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.cli import main
from airground.records import write_motion, write_tracks
from drives import fit_drive, read, see
from scenes import scene

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

SCENE = scene(tilt_deg=45)
DRIVE = fit_drive(SCENE)
T = np.arange(0, 60, 1 / 30)
READINGS = np.arange(-1.5, 62, 0.05)

CALIBRATE = ["calibrate", "--tracks", "tracks.csv", "--motion", "motion.csv", "--out", "c.json"]
SPEED = ["speed", "--calibration", "c.json", "--tracks", "tracks.csv", "--out", "s.csv"]


def record(folder: Path, rng: np.random.Generator) -> None:
    """Write tracks.csv and motion.csv of a drive that determines g."""
    write_tracks(folder / "tracks.csv", see(SCENE, DRIVE, T, noise=0.3, rng=rng))
    write_motion(folder / "motion.csv", read(DRIVE, READINGS, form="speed", offset=0.1))


def fails(capsys: pytest.CaptureFixture[str], argv: list[str], code: int) -> str:
    """Run what must fail: its code, one line on stderr, nothing on stdout."""
    assert main(argv) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1, err
    assert err.startswith("airground: ")
    return err


def shorten_demo(monkeypatch: pytest.MonkeyPatch, *, rate_hz: float) -> None:
    """Film and drive less of the demo, so that it takes seconds; the cart comes into view just before the end."""
    monkeypatch.setattr("airground.studies.demo.DURATION_S", 44.0)
    monkeypatch.setattr("airground.studies.film.RATE_HZ", rate_hz)
    monkeypatch.setattr("airground.studies.film.FILM_EVERY", 5)
    monkeypatch.setattr("airground.studies.demo_drive.CAMERA_HZ", 8.0)
    monkeypatch.setattr("airground.studies.demo_drive.GOALS_PX", ((600.0, 430.0),))
    u = np.linspace(560.0, 760.0, 25)
    sketch = np.column_stack([u, 420 + 30 * np.sin(u / 40)])
    monkeypatch.setattr("airground.studies.demo_drive.hand_sketch", lambda _: sketch)

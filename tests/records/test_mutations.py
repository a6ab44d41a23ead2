"""Whatever happens to the bytes of a file: it is read as something valid, or refused in one line."""

from __future__ import annotations

import dataclasses
import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.calibration import Calibration, Motion, TargetFit, Tracks
from airground.errors import FileError
from airground.geometry import DivisionLens
from airground.records import read_motion, read_tracks, write_motion, write_tracks
from commands import DRIVE, SCENE
from drives import read, see

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hypothesis.strategies import DrawFn

THOROUGH = 6 * settings().max_examples  # each takes a few ms
T = np.arange(0, 2, 0.1)
NUMBER = re.compile(rb"-?\d[\d.e+-]*")
WORDS = [
    *(b",,", b'""', b"\r\n", b"\n\n", b"\xef\xbb\xbf", b"nan", b"inf", b"1e999", b"1e308", b"-1"),
    *(b"1" + b"0" * 400, b"null", b"true", b"[]", b"{}", b"[" * 50, b'"g": 0, ', b"\\ud800"),
]


@st.composite
def mutations(draw: DrawFn) -> Callable[[bytes], bytes]:
    """A few deletions, insertions, flipped bits, other numbers and the like, at shares of the length."""
    pieces = st.sampled_from(WORDS) | st.binary(min_size=1, max_size=2)
    place = st.floats(0, 1, exclude_max=True)
    kinds = ("delete", "insert", "repeat", "flip", "cut", "number")
    steps = draw(
        st.lists(
            st.tuples(st.sampled_from(kinds), place, st.integers(1, 40), pieces),
            min_size=1,
            max_size=4,
        )
    )

    def mutate(data: bytes) -> bytes:
        for kind, share, count, piece in steps:
            i = int(share * len(data))
            if kind == "delete":
                data = data[:i] + data[i + count :]
            elif kind == "insert":
                data = data[:i] + piece + data[i:]
            elif kind == "repeat":
                data = data[: i + count] + data[i:]
            elif kind == "flip":
                data = data[:i] + bytes(b ^ 1 << count % 8 for b in data[i : i + 1]) + data[i + 1 :]
            elif kind == "cut":
                data = data[:i]
            elif number := NUMBER.search(data, i):
                data = data[: number.start()] + piece + data[number.end() :]
        return data

    return mutate


@pytest.fixture(scope="module")
def tracks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mutations") / "tracks.csv"
    seen = see(SCENE, DRIVE, T)
    names = ["robot", 'cart, "red"'] * (len(T) // 2)
    write_tracks(path, Tracks.from_rows(T, names, seen.uv, np.full(len(T), 0.5)))
    return path


@pytest.fixture(scope="module", params=["velocity", "speed", "distance"])
def motion(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mutations") / "motion.csv"
    write_motion(path, read(DRIVE, T, form=request.param))
    return path


@pytest.fixture(scope="module")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from airground.calibration import calibrate

    t = np.arange(0, 40, 0.1)
    path = tmp_path_factory.mktemp("mutations") / "calibration.json"
    plain = calibrate(see(SCENE, DRIVE, t), read(DRIVE, t), image_size_px=SCENE.image_size)
    lens = DivisionLens(-1.3e-8, np.array([639.5, 359.5]))
    target = TargetFit(400, 0.1, 0.01, 1.02, 0.01, (0.3, -0.1), (0.02, 0.03), 1e-3)
    dataclasses.replace(
        plain,
        lens=lens,
        k1_covariance=np.append(np.zeros(6), 1.7e-19),
        targets={"robot": target},
    ).save(path)
    return path


def check_rows(rows: Tracks | Motion) -> None:
    """All that a type promises, asked without its own checks."""
    assert len(rows) > 0
    assert set(np.unique(rows.target_index)) == set(range(len(rows.targets)))
    assert all(name and name == name.strip() for name in rows.targets)
    for name in rows.targets:
        assert (np.diff(rows.t[rows.rows(name)]) > 0).all()
    columns = (rows.uv, rows.sigma) if isinstance(rows, Tracks) else (rows.xy_dot, rows.heading)
    for column in (rows.t, *columns):
        assert column is None or np.isfinite(column).all()


def refused(error: FileError, path: Path) -> None:
    assert str(error).startswith(str(path))
    assert "\n" not in str(error)
    assert "\r" not in str(error)
    assert len(str(error)) < 1000


@settings(max_examples=THOROUGH)
@given(mutations())
def test_mutated_tracks(tracks: Path, mutate: Callable[[bytes], bytes]) -> None:
    path = tracks.with_name("mutated.csv")
    path.write_bytes(mutate(tracks.read_bytes()))
    try:
        check_rows(read_tracks(path))
    except FileError as error:
        refused(error, path)


@settings(max_examples=THOROUGH)
@given(mutations())
def test_mutated_motion(motion: Path, mutate: Callable[[bytes], bytes]) -> None:
    path = motion.with_name("mutated.csv")
    path.write_bytes(mutate(motion.read_bytes()))
    try:
        check_rows(read_motion(path))
    except FileError as error:
        refused(error, path)


@settings(max_examples=THOROUGH)
@given(mutations())
def test_mutated_calibrations(calibration: Path, mutate: Callable[[bytes], bytes]) -> None:
    path = calibration.with_name("mutated.json")
    path.write_bytes(mutate(calibration.read_bytes()))
    try:
        loaded = Calibration.load(path)
    except FileError as error:
        refused(error, path)
        return
    assert np.isfinite(loaded.model.g).all()
    assert np.isfinite(loaded.distort(loaded.origin_px)).all()
    assert loaded.k1_sigma is None or 0 <= loaded.k1_sigma < np.inf
    assert np.isfinite([loaded.time_offset_s, loaded.time_offset_sigma_s]).all()
    assert (np.linalg.eigvalsh(loaded.covariance) >= -1e-9 * np.abs(loaded.covariance).max()).all()
    path.with_name("again.json").unlink(missing_ok=True)
    loaded.save(path.with_name("again.json"))
    assert (Calibration.load(path.with_name("again.json")).model.g == loaded.model.g).all()

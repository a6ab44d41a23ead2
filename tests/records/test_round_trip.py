"""What is written reads back bit for bit, in whatever order its rows stand."""

from __future__ import annotations

import random
import string
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from airground.calibration.recordings import Motion, Tracks
from airground.errors import InputError
from airground.records import read_motion, read_tracks, write_motion, write_tracks

ODD = ["a,b", 'say "hi"', '"', ",", "two  words", "näme 🤖", "1_000", "nan", "#1", "'", "a\u2028b"]
COLUMNS = {
    Tracks: ("t", "uv", "sigma"),
    Motion: ("t", "xy_dot", "heading", "speed", "distance", "sigma_speed", "sigma_heading"),
}

numbers = st.floats(allow_nan=False, allow_infinity=False)
positive = st.floats(min_value=0, exclude_min=True, allow_infinity=False)
times = st.floats(-8e307, 8e307)  # differences stay finite
names = st.one_of(
    st.sampled_from(ODD),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\r\n\0"), min_size=1),
    st.text(string.printable, min_size=1),
).filter(lambda name: name == name.strip() and not set(name) & set("\r\n\0"))


@st.composite
def rows(draw: st.DrawFn) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Names, index and times in the order that recordings have; every target has a row."""
    targets = tuple(draw(st.lists(names, min_size=1, max_size=4, unique=True)))
    each = [np.sort(draw(st.lists(times, min_size=1, max_size=5, unique=True))) for _ in targets]
    index = np.repeat(np.arange(len(targets)), [len(t) for t in each])
    return targets, index, np.concatenate(each)


def column(draw: st.DrawFn, count: int, values: st.SearchStrategy[float] = numbers) -> np.ndarray:
    return np.array(draw(st.lists(values, min_size=count, max_size=count)))


@st.composite
def all_tracks(draw: st.DrawFn) -> Tracks:
    targets, index, t = draw(rows())
    uv = np.column_stack([column(draw, len(t)), column(draw, len(t))])
    sigma = column(draw, len(t), positive) if draw(st.booleans()) else None
    return Tracks(targets, index, t, uv, sigma)


@st.composite
def all_motion(draw: st.DrawFn) -> Motion:
    targets, index, t = draw(rows())
    form = draw(st.sampled_from([("xy",), ("speed",), ("distance",), ("speed", "distance")]))
    sigmas = {
        name: column(draw, len(t), positive)
        for name in ("sigma_speed", "sigma_heading")
        if draw(st.booleans())
    }
    if form == ("xy",):
        xy_dot = np.column_stack([column(draw, len(t)), column(draw, len(t))])
        return Motion(targets, index, t, xy_dot=xy_dot, **sigmas)
    along = {name: column(draw, len(t)) for name in form}
    return Motion(targets, index, t, heading=column(draw, len(t)), **along, **sigmas)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("round_trip")


def bits(array: np.ndarray | None) -> bytes | None:
    return None if array is None else array.tobytes()


def assert_same_bits(one: Tracks | Motion, other: Tracks | Motion) -> None:
    assert one.targets == other.targets
    assert one.target_index.tolist() == other.target_index.tolist()
    for name in COLUMNS[type(one)]:
        assert bits(getattr(one, name)) == bits(getattr(other, name)), name


def shuffled(path: Path, seed: int) -> None:
    header, *lines = path.read_bytes().decode().split("\n")[:-1]
    random.Random(seed).shuffle(lines)
    path.write_bytes("\n".join([header, *lines, ""]).encode())


def assert_same_rows(one: Tracks | Motion, other: Tracks | Motion) -> None:
    """Targets may come in another order, as it is that of their first rows."""
    assert set(one.targets) == set(other.targets)
    for target in one.targets:
        for name in COLUMNS[type(one)]:
            mine, theirs = getattr(one, name), getattr(other, name)
            assert (mine is None) == (theirs is None)
            if mine is not None:
                assert bits(mine[one.rows(target)]) == bits(theirs[other.rows(target)])


@given(tracks=all_tracks(), seed=st.integers(0, 99))
@example(
    tracks=Tracks(tuple(ODD), np.arange(len(ODD)), np.zeros(len(ODD)), np.zeros((len(ODD), 2))),
    seed=1,
)
@example(
    tracks=Tracks(
        ("a",), np.zeros(1, int), np.array([-0.0]), np.array([[5e-324, -1.7976931348623157e308]])
    ),
    seed=0,
)
def test_tracks(folder: Path, tracks: Tracks, seed: int) -> None:
    path = folder / "tracks.csv"
    write_tracks(path, tracks)
    notes: list[str] = []
    assert_same_bits(read_tracks(path, note=notes.append), tracks)
    shuffled(path, seed)
    assert_same_rows(read_tracks(path, note=notes.append), tracks)
    assert notes == []


@given(motion=all_motion(), seed=st.integers(0, 99))
def test_motion(folder: Path, motion: Motion, seed: int) -> None:
    path = folder / "motion.csv"
    write_motion(path, motion)
    notes: list[str] = []
    assert_same_bits(read_motion(path, note=notes.append), motion)
    shuffled(path, seed)
    assert_same_rows(read_motion(path, note=notes.append), motion)
    assert notes == []


def test_many_rows(folder: Path, rng: np.random.Generator) -> None:
    count = 45_000
    t = np.concatenate([np.sort(rng.normal(size=count // 3)) for _ in range(3)])
    index = np.repeat([0, 1, 2], count // 3)
    tracks = Tracks(("c", "a", "b"), index, t, rng.normal(size=(count, 2)) ** 9)
    write_tracks(folder / "many.csv", tracks)
    assert_same_bits(read_tracks(folder / "many.csv"), tracks)


def test_file_is_what_the_contract_says(tmp_path: Path) -> None:
    tracks = Tracks(("a", "b,c"), [0, 1], [0, 0.1], [[1, 2], [3, 4]], [0.5, 0.25])  # type: ignore[arg-type]
    write_tracks(tmp_path / "tracks.csv", tracks)
    assert (tmp_path / "tracks.csv").read_bytes() == (
        b't_s,target,u_px,v_px,sigma_px\n0.0,a,1.0,2.0,0.5\n0.1,"b,c",3.0,4.0,0.25\n'
    )


@pytest.mark.parametrize(
    "name", [" a", "a ", "\u00a0a", "a\nb", "a\rb", "a\0b", "\ud800", "a" * 1001]
)
def test_name_that_would_not_read_back_is_refused(tmp_path: Path, name: str) -> None:
    tracks = Tracks.from_rows([0], [name], [[1, 2]])
    with pytest.raises(InputError, match="target name") as caught:
        write_tracks(tmp_path / "tracks.csv", tracks)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []

"""`reproduce real`: what is found, what is compared, what is refused, what is said where there is nothing."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration import Tracks, calibrate
from airground.errors import FileError, UndeterminedError
from airground.geometry import align_rotation, n_error
from airground.records import write_motion, write_tracks
from airground.sim import calibration_drive, demo_world
from airground.studies.real import METHODS, compare
from airground.studies.recordings import find_recordings, odometry_homography, read_recording
from airground.studies.reproduce import ITEMS, reproduce
from airground.vision.homography import find_homography

if TYPE_CHECKING:
    from pathlib import Path

WORLD = demo_world()
DRIVE = calibration_drive(WORLD, np.random.default_rng(0))
ROBOT = WORLD.robot
ROWS = DRIVE.tracks.rows(ROBOT)
TRACKS = Tracks(
    t=DRIVE.tracks.t[ROWS],
    uv=DRIVE.tracks.uv[ROWS],
    targets=(ROBOT,),
    target_index=np.zeros(ROWS.stop - ROWS.start, dtype=np.intp),
)
SIZE = WORLD.camera.image_size_px


def put(folder: Path, truth: object, tracks: Tracks = TRACKS) -> Path:
    folder.mkdir(parents=True)
    write_tracks(folder / "tracks.csv", tracks)
    write_motion(folder / "motion.csv", DRIVE.motion)
    text = truth if isinstance(truth, str) else json.dumps(truth)
    (folder / "truth.json").write_text(text, "utf-8")
    return folder


def told(g: object = "true") -> dict[str, Any]:
    return {"g": WORLD.camera.g.tolist() if g == "true" else g, "image_size_px": list(SIZE)}


def test_recordings_are_found_by_what_is_in_the_folder(tmp_path: Path) -> None:
    deep = put(tmp_path / "x" / "y" / "no name tells", told())
    unknown = put(tmp_path / "unknown g", told(None))
    put(tmp_path / "recording_without_g", {"notes": "no g"})
    (put(tmp_path / "recording_without_motion", told()) / "motion.csv").unlink()
    broken = put(tmp_path / "broken", "{")
    assert find_recordings(tmp_path) == sorted([deep, unknown, broken])


def test_methods_are_compared_with_the_truth(tmp_path: Path) -> None:
    recording = read_recording(put(tmp_path / "a", told()))
    found = compare(recording)
    assert list(found) == list(METHODS)
    whole = calibrate(TRACKS, DRIVE.motion, image_size_px=SIZE)
    aligned, _ = align_rotation(WORLD.camera.g, whole.model)
    assert found["trajectory"]["n"] == pytest.approx(float(n_error(WORLD.camera.g, aligned)))
    assert found["trajectory"]["relative_sigma"] == whole.observability.relative_sigma
    assert found["trajectory"]["n"] < 0.03
    assert found["trajectory"]["map_error"] < 0.03
    assert "relative_sigma" in found["linear"]
    assert "relative_sigma" not in found["homography"]  # findHomography states none
    assert 0 < found["homography"]["n"] < 0.2


def test_a_rotation_of_the_ground_is_no_error(tmp_path: Path) -> None:
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    turned = read_recording(put(tmp_path / "a", told((WORLD.camera.g @ turn).tolist())))
    upright = read_recording(put(tmp_path / "b", told()))
    for one, other in zip(compare(turned).values(), compare(upright).values(), strict=True):
        assert one["n"] == pytest.approx(other["n"], rel=1e-6)


def test_the_homography_is_that_of_the_points(rng: np.random.Generator) -> None:
    xy = rng.uniform(-1, 1, (20, 2))
    uv = WORLD.camera.project(xy)
    G = find_homography(xy, uv)
    assert G is not None
    seen = np.column_stack([xy, np.ones(20)]) @ G.T
    assert_allclose(seen[:, :2] / seen[:, 2:], uv, atol=1e-3)
    assert find_homography(xy[:3], uv[:3]) is None


def test_several_robots_have_no_common_origin() -> None:
    two = Tracks(
        t=np.concatenate([TRACKS.t, TRACKS.t]),
        uv=np.concatenate([TRACKS.uv, TRACKS.uv]),
        targets=(ROBOT, "other"),
        target_index=np.repeat([0, 1], len(TRACKS.t)),
    )
    motion = type(DRIVE.motion)(
        t=np.concatenate([DRIVE.motion.t, DRIVE.motion.t]),
        targets=(ROBOT, "other"),
        target_index=np.repeat([0, 1], len(DRIVE.motion.t)),
        heading=None if DRIVE.motion.heading is None else np.tile(DRIVE.motion.heading, 2),
        speed=None if DRIVE.motion.speed is None else np.tile(DRIVE.motion.speed, 2),
    )
    with pytest.raises(UndeterminedError, match="2 robots: odometry gives each an origin"):
        odometry_homography(two, motion, 0.0)


def test_the_item(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = tmp_path / "data"
    put(data / "good", told())
    put(data / "broken", "[]")
    short = TRACKS.t < TRACKS.t[0] + 0.4  # a few sightings on one heading
    few = Tracks(
        t=TRACKS.t[short],
        uv=TRACKS.uv[short],
        targets=(ROBOT,),
        target_index=np.zeros(int(short.sum()), dtype=np.intp),
    )
    put(data / "short", told(None), few)
    monkeypatch.setenv("AIRGROUND_DATA", str(data))
    result = reproduce(["real"], out=tmp_path / "out")
    document: Any = result["real"]
    by_name = {one["name"]: one for one in document["recordings"]}
    assert list(by_name) == ["broken", "good", "short"]
    assert all("expected an object" in by_name["broken"][method]["refused"] for method in METHODS)
    assert by_name["good"]["trajectory"]["n"] < 0.03
    assert "refused" in by_name["short"]["linear"]
    assert "n" not in by_name["short"]["homography"]  # nobody knows the truth
    assert json.loads((tmp_path / "out" / "reproduce.json").read_text("utf-8")) == result
    assert (tmp_path / "out" / "real.png").stat().st_size > 5000
    sheet = ITEMS["real"].sheet(document)
    cells = dict(zip(("name", *METHODS), sheet.rows[1], strict=True))
    good = by_name["good"]["trajectory"]
    assert cells["trajectory"].startswith(f"{good['n']:.4f}, {good['map_error']:.1%} (")
    assert sheet.rows[0][1:] == ("refused",) * 3
    assert "short, linear method, refused: " in sheet.note


@pytest.mark.parametrize(
    ("named", "why"),
    [(None, "is not set"), ("", "is not set"), ("nowhere", "no folder"), (".", "holds tracks.csv")],
)
def test_no_recordings_is_a_line_and_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str | None, why: str
) -> None:
    if named is None:
        monkeypatch.delenv("AIRGROUND_DATA", raising=False)
    else:
        monkeypatch.setenv("AIRGROUND_DATA", named and str(tmp_path / named))
    result: Any = reproduce(["real", "table1"], trials=1, out=tmp_path / "out")
    assert list(result) == ["real", "table1"]
    assert result["real"]["recordings"] == []
    assert why in result["real"]["none"]
    assert "\n" not in result["real"]["none"]
    sheet = ITEMS["real"].sheet(result["real"])
    assert sheet.rows == ()
    assert sheet.note == result["real"]["none"]
    assert not (tmp_path / "out" / "real.png").exists()


@pytest.mark.parametrize("wrong", [{"g": "x"}, {"g": [[1, 2]]}, {"g": None, "image_size_px": 3}])
def test_a_truth_that_is_none_is_refused(tmp_path: Path, wrong: object) -> None:
    with pytest.raises(FileError, match=r"truth\.json"):
        read_recording(put(tmp_path / "a", wrong))

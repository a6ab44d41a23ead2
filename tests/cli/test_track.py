"""``airground track`` as a user runs it, on rendered videos."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.calibration import Motion, Tracks
from airground.cli import main
from airground.records import read_tracks, write_motion
from commands import CALIBRATE, fails, record
from footage import RATE_HZ, SIZE_PX, circle, circling, true_uv, write_film

TRACK = ["track", "--video", "film.avi", "--out", "t.csv"]
TAGS = [*TRACK, "--detector", "tag:family=36h11"]  # without looking for what there is first


@pytest.fixture(scope="session")
def films(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of videos that all tests read."""
    folder = tmp_path_factory.mktemp("films")
    write_film(folder / "still.avi", circling(), 2.5)
    write_film(folder / "plain.avi", circling(tag=False), 6.0)
    write_film(folder / "hover.avi", circling(moving_camera=True), 3.0)
    write_film(folder / "flight.avi", circling(moving_camera=True), 16.0, rate_hz=8.0)
    return folder


@pytest.fixture
def here(
    films: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> Path:
    """Folder with film.avi, which is the current one."""
    (tmp_path / "film.avi").write_bytes((films / f"{request.param}.avi").read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def error_px(tracks: Tracks, target: str, *, moving_camera: bool = False) -> float:
    """Root mean square distance of a target's sightings from the truth, in u and v."""
    rows = tracks.rows(target)
    truth = true_uv(circling(moving_camera=moving_camera), tracks.t[rows])
    return float(np.sqrt(np.mean((tracks.uv[rows] - truth) ** 2)))


@pytest.mark.parametrize("here", ["still"], indirect=True)
def test_a_tag_is_found_without_being_told(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*TRACK, "--json"]) == 0
    out, err = capsys.readouterr()
    document = json.loads(out)
    assert err == "note: an AVI file holds no times: counted at 20 frames per second\n"
    assert document["detector"] == "tags 36h11"
    assert document["frames"] == 51
    assert document["clock"] == "rate"  # an AVI file has no times
    assert document["image_size_px"] == list(SIZE_PX)
    tracks = read_tracks("t.csv")
    assert tracks.targets == ("7",)
    assert len(tracks) == document["sightings"] == document["targets"]["7"]["sightings"] >= 50
    np.testing.assert_allclose(tracks.t * RATE_HZ, np.round(tracks.t * RATE_HZ), atol=1e-6)
    assert error_px(tracks, "7") < 0.1
    assert tracks.sigma is not None
    assert 0.2 < error_px(tracks, "7") / np.median(tracks.sigma) < 3
    assert sorted(path.name for path in here.iterdir()) == ["film.avi", "t.csv"]


@pytest.mark.parametrize("here", ["still"], indirect=True)
def test_the_same_video_gives_the_same_files(here: Path) -> None:
    assert main([*TAGS, "--smoothed", "s.csv", "--preview", "p.avi"]) == 0
    first = {path.name: path.read_bytes() for path in here.iterdir()}
    assert main([*TAGS, "--smoothed", "s.csv", "--preview", "p.avi"]) == 0
    assert {path.name: path.read_bytes() for path in here.iterdir()} == first
    header, *rows = first["s.csv"].decode().splitlines()
    assert header == "t_s,target,u_px,v_px,sigma_px,u_dot_pxps,v_dot_pxps,sigma_dot_pxps"
    assert len(rows) == len(read_tracks("t.csv"))
    values = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    # Velocities are the slope of the truth, by differences of a millisecond.
    t, h = values[:, 0], 1e-3
    slope = (true_uv(circling(), t + h) - true_uv(circling(), t - h)) / (2 * h)
    inner = slice(5, -5)
    assert np.abs(values[inner, 5:7] - slope[inner]).max() < 3.0
    assert np.median(values[inner, 7]) < 3.0


@pytest.mark.parametrize("here", ["still"], indirect=True)
@pytest.mark.parametrize("name", ["p.mp4", "p.avi"])
def test_preview_shows_each_frame_with_the_track(here: Path, name: str) -> None:
    assert main([*TAGS, "--preview", name]) == 0
    video, film = cv2.VideoCapture(name), cv2.VideoCapture("film.avi")
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 51
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(RATE_HZ)
    for k in range(40):
        (shown, image), (_, plain) = video.read(), film.read()
        assert shown, k
    drawn = np.abs(image.astype(int) - plain.astype(int)).sum(axis=2) > 90
    u, v = np.rint(true_uv(circling(), np.array([39 / RATE_HZ]))[0]).astype(int)
    assert drawn[v - 2 : v + 3, u - 2 : u + 3].any()


@pytest.mark.parametrize("here", ["plain"], indirect=True)
def test_without_tags_what_moves_is_followed(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(TRACK) == 0
    assert "looked for moving things" in capsys.readouterr().out
    tracks = read_tracks("t.csv")
    longest = max(tracks.targets, key=lambda name: len(tracks.t[tracks.rows(name)]))
    rows = tracks.rows(longest)
    assert len(tracks.t[rows]) > 80
    # The middle of what is seen of a robot 10 cm high, which is not the middle of its roof.
    off = tracks.uv[rows] - true_uv(circling(), tracks.t[rows])
    assert np.abs(off).max() < 12
    assert np.std(off, axis=0).max() < 2.5


@pytest.mark.parametrize("here", ["hover"], indirect=True)
def test_stabilize_takes_the_cameras_own_motion_out(here: Path) -> None:
    assert main(TAGS) == 0
    shaken = error_px(read_tracks("t.csv"), "7", moving_camera=True)
    assert main([*TAGS, "--stabilize"]) == 0
    tracks = read_tracks("t.csv")
    held = error_px(tracks, "7", moving_camera=True)
    assert len(tracks) > 50
    assert shaken > 1.0
    assert held < 0.15 * shaken


def _write_motion(path: Path) -> None:
    """What the robot that drives in a circle would tell, exactly."""
    t = np.arange(0, 16, 0.05)
    xy, theta = circle(t)
    speed = np.hypot(*np.gradient(xy, t, axis=0).T)
    motion = Motion.from_rows(t, ["7"] * len(t), heading=theta, speed=speed)
    write_motion(path, motion)


@pytest.mark.parametrize("here", ["flight"], indirect=True)
def test_marks_above_the_ground_are_held_still_as_such(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _write_motion(here / "m.csv")
    assert main([*TAGS, "--rate-hz", "8", "--stabilize"]) == 0
    on_ground = error_px(read_tracks("t.csv"), "7", moving_camera=True)
    marks = ["--mark-height", "0.1", "--focal-length", "400", "--motion", "m.csv"]
    capsys.readouterr()
    assert main([*TAGS, "--rate-hz", "8", "--stabilize", *marks, "--json"]) == 0
    held = error_px(read_tracks("t.csv"), "7", moving_camera=True)
    assert held < 0.25 * on_ground
    document = json.loads(capsys.readouterr().out)
    truth = circling(moving_camera=True).camera_at(0.0).centre_m[2]
    assert document["camera_height_m"] == pytest.approx(truth, rel=0.03)


@pytest.mark.parametrize("here", ["still"], indirect=True)
def test_marks_above_the_ground_need_all_that_is_told(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "--focal-length and --motion too" in fails(
        capsys, [*TAGS, "--stabilize", "--mark-height", "0.1"], 2
    )
    all_of_it = ["--mark-height", "0.1", "--focal-length", "400", "--motion", "m.csv"]
    assert "give --stabilize too" in fails(capsys, [*TAGS, *all_of_it], 2)


@pytest.mark.parametrize("here", ["still"], indirect=True)
def test_duration_rate_and_detector_are_what_is_asked_for(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--duration-s", "1", "--rate-hz", "10", "--detector", "tag:family=36h11"]
    assert main([*TRACK, *options, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["frames"] == 11
    assert document["duration_s"] == pytest.approx(1.0)
    assert read_tracks("t.csv").t[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("here", ["still"], indirect=True)
def test_a_function_of_the_users_own(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (here / "mine.py").write_text(
        "import numpy as np\ndef corner(image):\n    return np.array([[12.5, 34.5, 0.25]])\n"
    )
    monkeypatch.syspath_prepend(here)
    assert main([*TRACK, "--detector", "mine:corner"]) == 0
    tracks = read_tracks("t.csv")
    assert tracks.targets == ("track-1",)
    assert tracks.sigma is not None
    assert (tracks.uv == [12.5, 34.5]).all()
    assert tracks.sigma == pytest.approx(0.25)


@pytest.mark.parametrize("here", ["still"], indirect=True)
@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (["--video", "missing.mp4"], 2, "missing.mp4"),
        (["--detector", "magic"], 2, "no detector 'magic'; there are auto, apriltag"),
        (["--detector", "blob:color=green"], 3, "nothing was seen for 0.5 s"),
        (["--preview", "p.gif"], 2, "expected a name that ends in .mp4"),
        (["--preview", "t.csv"], 2, "--preview"),
        (["--smoothed", "t.csv"], 2, "different files"),
        (["--out", "film.avi"], 2, "--out names an input file"),
        (["--preview", "film.avi"], 2, "--preview names an input file"),
        (["--calibration", "c.json"], 2, "--preview"),
        (["--duration-s", "0"], 2, "--duration-s"),
        (["--rate-hz", "nan"], 2, "--rate-hz"),
        (["--video", "rtsp://127.0.0.1:9/none", "--duration-s", "1"], 4, "127.0.0.1"),
    ],
)
def test_errors_are_one_line_and_leave_nothing(
    here: Path, capsys: pytest.CaptureFixture[str], options: list[str], code: int, words: str
) -> None:
    if options[0] == "--calibration":
        (here / "c.json").write_text("{}")
    before = {path.name: path.read_bytes() for path in here.iterdir()}
    assert words in fails(capsys, [*TRACK, *options], code)
    assert {path.name: path.read_bytes() for path in here.iterdir()} == before


def test_garbage_is_not_a_video(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("film.avi").write_bytes(b"not a video at all" * 100)
    assert "film.avi" in fails(capsys, TRACK, 2)
    assert [path.name for path in tmp_path.iterdir()] == ["film.avi"]


@pytest.mark.parametrize("here", ["still"], indirect=True)
def test_preview_with_a_calibration_has_a_grid_and_speeds(
    here: Path, rng: np.random.Generator
) -> None:
    record(here, rng)
    assert main([*CALIBRATE, "--image-size", "480x270", "--method", "linear"]) == 0
    assert main([*TAGS, "--duration-s", "0.3", "--shortest-s", "0.1", "--preview", "bare.avi"]) == 0
    assert (
        main(
            [
                *TAGS,
                "--duration-s",
                "0.3",
                "--shortest-s",
                "0.1",
                "--preview",
                "grid.avi",
                "--calibration",
                "c.json",
            ]
        )
        == 0
    )
    pictures = [cv2.VideoCapture(name).read()[1].astype(int) for name in ("bare.avi", "grid.avi")]
    assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 30).mean() > 0.005

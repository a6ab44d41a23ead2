from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.errors import FileError, InputError
from airground.vision.sources import FrameSource, open_source
from vision.sources.films import number_of, numbered, record, turn

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from airground.vision.frame import Frame, ImageArray
    from airground.vision.sources import Backend

# Seconds in 1/90000, from a time that is not zero: constant, as a phone records, and with long pauses.
STEADY = [9000 + 3600 * k for k in range(12)]
UNSTEADY = [9000, 9011, 12000, 15003, 15990, 20000, 110000, 110900, 113333, 119999, 200001, 203601]


def write_avi(
    path: Path, images: Sequence[ImageArray], codec: str = "MJPG", rate: float = 25
) -> Path:
    """By OpenCV, so that these tests run without PyAV."""
    height, width = images[0].shape[:2]
    writer = cv2.VideoWriter(
        str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*codec), rate, (width, height)
    )
    for image in images:
        writer.write(image)
    writer.release()
    return path


def soft_noise(rng: np.random.Generator) -> ImageArray:
    noise = rng.integers(0, 255, (48, 64, 3), dtype=np.uint8)
    return np.asarray(cv2.GaussianBlur(noise, (0, 0), 3), dtype=np.uint8)


def frames_of(source: FrameSource) -> list[Frame]:
    with source:
        return list(source)


@pytest.mark.parametrize("pts", [STEADY, UNSTEADY])
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        (
            "a.mp4",
            {
                "codec": "libx264",
                "options": {"bf": "2", "g": "6"},
                "clock_hz": 90000,
                "pix_fmt": "yuv420p",
            },
        ),
        (
            "a.mov",
            {"codec": "mpeg4", "options": {"bf": "2"}, "clock_hz": 60000, "pix_fmt": "yuv420p"},
        ),
        (
            "a.ts",
            {"codec": "libx264", "options": {"bf": "2"}, "clock_hz": 90000, "pix_fmt": "yuv420p"},
        ),
        ("a.mkv", {"codec": "ffv1", "options": {}, "clock_hz": 1000, "pix_fmt": "bgr0"}),
    ],
)
def test_times_are_presentation_times_from_the_first_frame(
    tmp_path: Path, backend: Backend, pts: list[int], name: str, kind: dict[str, Any]
) -> None:
    video = record(tmp_path / name, pts, **kind)

    source = open_source(video, backend=backend)
    frames = frames_of(source)

    assert source.clock == "media"
    expected = [(stamp - pts[0]) / kind["clock_hz"] for stamp in pts]
    assert_allclose([frame.t for frame in frames], expected, rtol=0, atol=0.5e-9)
    assert [number_of(frame.image) for frame in frames] == list(range(12))
    assert [frame.index for frame in frames] == list(range(12))
    assert source.health.state == "ended"
    assert source.health.frames == 12
    assert source.health.notes == ()


def test_both_decoders_give_the_same_numbers_and_pictures(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    noise = [soft_noise(rng) for _ in UNSTEADY]
    video = record(tmp_path / "a.mp4", UNSTEADY, images=noise, options={"bf": "2"})
    one, other = (frames_of(open_source(video, backend=b)) for b in ("opencv", "pyav"))

    assert [frame.t for frame in one] == [frame.t for frame in other]  # to the last bit
    for a, b in zip(one, other, strict=True):
        assert_allclose(a.image.astype(int), b.image, atol=2)  # versions of FFmpeg may round apart


def test_a_rate_replaces_the_times(tmp_path: Path, backend: Backend) -> None:
    video = record(tmp_path / "a.mp4", UNSTEADY)
    source = open_source(video, backend=backend, rate_hz=10.0)
    assert_allclose([frame.t for frame in frames_of(source)], np.arange(12) / 10)
    assert source.clock == "rate"


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, rate: float) -> None:
    with pytest.raises(InputError, match="frame rate"):
        open_source(tmp_path, rate_hz=rate)


@pytest.mark.parametrize("codec", ["MJPG", "mp4v", "FFV1"])
def test_avi_has_no_times_and_is_counted(tmp_path: Path, backend: Backend, codec: str) -> None:
    video = write_avi(tmp_path / "a.avi", [numbered(k) for k in range(12)], codec, rate=12.5)
    source = open_source(video, backend=backend)
    frames = frames_of(source)
    assert source.clock == "rate"
    assert_allclose([frame.t for frame in frames], np.arange(12) / 12.5)
    assert [number_of(frame.image) for frame in frames] == list(range(12))
    assert "12.5 frames per second" in source.health.notes[0]


def test_avi_with_pictures_out_of_order_is_counted_in_order(
    tmp_path: Path, backend: Backend
) -> None:
    video = record(tmp_path / "a.avi", range(12), clock_hz=25, codec="mpeg4", options={"bf": "2"})
    frames = frames_of(open_source(video, backend=backend))
    assert_allclose([frame.t for frame in frames], np.arange(len(frames)) / 25)
    assert [number_of(frame.image) for frame in frames] == list(range(12))


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt"),
    [("a.h264", "libx264", "yuv420p"), ("a.mjpeg", "mjpeg", "yuvj420p")],
)
def test_raw_video_without_times_is_counted(
    tmp_path: Path, backend: Backend, name: str, codec: str, pix_fmt: str
) -> None:
    video = record(tmp_path / name, range(12), clock_hz=25, codec=codec, pix_fmt=pix_fmt)
    source = open_source(video, backend=backend)
    assert_allclose([frame.t for frame in frames_of(source)], np.arange(12) / 25)
    assert source.clock == "rate"
    assert source.health.notes
    assert source.frame_count is None or source.frame_count == 12


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_a_camera_held_upright_gives_upright_pictures(
    tmp_path: Path, backend: Backend, quarters: int
) -> None:
    image = np.zeros((48, 64, 3), np.uint8)
    image[:24, :32] = 255  # top left
    video = record(tmp_path / "a.mp4", STEADY, images=[image] * 12)
    turn(video, quarters)

    shown = frames_of(open_source(video, backend=backend))[0].image

    assert shown.shape == ((48, 64, 3) if quarters % 2 == 0 else (64, 48, 3))
    corners = [shown[8, 8], shown[8, -8], shown[-8, -8], shown[-8, 8]]  # clockwise from top left
    bright = [bool(corner.mean() > 128) for corner in corners]
    assert bright == [k == quarters for k in range(4)]


@pytest.mark.parametrize(
    ("pix_fmt", "black", "white"),
    [("yuv420p", 16, 235), ("yuvj420p", 0, 255), ("gray", 0, 255), ("yuv420p10le", 64, 940)],
)
def test_black_is_black_and_white_is_white(
    tmp_path: Path, backend: Backend, pix_fmt: str, black: int, white: int
) -> None:
    """Levels of luma are written as they stand in the standard, without a conversion of ours."""
    av: Any = pytest.importorskip("av", reason="PyAV is not installed")
    video = tmp_path / "a.mkv"
    with av.open(str(video), "w") as container:
        stream = container.add_stream("ffv1" if pix_fmt == "gray" else "libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, pix_fmt
        for level in (black, (black + white) // 2, white):
            frame = av.VideoFrame(64, 48, pix_fmt)
            ten = pix_fmt.endswith("10le")
            for k, plane in enumerate(frame.planes):
                value = level if k == 0 else 512 if ten else 128
                cells = plane.buffer_size // (2 if ten else 1)
                plane.update(np.full(cells, value, np.uint16 if ten else np.uint8).tobytes())
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    images = [frame.image for frame in frames_of(open_source(video, backend=backend))]
    assert [image.shape for image in images] == [(48, 64, 3)] * 3
    for image, grey in zip(images, (0, 127.5, 255), strict=True):
        assert_allclose(image, grey, atol=3)


@pytest.mark.parametrize("size", [(65, 49), (63, 48), (1, 1)])
def test_odd_sizes(tmp_path: Path, backend: Backend, size: tuple[int, int]) -> None:
    video = record(
        tmp_path / "a.mkv",
        range(0, 400, 100),
        codec="ffv1",
        pix_fmt="bgr0",
        clock_hz=1000,
        images=[numbered(k, size) for k in range(4)],
    )
    frames = frames_of(open_source(video, backend=backend))
    for k, frame in enumerate(frames):
        assert_array_equal(frame.image, numbered(k, size))


def test_one_frame_is_a_video(tmp_path: Path, backend: Backend) -> None:
    frames = frames_of(open_source(record(tmp_path / "a.mp4", [4500]), backend=backend))
    assert [frame.t for frame in frames] == [0.0]


def test_the_number_of_frames_is_known(tmp_path: Path, backend: Backend) -> None:
    with open_source(record(tmp_path / "a.mp4", STEADY), backend=backend) as source:
        assert source.frame_count == 12
        assert source.health.state == "opening"


def test_iterating_again_goes_on_and_closing_ends(tmp_path: Path, backend: Backend) -> None:
    source = open_source(record(tmp_path / "a.mp4", STEADY), backend=backend)
    assert next(iter(source)).index == 0
    assert next(iter(source)).index == 1
    source.close()
    source.close()
    assert list(source) == []
    assert source.health.state == "ended"


@pytest.mark.parametrize(
    ("content", "problem"),
    [(b"", "empty"), (b"t_s,target\n0,1\n" * 50, "not a video"), (bytes(3000), "not a video")],
)
def test_what_is_no_video_is_refused(
    tmp_path: Path,
    backend: Backend,
    content: bytes,
    problem: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "a.mp4"
    path.write_bytes(content)
    with pytest.raises(FileError, match=problem) as caught:
        open_source(path, backend=backend)
    assert caught.value.path == str(path)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_missing_file_is_named(tmp_path: Path, backend: Backend) -> None:
    with pytest.raises(FileError, match="there is no such file"):
        open_source(str(tmp_path / "a.mp4"), backend=backend)
    with pytest.raises(FileError, match="there is no such file"):
        open_source("./a:b.mp4", backend=backend)


def test_sound_alone_is_no_video(tmp_path: Path) -> None:
    av: Any = pytest.importorskip("av", reason="PyAV is not installed")
    path = tmp_path / "a.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), layout="mono")
        frame.rate = 8000
        container.mux(stream.encode(frame))
    with pytest.raises(FileError, match="holds no video"):
        open_source(path, backend="pyav")


def test_a_name_with_a_colon_is_a_file(tmp_path: Path, backend: Backend) -> None:
    video = record(tmp_path / "a.mp4", STEADY).rename(tmp_path / "rtp:7.mp4")
    assert len(frames_of(open_source(video, backend=backend))) == 12


def test_a_damaged_picture_is_left_out_and_counted(
    tmp_path: Path, backend: Backend, capfd: pytest.CaptureFixture[str]
) -> None:
    video = write_avi(tmp_path / "a.avi", [numbered(k) for k in range(12)])
    data = bytearray(video.read_bytes())
    start = -1
    for _ in range(6):  # the sixth picture
        start = data.index(b"\xff\xd8\xff", start + 1)
    data[start : start + 200] = bytes(200)
    video.write_bytes(bytes(data))

    source = open_source(video, backend=backend)
    frames = frames_of(source)

    assert [frame.index for frame in frames] == [0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11]
    assert_allclose([frame.t for frame in frames], np.delete(np.arange(12), 5) / 25)
    assert [number_of(frame.image) for frame in frames] == [0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11]
    assert source.health.corrupt == 1
    assert any("1 damaged" in note for note in source.health.notes)
    assert capfd.readouterr() == ("", "")


def test_garbage_in_the_middle_leaves_what_is_before_and_after(
    tmp_path: Path, backend: Backend, rng: np.random.Generator, capfd: pytest.CaptureFixture[str]
) -> None:
    pts = [3600 * k for k in range(40)]
    images = [soft_noise(rng) for _ in pts]
    video = record(tmp_path / "a.mp4", pts, images=images, options={"g": "5", "bf": "0"})
    data = bytearray(video.read_bytes())
    size = len(data) - data.index(b"mdat")
    data[-size // 2 : -size // 2 + size // 8] = b"\xff" * (size // 8)
    video.write_bytes(bytes(data))

    source = open_source(video, backend=backend)
    frames = frames_of(source)

    assert source.health.corrupt >= (backend == "pyav")  # OpenCV may show what it has patched up
    assert [frame.index for frame in frames][:10] == list(range(10))
    assert frames[-1].index == 39
    assert frames[-1].t == 39 / 25
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("name", "codec"), [("a.mkv", "ffv1"), ("a.mp4", "mpeg4")])
def test_a_file_that_is_cut_short_gives_what_it_has_and_says_so(
    tmp_path: Path, backend: Backend, name: str, codec: str, capfd: pytest.CaptureFixture[str]
) -> None:
    pix_fmt = "bgr0" if codec == "ffv1" else "yuv420p"
    video = record(
        tmp_path / name,
        range(0, 1200, 40),
        codec=codec,
        pix_fmt=pix_fmt,
        clock_hz=1000,
        images=[numbered(k % 12) for k in range(30)],
    )
    data = video.read_bytes()
    video.write_bytes(data[: len(data) * 3 // 4])

    source = open_source(video, backend=backend)
    count = len(frames_of(source))

    assert 10 < count < 30
    # Whether Matroska counts its length from the first picture OpenCV does not tell, and so we do not.
    known = backend == "pyav" or name == "a.mp4"
    assert any("cut short" in note for note in source.health.notes) == known
    assert capfd.readouterr() == ("", "")


def test_a_recording_that_was_never_stopped_is_explained(tmp_path: Path, backend: Backend) -> None:
    video = record(tmp_path / "a.mp4", STEADY)
    data = bytearray(video.read_bytes())
    data[data.index(b"moov") :][:4] = b"free"
    start = data.index(b"moov")
    data[start : start + 4] = b"free"
    video.write_bytes(bytes(data))
    with pytest.raises(FileError, match="index .moov. is missing"):
        open_source(video, backend=backend)


def test_pictures_that_change_size_are_an_error(tmp_path: Path) -> None:
    """Two transport streams one after the other are a transport stream."""
    parts = [
        record(
            tmp_path / f"{k}.ts",
            [90000 * k + 3600 * n for n in range(4)],
            images=[numbered(n, size) for n in range(4)],
        )
        for k, size in enumerate([(64, 48), (96, 64)])
    ]
    video = tmp_path / "both.ts"
    video.write_bytes(b"".join(part.read_bytes() for part in parts))
    with (
        open_source(video, backend="pyav") as source,
        pytest.raises(FileError, match="96x64 pixels"),
    ):
        list(source)

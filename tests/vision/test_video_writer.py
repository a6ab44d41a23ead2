from __future__ import annotations

import shutil
import subprocess
from itertools import pairwise
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.errors import FileError, InputError
from airground.vision.sources import open_source
from airground.vision.video_writer import VideoWriter

if TYPE_CHECKING:
    from pathlib import Path

    from airground.vision.frame import ImageArray


@pytest.fixture(params=[False, True], ids=["opencv", "pyav"])
def pyav(request: pytest.FixtureRequest) -> bool:
    if request.param:
        pytest.importorskip("av", reason="PyAV is not installed")
    return bool(request.param)


def pictures(
    rng: np.random.Generator, size_px: tuple[int, int], count: int = 6
) -> list[ImageArray]:
    noise = rng.integers(0, 255, (count, size_px[1], size_px[0], 3), dtype=np.uint8)
    soft = [cv2.GaussianBlur(one, (0, 0), 4).astype(float) for one in noise]
    return [np.clip(128 + 4 * (one - 128), 0, 255).astype(np.uint8) for one in soft]


def write(path: Path, images: list[ImageArray], *, pyav: bool, rate_hz: float = 25.0) -> Path:
    height, width = images[0].shape[:2]
    with VideoWriter(path, size_px=(width, height), rate_hz=rate_hz, pyav=pyav) as writer:
        for image in images:
            writer.write(image)
    return path


def read(path: Path) -> tuple[list[ImageArray], list[float]]:
    with open_source(path) as source:
        frames = list(source)
    return [frame.image for frame in frames], [frame.t for frame in frames]


@pytest.mark.parametrize("suffix", [".mkv", ".avi"])
def test_lossless_gives_back_every_pixel(
    tmp_path: Path, rng: np.random.Generator, pyav: bool, suffix: str
) -> None:
    images = pictures(rng, (64, 48))
    back, times = read(write(tmp_path / f"a{suffix}", images, pyav=pyav))
    assert len(back) == len(images)
    for image, image_back in zip(images, back, strict=True):
        assert_array_equal(image_back, image)
    assert_allclose(times, np.arange(6) / 25, atol=1e-9)


@pytest.mark.parametrize("suffix", [".mp4", ".mov", ".m4v"])
@pytest.mark.parametrize("size", [(64, 48), (65, 49), (64, 49)])
def test_what_people_watch_looks_like_what_was_written(
    tmp_path: Path, rng: np.random.Generator, pyav: bool, suffix: str, size: tuple[int, int]
) -> None:
    images = pictures(rng, size)
    back, times = read(write(tmp_path / f"a{suffix}", images, pyav=pyav, rate_hz=10.0))
    assert_allclose(times, np.arange(6) / 10, atol=1e-9)
    width, height = size
    assert back[0].shape == (height + height % 2, width + width % 2, 3)
    for image, image_back in zip(images, back, strict=True):
        error = image_back[:height, :width].astype(float) - image
        assert (
            np.sqrt(np.mean(error**2)) < 8
        )  # of 255; a neighbouring picture is off by more than 20
    for image, after in pairwise(images):
        assert np.sqrt(np.mean((image.astype(float) - after) ** 2)) > 16


def test_the_picture_is_not_shifted_by_the_odd_column(tmp_path: Path, pyav: bool) -> None:
    image = np.zeros((49, 65, 3), np.uint8)
    image[20:30, 30:40] = 255
    back, _ = read(write(tmp_path / "a.mp4", [image] * 3, pyav=pyav))
    v, u = np.nonzero(back[0][..., 1] > 128)
    assert_allclose([u.mean(), v.mean()], [34.5, 24.5], atol=0.1)


@pytest.mark.parametrize("suffix", [".mp4", ".avi", ".mkv"])
def test_same_images_same_bytes(
    tmp_path: Path, rng: np.random.Generator, pyav: bool, suffix: str
) -> None:
    if not pyav:
        suffix = suffix.replace("mkv", "mov")  # OpenCV writes a random number into Matroska files
    images = pictures(rng, (64, 48))
    one = write(tmp_path / f"a{suffix}", images, pyav=pyav).read_bytes()
    other = write(tmp_path / f"b{suffix}", images, pyav=pyav).read_bytes()
    assert one == other


def test_ntsc_rates_are_fractions(tmp_path: Path, rng: np.random.Generator) -> None:
    pytest.importorskip("av", reason="PyAV is not installed")
    _, times = read(write(tmp_path / "a.mp4", pictures(rng, (64, 48)), pyav=True, rate_hz=29.97))
    assert_allclose(times, np.arange(6) * 1001 / 30000, atol=1e-9)


def test_grey_images_are_taken(tmp_path: Path, rng: np.random.Generator, pyav: bool) -> None:
    images = [np.ascontiguousarray(image[..., 0]) for image in pictures(rng, (64, 48))]
    back, _ = read(write(tmp_path / "a.avi", images, pyav=pyav))
    assert_array_equal(back[0], np.dstack([images[0]] * 3))


def test_browsers_can_play_it(tmp_path: Path, rng: np.random.Generator) -> None:
    """H.264, 4:2:0, colours stated, the index before the pictures."""
    pytest.importorskip("av", reason="PyAV is not installed")
    path = write(tmp_path / "a.mp4", pictures(rng, (65, 49)), pyav=True)
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")
    probe = shutil.which("ffprobe")
    if probe is None:
        pytest.skip("ffprobe is not installed; on Debian: apt install ffmpeg")
    fields = "codec_name,pix_fmt,color_range,color_space"
    command = [
        probe,
        "-v",
        "error",
        "-show_entries",
        f"stream={fields}",
        "-of",
        "csv=p=0",
        str(path),
    ]
    found = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    assert found == "h264,yuv420p,tv,smpte170m"


@pytest.mark.parametrize("name", ["a.gif", "a", "a.MP5"])
def test_unknown_suffixes_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"\.mp4.*lossless"):
        VideoWriter(tmp_path / name, size_px=(4, 4), rate_hz=25)
    assert not (tmp_path / name).exists()


@pytest.mark.parametrize("rate", [0.0, -25.0, float("nan"), float("inf")])
def test_rates_that_are_none_are_refused(tmp_path: Path, rate: float) -> None:
    with pytest.raises(InputError, match="rate"):
        VideoWriter(tmp_path / "a.mp4", size_px=(4, 4), rate_hz=rate)


def test_sizes_that_are_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="size"):
        VideoWriter(tmp_path / "a.mp4", size_px=(0, 4), rate_hz=25)


def test_opencv_would_cut_odd_sizes_and_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="even width and height"):
        VideoWriter(tmp_path / "a.avi", size_px=(65, 48), rate_hz=25, pyav=False)


@pytest.mark.parametrize(
    "image",
    [np.zeros((48, 65, 3), np.uint8), np.zeros((48, 64, 4), np.uint8), np.zeros((48, 64, 3))],
)
def test_other_images_are_refused(tmp_path: Path, pyav: bool, image: ImageArray) -> None:
    writer = VideoWriter(tmp_path / "a.mp4", size_px=(64, 48), rate_hz=25, pyav=pyav)
    with writer, pytest.raises(InputError, match=r"must have shape \(48, 64, 3\)"):
        writer.write(image)


def test_a_missing_folder_is_named(tmp_path: Path, pyav: bool) -> None:
    with pytest.raises(FileError, match="folder .*nowhere does not exist"):
        VideoWriter(tmp_path / "nowhere" / "a.mp4", size_px=(64, 48), rate_hz=25, pyav=pyav)


def test_a_folder_is_no_file(tmp_path: Path, pyav: bool) -> None:
    (tmp_path / "a.mp4").mkdir()
    with pytest.raises(FileError, match="is a folder"):
        VideoWriter(tmp_path / "a.mp4", size_px=(64, 48), rate_hz=25, pyav=pyav)


def test_closing_twice_does_nothing(tmp_path: Path, rng: np.random.Generator, pyav: bool) -> None:
    images = pictures(rng, (64, 48))
    writer = VideoWriter(tmp_path / "a.mp4", size_px=(64, 48), rate_hz=25, pyav=pyav)
    for image in images:
        writer.write(image)
    writer.close()
    data = writer.path.read_bytes()
    writer.close()
    assert writer.path.read_bytes() == data

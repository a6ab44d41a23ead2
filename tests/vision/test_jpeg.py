"""Images come back as they went, but for a little noise."""

from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError
from airground.vision.frame import ImageArray
from airground.vision.jpeg import decode_jpeg, encode_jpeg


def slope(width: int = 320, height: int = 180) -> ImageArray:
    v, u = np.mgrid[0:height, 0:width]
    channels = [u * 255 / width, v * 255 / height, 255 - u * 255 / width]
    return np.stack(channels, axis=-1).astype(np.uint8)


def test_the_image_comes_back() -> None:
    jpeg = encode_jpeg(slope(), quality=90)
    assert jpeg.size_px == (320, 180)
    back = decode_jpeg(jpeg.data)
    assert np.abs(back.astype(int) - slope()).max() < 12  # blue stays blue, too


def test_it_shrinks_and_keeps_its_proportions() -> None:
    jpeg = encode_jpeg(slope(), width_px=160)
    assert jpeg.size_px == (160, 90)
    back = decode_jpeg(jpeg.data)
    assert back.shape == (90, 160, 3)
    assert np.abs(back.astype(int) - slope(160, 90)).mean() < 3


def test_it_never_grows() -> None:
    assert encode_jpeg(slope(), width_px=1000).size_px == (320, 180)


def test_a_flat_strip_keeps_one_row() -> None:
    assert encode_jpeg(slope(1000, 2), width_px=10).size_px == (10, 1)


def test_quality_costs_bytes(rng: np.random.Generator) -> None:
    noise = rng.integers(0, 256, (90, 160, 3), dtype=np.uint8)
    assert len(encode_jpeg(noise, quality=30).data) < len(encode_jpeg(noise, quality=90).data)


def test_grey_comes_back_as_three_channels() -> None:
    back = decode_jpeg(encode_jpeg(np.full((8, 8), 77, dtype=np.uint8)).data)
    assert back.shape == (8, 8, 3)
    assert np.abs(back.astype(int) - 77).max() < 3


@pytest.mark.parametrize("data", [b"", b"no image", encode_jpeg(slope()).data[:20]])
def test_what_is_no_image_is_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="no JPEG"):
        decode_jpeg(data)


@pytest.mark.parametrize("shape", [(0, 4, 3), (4,), (2, 2, 2, 2)])
def test_arrays_that_are_no_image_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="must be"):
        encode_jpeg(np.zeros(shape, dtype=np.uint8))


def test_an_image_too_wide_for_the_format_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be coded"):
        encode_jpeg(np.zeros((1, 70_000, 3), dtype=np.uint8))


@pytest.mark.parametrize("wrong", [{"quality": 0}, {"quality": 101}, {"width_px": 0}])
def test_options_out_of_range_are_refused(wrong: dict[str, int]) -> None:
    with pytest.raises(InputError, match="must be"):
        encode_jpeg(slope(), **wrong)

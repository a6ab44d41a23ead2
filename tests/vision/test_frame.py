from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from airground.errors import InputError
from airground.vision.frame import Frame, ImageArray


def test_the_image_is_shared_and_cannot_be_written_through_the_frame() -> None:
    image = np.zeros((4, 6, 3), np.uint8)
    frame = Frame(image, 0.0)
    with pytest.raises(ValueError, match="read-only"):
        frame.image[0, 0] = 1
    image[0, 0] = 7  # the owner still may
    assert frame.image[0, 0, 0] == 7


def test_size_is_width_and_height() -> None:
    assert Frame(np.zeros((4, 6, 3), np.uint8), 0.0).size_px == (6, 4)
    assert Frame(np.zeros((4, 6), np.uint8), 0.0).size_px == (6, 4)


def test_one_channel_is_grey() -> None:
    image = np.arange(24, dtype=np.uint8).reshape(4, 6, 1)
    frame = Frame(image, 0.0)
    assert_array_equal(frame.image, image[..., 0])


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((4, 6, 3)),
        np.zeros((4, 6, 4), np.uint8),
        np.zeros((4, 6, 3, 1), np.uint8),
        np.zeros(6, np.uint8),
        np.zeros((0, 6, 3), np.uint8),
        np.zeros((4, 0), np.uint8),
    ],
)
def test_what_is_no_image_is_refused(image: ImageArray) -> None:
    with pytest.raises(InputError, match="8 bits"):
        Frame(image, 0.0)


@pytest.mark.parametrize("t", [float("nan"), float("inf"), -float("inf"), 1e16])
def test_what_is_no_time_is_refused(t: float) -> None:
    with pytest.raises(InputError, match="time"):
        Frame(np.zeros((4, 6), np.uint8), t)


def test_an_unknown_clock_is_refused_and_the_known_are_named() -> None:
    with pytest.raises(InputError, match="media, device, arrival"):
        Frame(np.zeros((4, 6), np.uint8), 0.0, "sundial")  # type: ignore[arg-type]

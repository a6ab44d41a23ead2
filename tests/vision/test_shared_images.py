"""Images in memory that two processes share."""

from __future__ import annotations

from collections.abc import Iterator
from multiprocessing.shared_memory import SharedMemory

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from airground.vision.shared_images import SharedImages

COLOUR, GREY = (6, 8, 3), (5, 7)


@pytest.fixture(params=[COLOUR, GREY])
def both(request: pytest.FixtureRequest) -> Iterator[tuple[SharedImages, SharedImages]]:
    """Who writes, and who reads."""
    writer = SharedImages(request.param, 2)
    reader = SharedImages(request.param, 2, writer.name)
    yield writer, reader
    reader.close()
    writer.close()


def picture(images: SharedImages, rng: np.random.Generator) -> np.ndarray:
    return rng.integers(0, 256, images.shape, dtype=np.uint8)


def test_what_one_writes_the_other_reads(
    both: tuple[SharedImages, SharedImages], rng: np.random.Generator
) -> None:
    writer, reader = both
    pictures = [picture(writer, rng) for _ in range(5)]
    for mark, image in enumerate(pictures):
        writer.write(mark, image)
        assert_array_equal(reader.read(mark), image)
        if mark:
            assert_array_equal(reader.read(mark - 1), pictures[mark - 1])


def test_what_was_overwritten_or_never_written_is_nothing(
    both: tuple[SharedImages, SharedImages], rng: np.random.Generator
) -> None:
    writer, reader = both
    assert reader.read(0) is None
    assert reader.read(1) is None
    for mark in range(3):
        writer.write(mark, picture(writer, rng))
    assert reader.read(0) is None
    assert reader.read(3) is None
    assert reader.read(1) is not None
    assert reader.read(2) is not None


def test_what_was_read_stays_as_it_was(
    both: tuple[SharedImages, SharedImages], rng: np.random.Generator
) -> None:
    writer, reader = both
    first = picture(writer, rng)
    writer.write(0, first)
    read = reader.read(0)
    writer.write(2, 255 - first)  # at the same place
    assert read is not None
    assert_array_equal(read, first)
    read[:] = 0  # it is the reader's own
    assert_array_equal(reader.read(2), 255 - first)


def test_an_image_of_another_size_is_refused(both: tuple[SharedImages, SharedImages]) -> None:
    with pytest.raises(ValueError, match="broadcast"):
        both[0].write(0, np.zeros((9, 9, 9), np.uint8))


def test_memory_is_let_go_of_by_who_made_it() -> None:
    writer = SharedImages(GREY)
    reader = SharedImages(GREY, name=writer.name)
    reader.close()
    reader.close()
    writer.write(0, np.full(GREY, 9, np.uint8))  # the other one did not take it away
    assert_array_equal(writer.read(0), np.full(GREY, 9))
    name = writer.name
    writer.close()
    writer.close()
    with pytest.raises(FileNotFoundError):
        SharedMemory(name)

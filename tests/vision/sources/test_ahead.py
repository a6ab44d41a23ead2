"""Frames made ahead by a thread: the same ones, in order, and the thread ends."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.errors import InputError
from airground.vision.frame import Frame
from airground.vision.sources.ahead import ahead

if TYPE_CHECKING:
    from collections.abc import Iterator

IMAGE = np.zeros((2, 3), dtype=np.uint8)


def frames(count: int, made: list[int] | None = None) -> Iterator[Frame]:
    for k in range(count):
        if made is not None:
            made.append(k)
        yield Frame(IMAGE, float(k), index=k)


def threads() -> int:
    return sum(thread.name == "frames ahead" for thread in threading.enumerate())


@pytest.mark.parametrize("most", [1, 4, 100])
def test_all_frames_come_in_order(most: int) -> None:
    with ahead(frames(30), most) as taken:
        assert [frame.index for frame in taken] == list(range(30))
    assert threads() == 0


def test_no_more_than_a_few_are_made_before_they_are_wanted() -> None:
    made: list[int] = []
    with ahead(frames(1000, made), 4) as taken:
        for _ in range(3):
            next(taken)
    # Three were taken, four lie ready, one is in the thread's hand.
    assert len(made) <= 8
    assert threads() == 0  # and the thread has ended, though the source has not


def test_an_error_of_the_source_comes_out_in_its_place() -> None:
    def broken() -> Iterator[Frame]:
        yield from frames(2)
        raise InputError("the third frame is bad")

    with ahead(broken()) as taken:
        assert next(taken).index == 0
        assert next(taken).index == 1
        with pytest.raises(InputError, match="third"):
            next(taken)
    assert threads() == 0


def test_an_error_of_the_user_ends_the_thread() -> None:
    def use() -> None:
        with ahead(frames(1000)) as taken:
            next(taken)
            raise KeyError

    with pytest.raises(KeyError):
        use()
    assert threads() == 0


def test_none_ahead_is_refused() -> None:
    with pytest.raises(InputError, match="1 or more"), ahead(frames(1), 0):
        pass

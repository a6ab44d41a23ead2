from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.errors import InputError
from airground.vision.sources import FrameSource, GeneratedSource, SourceHealth

if TYPE_CHECKING:
    from collections.abc import Iterator

    from airground.vision.frame import ImageArray

GREY = np.zeros((4, 6), np.uint8)


def test_frames_are_made_when_they_are_asked_for() -> None:
    made = []

    def frames() -> Iterator[tuple[float, ImageArray]]:
        for k in range(3):
            made.append(k)
            yield 0.1 * k, GREY

    with GeneratedSource(frames(), "world", frame_count=3) as source:
        assert isinstance(source, FrameSource)
        assert source.frame_count == 3
        assert source.health == SourceHealth("opening")
        assert made == []
        first = next(iter(source))
        assert made == [0]
        assert (first.t, first.index, first.clock, first.segment) == (0.0, 0, "world", 0)
        assert [frame.index for frame in source] == [1, 2]
        assert source.health == SourceHealth("ended", frames=3)


@pytest.mark.parametrize("times", [[0.0, 0.0], [1.0, 0.5]])
def test_times_must_ascend(times: list[float]) -> None:
    source = GeneratedSource([(t, GREY) for t in times], "made up")
    with pytest.raises(InputError, match="made up: times must ascend"):
        list(source)


def test_none_is_fine() -> None:
    source = GeneratedSource([])
    assert list(source) == []
    assert source.health.state == "ended"


def test_a_clock_may_be_named() -> None:
    source = GeneratedSource([(1e9, GREY)], clock="wall")
    assert [frame.clock for frame in source] == ["wall"]

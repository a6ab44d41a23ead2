"""Every global unknown has one place in the vector of all of them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.calibration.trajectory.state import Free, Layout


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    robots = draw(st.integers(1, 5))
    some = st.sets(st.integers(0, robots - 1)).map(lambda s: tuple(sorted(s)))
    free = Free(
        offset=draw(st.booleans()),
        lens=draw(st.booleans()),
        turn=draw(some),
        lever=draw(some),
        slip=draw(st.booleans()),
        drift=draw(st.booleans()),
    )
    return Layout(free, robots)


@given(layouts())
def test_places_partition_the_vector(layout: Layout) -> None:
    free = layout.free
    places = list(range(6))
    for place, wanted in ((layout.offset, free.offset), (layout.bend, free.lens)):
        assert (place is not None) == wanted
        places += [] if place is None else [place]
    assert sorted(places) == list(range(layout.shared))
    for k in range(layout.robots):
        mine = [layout.own(k)]
        turn, lever = layout.turn(k), layout.lever(k)
        assert (turn is not None) == (k in free.turn)
        assert (lever is not None) == (k in free.lever)
        mine += [] if turn is None else [turn]
        mine += [] if lever is None else [lever, lever + 1]
        assert len(mine) == layout.own_size(k)
        assert list(layout.columns(k)) == [*range(layout.shared), *mine]
        places += mine
    assert sorted(places) == list(range(layout.size))


@pytest.mark.parametrize(
    ("drift", "slip", "width"),
    [(False, False, 2), (True, False, 3), (False, True, 3), (True, True, 4)],
)
def test_unknowns_of_a_sighting(drift: bool, slip: bool, width: int) -> None:
    assert Free(drift=drift, slip=slip).width == width

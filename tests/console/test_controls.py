"""One holder at most, and whoever loses the controls is told of once."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from airground.console.controls import Controls


def test_take_and_give_back() -> None:
    controls = Controls()
    assert controls.holder is None
    taken = controls.take("a")
    assert (taken.ok, taken.changed, taken.gone) == (True, True, None)
    given_back = controls.give_back("a")
    assert (given_back.ok, given_back.gone, controls.holder) == (True, "a", None)


def test_taking_what_one_has_changes_nothing() -> None:
    controls = Controls()
    controls.take("a")
    again = controls.take("a", force=True)
    assert (again.ok, again.changed, again.gone) == (True, False, None)


def test_they_are_not_taken_from_another_but_by_force() -> None:
    controls = Controls()
    controls.take("a")
    asked = controls.take("b")
    assert not asked.ok
    assert "holds" in asked.line
    assert controls.holder == "a"
    forced = controls.take("b", force=True)
    assert (forced.ok, forced.gone, controls.holder) == (True, "a", "b")


def test_only_the_holder_gives_back() -> None:
    controls = Controls()
    controls.take("a")
    assert not controls.give_back("b").ok
    assert controls.holder == "a"


CLIENTS = st.sampled_from("abc")
STEPS = st.lists(st.tuples(st.sampled_from(["take", "force", "give"]), CLIENTS), max_size=30)


@given(STEPS)
def test_who_held_them_and_does_not_any_more_is_always_named(steps: list[tuple[str, str]]) -> None:
    controls = Controls()
    for what, client in steps:
        before = controls.holder
        force = what == "force"
        came = controls.give_back(client) if what == "give" else controls.take(client, force=force)
        lost = before is not None and controls.holder != before
        assert came.gone == (before if lost else None)
        assert came.changed == (controls.holder != before)
        assert came.ok or controls.holder == before

"""Who is at the controls, and STOP."""

from __future__ import annotations

from airground.session.operator_watch import OperatorWatch


def test_silence_counts_only_for_somebody_who_was_there() -> None:
    one = OperatorWatch(1.0)
    assert not one.silent(100.0)
    one.hear(100.0, "me")
    assert not one.silent(101.0)
    assert one.silent(101.01)
    one.hear(101.5, "you")
    assert (one.client, one.silent(102.0)) == ("you", False)
    one.leave()
    assert (one.client, one.silent(200.0)) == ("", False)


def test_stop_holds_until_it_is_released_and_keeps_its_first_reason() -> None:
    one = OperatorWatch(1.0)
    one.press("because")
    one.press("something else")
    assert (one.stopped, one.why) == (True, "because")
    one.release()
    assert (one.stopped, one.why) == (False, "")

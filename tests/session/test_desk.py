"""Work that leaves the loop: numbered, cancelled by kind, and its results used once."""

from __future__ import annotations

from typing import Any

from airground.session.desk import Desk
from airground.session.inputs import Finished


def desk(*whats: str) -> tuple[Desk, list[Any]]:
    one, results = Desk(), list[Any]()
    for what in whats:
        one.give(what, lambda: None, results.append)
    return one, results


def test_jobs_are_handed_out_once_and_results_used_once() -> None:
    one, results = desk("way of red", "fences")
    jobs = one.collect()
    assert [(job.number, job.what, job.heavy) for job in jobs] == [
        (1, "way of red", False),
        (2, "fences", False),
    ]
    assert one.collect() == ()
    one.take(Finished(2, "second"))
    one.take(Finished(1, "first"))
    one.take(Finished(1, "again"))
    one.take(Finished(77, "nobody's"))
    assert results == ["second", "first"]


def test_what_is_cancelled_is_not_waited_for_and_its_result_dropped() -> None:
    one, results = desk("way of red", "way of blue", "sketch of red", "waypoints")
    one.cancel("way of red")
    assert not one.waits_for("way of red")
    assert one.waits_for("way of blue")
    one.cancel("way")  # of whomever
    assert not one.waits_for("way of blue")
    assert one.waits_for("waypoints")
    for number in range(1, 5):
        one.take(Finished(number, number))
    assert results == [3, 4]


def test_what_follows_may_give_new_work() -> None:
    one = Desk()

    def more(_: Any) -> None:
        one.give("b", lambda: None, more)

    one.give("a", lambda: None, more)
    one.collect()
    one.take(Finished(1, None))
    assert [job.what for job in one.collect()] == ["b"]

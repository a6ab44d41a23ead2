"""Hostile messages change nothing and are counted; STOP always comes through."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.console.member import FLOOD, TOO_LARGE, UNREAD
from airground.session.orders import KINDS
from console.harness import Bench

ALIVE = {"kind": "alive"}
STOP = {"kind": "order", "seq": 1, "order": {"kind": "stop"}}


def order(seq: object, **fields: object) -> dict[str, Any]:
    return {"kind": "order", "seq": seq, "order": fields}


def test_the_holder_gives_orders_and_each_is_answered() -> None:
    bench = Bench()
    ann = bench.join("Ann")
    assert bench.take(ann)[0] == {"reply": 1, "ok": True, "line": ""}
    goal = order(2, kind="drive_to", robot="one", goals_px=[[1, 2]])
    said = bench.say(ann, goal, order(5, kind="hand", robot="one", forward=0.5, turn=-1))
    assert said == [{"reply": 2, "ok": True, "line": ""}, {"reply": 5, "ok": True, "line": ""}]
    assert bench.kinds() == [("c1", "drive_to"), ("c1", "hand")]
    assert bench.hostile() == {}


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"stop"}))
def test_a_watcher_gives_no_orders(kind: str) -> None:
    bench = Bench()
    ann, bob = bench.join(), bench.join()
    bench.take(ann)
    said = bench.say(bob, order(1, kind=kind))
    assert said[0]["reply"] == 1
    assert not said[0]["ok"]
    assert "take the controls" in said[0]["line"]
    assert bench.kinds() == []
    assert bench.hostile() == {"watcher": 1}


def test_nobody_gives_orders_where_nobody_holds_the_controls() -> None:
    bench = Bench()
    bench.say(bench.join(), order(1, **ALIVE))
    assert bench.kinds() == []


def test_gone_is_not_the_pages_to_say() -> None:
    bench = Bench()
    ann = bench.join()
    bench.take(ann)
    assert not bench.say(ann, order(2, kind="gone"))[0]["ok"]
    assert bench.kinds() == []


def test_an_order_that_is_wrong_says_where() -> None:
    bench = Bench()
    ann = bench.join()
    bench.take(ann)
    (said,) = bench.say(ann, order(2, kind="drive_to", robot="one", goals_px=[["x", 2]]))
    assert (said["reply"], said["ok"]) == (2, False)
    assert "goals_px" in said["line"]
    assert bench.hostile() == {"order": 1}
    assert bench.kinds() == []


@pytest.mark.parametrize("seq", [0, 1, 7])
def test_numbers_that_do_not_ascend_are_refused(seq: int) -> None:
    bench = Bench()
    ann = bench.join()
    bench.take(ann, 7)
    (said,) = bench.say(ann, order(seq, **ALIVE))
    assert (said["reply"], said["ok"]) == (seq, False)
    assert bench.hostile() == {"bad_seq": 1}
    assert bench.kinds() == []


@pytest.mark.parametrize(
    "message",
    [
        STOP,
        order(0, kind="stop"),
        order(-5, kind="stop"),
        order("x", kind="stop"),
        order(None, kind="stop"),
        order(1e300, kind="stop"),
        order(3, kind="stop", junk=[1]),
        {"kind": "order", "order": {"kind": "stop"}},
        {"kind": "order", "order": {"kind": "stop"}, "more": True},
    ],
)
def test_everybody_may_stop_whatever_else_is_wrong(message: dict[str, Any]) -> None:
    bench = Bench()
    ann, bob = bench.join(), bench.join()
    bench.take(ann)
    bench.say(bob, order(3, **ALIVE))  # so that numbers up to 3 are used up
    bench.session.orders.clear()
    assert bench.say(bob, message)[0]["ok"]
    assert bench.kinds() == [("c2", "stop")]


def test_stop_comes_through_a_flood() -> None:
    bench = Bench()
    bob = bench.join()
    for number in range(300):  # more than may come at once, less than is tolerated
        bench.say(bob, {"kind": "ping", "id": number})
    assert bench.hostile()["flood"] == 60
    assert bob.ending is None
    assert bench.say(bob, STOP) == [{"reply": 1, "ok": True, "line": ""}]
    assert bench.kinds() == [("c1", "stop")]


def test_a_flood_ends_the_conversation_and_is_answered_once_a_second() -> None:
    bench = Bench()
    bob = bench.join()
    said = bench.say(bob, *[{"kind": "shown", "index": 1}] * 400)
    assert bob.ending == FLOOD
    assert len(said) == 1
    assert "too many" in said[0]["line"]


def test_so_does_a_flood_of_stops_but_all_of_them_are_heard() -> None:
    bench = Bench()
    bob = bench.join()
    stops = 0
    while bob.ending is None:
        bench.say(bob, STOP)
        stops += 1
    assert bob.ending == FLOOD
    assert stops < 400
    assert bench.kinds() == [("c1", "stop")] * stops


def test_and_so_does_long_nonsense() -> None:
    bench = Bench()
    bob = bench.join()
    for _ in range(101):
        bench.say(bob, "nonsense")
    assert bob.ending == FLOOD
    assert bench.hostile() == {"malformed": 101}


def test_what_a_page_sends_at_its_busiest_is_no_flood() -> None:
    bench = Bench()
    ann = bench.join()
    bench.take(ann)
    seq = 1
    sketch = [[k, k / 2] for k in range(100)]
    for step in range(200):  # ten seconds of twenty steps
        bench.t += 0.05
        said = [
            order(seq + 1, kind="hand", robot="one", forward=1, turn=0),
            order(seq + 2, kind="sketch", robot="one", sketch=step, points_px=sketch),
            {"kind": "shown", "index": step},
        ]
        if step % 4 == 0:
            said += [order(seq + 3, **ALIVE), {"kind": "ping", "id": step}]
        seq += 3
        bench.say(ann, *said)
    assert bench.hostile() == {}
    assert len(bench.session.orders) == 200 + 200 + 50


def test_a_message_that_is_too_long_ends_the_conversation() -> None:
    bench = Bench()
    bob = bench.join()
    bench.say(bob, " " * 256_001)
    assert bob.ending == TOO_LARGE
    assert bench.hostile() == {"too_large": 1}


def test_who_asks_and_does_not_read_is_sent_away() -> None:
    bench = Bench()
    bob = bench.join()
    for number in range(300):
        bench.t += 0.1
        bench.desk.receive(bob, json.dumps({"kind": "ping", "id": number}))
    assert bob.ending == UNREAD
    assert len(bob.outbox) <= 256


@pytest.mark.parametrize(
    ("message", "kind"),
    [
        (b"\x00\xff", "binary"),
        ("{", "too_deep"),
        ("[1]", "malformed"),
        ('{"kind":"ping","id":NaN}', "malformed"),
        ('{"kind":"fly"}', "unknown_kind"),
        ('{"kind":"hello","version":1}', "malformed"),
        ("[" * 200_000, "too_deep"),
        ('{"kind":"view","image":"yes"}', "malformed"),
    ],
)
def test_each_sort_is_counted_under_its_name(message: str | bytes, kind: str) -> None:
    bench = Bench()
    ann = bench.join()
    bench.take(ann)
    said = bench.say(ann, message)
    assert bench.hostile() == {kind: 1}
    assert not said[0]["ok"]
    assert bench.kinds() == []


def test_hostile_messages_do_not_count_as_being_there() -> None:
    bench = Bench()
    ann = bench.join()
    heard = ann.heard_s
    bench.t += 0.5
    bench.say(ann, "nonsense", order(1, **ALIVE))
    assert ann.heard_s == heard
    bench.say(ann, {"kind": "ping", "id": 1})
    assert ann.heard_s == bench.t


JSON: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=3,
)
WORDS = ["hello", "order", "controls", "view", "shown", "ping", *KINDS]
OBJECTS = st.dictionaries(
    st.sampled_from(["seq", "order", "take", "image", "index", "id", "rate_hz", "robot", "force"]),
    JSON
    | st.integers(0, 50)
    | st.just(value=True)
    | st.fixed_dictionaries({"kind": st.sampled_from(WORDS)}),
    max_size=5,
)
NEARLY = st.builds(lambda kind, rest: rest | {"kind": kind}, st.sampled_from(WORDS), OBJECTS)
ANYTHING = st.lists(
    st.binary(max_size=60)
    | st.text(max_size=60)
    | JSON.map(json.dumps)
    | NEARLY.map(json.dumps)
    | NEARLY.map(lambda one: json.dumps(one)[:-1]),
    min_size=1,
    max_size=4,
)


def stops(messages: list[str | bytes]) -> int:
    count = 0
    for message in messages:
        try:
            said: Any = json.loads(message) if isinstance(message, str) else None
            count += said["kind"] == "order" and said["order"]["kind"] == "stop"
        except (ValueError, TypeError, KeyError):
            continue
    return count


@given(ANYTHING)
def test_whatever_a_watcher_sends_nothing_but_stop_is_handed_in(
    messages: list[str | bytes],
) -> None:
    async def scenario() -> None:
        bench = Bench()
        ann, bob = bench.join(), bench.join()
        bench.take(ann)
        bench.hub.start()
        try:
            for message in messages:
                bench.desk.receive(bob, message)
        finally:
            bench.hub.stop()
        kinds = [kind for client, kind in bench.kinds() if client == bob.client]
        if "gone" in kinds:  # it took the controls by force, as it may, and lost them by leaving
            kinds.remove("gone")
            assert any("force" in str(message) for message in messages)
        else:
            assert kinds == ["stop"] * stops(messages)

    asyncio.run(scenario())

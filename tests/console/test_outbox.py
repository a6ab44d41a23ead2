"""What a slow client is told: the newest of each state, all replies, and one image."""

from __future__ import annotations

import asyncio

from hypothesis import given
from hypothesis import strategies as st

from airground.console.outbox import Outbox


def drain(outbox: Outbox) -> list[str | bytes]:
    taken = []
    while (message := outbox.take()) is not None:
        taken.append(message)
    return taken


def test_the_newest_of_a_key_wins_and_keeps_its_turn() -> None:
    outbox = Outbox()
    outbox.put("state", "1")
    outbox.put("fences", "2")
    outbox.put("state", "3")
    assert drain(outbox) == ["3", "2"]


def test_replies_go_first_and_in_their_order() -> None:
    outbox = Outbox()
    outbox.put("state", "s")
    outbox.image(b"i")
    for number in "123":
        assert outbox.reply(number)
    assert drain(outbox)[:3] == ["1", "2", "3"]


def test_there_is_an_end_to_replies() -> None:
    outbox = Outbox(replies=2)
    assert outbox.reply("1")
    assert outbox.reply("2")
    assert not outbox.reply("3")
    assert drain(outbox) == ["1", "2"]
    assert outbox.reply("4")


def test_one_image_and_it_is_the_newest() -> None:
    outbox = Outbox()
    outbox.image(b"1")
    outbox.image(b"2")
    assert drain(outbox) == [b"2"]


def test_states_that_never_cease_do_not_keep_images_back() -> None:
    outbox = Outbox()
    outbox.put("state", "s")
    outbox.image(b"i")
    taken = []
    for _ in range(4):
        outbox.put("state", "s")
        taken.append(outbox.take())
    assert b"i" in taken


def test_events_are_bounded_and_the_oldest_give_way() -> None:
    outbox = Outbox(events=3)
    for number in range(10):
        outbox.put(f"event/{number}", str(number))
    outbox.put("state", "s")
    assert drain(outbox) == ["7", "8", "9", "s"]
    outbox.put("event/10", "10")
    assert drain(outbox) == ["10"]


MESSAGES = st.lists(
    st.tuples(st.sampled_from(["put", "event", "reply", "image", "take"]), st.integers(0, 5)),
    max_size=200,
)


@given(MESSAGES)
def test_never_more_than_its_bounds_whatever_is_put_in(messages: list[tuple[str, int]]) -> None:
    outbox = Outbox(replies=4, events=3)
    for count, (what, key) in enumerate(messages):
        if what == "put":
            outbox.put(f"key-{key}", "s")
        elif what == "event":
            outbox.put(f"event/{count}", "e")
        elif what == "reply":
            outbox.reply("r")
        elif what == "image":
            outbox.image(b"i")
        else:
            outbox.take()
        assert len(outbox) <= 4 + 6 + 3 + 1
    drain(outbox)
    assert len(outbox) == 0


def test_next_waits() -> None:
    async def scenario() -> str | bytes:
        outbox = Outbox()
        waiting = asyncio.ensure_future(outbox.next())
        await asyncio.sleep(0)
        assert not waiting.done()
        outbox.put("state", "s")
        return await waiting

    assert asyncio.run(scenario()) == "s"

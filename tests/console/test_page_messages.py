"""What a page sends is read without trust, and quickly, whatever it is."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.console.page_messages import (
    AskControls,
    GiveOrder,
    Hello,
    HostileError,
    Ping,
    Shown,
    View,
    is_stop,
    read_document,
    read_message,
    seq_of,
)

DEPTH = 8


def read(text: str) -> object:
    return read_message(read_document(text, DEPTH))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"kind":"hello","version":1}', Hello(1)),
        ('{"kind":"hello","version":1,"token":"t","name":"Ann"}', Hello(1, "t", "Ann")),
        ('{"kind":"order","seq":3,"order":{"kind":"stop"}}', GiveOrder(3, {"kind": "stop"})),
        ('{"kind":"controls","seq":4,"take":true}', AskControls(4, take=True)),
        (
            '{"kind":"controls","seq":4,"take":true,"force":true}',
            AskControls(4, take=True, force=True),
        ),
        ('{"kind":"view","image":false}', View(image=False)),
        ('{"kind":"view","image":true,"rate_hz":5,"width_px":640}', View(True, 5.0, 640)),
        ('{"kind":"shown","index":7}', Shown(7)),
        ('{"kind":"ping","id":9}', Ping(9)),
    ],
)
def test_messages_of_the_page(text: str, message: object) -> None:
    assert read(text) == message


def test_a_name_loses_what_cannot_be_shown() -> None:
    assert read('{"kind":"hello","version":1,"name":"A\\u0000\\u202e\\ud800b"}') == Hello(
        1, "", "Ab"
    )


HOSTILE = {
    "[]": "malformed",
    "1": "malformed",
    "null": "malformed",
    "": "malformed",
    "{": "too_deep",
    '{"kind":"order"': "too_deep",
    '{"kind":"nothing"}': "unknown_kind",
    '{"kind":["order"]}': "unknown_kind",
    "{}": "unknown_kind",
    '{"kind":"ping"}': "malformed",
    '{"kind":"ping","id":1.5}': "malformed",
    '{"kind":"ping","id":true}': "malformed",
    '{"kind":"ping","id":-1}': "malformed",
    '{"kind":"ping","id":9007199254740992}': "malformed",
    '{"kind":"ping","id":NaN}': "malformed",
    '{"kind":"ping","id":1,"more":2}': "malformed",
    '{"kind":"ping","id":' + "9" * 5000 + "}": "malformed",
    '{"kind":"view","image":1}': "malformed",
    '{"kind":"view","image":true,"rate_hz":1e999}': "malformed",
    '{"kind":"view","image":true,"rate_hz":0}': "malformed",
    '{"kind":"view","image":true,"rate_hz":"15"}': "malformed",
    '{"kind":"view","image":true,"rate_hz":' + "9" * 400 + "}": "malformed",
    '{"kind":"view","image":true,"width_px":1e6}': "malformed",
    '{"kind":"controls","seq":1,"take":"yes"}': "malformed",
    '{"kind":"hello","version":"1"}': "malformed",
    '{"kind":"hello","version":1,"name":5}': "malformed",
    '{"kind":"hello","version":1,"name":"' + "x" * 41 + '"}': "malformed",
    '{"kind":"hello","version":1,"token":"' + "x" * 300 + '"}': "malformed",
    '{"kind":"order","seq":1,"order":' + "[" * 9 + "]" * 9 + "}": "too_deep",
    "[" * 100_000: "too_deep",
    "[" * 100_000 + "]" * 100_000: "too_deep",
    '{"a":' * 50_000 + "1" + "}" * 50_000: "too_deep",
    '"' * 250_000: "malformed",
    '\\"' * 125_000: "malformed",
    '{"kind":"' + "\\" * 250_000: "too_deep",
}


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: text[:30])
def test_hostile_messages_have_their_name(text: str) -> None:
    with pytest.raises(HostileError) as caught:
        read(text)
    assert caught.value.kind == HOSTILE[text]
    assert len(caught.value.line) < 200


def test_brackets_in_texts_are_not_deep() -> None:
    assert read('{"kind":"hello","version":1,"name":"[[[[[[[[[\\"]]"}') == Hello(
        1, "", '[[[[[[[[["]]'
    )


@given(st.text(max_size=200))
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(HostileError):
        read(text)


JSON: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)
KEYS = ["version", "token", "name", "seq", "order", "take", "force", "image", "rate_hz", "index"]
NEARLY = st.builds(
    lambda kind, rest: rest | {"kind": kind},
    st.sampled_from(["hello", "order", "controls", "view", "shown", "ping"]),
    st.dictionaries(st.sampled_from([*KEYS, "width_px", "id"]), JSON, max_size=5),
)


@given(NEARLY)
def test_wrong_types_of_right_fields_are_refused_and_nothing_else_is_raised(
    document: dict[str, Any],
) -> None:
    try:
        read(json.dumps(document))
    except HostileError:
        return
    assert all(value is not None for key, value in document.items() if key != "order")


@given(JSON)
def test_depth_is_that_of_the_brackets(value: Any) -> None:
    def depth(one: Any) -> int:
        inner = one.values() if isinstance(one, dict) else one if isinstance(one, list) else None
        return 0 if inner is None else 1 + max(map(depth, inner), default=0)

    text = json.dumps({"a": value}, allow_nan=False) if _finite(value) else "{}"
    document = {"a": value} if _finite(value) else {}
    deep = depth(document)
    assert read_document(text, deep) == document
    with pytest.raises(HostileError):
        read_document(text, deep - 1)


def _finite(value: Any) -> bool:
    try:
        json.dumps(value, allow_nan=False)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize(
    ("document", "stop"),
    [
        ({"kind": "order", "seq": 1, "order": {"kind": "stop"}}, True),
        ({"kind": "order", "order": {"kind": "stop"}}, True),
        ({"kind": "order", "seq": "x", "order": {"kind": "stop", "junk": 1}}, True),
        ({"kind": "order", "seq": 1, "order": {"kind": "release"}}, False),
        ({"kind": "order", "seq": 1, "order": "stop"}, False),
        ({"kind": "stop"}, False),
    ],
)
def test_stop_is_known_whatever_else_is_wrong(document: dict[str, Any], stop: bool) -> None:
    assert is_stop(document) == stop


@pytest.mark.parametrize(
    ("seq", "found"), [(0, 0), (5, 5), (True, None), (-1, None), (1.5, None), (2**53, None)]
)
def test_seq(seq: object, found: int | None) -> None:
    assert seq_of({"seq": seq}) == found

"""Datagrams, good and hostile."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.control import VelocityCommand
from airground.errors import InputError
from airground.robots.udp_messages import MOST_BYTES, command_datagram, parse_reading


def test_a_command_is_written_as_documented(root: Any) -> None:
    text = command_datagram(7, 12.34567891, VelocityCommand(0.25, -0.5, 0.125), 0.5)
    document = json.loads(text)
    assert document == {
        "kind": "command",
        "seq": 7,
        "t_s": 12.345679,
        "v_mps": 0.25,
        "omega_radps": -0.5,
        "lateral_mps": 0.125,
        "timeout_s": 0.5,
    }
    page = (root / "docs" / "robots.md").read_text("utf-8")
    assert [field for field in document if f"`{field}`" not in page] == []


def test_a_command_that_is_not_finite_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="JSON compliant"):
        command_datagram(1, 0.0, VelocityCommand(float("nan"), 0.0), 0.5)


def test_readings_may_leave_out_what_a_robot_does_not_know() -> None:
    whole = b'{"t_s": 5, "heading_rad": -7.5, "speed_mps": 0.25, "turn_rate_radps": 0.5}'
    assert parse_reading(whole) == (5.0, -7.5, 0.25, 0.5)
    assert parse_reading(b'{"kind": "reading", "t_s": 5, "speed_mps": 0}') == (5.0, None, 0.0, None)
    some = b'{"t_s": 5, "heading_rad": null, "turn_rate_radps": 1}'
    assert parse_reading(some) == (5.0, None, None, 1.0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (b"", "not JSON"),
        (b"\xff\xfe\x00", "not JSON"),
        (b"[" * 1000, "not JSON"),
        (b'{"a":' * 200, "not JSON"),
        (b'{"t_s": NaN, "speed_mps": 1}', "not JSON"),
        (b'{"t_s": 1, "speed_mps": -Infinity}', "not JSON"),
        (b'{"t_s": 1, "speed_mps": 1' + b" " * MOST_BYTES + b"}", "bytes"),
        (b"[1, 2]", "object"),
        (b"7", "object"),
        (b'{"speed_mps": 1}', "t_s is missing"),
        (b'{"t_s": null, "speed_mps": 1}', "t_s is missing"),
        (b'{"t_s": 1}', "none of heading_rad"),
        (b'{"t_s": 1, "heading_rad": null}', "none of heading_rad"),
        (b'{"t_s": "1", "speed_mps": 1}', "t_s must be a number, not a str"),
        (b'{"t_s": true, "speed_mps": 1}', "t_s must be a number, not a bool"),
        (b'{"t_s": 1, "speed_mps": [1]}', "speed_mps must be a number"),
        (b'{"t_s": 1, "speed_mps": 1e300}', "speed_mps must be -100 to 100"),
        (b'{"t_s": 1, "speed_mps": 1e999}', "speed_mps must be -100 to 100"),
        (b'{"t_s": 1, "speed_mps": 1' + b"0" * 400 + b"}", "speed_mps must be -100 to 100"),
        (b'{"t_s": 1, "speed_mps": 1' + b"0" * 900 + b"}", "speed_mps"),
        (b'{"t_s": 1e13, "speed_mps": 1}', "t_s must be"),
        (b'{"t_s": 1, "turn_rate_radps": 101}', "turn_rate_radps must be"),
        (b'{"t_s": 1, "speed_mp": 1}', "unknown field 'speed_mp'"),
        (b'{"kind": "command", "t_s": 1, "speed_mps": 1}', "kind"),
    ],
)
def test_anything_else_is_refused_in_one_line(text: bytes, says: str) -> None:
    with pytest.raises(InputError, match=says) as caught:
        parse_reading(text)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 160


@given(st.binary(max_size=200) | st.text(max_size=100).map(str.encode))
def test_no_bytes_raise_anything_else(text: bytes) -> None:
    with pytest.raises(InputError):
        parse_reading(text)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=4,
)


@given(st.dictionaries(st.sampled_from(["t_s", "heading_rad", "speed_mps", "kind"]), json_values))
def test_what_is_let_through_are_numbers_in_range(document: dict[str, Any]) -> None:
    try:
        t_s, heading, speed, turn_rate = parse_reading(json.dumps(document).encode())
    except InputError:
        return
    assert abs(t_s) <= 1e12
    assert turn_rate is None
    assert heading is None or abs(heading) <= 1e6
    assert speed is None or abs(speed) <= 100

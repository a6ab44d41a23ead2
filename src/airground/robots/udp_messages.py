"""The datagrams that a robot and its driver exchange: JSON, one object each; docs/robots.md is their description."""

from __future__ import annotations

import json
from math import isfinite
from typing import TYPE_CHECKING, Any

from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand

__all__ = ["MOST_BYTES", "command_datagram", "parse_reading"]

MOST_BYTES = 1024
"""A datagram that is longer is none of ours; it also fits into one packet of every network."""

# What no robot that is driven by us does: a number beyond it is a wrong unit, or damaged.
LARGEST = {"t_s": 1e12, "heading_rad": 1e6, "speed_mps": 100.0, "turn_rate_radps": 100.0}

FIELDS = ("heading_rad", "speed_mps", "turn_rate_radps")


def command_datagram(seq: int, t_s: float, command: VelocityCommand, timeout_s: float) -> bytes:
    """Write a command.

    Parameters
    ----------
    seq : int
        Grows by one with each datagram.
    t_s : float [s]
        When it is sent.
    command : VelocityCommand
        What to do; finite.
    timeout_s : float [s]
        After such a silence the robot must stop by itself.

    Returns
    -------
    datagram : bytes
        JSON.
    """
    return json.dumps(
        {
            "kind": "command",
            "seq": seq,
            "t_s": round(t_s, 6),
            "v_mps": command.v,
            "omega_radps": command.omega,
            "lateral_mps": command.lateral,
            "timeout_s": timeout_s,
        },
        allow_nan=False,
    ).encode()


def parse_reading(
    datagram: bytes,
) -> tuple[float, float | None, float | None, float | None]:
    """Read what a robot tells about itself.

    Parameters
    ----------
    datagram : bytes
        As it came.

    Returns
    -------
    t_s : float [s]
        On the robot's clock.
    heading, speed, turn_rate : float or None [rad, m/s, rad/s]
        None for what it does not tell; one of them at least is there.

    Raises
    ------
    InputError
        If it is anything else than what stands in docs/robots.md.
    """
    if len(datagram) > MOST_BYTES:
        raise InputError(f"a datagram may have {MOST_BYTES} bytes, not more")
    try:
        document: Any = json.loads(datagram, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise InputError(f"not JSON: {type(error).__name__}") from None
    if not isinstance(document, dict):
        raise InputError(f"a JSON object was expected, not a {type(document).__name__}")
    if document.pop("kind", "reading") != "reading":
        raise InputError('kind must be "reading", or be left out')
    unknown = sorted(set(document) - set(LARGEST))
    if unknown:
        raise InputError(f"unknown field {unknown[0][:40]!r}; known are {', '.join(LARGEST)}")
    values = {name: _number(document, name) for name in LARGEST}
    t_s = values["t_s"]
    if t_s is None:
        raise InputError("t_s is missing: when it was read, on the robot's clock")
    heading, speed, turn_rate = (values[name] for name in FIELDS)
    if heading is None and speed is None and turn_rate is None:
        raise InputError(f"none of {', '.join(FIELDS)} is there")
    return t_s, heading, speed, turn_rate


def _number(document: dict[str, Any], name: str) -> float | None:
    value = document.get(name)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{name} must be a number, not a {type(value).__name__}")
    most = LARGEST[name]
    # A whole number may be too large for a float.
    if not -most <= value <= most or not isfinite(value):
        raise InputError(f"{name} must be -{most:g} to {most:g}")
    return float(value)


def _no_number(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")

"""What a page sends, read without trust."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, fields
from math import isfinite
from typing import Any, ClassVar, NoReturn, get_args

from airground.errors import InputError

__all__ = [
    "AskControls",
    "GiveOrder",
    "Hello",
    "HostileError",
    "PageMessage",
    "Ping",
    "Shown",
    "View",
    "is_stop",
    "read_document",
    "read_message",
    "seq_of",
]

LARGEST = 2**53
LONGEST_NAME = 40
LONGEST_TOKEN = 256
STRINGS = re.compile(r'"(?:[^"\\]++|\\.)*+(?:"|\\?\Z)', re.DOTALL)  # linear: nothing is tried twice
SQUARE = bytes.maketrans(b"{}", b"[]")
REST = bytes(set(range(128)) - set(b"[]{}"))


class HostileError(InputError):
    """A message that no page of ours sends. It changes nothing and is counted.

    Parameters
    ----------
    kind : str
        Under which it is counted.
    line : str
        What was wrong.
    """

    def __init__(self, kind: str, line: str) -> None:
        super().__init__(line)
        self.kind = kind
        self.line = line


@dataclass(frozen=True, slots=True)
class Hello:
    """Who a client is; its first message."""

    kind: ClassVar[str] = "hello"

    version: int
    """Of the protocol that its page speaks."""

    token: str = ""
    """What the server's address held; empty where it held none."""

    name: str = ""
    """To show to others."""


@dataclass(frozen=True, slots=True)
class GiveOrder:
    """An order to the session."""

    kind: ClassVar[str] = "order"

    seq: int
    """Number that the reply names; ascends."""

    order: object
    """As `parse_order` takes it."""


@dataclass(frozen=True, slots=True)
class AskControls:
    """Take the controls, or give them back."""

    kind: ClassVar[str] = "controls"

    seq: int
    """Number that the reply names; ascends."""

    take: bool
    """Whether to take them."""

    force: bool = False
    """Whether to take them from whom holds them."""


@dataclass(frozen=True, slots=True)
class View:
    """What images a client wants; also says that it waits for none."""

    kind: ClassVar[str] = "view"

    image: bool
    """Whether any."""

    rate_hz: float = 15.0
    """At most so many a second."""

    width_px: int = 1280
    """About how wide; never wider than the camera's."""


@dataclass(frozen=True, slots=True)
class Shown:
    """An image was shown, so that the next may be sent."""

    kind: ClassVar[str] = "shown"

    index: int
    """Of the image."""


@dataclass(frozen=True, slots=True)
class Ping:
    """Ask whether the server is there."""

    kind: ClassVar[str] = "ping"

    id: int
    """Comes back."""


PageMessage = Hello | GiveOrder | AskControls | View | Shown | Ping

KINDS: dict[str, Any] = {one.kind: one for one in get_args(PageMessage)}


def _refuse(line: str) -> NoReturn:
    raise HostileError("malformed", line)


def _number(name: str, value: object, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        _refuse(f"{name} must be a number")
    if not (low <= value <= high and isfinite(value)):
        _refuse(f"{name} must be a number from {low:g} to {high:g}")
    return float(value)


def _whole(name: str, value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < LARGEST:
        _refuse(f"{name} must be a whole number, zero or more")
    return value


def _flag(name: str, value: object) -> bool:
    if not isinstance(value, bool):
        _refuse(f"{name} must be true or false")
    return value


def _token(name: str, value: object) -> str:
    if not (isinstance(value, str) and len(value) <= LONGEST_TOKEN):
        _refuse(f"{name} must be a text")
    return value


def _name(name: str, value: object) -> str:
    if not (isinstance(value, str) and len(value) <= LONGEST_NAME):
        _refuse(f"{name} must be a text of up to {LONGEST_NAME} letters")
    return "".join(letter for letter in value if letter.isprintable())


FIELDS: dict[str, Any] = {
    "version": _whole,
    "token": _token,
    "name": _name,
    "seq": _whole,
    "order": lambda _, value: value,  # `parse_order` reads it
    "take": _flag,
    "force": _flag,
    "image": _flag,
    "rate_hz": lambda name, value: _number(name, value, 0.1, 100.0),
    "width_px": lambda name, value: int(_number(name, value, 1, 16_384)),
    "index": _whole,
    "id": _whole,
}


def read_document(text: str, depth: int) -> dict[str, Any]:
    """Read JSON whose depth is bounded before it is parsed.

    Parameters
    ----------
    text : str
        Of bounded length.
    depth : int
        Most brackets within brackets.

    Returns
    -------
    document : dict
        Of finite numbers, but for those that are too large to be one.

    Raises
    ------
    HostileError
        If it is not JSON, not an object, or too deep.
    """
    brackets = STRINGS.sub("", text).encode("ascii", "ignore").translate(SQUARE, REST)
    for _ in range(depth):  # each time the innermost go
        brackets = brackets.replace(b"[]", b"")
    if brackets:
        raise HostileError("too_deep", f"brackets do not match, or more than {depth} deep")
    try:
        document = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise HostileError("malformed", "a message must be JSON without NaN") from error
    if not isinstance(document, dict):
        _refuse("a message must be an object")
    return document


def read_message(document: dict[str, Any]) -> PageMessage:
    """Read what a page sent.

    Parameters
    ----------
    document : dict
        As `read_document` gives it.

    Returns
    -------
    message : PageMessage
        Of known kind, with fields of sensible types and sizes; an order is not looked into.

    Raises
    ------
    HostileError
        If it is none of ours.
    """
    name = document.get("kind")
    kind = KINDS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise HostileError("unknown_kind", f"kind must be one of {', '.join(KINDS)}")
    declared = [one.name for one in fields(kind)]
    if any(key != "kind" and key not in declared for key in document):
        _refuse(f"{name} has no fields but {', '.join(declared)}")
    values = {key: FIELDS[key](key, document[key]) for key in declared if key in document}
    try:
        message: PageMessage = kind(**values)
    except TypeError:
        _refuse(f"{name} must have {', '.join(declared)}")
    return message


def is_stop(document: dict[str, Any]) -> bool:
    """Tell whether a message says STOP, whatever else is wrong with it.

    Parameters
    ----------
    document : dict
        As `read_document` gives it.

    Returns
    -------
    stop : bool
        To be obeyed at once.
    """
    order = document.get("order")
    return (
        document.get("kind") == "order" and isinstance(order, dict) and order.get("kind") == "stop"
    )


def seq_of(document: dict[str, Any]) -> int | None:
    """Give the number that a reply should name.

    Parameters
    ----------
    document : dict
        As `read_document` gives it.

    Returns
    -------
    seq : int or None
        None where there is none to be trusted.
    """
    seq = document.get("seq")
    if isinstance(seq, bool) or not isinstance(seq, int):
        return None
    return seq if 0 <= seq < LARGEST else None

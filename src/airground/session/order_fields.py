"""How each field of an order is read from what somebody sent."""

from __future__ import annotations

from math import isfinite
from typing import Any

from airground.errors import InputError

__all__ = ["FIELDS", "SPECIAL", "shown"]

Pixels = tuple[tuple[float, float], ...]

MOST_POINTS = 4000  # of a sketch
MOST_GOALS = 50
MOST_FENCES = 40
MOST_CORNERS = 100
FARTHEST_PX = 1e5
FASTEST_MPS = 100.0
LONGEST_NAME = 64


def shown(value: object) -> str:
    """Give a value as a message may hold it.

    Parameters
    ----------
    value : object
        Anything.

    Returns
    -------
    text : str
        Short.
    """
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _number(what: str, value: object, low: float, high: float) -> float:
    # bool is an int to Python, not to us
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{what} must be a number, not {shown(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = float("nan")
    if not (isfinite(number) and low <= number <= high):
        raise InputError(f"{what} must be a number from {low:g} to {high:g}, not {shown(value)}")
    return number


def _name(what: str, value: object) -> str:
    if not (isinstance(value, str) and 0 < len(value) <= LONGEST_NAME and value.isprintable()):
        raise InputError(f"{what} must be a name of up to {LONGEST_NAME} letters")
    return value


def _maybe_name(what: str, value: object) -> str | None:
    return None if value is None else _name(what, value)


def _names(what: str, value: object) -> tuple[str, ...]:
    if not (isinstance(value, list | tuple) and len(value) <= MOST_GOALS):
        raise InputError(f"{what} must be a list of up to {MOST_GOALS} names")
    return tuple(_name(what, one) for one in value)


def _pixels(what: str, value: object, least: int, most: int) -> Pixels:
    if not (isinstance(value, list | tuple) and least <= len(value) <= most):
        raise InputError(f"{what} must be a list of {least} to {most} pixels [u, v]")
    points = []
    for one in value:
        if not (isinstance(one, list | tuple) and len(one) == 2):
            raise InputError(f"{what} must hold pixels [u, v], not {shown(one)}")
        u, v = (_number(what, c, -FARTHEST_PX, FARTHEST_PX) for c in one)
        points.append((u, v))
    return tuple(points)


def _polygons(what: str, value: object) -> tuple[Pixels, ...]:
    if not (isinstance(value, list | tuple) and len(value) <= MOST_FENCES):
        raise InputError(f"{what} must be a list of up to {MOST_FENCES} polygons")
    return tuple(_pixels(what, one, 3, MOST_CORNERS) for one in value)


def _maybe(what: str, value: object, low: float, high: float) -> float | None:
    return None if value is None else _number(what, value, low, high)


def _whole(what: str, value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**53:
        raise InputError(f"{what} must be a whole number, not {shown(value)}")
    return value


def _flag(what: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{what} must be true or false, not {shown(value)}")
    return value


def _way(what: str, value: object) -> str:
    if value not in ("guided", "hand"):
        raise InputError(f"{what} must be guided or hand, not {shown(value)}")
    return str(value)


FIELDS: dict[str, Any] = {
    "robot": _name,
    "robots": _names,
    "goals_px": lambda what, value: _pixels(what, value, 1, MOST_GOALS),
    "points_px": lambda what, value: _pixels(what, value, 2, MOST_POINTS),
    "heading_rad": lambda what, value: _maybe(what, value, -100.0, 100.0),
    "speed_mps": lambda what, value: _maybe(what, value, 1e-3, FASTEST_MPS),
    "sketch": _whole,
    "stay_inside": _polygons,
    "keep_out": _polygons,
    "by": _way,
    "keep": _flag,
    "forward": lambda what, value: _number(what, value, -1.0, 1.0),
    "turn": lambda what, value: _number(what, value, -1.0, 1.0),
}
# The only fields of one name that differ between orders.
SPECIAL: dict[tuple[str, str], Any] = {
    ("rest", "robot"): _maybe_name,
    ("set_speed", "speed_mps"): lambda what, value: _number(what, value, 1e-3, FASTEST_MPS),
}

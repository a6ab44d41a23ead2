"""Values of a site file: read strictly, each by a function that raises ValueError with what was expected."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["choice", "flag", "kind", "number", "pair", "shown", "text", "whole"]

_SHOWN = 60


def kind(value: object) -> str:
    """What TOML calls a value.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    name : str
        With its article.
    """
    names = {bool: "true or false", dict: "a table", list: "a list", str: "a text"}
    return names.get(type(value), "a number" if isinstance(value, int | float) else "a date")


def shown(value: object) -> str:
    """Show a value as TOML has it, short.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    text : str
        On one line.
    """
    if isinstance(value, dict) or (isinstance(value, list) and len(repr(value)) > _SHOWN):
        return kind(value)
    said = str(value).lower() if isinstance(value, bool) else repr(value)
    said = f'"{said[1:-1]}"' if isinstance(value, str) else said
    return said if len(said) <= _SHOWN else f"{said[: _SHOWN - 3]}..."


def number(value: object) -> float:
    """Read a finite number.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    number : float
        Finite.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("a number")
    try:
        read = float(value)
    except OverflowError:
        read = float("inf")
    if not isfinite(read):
        raise ValueError("a finite number")
    return read


def whole(value: object) -> int:
    """Read a whole number.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    number : int
        Of any size.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError("a whole number")
    return value


def flag(value: object) -> bool:
    """Read a truth value.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    flag : bool
        Itself.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if not isinstance(value, bool):
        raise ValueError("true or false")
    return value


def text(value: object) -> str:
    """Read a text that a person can see.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    text : str
        Not empty, without blanks around it.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if not isinstance(value, str):
        raise ValueError('a text in quotes: "..."')
    if not (value and value == value.strip() and value.isprintable()):
        raise ValueError("a text that is not empty, without blanks around it or control characters")
    return value


def choice(*allowed: str) -> Callable[[object], str]:
    """Read one of some words.

    Parameters
    ----------
    *allowed : str
        The words.

    Returns
    -------
    read : callable
        For `Table.get`.
    """

    def read(value: object) -> str:
        if not isinstance(value, str) or value not in allowed:
            raise ValueError(" or ".join(f'"{word}"' for word in allowed))
        return value

    return read


def pair(value: object) -> tuple[float, float]:
    """Read two numbers.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    numbers : (float, float)
        Finite.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError("two numbers: [1.0, 2.0]")
    try:
        first, second = map(number, value)
    except ValueError as error:
        raise ValueError("two finite numbers: [1.0, 2.0]") from error
    return first, second

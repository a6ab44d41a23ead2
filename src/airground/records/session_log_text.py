"""JSON that gives back what it was given, bit for bit, and that any reader of JSON can read.

Python writes a float with the fewest digits that read back to it. NaN and infinity, which JSON lacks, become objects:
``{"$float": "nan"}``.
"""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np

from airground.errors import InputError

__all__ = ["exact_json", "parse_json"]

# A text is matched whole, so that words within it are left alone.
_TEXT_OR_CONSTANT = re.compile(rb'"[^"\\]*(?:\\.[^"\\]*)*"|NaN|-?Infinity')
_MARK = "$float"
_NAMES = {b"NaN": b"nan", b"Infinity": b"inf", b"-Infinity": b"-inf"}
_FLOATS = {"nan": float("nan"), "inf": float("inf"), "-inf": float("-inf")}


def exact_json(document: object) -> bytes:
    """Write a document.

    Parameters
    ----------
    document : object
        Of dicts with texts as keys, lists, tuples, texts, numbers, truth values, None, and arrays. Tuples and arrays
        are read back as lists.

    Returns
    -------
    text : bytes
        ASCII, on one line.

    Raises
    ------
    InputError
        If something in it has no place in JSON.
    """
    try:
        text = json.dumps(document, separators=(",", ":"), default=_plain).encode("ascii")
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(f"a record cannot be written: {error}") from error
    if b"NaN" in text or b"Infinity" in text:
        text = _TEXT_OR_CONSTANT.sub(_spelled, text)
    return text


def parse_json(text: bytes) -> Any:
    """Read what `exact_json` wrote.

    Parameters
    ----------
    text : bytes
        Of a document.

    Returns
    -------
    document : object
        The same numbers and texts. All NaN in it are one object, so that lists of two documents with NaN at the same
        places are equal.

    Raises
    ------
    ValueError
        If it is not JSON.
    """
    try:
        return json.loads(text, object_hook=_restored if _MARK.encode() in text else None)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in JSON")


def _spelled(match: re.Match[bytes]) -> bytes:
    name = _NAMES.get(match[0])
    return match[0] if name is None else b'{"%s":"%s"}' % (_MARK.encode(), name)


def _restored(found: dict[str, Any]) -> Any:
    value = found.get(_MARK)
    return _FLOATS[value] if len(found) == 1 and value in _FLOATS else found

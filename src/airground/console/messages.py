"""What the server tells the page, as JSON: names are those of `session.tick`, numbers are short, and never NaN."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from airground.session.handle import SiteView
    from airground.session.tick import PathView, SessionTick

__all__ = [
    "fences_document",
    "message_text",
    "path_document",
    "plain",
    "site_document",
    "state_document",
    "state_text",
]

DECIMALS = 4
# Finer than a person can see or a robot can follow, and half the bytes.
FEWER = {
    "uv": 2,
    "ahead_uv": 1,
    "goals_px": 1,
    "points": 3,
    "undrivable": 1,
    "leg_from_px": 1,
    "leg_to_px": 1,
    "t": 3,
    "seen_s": 3,
    "heard_s": 3,
    "age_s": 3,
    "rate_hz": 2,
    "error_px": 2,
}
MOST_OTHERS = 200  # a tracker gone wild shall not fill the line

SIMPLE = (str, int, bool)
_FIELDS: dict[type, tuple[tuple[str, int], ...]] = {}


def plain(value: Any, decimals: int = DECIMALS) -> Any:
    """Give a value as JSON can hold it.

    Parameters
    ----------
    value : object
        Numbers, texts, sequences, mappings, arrays, dataclasses, and any mixture.
    decimals : int
        Digits after the point that numbers keep.

    Returns
    -------
    document : object
        Lists, dicts, numbers, texts; None for what is not a finite number.
    """
    kind = type(value)
    if kind is float:
        return round(value, decimals) if isfinite(value) else None
    if value is None or kind in SIMPLE:
        return value
    if kind in (tuple, list):
        return [plain(one, decimals) for one in value]
    if (known := _FIELDS.get(kind)) is None and is_dataclass(kind):
        known = tuple((one.name, FEWER.get(one.name, DECIMALS)) for one in fields(kind))
        _FIELDS[kind] = known
    if known is not None:
        return {name: plain(getattr(value, name), digits) for name, digits in known}
    return _rarer(value, decimals)


def _rarer(value: Any, decimals: int) -> Any:
    if isinstance(value, Mapping):
        return {str(key): plain(one, decimals) for key, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist(), decimals)
    return str(value)


def state_text(key: str, rev: int, data: Any) -> str:
    """Give a state message as it is sent.

    Parameters
    ----------
    key : str
        What it is about; the newest of a key wins.
    rev : int
        Grows with every message of the server.
    data : object
        Plain.

    Returns
    -------
    text : str
        JSON.
    """
    return message_text({"key": key, "rev": rev, "data": data})


def message_text(document: Any) -> str:
    """Give a document as it is sent.

    Parameters
    ----------
    document : object
        Plain.

    Returns
    -------
    text : str
        JSON on one line, ASCII only, without spaces.
    """
    return json.dumps(document, separators=(",", ":"), allow_nan=False)


def state_document(tick: SessionTick, now: float) -> dict[str, Any]:
    """Give what changes with every step.

    Parameters
    ----------
    tick : SessionTick
        The newest.
    now : float [s]
        Session clock, for the page to see how late this was sent.

    Returns
    -------
    document : dict
        Data of the message ``state``.
    """
    return {
        "t": plain(tick.t, 3),
        "now": plain(float(now), 3),
        "number": tick.number,
        "mode": tick.mode,
        "why": tick.why,
        "stop_heard": tick.stop_heard,
        "robots": plain(tick.robots),
        "others": plain(tick.others[:MOST_OTHERS]),
        "camera": plain(tick.camera),
        "stages_ms": plain(tick.stages_ms, 2),
    }


def path_document(path: PathView) -> dict[str, Any]:
    """Give a path that was made of a sketch.

    Parameters
    ----------
    path : PathView
        Any.

    Returns
    -------
    document : dict
        Data of the message ``path/<robot>``, with ``drivable`` added.
    """
    document: dict[str, Any] = plain(path)
    return document | {"drivable": path.drivable}


def fences_document(tick: SessionTick) -> dict[str, Any]:
    """Give where robots may be.

    Parameters
    ----------
    tick : SessionTick
        The newest.

    Returns
    -------
    document : dict
        Data of the message ``fences``.
    """
    stay_inside, keep_out = tick.fences
    return {
        "stay_inside": plain(stay_inside, 1),
        "keep_out": plain(keep_out, 1),
        "revision": tick.fences_revision,
    }


def site_document(site: SiteView) -> dict[str, Any]:
    """Give what does not change in a session.

    Parameters
    ----------
    site : SiteView
        Its robots, and how it runs.

    Returns
    -------
    document : dict
        Of the message ``hello``.
    """
    return {
        "name": site.name,
        "control_hz": plain(site.control_hz),
        "wanted_sigma": plain(site.wanted_sigma),
        "robots": [
            {
                "name": robot.name,
                "kind": robot.kind,
                "radius_m": plain(robot.radius_m),
                "limits": plain(robot.limits),
            }
            for robot in site.robots
        ],
    }

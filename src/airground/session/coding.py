"""Inputs as what `exact_json` can hold, to the last bit, and back.

Tracks are not read back: a replay's tracker makes them anew. Nor is work that left the loop: a replay does it anew,
where its result came in.
"""

from __future__ import annotations

from dataclasses import asdict, fields, is_dataclass
from typing import TYPE_CHECKING, Any, get_type_hints

import numpy as np

from airground.control import Limits
from airground.control.estimation.options import StateOptions
from airground.control.safety.bounds import SafetyBounds
from airground.errors import InputError
from airground.robots import RobotReading
from airground.session.inputs import CameraNews, Finished, Heard, Ordered, Seen
from airground.session.options import RobotOptions, SessionOptions
from airground.session.orders import order_document, parse_order
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.geometry.arrays import FloatArray
    from airground.session.inputs import Input
    from airground.vision.tracker import TrackerState

__all__ = [
    "input_document",
    "options_document",
    "read_input",
    "read_options",
    "tracks_document",
]

_ARRAYS = ("uv", "covariance", "angle", "angle_sigma", "score", "outline")


def input_document(one: Input) -> dict[str, Any]:
    """Give an input as JSON can hold it.

    Parameters
    ----------
    one : Input
        Any.

    Returns
    -------
    document : dict
        For `read_input`.
    """
    if isinstance(one, Seen):
        sightings: dict[str, Any] = {k: getattr(one.sightings, k) for k in _ARRAYS}
        sightings["labels"] = list(one.sightings.labels)
        return {
            "kind": "seen",
            "t": one.t,
            "arrived_s": one.arrived_s,
            "index": one.index,
            "size_px": list(one.size_px),
            "segment": one.segment,
            "sightings": sightings,
            "tracks": tracks_document(one.tracks),
        }
    if isinstance(one, CameraNews):
        return {"kind": "camera", "state": one.state, "line": one.line, "frozen_s": one.frozen_s}
    if isinstance(one, Heard):
        readings = [{k.name: getattr(r, k.name) for k in fields(r)} for r in one.readings]
        return {"kind": "heard", "robot": one.robot, "readings": readings}
    if isinstance(one, Ordered):
        return {"kind": "ordered", "client": one.client, "order": order_document(one.order)}
    return {"kind": "finished", "job": one.job}


def tracks_document(tracks: TrackerState) -> dict[str, Any]:
    """Give what a tracker believes as JSON can hold it.

    Parameters
    ----------
    tracks : TrackerState
        After a frame.

    Returns
    -------
    document : dict
        What a replay is compared with.
    """
    return {
        "names": list(tracks.names),
        "labels": list(tracks.labels),
        "serial": tracks.serial,
        "uv": tracks.uv,
        "uv_dot": tracks.uv_dot,
        "confirmed": tracks.confirmed,
        "sighting": tracks.sighting,
        "swap_probability": tracks.swap_probability,
        "merged_with": [list(names) for names in tracks.merged_with],
    }


def read_input(
    document: dict[str, Any],
    track: Callable[[Sightings, int], TrackerState],
    result: Callable[[int], Any],
) -> Input:
    """Read an input.

    Parameters
    ----------
    document : dict
        Of `input_document`.
    track : callable
        Makes tracks of sightings and the camera's segment.
    result : callable
        Gives the result of a job by its number.

    Returns
    -------
    one : Input
        As it was.

    Raises
    ------
    InputError
        If it is no input.
    """
    try:
        kind = document["kind"]
        if kind == "seen":
            given = document["sightings"]
            count = len(given["uv"])
            arrays = {k: _array(given[k], count, k) for k in _ARRAYS}
            sightings = Sightings(document["t"], labels=tuple(given["labels"]), **arrays)
            return Seen(
                t=document["t"],
                arrived_s=document["arrived_s"],
                index=document["index"],
                size_px=tuple(document["size_px"]),
                sightings=sightings,
                tracks=track(sightings, document["segment"]),
                segment=document["segment"],
            )
        if kind == "camera":
            return CameraNews(document["state"], document["line"], document["frozen_s"])
        if kind == "heard":
            readings = tuple(RobotReading(**one) for one in document["readings"])
            return Heard(document["robot"], readings)
        if kind == "ordered":
            return Ordered(document["client"], parse_order(document["order"]))
        if kind == "finished":
            return Finished(document["job"], result(document["job"]))
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"an input of the recording cannot be read: {error!r}") from error
    raise InputError(f"the recording has an input of a kind that is not known: {kind!r}")


def options_document(options: SessionOptions) -> dict[str, Any]:
    """Give a session's options as JSON can hold them.

    Parameters
    ----------
    options : SessionOptions
        Any.

    Returns
    -------
    document : dict
        For `read_options`.
    """
    return asdict(options)


def read_options(document: dict[str, Any]) -> SessionOptions:
    """Read a session's options.

    Parameters
    ----------
    document : dict
        Of `options_document`.

    Returns
    -------
    options : SessionOptions
        As they were.

    Raises
    ------
    InputError
        If it holds others than this version knows.
    """
    try:
        given = dict(document)
        robots = tuple(
            _read(
                RobotOptions,
                robot
                | {
                    "limits": _read(Limits, robot["limits"]),
                    "state": _read(StateOptions, robot["state"]),
                },
            )
            for robot in given.pop("robots")
        )
        bounds = _read(SafetyBounds, given.pop("bounds"))
        options: SessionOptions = _read(
            SessionOptions, given | {"robots": robots, "bounds": bounds}
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"the recording's options are not those of this version: {error}"
        ) from error
    return options


def _read(kind: Any, given: dict[str, Any]) -> Any:
    hints = get_type_hints(kind)
    values = {}
    for name, value in given.items():
        if name not in hints:
            raise ValueError(f"{kind.__name__} has no {name}")
        if is_dataclass(value) or isinstance(value, tuple):
            values[name] = value
        else:
            values[name] = _tuples(value)
    return kind(**values)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(one) for one in value) if isinstance(value, list) else value


_SHAPES = {"uv": (2,), "covariance": (2, 2), "outline": (4, 2)}


def _array(given: Any, count: int, name: str) -> FloatArray:
    return np.array(given, dtype=np.float64).reshape(count, *_SHAPES.get(name, ()))

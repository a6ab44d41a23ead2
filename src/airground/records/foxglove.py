"""Messages of Foxglove's, from plain numbers: what its panels show of a recording.

Pixels of its annotations begin at the corner of the top-left pixel, ours at that pixel's centre: half a pixel is added.
Its camera matrix is OpenCV's, which counts as we do.
"""

from __future__ import annotations

import json
from base64 import b64encode
from dataclasses import dataclass
from math import cos, isfinite, sin
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from airground.errors import InputError, UndeterminedCameraError
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = [
    "Dot",
    "Level",
    "Line",
    "Marks",
    "Words",
    "camera_calibration",
    "compressed_image",
    "image_annotations",
    "log_message",
    "pose_in_frame",
    "seen_marks",
]

Message = dict[str, Any]
Level = Literal["info", "warning", "error"]
Color = tuple[float, float, float, float]
Uv = tuple[float, float]

CAMERA, GROUND = "camera", "ground"
_LEVELS = {"info": 2, "warning": 3, "error": 4}
_LINE_LOOP, _LINE_STRIP = 2, 3
_CLEAR: Color = (0.0, 0.0, 0.0, 0.0)
_SHADE: Color = (0.0, 0.0, 0.0, 0.5)
WHITE: Color = (1.0, 1.0, 1.0, 1.0)
YELLOW: Color = (1.0, 0.85, 0.2, 1.0)
BLUE: Color = (0.35, 0.75, 1.0, 1.0)
FONT_PX, LEAST_RADIUS_PX = 16.0, 4.0
AHEAD_S = 0.5  # length of a track's velocity


@dataclass(frozen=True, slots=True)
class Dot:
    """A circle in the image."""

    uv: Uv
    """Centre [px]."""

    radius_px: float = LEAST_RADIUS_PX
    """Radius [px]."""

    color: Color = WHITE
    """Red, green, blue, opacity, each 0 to 1."""


@dataclass(frozen=True, slots=True)
class Line:
    """A polyline in the image."""

    points: Sequence[Uv]
    """Corners [px]."""

    color: Color = WHITE
    """Red, green, blue, opacity, each 0 to 1."""

    closed: bool = False
    """Whether the last corner is joined to the first."""


@dataclass(frozen=True, slots=True)
class Words:
    """A text in the image."""

    uv: Uv
    """Its bottom left [px]."""

    text: str
    """What it says."""

    color: Color = WHITE
    """Red, green, blue, opacity, each 0 to 1."""


@dataclass(frozen=True, slots=True)
class Marks:
    """What is drawn over one image."""

    dots: tuple[Dot, ...] = ()
    """Circles."""

    lines: tuple[Line, ...] = ()
    """Polylines."""

    words: tuple[Words, ...] = ()
    """Texts."""


def compressed_image(ns: int, jpeg: bytes) -> bytes:
    """``foxglove.CompressedImage``, as JSON: megabytes a second, that nothing but this should look at.

    Parameters
    ----------
    ns : int [ns]
        Wall clock.
    jpeg : bytes
        The image.

    Returns
    -------
    text : bytes
        JSON.
    """
    head = {"timestamp": _time(ns), "frame_id": CAMERA, "format": "jpeg"}
    return b'%s,"data":"%s"}' % (json.dumps(head)[:-1].encode("ascii"), b64encode(jpeg))


def image_annotations(ns: int, marks: Marks) -> Message:
    """``foxglove.ImageAnnotations``. What is not finite is left out.

    Parameters
    ----------
    ns : int [ns]
        Wall clock.
    marks : Marks
        What to draw.

    Returns
    -------
    message : dict
        For JSON.
    """
    stamp = _time(ns)
    circles = [
        {
            "timestamp": stamp,
            "position": _point(dot.uv),
            "diameter": 2.0 * float(dot.radius_px),
            "thickness": 2.0,
            "fill_color": _color(_CLEAR),
            "outline_color": _color(dot.color),
            "metadata": [],
        }
        for dot in marks.dots
        if _finite(dot.uv) and isfinite(dot.radius_px)
    ]
    points = [
        {
            "timestamp": stamp,
            "type": _LINE_LOOP if line.closed else _LINE_STRIP,
            "points": [_point(uv) for uv in line.points],
            "outline_color": _color(line.color),
            "outline_colors": [],
            "fill_color": _color(_CLEAR),
            "thickness": 2.0,
            "metadata": [],
        }
        for line in marks.lines
        if all(map(_finite, line.points))
    ]
    texts = [
        {
            "timestamp": stamp,
            "position": _point(words.uv),
            "text": words.text,
            "font_size": FONT_PX,
            "text_color": _color(words.color),
            "background_color": _color(_SHADE),
            "metadata": [],
        }
        for words in marks.words
        if _finite(words.uv)
    ]
    drawn = {"circles": circles, "points": points, "texts": texts}
    return {"timestamp": stamp, **drawn, "metadata": []}


def seen_marks(seen: Mapping[str, Any]) -> Marks:
    """Marks for what was seen in a frame, and what the tracker made of it.

    Parameters
    ----------
    seen : dict
        As it is logged: `sightings` with `uv`, `covariance`; `tracks` with `names`, `uv`, `uv_dot`, `confirmed`.

    Returns
    -------
    marks : Marks
        A circle of three deviations around each sighting; name and way of the next half second of each track.
    """
    sightings, tracks = seen["sightings"], seen["tracks"]
    dots = []
    for (u, v), covariance in zip(sightings["uv"], sightings["covariance"], strict=True):
        variance = 0.5 * (covariance[0][0] + covariance[1][1])
        dots.append(Dot((u, v), max(3.0 * variance**0.5, LEAST_RADIUS_PX), YELLOW))
    lines, words = [], []
    rows = zip(tracks["names"], tracks["uv"], tracks["uv_dot"], tracks["confirmed"], strict=True)
    for name, (u, v), (u_dot, v_dot), confirmed in rows:
        if confirmed:
            lines.append(Line(((u, v), (u + AHEAD_S * u_dot, v + AHEAD_S * v_dot)), BLUE))
            words.append(Words((u + 8.0, v - 8.0), name, BLUE))
    return Marks(tuple(dots), tuple(lines), tuple(words))


def pose_in_frame(ns: int, x_m: float, y_m: float, heading_rad: float) -> Message:
    """``foxglove.PoseInFrame``, of something that stands on the ground.

    Parameters
    ----------
    ns : int [ns]
        Wall clock.
    x_m, y_m : float [m]
        Where it is.
    heading_rad : float [rad]
        Where it looks, counter-clockwise from x.

    Returns
    -------
    message : dict
        For JSON.
    """
    turn = {"x": 0.0, "y": 0.0, "z": sin(heading_rad / 2), "w": cos(heading_rad / 2)}
    place = {"x": float(x_m), "y": float(y_m), "z": 0.0}
    pose = {"position": place, "orientation": turn}
    return {"timestamp": _time(ns), "frame_id": GROUND, "pose": pose}


def log_message(ns: int, level: Level, line: str, name: str) -> Message:
    """``foxglove.Log``.

    Parameters
    ----------
    ns : int [ns]
        Wall clock.
    level : {"info", "warning", "error"}
        How bad it is.
    line : str
        What happened.
    name : str
        Whom it is about.

    Returns
    -------
    message : dict
        For JSON.
    """
    return {
        "timestamp": _time(ns),
        "level": _LEVELS[level],
        "message": line,
        "name": name,
        "file": "",
        "line": 0,
    }


def camera_calibration(ns: int, document: Mapping[str, Any]) -> Message | None:
    """``foxglove.CameraCalibration``, for a camera with square pixels that looks along its image's middle.

    Parameters
    ----------
    ns : int [ns]
        Wall clock.
    document : dict
        The object of a calibration.json.

    Returns
    -------
    message : dict or None
        For JSON. None where g does not tell the focal length, the size of the image is not known, or the lens bends
        lines: Foxglove knows no division model.
    """
    size = document.get("image_size_px")
    if size is None or document["distortion"]["model"] != "none":
        return None
    width, height = size
    u, v = 0.5 * (width - 1), 0.5 * (height - 1)
    try:
        focal = LimitedHomography(np.array(document["g"])).camera((u, v)).focal_length_px
    except (InputError, UndeterminedCameraError):
        return None
    return {
        "timestamp": _time(ns),
        "frame_id": CAMERA,
        "width": int(width),
        "height": int(height),
        "distortion_model": "plumb_bob",
        "D": [0.0] * 5,
        "K": [focal, 0.0, u, 0.0, focal, v, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [focal, 0.0, u, 0.0, 0.0, focal, v, 0.0, 0.0, 0.0, 1.0, 0.0],
    }


def _time(ns: int) -> dict[str, int]:
    sec, nsec = divmod(max(ns, 0), 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def _point(uv: Uv) -> dict[str, float]:
    return {"x": float(uv[0]) + 0.5, "y": float(uv[1]) + 0.5}


def _color(color: Color) -> dict[str, float]:
    return dict(zip("rgba", color, strict=True))


def _finite(uv: Uv) -> bool:
    return isfinite(uv[0]) and isfinite(uv[1])

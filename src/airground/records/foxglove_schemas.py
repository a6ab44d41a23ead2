"""Shapes of the messages of Foxglove's that we write, as JSON Schema. Names and nesting are theirs."""

from __future__ import annotations

from typing import Any

__all__ = ["FOXGLOVE"]

Shape = dict[str, Any]

_NUMBER: Shape = {"type": "number"}
_TEXT: Shape = {"type": "string"}
_COUNT: Shape = {"type": "integer", "minimum": 0}


def _object(title: str, **properties: Shape) -> Shape:
    return {
        "title": title,
        "type": "object",
        "properties": properties,
        "required": list(properties),
    }


def _list(items: Shape, count: int | None = None) -> Shape:
    length = {} if count is None else {"minItems": count, "maxItems": count}
    return {"type": "array", "items": items, **length}


def _choice(title: str, *names: str) -> Shape:
    """Whole numbers from 0 on, each with its name."""
    return {"title": title, "oneOf": [{"title": n, "const": k} for k, n in enumerate(names)]}


_TIME = _object("time", sec=_COUNT, nsec={**_COUNT, "maximum": 999_999_999})
_COLOR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POINT = _object("foxglove.Point2", x=_NUMBER, y=_NUMBER)
_PAIRS = _list(_object("foxglove.KeyValuePair", key=_TEXT, value=_TEXT))
_VECTOR = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POINTS_TYPE = _choice(
    "foxglove.PointsAnnotationType", "UNKNOWN", "POINTS", "LINE_LOOP", "LINE_STRIP", "LINE_LIST"
)
_LEVEL = _choice(
    "foxglove.LogLevel", "UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"
)  # fmt: skip
_CIRCLE = _object(
    "foxglove.CircleAnnotation",
    timestamp=_TIME,
    position=_POINT,
    diameter=_NUMBER,
    thickness=_NUMBER,
    fill_color=_COLOR,
    outline_color=_COLOR,
    metadata=_PAIRS,
)
_POINTS = _object(
    "foxglove.PointsAnnotation",
    timestamp=_TIME,
    type=_POINTS_TYPE,
    points=_list(_POINT),
    outline_color=_COLOR,
    outline_colors=_list(_COLOR),
    fill_color=_COLOR,
    thickness=_NUMBER,
    metadata=_PAIRS,
)
_WORDS = _object(
    "foxglove.TextAnnotation",
    timestamp=_TIME,
    position=_POINT,
    text=_TEXT,
    font_size=_NUMBER,
    text_color=_COLOR,
    background_color=_COLOR,
    metadata=_PAIRS,
)

FOXGLOVE: dict[str, Shape] = {
    shape["title"]: shape
    for shape in (
        _object(
            "foxglove.CompressedImage",
            timestamp=_TIME,
            frame_id=_TEXT,
            data={**_TEXT, "contentEncoding": "base64"},
            format=_TEXT,
        ),
        _object(
            "foxglove.ImageAnnotations",
            timestamp=_TIME,
            circles=_list(_CIRCLE),
            points=_list(_POINTS),
            texts=_list(_WORDS),
            metadata=_PAIRS,
        ),
        _object(
            "foxglove.CameraCalibration",
            timestamp=_TIME,
            frame_id=_TEXT,
            width=_COUNT,
            height=_COUNT,
            distortion_model=_TEXT,
            D=_list(_NUMBER),
            K=_list(_NUMBER, 9),
            R=_list(_NUMBER, 9),
            P=_list(_NUMBER, 12),
        ),
        _object(
            "foxglove.PoseInFrame",
            timestamp=_TIME,
            frame_id=_TEXT,
            pose=_object("foxglove.Pose", position=_VECTOR, orientation=_QUATERNION),
        ),
        _object(
            "foxglove.Log",
            timestamp=_TIME,
            level=_LEVEL,
            message=_TEXT,
            name=_TEXT,
            file=_TEXT,
            line=_COUNT,
        ),
    )
}
"""Schemas by their names."""

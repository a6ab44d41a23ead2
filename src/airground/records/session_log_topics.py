"""What lies where in the log of a session, and what shape it has."""

from __future__ import annotations

from typing import Any

from airground.records.foxglove_schemas import FOXGLOVE

__all__ = ["FORMAT", "SCHEMAS", "TOPICS"]

FORMAT = "airground.session/1"

HEADER = "/session/header"
STEPS = "/session/steps"
EVENTS = "/session/events"
CALIBRATION = "/camera/calibration"
CAMERA_INFO = "/camera/info"
IMAGE = "/camera/image"
ANNOTATIONS = "/camera/annotations"
POSE = "/robots/{}/pose"

_NUMBER = {"type": "number"}

SCHEMAS: dict[str, dict[str, Any]] = {
    **FOXGLOVE,
    "airground.Session": {
        "title": "airground.Session",
        "type": "object",
        "properties": {
            "format": {"type": "string", "description": "airground.session/1"},
            "version": {"type": "string", "description": "of airground, that wrote it"},
            "start_unix_ns": {"type": "integer", "description": "wall clock at session time 0"},
        },
        "required": ["format", "version", "start_unix_ns"],
    },
    "airground.Step": {
        "title": "airground.Step",
        "type": "object",
        "properties": {
            "t": {**_NUMBER, "description": "session clock [s]"},
            "number": {"type": "integer", "description": "of the step"},
            "inputs": {
                "type": "array",
                "items": {"type": "object"},
                "description": "all that the session was told, in order",
            },
            "outputs": {"type": "object", "description": "what it decided"},
        },
        "required": ["t", "number", "inputs", "outputs"],
    },
    "airground.Calibration": {
        "title": "airground.Calibration",
        "type": "object",
        "properties": {
            "t": {**_NUMBER, "description": "session clock [s]"},
            "calibration": {"type": "object", "description": "as in calibration.json"},
        },
        "required": ["t", "calibration"],
    },
}
"""Shapes of all messages, by their names."""

TOPICS: dict[str, str] = {
    HEADER: "airground.Session",
    STEPS: "airground.Step",
    EVENTS: "foxglove.Log",
    CALIBRATION: "airground.Calibration",
    CAMERA_INFO: "foxglove.CameraCalibration",
    IMAGE: "foxglove.CompressedImage",
    ANNOTATIONS: "foxglove.ImageAnnotations",
}
"""Schema of each topic; `POSE` comes on top, one for each robot."""

POSE_SCHEMA = "foxglove.PoseInFrame"

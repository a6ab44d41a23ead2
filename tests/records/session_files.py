"""What tests of the session's log share: a drive as a session logs it, and a check of JSON against its schema."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airground.calibration import Motion, Tracks

HEADER = {"site": "yard", "robots": [{"name": "robot", "track": "3"}], "seed": 7}


def seen(t: float, uv: Any, sigma: float = 0.3, **tracks: Any) -> dict[str, Any]:
    """A frame with one mark, as it is logged; keywords replace columns of its one track."""
    variance = sigma**2
    columns = {
        "names": ["3"],
        "labels": ["3"],
        "uv": [[float(uv[0]), float(uv[1])]],
        "uv_dot": [[10.0, -4.0]],
        "confirmed": [True],
        "sighting": [0],
        "merged_with": [[]],
        "swap_probability": [0.0],
    }
    return {
        "kind": "seen",
        "t": t,
        "arrived_s": t + 0.05,
        "index": 1,
        "size_px": [1280, 720],
        "sightings": {
            "t": t,
            "uv": [[float(uv[0]), float(uv[1])]],
            "covariance": [[[variance, 0.0], [0.0, variance]]],
            "labels": ["3"],
            "angle": [float("nan")],
        },
        "tracks": columns | tracks,
    }


def heard(t: float, heading: float | None, speed: float | None) -> dict[str, Any]:
    """A reading, as it is logged."""
    reading = {"t": t, "heading": heading, "speed": speed, "turn_rate": None}
    return {"kind": "heard", "robot": "robot", "readings": [reading]}


def inputs(tracks: Tracks, motion: Motion) -> list[tuple[float, dict[str, Any]]]:
    """Sightings and readings in the order in which they arrive."""
    assert motion.heading is not None
    assert motion.speed is not None
    frames = [(t + 0.05, seen(t, uv)) for t, uv in zip(tracks.t.tolist(), tracks.uv, strict=True)]
    rows = zip(motion.t.tolist(), motion.heading.tolist(), motion.speed.tolist(), strict=True)
    readings = [(t, heard(t, heading, speed)) for t, heading, speed in rows]
    return sorted([*frames, *readings], key=lambda one: one[0])


def misfits(value: Any, schema: dict[str, Any], where: str = "") -> list[str]:
    """Where a value does not have the shape of a schema: the few words of JSON Schema that we use."""
    kinds: dict[str, Any] = {
        "object": dict,
        "array": list,
        "string": str,
        "number": (int, float),
        "integer": int,
    }
    if "oneOf" in schema:
        return [] if any(value == one["const"] for one in schema["oneOf"]) else [where]
    if not isinstance(value, kinds[schema["type"]]) or isinstance(value, bool):
        return [f"{where}: {value!r} is no {schema['type']}"]
    found = []
    if schema["type"] == "object":
        properties = schema.get("properties", {})
        found += [
            f"{where}.{key} is missing" for key in schema.get("required", ()) if key not in value
        ]
        for key, one in value.items():
            if key in properties:
                found += misfits(one, properties[key], f"{where}.{key}")
            elif schema.get("title", "").startswith(("foxglove", "time")):
                found.append(f"{where}.{key} is not known")
    if schema["type"] == "array":
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            found.append(f"{where} has {len(value)} items")
        items = schema["items"]
        if "properties" in items or items["type"] != "object":
            found += [
                m for k, one in enumerate(value) for m in misfits(one, items, f"{where}[{k}]")
            ]
    if "minimum" in schema and value < schema["minimum"]:
        found.append(f"{where}: {value} is too small")
    return found

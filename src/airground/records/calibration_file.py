"""``calibration.json``: written whole or not at all, read back bit for bit.

Python writes a float with the fewest digits that read back to it, so JSON loses nothing. NaN and infinity have no place
in JSON, nor in a calibration.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from airground._version import __version__
from airground.calibration.calibration import Calibration, Fit, Provenance, TargetFit
from airground.calibration.observability import Observability
from airground.errors import FileError, InputError
from airground.geometry.lens import DivisionLens
from airground.geometry.limited import LimitedHomography
from airground.records.access import file_error
from airground.records.atomic import write_text
from airground.records.json_reader import JsonReader

if TYPE_CHECKING:
    import os

    from airground.geometry.arrays import FloatArray

__all__ = [
    "FORMAT",
    "calibration_document",
    "load_calibration",
    "read_calibration",
    "save_calibration",
]

FORMAT = "airground.calibration/1"
LENSES = ("none", "division")  # models of distortion that can be read
MAX_BYTES = 10_000_000  # a calibration has a few kB; anything much larger is something else


def calibration_document(calibration: Calibration) -> dict[str, Any]:
    """Give the JSON object of a calibration.

    Parameters
    ----------
    calibration : Calibration
        What to write.

    Returns
    -------
    document : dict
        As docs/files.md describes it.
    """
    c = calibration
    provenance = c.provenance
    return {
        "format": FORMAT,
        "g": c.model.g.tolist(),
        "covariance": c.covariance.tolist(),
        "image_size_px": None if c.image_size_px is None else list(c.image_size_px),
        "origin_px": c.origin_px.tolist(),
        "image_from_ground": c.model.image_from_ground(c.origin_px).tolist(),
        "time_offset_s": c.time_offset_s,
        "time_offset_sigma_s": c.time_offset_sigma_s,
        "distortion": _distortion(c),
        "targets": {name: _target_document(target) for name, target in c.targets.items()},
        "fit": {
            **asdict(c.fit),
            "nuisances": list(c.fit.nuisances),
            "region_px": None if c.fit.region_px is None else list(c.fit.region_px),
        },
        "observability": {
            **asdict(c.observability),
            "singular_values": list(c.observability.singular_values),
        },
        "provenance": {
            "version": provenance.version or __version__,
            "command": provenance.command,
            "inputs": [{"name": name, "sha256": digest} for name, digest in provenance.inputs],
            "created": provenance.created,
        },
    }


def _distortion(c: Calibration) -> dict[str, Any]:
    if c.lens is None:
        return {"model": "none"}
    lens = {"model": "division", "k1": c.lens.k1, "center_px": c.lens.center.tolist()}
    return lens if c.k1_covariance is None else {**lens, "k1_covariance": c.k1_covariance.tolist()}


def _target_document(target: TargetFit) -> dict[str, Any]:
    """Fields under their names; pairs as lists, as they come back from JSON."""
    fields = asdict(target)
    return {key: list(v) if isinstance(v, tuple) else v for key, v in fields.items()}


def save_calibration(path: str | os.PathLike[str], calibration: Calibration) -> None:
    """Write a calibration, whole or not at all.

    Parameters
    ----------
    path : path
        Where to.
    calibration : Calibration
        What to write; the time of creation is filled in where it is missing.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    if not calibration.provenance.created:
        now = datetime.now(UTC).isoformat(timespec="seconds")
        calibration = replace(calibration, provenance=replace(calibration.provenance, created=now))
    write_text(
        path, json.dumps(calibration_document(calibration), indent=1, allow_nan=False) + "\n"
    )


def load_calibration(path: str | os.PathLike[str]) -> Calibration:
    """Read a calibration.

    Parameters
    ----------
    path : path
        Where from.

    Returns
    -------
    calibration : Calibration
        The same numbers that were saved, bit for bit.

    Raises
    ------
    FileError
        If the file is not a calibration of a known version.
    """
    name = str(path)
    return read_calibration(_json(name), name)


def read_calibration(given: object, name: str) -> Calibration:
    """Read a calibration from what JSON gave.

    Parameters
    ----------
    given : object
        Of `calibration_document`.
    name : str
        Of the file that it stands in, for errors.

    Returns
    -------
    calibration : Calibration
        The same numbers.

    Raises
    ------
    FileError
        If it is not a calibration of a known version.
    """
    document = JsonReader(name, given)
    declared = document.text("format")
    family, _, version = declared.partition("/")
    if family != "airground.calibration":
        raise FileError(name, f'key format: found "{declared}", expected "{FORMAT}"')
    if version.split(".")[0] != "1":
        raise FileError(
            name, f"key format: version {version} is not known here, expected 1; update airground"
        )
    lens, k1_covariance = _lens(document.part("distortion"))
    fit, seen = document.part("fit"), document.part("observability")
    try:
        return Calibration(
            model=LimitedHomography(document.get("g")),
            covariance=document.get("covariance"),
            origin_px=document.get("origin_px"),
            image_size_px=_size(document),
            time_offset_s=document.number("time_offset_s"),
            time_offset_sigma_s=document.number("time_offset_sigma_s"),
            targets={target: _target(entry) for target, entry in document.part("targets").parts()},
            fit=Fit(
                method=fit.choice("method", ("linear", "trajectory")),
                rms_px=fit.number("rms_px"),
                sightings=int(fit.number("sightings")),
                inlier_fraction=fit.number("inlier_fraction"),
                window_s=fit.number_or_none("window_s"),
                region_px=fit.numbers("region_px", 4) if fit.has("region_px") else None,
                nuisances=fit.texts("nuisances") if fit.has("nuisances") else (),
                sighting_sigma_px=fit.number_or_none("sighting_sigma_px"),
                speed_sigma_sqrt_s=fit.number_or_none("speed_sigma_sqrt_s"),
                heading_sigma_rad_sqrt_s=fit.number_or_none("heading_sigma_rad_sqrt_s"),
                sighting_correlation=fit.number_or_none("sighting_correlation"),
            ),
            observability=Observability(
                verdict=seen.choice("verdict", ("ok", "weak")),
                relative_sigma=seen.number("relative_sigma"),
                singular_values=seen.numbers("singular_values"),
                advice=seen.text("advice"),
            ),
            provenance=_provenance(document),
            lens=lens,
            k1_covariance=k1_covariance,
        )
    except FileError:
        raise
    except InputError as error:  # a value of the right type that makes no sense
        raise FileError(name, str(error)) from error


def _json(name: str) -> object:
    try:
        with Path(name).open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise file_error(name, error, "read") from error
    if len(data) > MAX_BYTES:
        raise FileError(name, f"is longer than {MAX_BYTES} bytes; expected a calibration in JSON")
    try:
        return json.loads(data.decode("utf-8-sig"), parse_constant=_refuse)
    except UnicodeDecodeError as error:
        raise FileError(name, "is not a text file; expected a calibration in JSON") from error
    except json.JSONDecodeError as error:
        raise FileError(
            name, f"is not JSON ({error.msg}); expected a calibration, whole", line=error.lineno
        ) from error
    except (ValueError, RecursionError) as error:
        raise FileError(name, f"is not a calibration: {error}") from error


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not a number that a calibration may hold")


def _lens(part: JsonReader) -> tuple[DivisionLens | None, FloatArray | None]:
    model = part.text("model")
    if model not in LENSES:
        known = " or ".join(f'"{name}"' for name in LENSES)
        raise part.wrong("model", f"{known} (no other is known here; update airground)", model)
    if model == "none":
        return None, None
    k1, center = part.number("k1"), part.numbers("center_px", 2)
    try:
        lens = DivisionLens(k1, np.array(center))
    except InputError as error:
        raise FileError(part.name, f"key distortion: {error}") from error
    if not part.has("k1_covariance"):
        return lens, None
    return lens, np.array(part.numbers("k1_covariance", 7), dtype=np.float64)


def _target(entry: JsonReader) -> TargetFit:
    return TargetFit(
        sightings=entry.count_or_none("sightings"),
        heading_bias_rad=entry.number_or_none("heading_bias_rad"),
        heading_bias_sigma_rad=entry.sigma_or_none("heading_bias_sigma_rad"),
        speed_scale=entry.number_or_none("speed_scale"),
        speed_scale_sigma=entry.sigma_or_none("speed_scale_sigma"),
        lever_arm_m=entry.pair_or_none("lever_arm_m"),
        lever_arm_sigma_m=entry.pair_or_none("lever_arm_sigma_m", least=0.0),
        heading_drift_rad_per_sqrt_s=entry.sigma_or_none("heading_drift_rad_per_sqrt_s"),
    )


def _provenance(document: JsonReader) -> Provenance:
    """Where the file came from, as far as whoever wrote it said so."""
    if not document.has("provenance"):
        return Provenance()
    part = document.part("provenance")
    inputs = part.items("inputs") if part.has("inputs") else []
    return Provenance(
        version=part.text("version") if part.has("version") else "",
        command=part.text("command") if part.has("command") else "",
        inputs=tuple((i.text("name"), i.text("sha256")) for i in inputs),
        created=part.text("created") if part.has("created") else "",
    )


def _size(document: JsonReader) -> tuple[int, int] | None:
    if document.get("image_size_px") is None:
        return None
    width, height = document.numbers("image_size_px", 2)
    return int(width), int(height)

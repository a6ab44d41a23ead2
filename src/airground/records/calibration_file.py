"""``calibration.json``: written whole or not at all, read back bit for bit.

Python writes a float with the fewest digits that read back to it, so JSON loses nothing. NaN and infinity have no place
in JSON, nor in a calibration.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from airground._version import __version__
from airground.calibration.calibration import Calibration, Fit, Provenance, TargetFit
from airground.calibration.observability import Observability
from airground.errors import FileError, InputError
from airground.geometry.limited import LimitedHomography
from airground.records.access import file_error
from airground.records.atomic import write_text

if TYPE_CHECKING:
    import os

__all__ = ["FORMAT", "calibration_document", "load_calibration", "save_calibration"]

FORMAT = "airground.calibration/1"
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
        "distortion": {"model": "none"},
        "targets": {name: asdict(target) for name, target in c.targets.items()},
        "fit": {
            **asdict(c.fit),
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
    document = _Reader(name, _json(name), "")
    declared = document.text("format")
    family, _, version = declared.partition("/")
    if family != "airground.calibration":
        raise FileError(name, f'key format: found "{declared}", expected "{FORMAT}"')
    if version.split(".")[0] != "1":
        raise FileError(
            name, f"key format: version {version} is not known here, expected 1; update airground"
        )
    lens = document.part("distortion").text("model")
    if lens != "none":
        raise FileError(
            name,
            f'key distortion.model: found "{lens}", and this version knows "none" only; update airground',
        )
    fit, seen = document.part("fit"), document.part("observability")
    try:
        return Calibration(
            model=LimitedHomography(document.get("g")),
            covariance=document.get("covariance"),
            origin_px=document.get("origin_px"),
            image_size_px=_size(document),
            time_offset_s=document.number("time_offset_s"),
            time_offset_sigma_s=document.number("time_offset_sigma_s"),
            targets={
                target: TargetFit(
                    sightings=entry.count_or_none("sightings"),
                    heading_bias_rad=entry.number_or_none("heading_bias_rad"),
                )
                for target, entry in document.part("targets").parts()
            },
            fit=Fit(
                method=fit.choice("method", ("linear", "trajectory")),
                rms_px=fit.number("rms_px"),
                sightings=int(fit.number("sightings")),
                inlier_fraction=fit.number("inlier_fraction"),
                window_s=fit.number_or_none("window_s"),
                region_px=fit.numbers("region_px", 4) if fit.has("region_px") else None,
            ),
            observability=Observability(
                verdict=seen.choice("verdict", ("ok", "weak")),
                relative_sigma=seen.number("relative_sigma"),
                singular_values=seen.numbers("singular_values"),
                advice=seen.text("advice"),
            ),
            provenance=_provenance(document),
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


def _provenance(document: _Reader) -> Provenance:
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


def _size(document: _Reader) -> tuple[int, int] | None:
    if document.get("image_size_px") is None:
        return None
    width, height = document.numbers("image_size_px", 2)
    return int(width), int(height)


class _Reader:
    """A JSON object whose entries are asked for by name and type; a mistake is named by its path."""

    def __init__(self, name: str, value: object, where: str) -> None:
        self.name = name
        self.where = where
        if not isinstance(value, dict):
            key = f"key {where.removesuffix('.')}: " if where else ""
            raise FileError(name, f"{key}expected a JSON object, found {_kind(value)}")
        self.value: dict[str, Any] = value

    def wrong(self, key: str, expected: str, found: object) -> FileError:
        """Error for an entry."""
        return FileError(
            self.name, f"key {self.where}{key}: expected {expected}, found {_kind(found)}"
        )

    def get(self, key: str) -> Any:
        """Entry as it is."""
        if key not in self.value:
            raise FileError(self.name, f"key {self.where}{key} is missing")
        return self.value[key]

    def has(self, key: str) -> bool:
        """Whether an entry is there and not null."""
        return self.value.get(key) is not None

    def text(self, key: str) -> str:
        """Entry that is a text."""
        value = self.get(key)
        if not isinstance(value, str):
            raise self.wrong(key, "a text", value)
        return value

    def number(self, key: str) -> float:
        """Entry that is a number."""
        value = self.get(key)
        if not _is_number(value):
            raise self.wrong(key, "a number", value)
        return float(value)

    def count_or_none(self, key: str) -> int | None:
        """Entry that is a whole number, if it is there."""
        return int(self.number(key)) if self.has(key) else None

    def number_or_none(self, key: str) -> float | None:
        """Entry that is a number, if it is there."""
        return self.number(key) if self.has(key) else None

    def numbers(self, key: str, count: int | None = None) -> Any:
        """Entry that is a list of so many numbers."""
        value = self.get(key)
        fine = isinstance(value, list) and count in {None, len(value)}
        if not fine or not all(map(_is_number, value)):
            wanted = "a list of numbers" if count is None else f"{count} numbers"
            raise self.wrong(key, wanted, value)
        return tuple(value)

    def choice(self, key: str, known: tuple[str, ...]) -> Any:
        """Entry that is one of some words."""
        value = self.text(key)
        if value not in known:
            raise self.wrong(key, " or ".join(known), value)
        return value

    def part(self, key: str) -> _Reader:
        """Entry that is an object."""
        return _Reader(self.name, self.get(key), f"{self.where}{key}.")

    def parts(self) -> list[tuple[str, _Reader]]:
        """All entries, which are objects."""
        return [(key, self.part(key)) for key in self.value]

    def items(self, key: str) -> list[_Reader]:
        """Entry that is a list of objects."""
        value = self.get(key)
        if not isinstance(value, list):
            raise self.wrong(key, "a list", value)
        return [_Reader(self.name, v, f"{self.where}{key}[{k}].") for k, v in enumerate(value)]


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)  # JSON has no infinity, but 1e999 reads as one
    except OverflowError:
        return False


def _kind(value: object) -> str:
    try:
        text = json.dumps(value)
    except RecursionError:
        return "brackets in brackets"
    return text if len(text) <= 40 else f"{text[:37]}..."

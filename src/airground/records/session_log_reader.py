"""Read the log of a session, as far as it goes."""

from __future__ import annotations

import base64
import binascii
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from airground.errors import FileError
from airground.records import session_log_topics as topics
from airground.records.cells import shown
from airground.records.session_log_chunks import ChunkScan
from airground.records.session_log_text import parse_json
from airground.records.session_log_topics import FORMAT

if TYPE_CHECKING:
    from collections.abc import Iterator

    from airground.records.access import StrPath
    from airground.records.session_log_chunks import RawMessage

__all__ = [
    "LoggedCalibration",
    "LoggedEvent",
    "LoggedImage",
    "LoggedStep",
    "SessionRecording",
    "read_session",
]

_LEVELS = {2: "info", 3: "warning", 4: "error"}


@dataclass(frozen=True, slots=True, eq=False)
class LoggedStep:
    """A step."""

    t: float
    """Session clock [s]."""

    number: int
    """Of the step."""

    inputs: list[dict[str, Any]]
    """What the session was told, in order."""

    outputs: dict[str, Any]
    """What it decided."""


@dataclass(frozen=True, slots=True, eq=False)
class LoggedImage:
    """An image."""

    t: float
    """When it was taken, by the session clock, to the nanosecond [s]."""

    jpeg: bytes
    """As it was handed over."""


@dataclass(frozen=True, slots=True, eq=False)
class LoggedCalibration:
    """A calibration that was in force from then on."""

    t: float
    """Session clock [s]."""

    document: dict[str, Any]
    """The object of a calibration.json."""


@dataclass(frozen=True, slots=True)
class LoggedEvent:
    """Something that happened."""

    t: float
    """Session clock, to the nanosecond [s]."""

    level: str
    """info, warning or error."""

    line: str
    """What."""

    name: str
    """Robot that it is about; `session` for none."""


class SessionRecording:
    """A log that is read. Each of its iterators goes through the file anew, with a chunk in memory at a time.

    Parameters
    ----------
    path : path-like
        The file.
    """

    def __init__(self, path: StrPath) -> None:
        self._scan = ChunkScan(path)
        self.path = self._scan.path
        self.header = self._header()
        self.start_unix_ns = _whole(self.header.get("start_unix_ns"))

    @property
    def cut(self) -> str:
        """Where the file is cut off or damaged, in a few words, once something was read to its end; else empty."""
        return self._scan.cut

    @property
    def truncated(self) -> bool:
        """Whether the file was not ended properly; reads all of it where that is not known yet."""
        if not self._scan.cut:
            for _ in self._scan:
                pass
        return bool(self._scan.cut)

    def steps(self) -> Iterator[LoggedStep]:
        """Go through the steps.

        Yields
        ------
        step : LoggedStep
            In the order of writing.
        """
        for _, step in self._documents(topics.STEPS):
            yield LoggedStep(step["t"], step["number"], step["inputs"], step["outputs"])

    def images(self) -> Iterator[LoggedImage]:
        """Go through the images.

        Yields
        ------
        image : LoggedImage
            In the order of writing.
        """
        for raw, image in self._documents(topics.IMAGE):
            try:
                jpeg = base64.b64decode(image["data"], validate=True)
            except (binascii.Error, TypeError) as error:
                raise FileError(self.path, f"an image is not in base64: {error}") from error
            yield LoggedImage(self._t(raw), jpeg)

    def calibrations(self) -> Iterator[LoggedCalibration]:
        """Go through the calibrations.

        Yields
        ------
        calibration : LoggedCalibration
            In the order of writing.
        """
        for _, one in self._documents(topics.CALIBRATION):
            yield LoggedCalibration(one["t"], one["calibration"])

    def events(self) -> Iterator[LoggedEvent]:
        """Go through the events.

        Yields
        ------
        event : LoggedEvent
            In the order of writing.
        """
        for raw, one in self._documents(topics.EVENTS):
            level = _LEVELS.get(one["level"], "info")
            yield LoggedEvent(self._t(raw), level, one["message"], one["name"])

    def _documents(self, topic: str) -> Iterator[tuple[RawMessage, dict[str, Any]]]:
        for raw in self._scan:
            if raw.topic == topic:
                yield raw, self._parsed(raw)

    def _parsed(self, raw: RawMessage) -> dict[str, Any]:
        """A message, with the entries that its schema asks for."""
        try:
            document = parse_json(raw.data)
        except ValueError as error:
            raise FileError(self.path, f"a message of {raw.topic} is not JSON: {error}") from error
        wanted = topics.SCHEMAS[topics.TOPICS[raw.topic]]["required"]
        if not isinstance(document, dict) or any(key not in document for key in wanted):
            problem = f"a message of {raw.topic} must have {', '.join(wanted)}"
            raise FileError(self.path, problem)
        return document

    def _header(self) -> dict[str, Any]:
        for raw in self._scan:
            if raw.topic == topics.HEADER and raw.schema == "airground.Session":
                header = self._parsed(raw)
                _check_format(self.path, header["format"])
                return header
        if self._scan.cut:
            raise FileError(self.path, f"{self._scan.cut}, before anything was recorded")
        problem = "is an MCAP file, but not the log of a session: it has no /session/header"
        raise FileError(self.path, problem)

    def _t(self, raw: RawMessage) -> float:
        return (raw.ns - self.start_unix_ns) / 1e9


def read_session(path: StrPath) -> SessionRecording:
    """Open the log of a session, whole or cut off.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    recording : SessionRecording
        With its header read.

    Raises
    ------
    FileError
        If it cannot be read, is no log of a session, or was cut off before anything was recorded.
    """
    return SessionRecording(path)


def _check_format(path: str, declared: object) -> None:
    family, _, version = str(declared).partition("/")
    if family != "airground.session":
        raise FileError(path, f'format: found {shown(str(declared))}, expected "{FORMAT}"')
    if version.split(".")[0] != "1":
        raise FileError(
            path,
            f"format: version {shown(version)} is not known here, expected 1; update airground",
        )


def _whole(value: object) -> int:
    return value if isinstance(value, int) else 0

"""A recording through the same loop again: the same tracks and the same commands, or where they differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from airground.errors import FileError
from airground.records.calibration_file import read_calibration
from airground.records.session_log_reader import read_session
from airground.records.session_log_text import exact_json, parse_json
from airground.session.coding import read_input, read_options, tracks_document
from airground.session.inputs import Seen
from airground.session.recorder import outputs_document
from airground.session.session import Session
from airground.session.workers import done
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from airground.records.session_log_reader import SessionRecording
    from airground.session.tick import Job, SessionTick
    from airground.vision.sightings import Sightings
    from airground.vision.tracker import TrackerState

__all__ = ["Difference", "Replay", "Replayed", "replay"]


@dataclass(frozen=True, slots=True)
class Difference:
    """Where a replay first went another way."""

    step: int
    """Number of the step."""

    t: float
    """When [s]."""

    what: str
    """In one line."""


@dataclass(frozen=True, slots=True)
class Replayed:
    """How a replay went."""

    steps: int
    """That were replayed."""

    frames: int
    """That were tracked anew."""

    commands: int
    """That were decided anew, not counting rest."""

    duration_s: float
    """Of the recording [s]."""

    difference: Difference | None
    """The first; None where all was the same."""

    cut: str
    """Where the file is cut off, in a few words; empty where it is whole."""


class Replay:
    """Steps through a recording.

    Parameters
    ----------
    recording : SessionRecording
        What to replay.

    Raises
    ------
    FileError
        If its header cannot be read.
    InputError
        If its options are not those of this version.
    """

    def __init__(self, recording: SessionRecording) -> None:
        self.recording = recording
        header = recording.header
        try:
            given, options = header["calibration"], header["options"]
        except KeyError as error:
            raise FileError(recording.path, f"its header has no {error}") from error
        calibration = None if given is None else read_calibration(given, recording.path)
        self.session = Session(read_options(options), calibration)
        self._tracker = Tracker()
        self._segment: int | None = None
        self._jobs: dict[int, Job] = {}
        self.frames = 0
        """Tracked so far."""

    def steps(self) -> Iterator[tuple[SessionTick, Difference | None]]:
        """Replay step by step.

        Yields
        ------
        tick : SessionTick
            What was decided now.
        difference : Difference or None
            What is not as it was then.
        """
        for step in self.recording.steps():
            differs = ""
            inputs = []
            for document in step.inputs:
                one = read_input(document, self._track, self._result)
                inputs.append(one)
                if isinstance(one, Seen):
                    self.frames += 1
                    if _exact(tracks_document(one.tracks)) != document["tracks"]:
                        differs = differs or f"tracks of frame {one.index}"
            tick = self.session.step(step.t, inputs)
            self._jobs |= {job.number: job for job in tick.jobs}
            now = _exact(outputs_document(tick))
            for key, value in now.items():
                if value != step.outputs.get(key):
                    differs = differs or f"{key}: {value}, was {step.outputs.get(key)}"
            yield tick, Difference(step.number, step.t, differs) if differs else None

    def _track(self, sightings: Sightings, segment: int) -> TrackerState:
        if self._segment not in (None, segment):
            self._tracker.restart()
        self._segment = segment
        return self._tracker.update(sightings)

    def _result(self, number: int) -> Any:
        job = self._jobs.pop(number, None)
        if job is None:
            raise FileError(self.recording.path, f"job {number} ended but never began")
        return done(job)


def replay(path: str, *, each: Callable[[SessionTick], None] | None = None) -> Replayed:
    """Replay a whole recording.

    Parameters
    ----------
    path : str
        The file.
    each : callable, optional
        Told of every step.

    Returns
    -------
    replayed : Replayed
        With the first difference, if there is one.

    Raises
    ------
    FileError
        If it is no recording of a session.
    """
    recording = read_session(path)
    run = Replay(recording)
    steps = commands = 0
    first: Difference | None = None
    began = last = None
    for tick, difference in run.steps():
        steps += 1
        commands += sum(not command.at_rest for command in tick.commands.values())
        first = first or difference
        began, last = tick.t if began is None else began, tick.t
        if each is not None:
            each(tick)
    duration = 0.0 if began is None or last is None else last - began
    return Replayed(steps, run.frames, commands, duration, first, recording.cut)


def _exact(document: dict[str, Any]) -> dict[str, Any]:
    """As the recording would give it back."""
    read: dict[str, Any] = parse_json(exact_json(document))
    return read

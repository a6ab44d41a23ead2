"""The log of a session: exact, in order, never in the way, and readable for others."""

from __future__ import annotations

import errno
import math
import os
import subprocess
import sys
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from airground.errors import FileError, InputError
from airground.records import session_log, session_log_file
from airground.records.foxglove import Marks, seen_marks
from airground.records.session_log import SessionLog
from airground.records.session_log_reader import read_session
from airground.records.session_log_text import exact_json, parse_json
from airground.records.session_log_topics import SCHEMAS, TOPICS
from records.session_files import HEADER, heard, misfits, seen
from scenes import scene

START_NS = 1_700_000_000_123_456_789
SCENE = scene(tilt_deg=45)
G = SCENE.g.tolist()

documents = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


def same(a: Any, b: Any) -> bool:
    """Equal in type and value; -0.0 is not 0.0, and NaN is NaN."""
    if isinstance(a, float) and isinstance(b, float):
        return (math.isnan(a) and math.isnan(b)) or (
            a == b and math.copysign(1, a) == math.copysign(1, b)
        )
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    return type(a) is type(b) and bool(a == b)


@given(documents)
def test_a_document_reads_back_bit_for_bit(document: Any) -> None:
    text = exact_json(document)
    assert same(parse_json(text), document)
    strict: Any = parse_json(text.replace(b"$float", b"other"))  # plain JSON: no NaN in it
    assert exact_json(strict).count(b"NaN") == text.count(b"NaN")


def test_arrays_and_words_that_look_like_numbers() -> None:
    document = {
        "a": np.array([1 / 3, np.nan]),
        "b": np.int64(3),
        "c": ['"NaN', "-Infinity", -np.inf],
    }
    back = parse_json(exact_json(document))
    assert same(back, {"a": [1 / 3, math.nan], "b": 3, "c": ['"NaN', "-Infinity", -math.inf]})
    assert back == parse_json(exact_json(document))  # NaN beside NaN: a replay compares documents
    for wrong in ({"a": object()}, {"a": {1, 2}}, {(1, 2): 3}):
        with pytest.raises(InputError, match="cannot be written"):
            exact_json(wrong)


def write(path: Path, steps: int = 100) -> SessionLog:
    """A session of everything there is."""
    with SessionLog(path, HEADER, start_unix_ns=START_NS) as log:
        for k in range(steps):
            t = k / 50 + 1e-9 * k
            frame = seen(t, (100 + k / 3, 200.0))
            told = {"mode": "driving", "x": k / 7, "nan": math.nan}
            log.step(t, k, [frame, heard(t, k / 9, None)], told)
            if k % 2 == 0:
                log.image(t, b"\xff\xd8 not a real one \xff\xd9" + bytes([k]))
                log.annotations(t, seen_marks(frame))
                log.pose(t, "robot", 1.0, 2.0, math.pi / 2)
        calibration = {"g": G, "image_size_px": [1280, 720], "distortion": {"model": "none"}}
        log.calibration(1.0, calibration)
        log.calibration(1.5, calibration | {"image_size_px": None})
        log.event(1.25, "warning", "robot does not obey", "robot")
        log.event(1.5, "info", "calibrated")
    return log


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    log = write(path)
    assert (log.trouble, log.dropped) == ("", 0)
    found = read_session(path)
    assert found.header == {
        **HEADER,
        "format": "airground.session/1",
        "version": found.header["version"],
        "start_unix_ns": START_NS,
    }
    assert not found.truncated
    steps = list(found.steps())
    assert [step.number for step in steps] == list(range(100))
    assert [step.t for step in steps] == [k / 50 + 1e-9 * k for k in range(100)]
    last = steps[-1]
    assert same(last.inputs, [seen(last.t, (133, 200.0)), heard(last.t, 11.0, None)])
    assert same(last.outputs, {"mode": "driving", "x": 99 / 7, "nan": math.nan})
    images = list(found.images())
    assert [image.jpeg[-1] for image in images] == list(range(0, 100, 2))
    assert images[7].t == pytest.approx(14 / 50 + 14e-9, abs=1e-9)
    calibrations = list(found.calibrations())
    assert [(one.t, one.document["g"]) for one in calibrations] == [(1.0, G), (1.5, G)]
    events = [(one.level, one.line, one.name) for one in found.events()]
    assert events == [
        ("warning", "robot does not obey", "robot"),
        ("info", "calibrated", "session"),
    ]
    assert found.cut == ""


def test_the_official_reader_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    write(path)
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        names = {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()}
        assert names == {**TOPICS, "/robots/robot/pose": "foxglove.PoseInFrame"}
        assert {c.message_encoding for c in summary.channels.values()} == {"json"}
        assert {s.encoding for s in summary.schemas.values()} == {"jsonschema"}
        counts = {
            summary.channels[k].topic: count
            for k, count in summary.statistics.channel_message_counts.items()
        }
        assert counts["/session/steps"] == 100
        assert counts["/camera/image"] == counts["/camera/annotations"] == 50
        assert (counts["/camera/calibration"], counts["/camera/info"]) == (2, 1)
        assert summary.statistics.message_count == sum(counts.values())
        assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 1
        after = list(reader.iter_messages(topics="/session/steps", starting_at=START_NS + 10**9))
        assert len(after) == 50  # steps 50 to 99, found by time
        wrong = []
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            shape = SCHEMAS[schema.name]
            assert parse_json(schema.data) == shape
            wrong += misfits(parse_json(message.data), shape, channel.topic)
        assert wrong == []


def test_foxglove_is_told_in_its_own_pixels_and_words(tmp_path: Path) -> None:
    """Names by hand, from Foxglove's documentation: not from the code that writes them."""
    path = tmp_path / "s.mcap"
    write(path, steps=1)
    by_topic = {}
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            by_topic[channel.topic] = parse_json(message.data)
    image = by_topic["/camera/image"]
    assert set(image) == {"timestamp", "frame_id", "data", "format"}
    assert image["timestamp"] == {"sec": 1_700_000_000, "nsec": 123_456_789}
    assert image["format"] == "jpeg"
    marks = by_topic["/camera/annotations"]
    assert set(marks) == {"timestamp", "circles", "points", "texts", "metadata"}
    (circle,), (line,), (words,) = marks["circles"], marks["points"], marks["texts"]
    assert set(circle) == {
        "timestamp",
        "position",
        "diameter",
        "thickness",
        "fill_color",
        "outline_color",
        "metadata",
    }
    assert circle["position"] == {"x": 100.5, "y": 200.5}  # its pixels begin at a corner
    assert set(line) == {
        "timestamp",
        "type",
        "points",
        "outline_color",
        "outline_colors",
        "fill_color",
        "thickness",
        "metadata",
    }
    assert line["type"] == 3  # LINE_STRIP
    assert set(words) == {
        "timestamp",
        "position",
        "text",
        "font_size",
        "text_color",
        "background_color",
        "metadata",
    }
    assert words["text"] == "3"
    pose = by_topic["/robots/robot/pose"]["pose"]
    assert pose["position"] == {"x": 1.0, "y": 2.0, "z": 0.0}
    assert pose["orientation"]["z"] == pytest.approx(math.sqrt(0.5))
    event = by_topic["/session/events"]
    assert (event["level"], event["name"]) == (2, "session")
    camera = by_topic["/camera/info"]
    assert set(camera) == {
        "timestamp",
        "frame_id",
        "width",
        "height",
        "distortion_model",
        "D",
        "K",
        "R",
        "P",
    }
    assert (camera["K"][2], camera["K"][5]) == SCENE.principal_point  # counted as OpenCV does
    assert camera["K"][0] == camera["K"][4] == pytest.approx(SCENE.focal_length)
    assert camera["P"][:3] == camera["K"][:3]


def test_marks_that_are_not_finite_are_left_out(tmp_path: Path) -> None:
    frame = seen(0.0, (math.nan, 2.0))
    path = tmp_path / "s.mcap"
    with SessionLog(path, {}) as log:
        log.annotations(0.0, seen_marks(frame))
        log.annotations(0.0, Marks())
    with path.open("rb") as stream:
        messages = [m.data for _, c, m in make_reader(stream).iter_messages() if "anno" in c.topic]
    drawn = [parse_json(one) for one in messages]
    assert [[m["circles"], m["points"], m["texts"]] for m in drawn] == [[[], [], []]] * 2


def test_a_file_that_is_there_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    path.write_bytes(b"mine")
    with pytest.raises(FileError, match="is there already; choose another name"):
        SessionLog(path, {})
    assert path.read_bytes() == b"mine"
    with pytest.raises(FileError, match="the folder .* does not exist"):
        SessionLog(tmp_path / "none" / "s.mcap", {})
    with pytest.raises(InputError, match="cannot be written"):
        SessionLog(tmp_path / "t.mcap", {"a": object()})
    assert not (tmp_path / "t.mcap").exists()


def test_closed_twice_and_written_after(tmp_path: Path) -> None:
    log = SessionLog(tmp_path / "s.mcap", {})
    log.close()
    log.close()
    log.step(0.0, 0, [], {})
    assert list(read_session(log.path).steps()) == []


class Slow(session_log_file.SessionFile):
    """A disk that does not answer until it is let go."""

    go = Event()

    def flush(self) -> None:
        if self._channels and self._counts:  # not the header
            assert self.go.wait(30)
        super().flush()


def test_a_slow_disk_costs_images_first_and_never_a_wait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_log, "SessionFile", Slow)
    Slow.go.clear()
    log = SessionLog(tmp_path / "s.mcap", HEADER, queue_bytes=1_000_000)
    for k in range(100):
        log.image(k / 50, bytes(10_000))
        log.step(k / 50, k, [{"pad": "x" * 2000}], {})
    assert log.trouble == ""
    assert 40 <= log.dropped < 100  # half of the room is theirs
    Slow.go.set()
    log.close()
    found = read_session(log.path)
    assert [step.number for step in found.steps()] == list(range(100))
    assert len(list(found.images())) == 100 - log.dropped
    assert not found.truncated


def test_a_disk_that_cannot_take_the_steps_ends_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_log, "SessionFile", Slow)
    Slow.go.clear()
    notes: list[str] = []
    log = SessionLog(tmp_path / "s.mcap", HEADER, queue_bytes=100_000, note=notes.append)
    for k in range(200):
        log.step(k / 50, k, [{"pad": "x" * 2000}], {})
    assert "the disk does not keep up; the recording ended at" in log.trouble
    assert "\n" not in log.trouble
    assert notes == [log.trouble]
    Slow.go.set()
    log.close()
    found = read_session(log.path)
    numbers = [step.number for step in found.steps()]
    assert numbers == list(range(len(numbers)))
    assert 20 < len(numbers) < 200
    assert [event.line for event in found.events()] == [log.trouble]


def test_a_full_disk_ends_the_recording_and_not_the_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk takes half of a chunk and then no more, not even the index."""
    room = 30_000
    real = os.write

    def write(fd: int, data: memoryview) -> int:
        nonlocal room
        if room == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = real(fd, data[:room])
        room -= taken
        return taken

    monkeypatch.setattr("airground.records.session_log_file.os.write", write)
    log = SessionLog(tmp_path / "s.mcap", HEADER)
    pad = np.random.default_rng(0).normal(size=400)
    for k in range(2000):
        log.step(k / 50, k, [{"pad": pad + k}], {})
        if log.trouble:
            break
    else:
        log.close()
    assert "the disk is full; the recording ended at" in log.trouble
    log.step(99.0, 99, [], {})  # the session goes on
    log.close()
    monkeypatch.undo()
    found = read_session(log.path)
    numbers = [step.number for step in found.steps()]
    assert numbers == list(range(len(numbers)))
    assert found.truncated
    assert Path(log.path).stat().st_size <= 30_000


LIMITED = """
import resource, sys, time
resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))
import random
from airground.records.session_log import SessionLog
log = SessionLog(sys.argv[1], {"site": "yard"})
number = 0
while not log.trouble and number < 20_000:
    log.step(number / 50, number, [{"pad": [random.random() for _ in range(300)]}], {})
    number += 1
    time.sleep(0.004)
log.step(number / 50, number, [], {})
log.close()
print(log.trouble)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_a_file_that_may_not_grow_is_ended_properly(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, str(path)],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert done.stderr == ""
    assert "the recording ended at" in done.stdout
    assert done.stdout.count("\n") == 1
    found = read_session(path)
    numbers = [step.number for step in found.steps()]
    assert numbers == list(range(len(numbers)))
    assert len(numbers) > 10
    assert path.stat().st_size <= 300_000

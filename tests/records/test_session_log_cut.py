"""A log that was cut off, by a kill, a power cut or anything else, is read up to there."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, Writer

from airground.errors import FileError
from airground.records.session_log import SessionLog
from airground.records.session_log_file import SessionFile
from airground.records.session_log_reader import read_session
from airground.records.session_log_text import exact_json
from records.session_files import HEADER

RECORDER = """
import os, sys, time
from airground.records.session_log import SessionLog
log = SessionLog(sys.argv[1], {"site": "yard"})
start, number, jpeg = time.monotonic(), 0, os.urandom(90_000)
pad = [k / 7 for k in range(350)]
while True:
    t = time.monotonic() - start
    log.step(t, number, [{"kind": "seen", "pad": pad}], {"number": number})
    if number % 2:
        log.image(t, jpeg)
    print(t, number, flush=True)
    number += 1
    time.sleep(max(start + number / 50 - time.monotonic(), 0))
"""


def test_kill_9_while_recording_at_full_rate(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    with subprocess.Popen(
        [sys.executable, "-c", RECORDER, str(path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if float(line.split()[0]) > 1.5:
                process.kill()
                break
        rest = process.stdout.read().split("\n")
    said = [line, *[one for one in rest if len(one.split()) == 2]][-1]
    killed_t, last_number = float(said.split()[0]), int(said.split()[1])
    found = read_session(path)
    steps = list(found.steps())
    assert [step.number for step in steps] == list(range(len(steps)))
    assert len(steps) <= last_number + 2
    assert steps[-1].t > killed_t - 1.0
    assert found.truncated
    images = list(found.images())
    assert len(images) > 10
    assert {len(image.jpeg) for image in images} == {90_000}


def test_a_step_is_in_the_systems_hands_soon(tmp_path: Path) -> None:
    """Without any more of them, and without an end."""
    path = tmp_path / "s.mcap"
    with SessionLog(path, HEADER) as log:
        for number in range(3):
            log.step(number / 50, number, [], {})
            end = time.monotonic() + 20
            while len(list(read_session(path).steps())) <= number:
                assert time.monotonic() < end
                time.sleep(0.02)


def small(path: Path) -> list[int]:
    """A small log of several chunks, and where each of them begins."""
    file = SessionFile(path)
    session = file.add_channel("/session/header", file.add_schema("airground.Session", b"{}"))
    steps = file.add_channel("/session/steps", file.add_schema("airground.Step", b"{}"))
    own = {"format": "airground.session/1", "version": "0", "start_unix_ns": 5}
    file.add(session, 5, exact_json(HEADER | own))
    file.flush()
    starts = [path.stat().st_size]
    for chunk in range(3):
        for k in range(2):
            number = 2 * chunk + k
            step = {"t": number / 50, "number": number, "inputs": [], "outputs": {"x": number / 3}}
            file.add(steps, number, exact_json(step))
        file.flush()
        starts.append(path.stat().st_size)
    file.finish()
    return starts


def test_every_length_is_read_up_to_the_cut(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    starts = small(path)
    size = path.stat().st_size
    with path.open("r+b") as stream:
        for length in range(size - 1, -1, -1):
            stream.truncate(length)
            try:
                found = read_session(path)
            except FileError as error:
                said = "before anything was recorded" if length else "is empty"
                assert said in str(error)  # noqa: PT017
                assert length < starts[0]
                continue
            numbers = [step.number for step in found.steps()]
            # All chunks that end before the cut; its message index, which follows it, may be gone.
            wholes = sum(length >= start for start in starts[1:])
            assert numbers == list(range(len(numbers)))
            assert 2 * wholes <= len(numbers) <= 2 * wholes + 2
            assert found.truncated
            assert "cut off" in found.cut


def test_a_damaged_byte_never_gives_a_wrong_step(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "s.mcap"
    small(path)
    whole = path.read_bytes()
    true = [(step.t, step.number, step.outputs) for step in read_session(path).steps()]
    digits = [k for k, byte in enumerate(whole) if byte in b"0123456789"]  # another digit fits too
    changes = [(k, 1) for k in digits]
    changes += [(int(k), int(rng.integers(1, 256))) for k in rng.integers(0, len(whole), 100)]
    for place, change in changes:
        broken = bytearray(whole)
        broken[place] ^= change
        path.write_bytes(broken)
        try:
            found = read_session(path)
            steps = [(step.t, step.number, step.outputs) for step in found.steps()]
        except FileError as error:
            assert "\n" not in str(error)  # noqa: PT017
            continue
        assert steps == [one for one in true if one in steps]  # some may lack, none is wrong


@pytest.mark.parametrize("tail", [bytes(5000), b"\xff" * 5000, b"\x06" + bytes(5000)])
def test_a_tail_that_the_disk_made_up(tmp_path: Path, tail: bytes) -> None:
    """After a power cut a file may have the length that it was to have, and zeros where data were to be."""
    path = tmp_path / "s.mcap"
    starts = small(path)
    path.write_bytes(path.read_bytes()[: starts[2]] + tail)
    found = read_session(path)
    assert [step.number for step in found.steps()] == [0, 1, 2, 3]
    assert found.truncated


@pytest.mark.parametrize("compression", CompressionType)
def test_files_of_the_official_writer_are_read(
    tmp_path: Path, compression: CompressionType
) -> None:
    """As tools leave them that mend or cut a recording."""
    path = tmp_path / "s.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=200, compression=compression)
        writer.start()
        schemas = [
            writer.register_schema(name, "jsonschema", b"{}")
            for name in ("airground.Session", "airground.Step")
        ]
        session = writer.register_channel("/session/header", "json", schemas[0])
        steps = writer.register_channel("/session/steps", "json", schemas[1])
        own = {"format": "airground.session/1.2", "version": "0", "start_unix_ns": 5}
        writer.add_message(session, 5, exact_json(own), 5)
        for k in range(10):
            step = {"t": k / 3, "number": k, "inputs": [], "outputs": {}}
            writer.add_message(steps, k, exact_json(step), k)
        writer.add_metadata("other", {"a": "b"})
        writer.add_attachment(0, 0, "a.txt", "text/plain", b"hello")
        writer.finish()  # type: ignore[no-untyped-call]
    found = read_session(path)
    assert [step.t for step in found.steps()] == [k / 3 for k in range(10)]
    assert not found.truncated


def foreign(path: Path, topic: str, schema: str, data: bytes) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        number = writer.register_schema(schema, "jsonschema", b"{}")
        writer.add_message(writer.register_channel(topic, "json", number), 5, data, 5)
        writer.finish()  # type: ignore[no-untyped-call]


OWN = '{"format": "airground.session/%s", "version": "0", "start_unix_ns": 5}'


@pytest.mark.parametrize(
    ("topic", "schema", "data", "match"),
    [
        ("/imu", "x.Imu", "{}", "is an MCAP file, but not the log of a session"),
        ("/session/header", "airground.Session", OWN % "2", "version '2' is not known here, expected 1"),
        ("/session/header", "airground.Session", OWN.replace("session", "x") % "1", "format: found"),
        ("/session/header", "airground.Session", "{}", "must have format, version, start_unix_ns"),
        ("/session/header", "airground.Session", "[", "a message of /session/header is not JSON"),
        ("/session/header", "airground.Session", "[" * 100_000, "nested too deeply|not JSON"),
    ],
)  # fmt: skip
def test_what_is_no_log_of_ours_is_refused(
    tmp_path: Path, topic: str, schema: str, data: str, match: str
) -> None:
    path = tmp_path / "s.mcap"
    foreign(path, topic, schema, data.encode())
    with pytest.raises(FileError, match=match) as caught:
        read_session(path)
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    with pytest.raises(FileError, match="there is no such file"):
        read_session(path)
    path.write_bytes(b"")
    with pytest.raises(FileError, match="is empty"):
        read_session(path)
    path.write_bytes(b"t_s,target,u_px,v_px\n")
    with pytest.raises(FileError, match="is not an MCAP file"):
        read_session(path)
    with pytest.raises(FileError, match="is a folder"):
        read_session(tmp_path)


def test_the_official_reader_takes_a_cut_file_too(tmp_path: Path) -> None:
    """By its own means: what is left is MCAP, only without an end."""
    path = tmp_path / "s.mcap"
    starts = small(path)
    path.write_bytes(path.read_bytes()[: starts[3]])

    with path.open("rb") as stream:
        messages = NonSeekingReader(stream).iter_messages(log_time_order=False)
        found = [next(messages)[2].log_time for _ in range(7)]
        with pytest.raises(EndOfFile):
            next(messages)
    assert found == [5, 0, 1, 2, 3, 4, 5]

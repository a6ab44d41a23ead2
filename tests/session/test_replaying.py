"""A recording through the same loop again: the same to the last bit, and what was changed is found."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from airground.errors import FileError
from airground.records import session_log_reader
from airground.session.orders import DriveTo, FollowPath, SetFences, Sketch, Stop
from airground.session.recorder import Recorder
from airground.session.replaying import replay
from session_runs import RED_GOAL, session

if TYPE_CHECKING:
    from pathlib import Path

LINE = ((480.0, 370.0), (560.0, 330.0), (660.0, 320.0), (720.0, 300.0))
BOX = ((900.0, 330.0), (940.0, 330.0), (940.0, 300.0), (900.0, 300.0))


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three seconds with jobs, orders, a fault and a STOP."""
    path = tmp_path_factory.mktemp("session") / "s.mcap"
    one = session(2, seed=4)
    recorder = Recorder(path, one.session.options, one.session.calibration, images="none")

    def go(steps: int) -> None:
        for _ in range(steps):
            tick = one.step()
            recorder.step(one.inputs, tick)

    go(10)
    one.order(SetFences(keep_out=(BOX,)))
    go(8)
    one.order(Sketch("red", 1, LINE))
    one.order(DriveTo("blue", ((1000.0, 430.0),)))
    one.order(DriveTo("nobody", (RED_GOAL,)))
    go(10)
    one.order(FollowPath("red", 1))
    go(50)
    one.world.faults.camera(gone=True)
    go(10)
    one.world.faults.clear()
    go(30)
    one.order(Stop(), "somebody")
    go(10)
    recorder.close()
    assert recorder.trouble == ""
    return path


def test_a_replay_is_the_same(recording: Path) -> None:
    seen: list[int] = []
    again = replay(str(recording), each=lambda tick: seen.append(tick.number))
    assert again.difference is None
    assert again.steps == 128 == len(seen)
    assert again.frames > 30
    assert again.commands > 50
    assert again.duration_s == pytest.approx(127 / 50)
    assert again.cut == ""


def spoiled(
    recording: Path, monkeypatch: pytest.MonkeyPatch, spoil: Any, at: int = 60
) -> tuple[int, str]:
    """First difference, where a step was read otherwise than it was written."""
    real = session_log_reader.SessionRecording.steps

    def steps(self: Any) -> Any:
        for step in real(self):
            if step.number == at:
                spoil(step)
            yield step

    monkeypatch.setattr(session_log_reader.SessionRecording, "steps", steps)
    difference = replay(str(recording)).difference
    assert difference is not None
    return difference.step, difference.what


def test_a_command_that_was_another_is_found(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def spoil(step: Any) -> None:
        step.outputs["commands"]["red"]["v"] += 1e-15

    step, what = spoiled(recording, monkeypatch, spoil)
    assert step == 60
    assert what.startswith("commands: ")


def test_an_input_that_was_another_changes_what_is_decided(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def spoil(step: Any) -> None:
        for one in step.inputs:
            if one["kind"] == "heard" and one["robot"] == "red":
                one["readings"][0]["speed"] += 0.01

    step, _ = spoiled(recording, monkeypatch, spoil)
    assert 60 <= step <= 62


def test_tracks_that_were_others_are_found(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoilt = []

    def spoil(step: Any) -> None:
        for one in step.inputs:
            if one["kind"] == "seen":
                one["tracks"]["names"] = ["?"]
                spoilt.append(one)

    found = [spoiled(recording, monkeypatch, spoil, at) for at in (58,)]
    if not spoilt:  # no frame in that step
        found = [spoiled(recording, monkeypatch, spoil, at) for at in (59,)]
    assert found[0][1].startswith("tracks of frame")


def test_what_is_no_recording_is_said(tmp_path: Path) -> None:
    path = tmp_path / "no.mcap"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(FileError):
        replay(str(path))

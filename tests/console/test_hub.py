"""What clients are told, and who drives."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from airground.session.tick import CalibrationView, PathView, SessionEvent
from console.harness import Bench, beat, newest, read, running

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

VIEW = CalibrationView("calibrated", 0.012, 1)


def scenario(work: Callable[[Bench], Awaitable[None]]) -> None:
    async def whole() -> None:
        async with running(Bench()) as bench:
            await work(bench)

    asyncio.run(whole())


def test_everything_is_told_to_who_comes_and_hello_is_first() -> None:
    async def work(bench: Bench) -> None:
        bench.session.recording = "drive.mcap"
        bench.session.step(events=(SessionEvent(0.1, "info", "it began"),))
        await beat()
        member = bench.hub.join("Ann")
        assert member is not None
        await beat()
        messages = read(member)
        assert messages[0]["key"] == "hello"
        hello = messages[0]["data"]
        assert (hello["version"], hello["client"]) == (1, "c1")
        assert hello["limits"]["message_bytes"] == 256_000
        assert newest(messages, "recording") == {"file": "drive.mcap"}
        assert newest(messages, "fences")["revision"] == 0
        assert newest(messages, "event/1")["line"] == "it began"
        assert newest(messages, "state")["mode"] == "idle"
        assert newest(messages, "controls") == {
            "holder": None,
            "name": "",
            "you": False,
            "clients": 1,
        }
        assert newest(messages, "calibration")["status"] == "calibrated"
        revisions = [one["rev"] for one in messages]
        assert len(set(revisions)) == len(revisions)

    scenario(work)


def test_who_comes_when_the_session_is_silent_is_told_its_last_state() -> None:
    async def work(bench: Bench) -> None:
        bench.session.step(why="last words")
        await beat()
        member = bench.hub.join("Ann")
        assert member is not None
        assert newest(read(member), "state")["why"] == "last words"

    scenario(work)


def test_the_newest_state_wins() -> None:
    async def work(bench: Bench) -> None:
        ann = bench.join()
        for number in range(50):
            bench.session.step(why=str(number))
        await beat()
        bench.session.step(why="last")
        await beat()
        states = [one for one in read(ann) if one["key"] == "state"]
        assert [one["data"]["why"] for one in states] == ["last"]

    scenario(work)


def test_no_event_is_lost_and_the_last_hundred_are_kept() -> None:
    async def work(bench: Bench) -> None:
        ann = bench.join()
        for number in range(150):
            bench.session.step(events=(SessionEvent(0.0, "info", str(number)),))
            if number % 40 == 0:
                await beat()
                assert newest(read(ann), f"event/{number + 1}")["line"] == str(number)
        await beat()
        late = bench.hub.join("late")
        assert late is not None
        lines = [one["data"]["line"] for one in read(late) if one["key"].startswith("event/")]
        assert lines == [str(number) for number in range(50, 150)]

    scenario(work)


def test_a_refused_order_is_told_to_who_gave_it_and_to_nobody_else() -> None:
    async def work(bench: Bench) -> None:
        ann, bob = bench.join(), bench.join()
        bench.session.step(refused=(("c1", "beyond the fence"), ("c9", "who?")))
        bench.session.step()
        await beat()
        assert {"reply": None, "ok": False, "line": "beyond the fence"} in read(ann)
        assert not any("reply" in one for one in read(bob))
        assert bench.hub.tally.document()["refused"] == 2

    scenario(work)


def test_the_controls_go_from_hand_to_hand() -> None:
    async def work(bench: Bench) -> None:
        ann, bob = bench.join("Ann"), bench.join("Bob")
        assert newest(bench.take(ann), "controls")["you"] is True
        told = newest(read(bob), "controls")
        assert (told["holder"], told["name"], told["you"], told["clients"]) == (
            "c1",
            "Ann",
            False,
            2,
        )
        assert bench.take(bob)[0]["ok"] is False
        assert bench.kinds() == []
        assert bench.take(bob, 2, force=True)[0]["ok"] is True
        assert bench.kinds() == [("c1", "gone")]  # what Ann drove stops before Bob drives
        messages = read(ann)
        assert messages[0]["line"] == "Bob has taken the controls"
        assert newest(messages, "controls")["you"] is False
        bench.say(bob, {"kind": "controls", "seq": 3, "take": False})
        assert bench.kinds() == [("c1", "gone"), ("c2", "gone")]
        assert newest(read(ann), "controls")["holder"] is None

    scenario(work)


def test_when_the_holder_leaves_what_it_drove_stops() -> None:
    async def work(bench: Bench) -> None:
        ann, bob = bench.join(), bench.join()
        bench.take(ann)
        read(bob)
        bench.hub.leave(ann)
        bench.hub.leave(ann)
        assert bench.kinds() == [("c1", "gone")]
        assert newest(read(bob), "controls") == {
            "holder": None,
            "name": "",
            "you": False,
            "clients": 1,
        }
        bench.hub.leave(bob)
        assert bench.kinds() == [("c1", "gone")]

    scenario(work)


def test_the_end_of_the_console_is_the_end_of_driving() -> None:
    async def whole() -> None:
        bench = Bench()
        async with running(bench):
            bench.take(bench.join())
        assert bench.kinds() == [("c1", "gone")]
        assert bench.session.listeners == []
        bench.hub.stop()

    asyncio.run(whole())


async def pass_time(bench: Bench, seconds: float) -> None:
    """In steps that are no stall of the event loop."""
    for _ in range(round(seconds / 0.2)):
        bench.t += 0.2
        await beat()


def test_a_silent_holder_loses_the_controls_once() -> None:
    async def work(bench: Bench) -> None:
        ann, bob = bench.join(), bench.join()
        bench.take(ann)
        for _ in range(3):
            await pass_time(bench, 0.8)
            bench.say(ann, {"kind": "ping", "id": 1})
        assert bench.kinds() == []
        await pass_time(bench, 1.4)
        assert bench.kinds() == [("c1", "gone")]
        messages = read(ann)
        assert any("not heard" in one.get("line", "") for one in messages)
        assert newest(messages, "controls")["holder"] is None
        await pass_time(bench, 1.4)
        assert bench.kinds() == [("c1", "gone")]
        assert bench.take(bob)[0]["ok"] is True

    scenario(work)


def test_a_stall_of_our_own_is_not_the_operators_silence() -> None:
    async def work(bench: Bench) -> None:
        bench.take(bench.join())
        await beat()
        bench.t += 5.0
        await beat()
        assert bench.kinds() == []
        await pass_time(bench, 1.4)
        assert bench.kinds() == [("c1", "gone")]

    scenario(work)


def path(sketch: int, **changes: Any) -> PathView:
    points = np.array([[1.0, 2.0, 0.3], [3.0, 4.0, 0.3]])
    return replace(PathView("one", sketch, points, (), 1.0, 2.0, 0.5), **changes)


def test_paths_and_fences_are_told_when_they_change() -> None:
    async def work(bench: Bench) -> None:
        ann = bench.join()
        first = path(1)
        bench.session.step(paths=(first,))
        await beat()
        assert newest(read(ann), "path/one")["sketch"] == 1
        bench.session.step(paths=(first,))
        await beat()
        assert not any(one["key"].startswith(("path/", "fences")) for one in read(ann))
        bench.session.step(paths=(path(1, released=True),), fences_revision=5)
        await beat()
        messages = read(ann)
        assert newest(messages, "path/one")["released"] is True
        assert newest(messages, "fences")["revision"] == 5
        bench.session.step()
        await beat()
        assert newest(read(ann), "path/one") is None
        later = bench.hub.join("later")
        assert later is not None
        assert not any(one["key"].startswith("path/") for one in read(later))

    scenario(work)


async def until_told(bench: Bench, member: Any, wanted: Callable[[Any], bool]) -> Any:
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline:
        await beat()
        for one in read(member):
            if one.get("key") == "calibration" and wanted(one["data"]):
                return one["data"]
    pytest.fail("never told")


def test_a_grid_belongs_to_its_calibration() -> None:
    async def work(bench: Bench) -> None:
        ann = bench.join()
        bench.session.step(calibration=VIEW)
        told = await until_told(bench, ann, lambda data: bool(data["grid"]))
        assert told["image_size_px"] == [1280, 720]
        assert told["revision"] == 1
        bench.session.calibration = None
        bench.session.step(calibration=CalibrationView("none", None, 2))
        told = await until_told(bench, ann, lambda data: data["revision"] == 2)
        assert told["grid"] == []
        assert told["rectify"] is None

    scenario(work)


def test_the_course_of_a_calibration_is_told_in_measure_but_its_phases_at_once() -> None:
    async def work(bench: Bench) -> None:
        bench.session.calibration = None
        ann = bench.join()
        none = CalibrationView("none", None, 0, phase="running")
        bench.session.step(calibration=none)
        await beat()
        read(ann)
        count = 0
        for k in range(10):
            bench.session.step(calibration=replace(none, live_sigma=0.1 - 0.001 * k))
            await beat()
            count += any(one["key"] == "calibration" for one in read(ann))
        assert count == 0  # the clock has not gone on
        bench.session.step(calibration=replace(none, phase="good"))
        await beat()
        assert newest(read(ann), "calibration")["phase"] == "good"
        bench.t += 0.26
        bench.session.step(calibration=replace(none, phase="good", live_sigma=0.01))
        await beat()
        assert newest(read(ann), "calibration")["live_sigma"] == 0.01

    scenario(work)


def test_counts_are_told() -> None:
    async def work(bench: Bench) -> None:
        ann = bench.join()
        await beat()
        read(ann)
        bench.say(ann, "nonsense")
        bench.t += 1.1
        await beat()
        counts = newest(read(ann), "counts")
        assert counts["by_kind"] == {"malformed": 1}
        assert counts["hostile"] == 1

    scenario(work)


def test_a_view_that_cannot_be_told_does_not_silence_the_console(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def work(bench: Bench) -> None:
        ann = bench.join()
        bench.session.step(camera=None)  # a fault of ours
        await beat()
        bench.session.step(why="again")
        await beat()
        assert newest(read(ann), "state")["why"] == "again"
        assert bench.hub.tally.document()["faults"] >= 1

    scenario(work)
    assert "could not tell" in caplog.text


def test_there_is_room_for_so_many() -> None:
    bench = Bench()
    for _ in range(32):
        bench.join()
    assert bench.hub.join("one too many") is None


def test_health_tells_of_a_silent_session() -> None:
    async def work(bench: Bench) -> None:
        assert bench.hub.health()["status"] == "silent"
        bench.session.step()
        await beat()
        assert bench.hub.health()["status"] == "ok"
        bench.t += 1.5
        assert bench.hub.health()["status"] == "silent"

    scenario(work)

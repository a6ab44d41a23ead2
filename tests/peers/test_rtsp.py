"""RTSP from GStreamer's server, as IP cameras speak it."""

from __future__ import annotations

import signal
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import UnreachableError
from airground.vision.sources import LiveSource, live_source, open_source
from vision.sources.films import until

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable

    from airground.vision.sources import Backend

    Serve = Callable[..., subprocess.Popen[str]]


def address(port: int, login: str = "") -> str:
    return f"rtsp://{login}127.0.0.1:{port}/ball"


def state(source: LiveSource) -> str:
    return source.health.state


def test_frames_come_at_their_times(serve_rtsp: Serve, free_port: int, backend: Backend) -> None:
    serve_rtsp(free_port)
    with open_source(address(free_port), backend=backend, patience_s=30, stall_s=10) as source:
        frames = list(islice(source, 10))
        health = source.health
        # Who reads slowly gets the newest; the old ones are gone, not queued.
        until(lambda: source.health.dropped >= health.dropped + 10)
        next_two = list(islice(source, 2))
    assert next_two[0].index >= frames[-1].index + 10
    assert next_two[1].index > next_two[0].index
    steps = np.diff([frame.t for frame in frames])
    dropped = np.diff([frame.index for frame in frames])
    # However late they are read here, the times are the camera's; RTP counts 1/90000 s.
    assert_allclose(steps, 0.04 * dropped, atol=1e-4)
    assert {frame.clock for frame in frames} == {"media"}
    assert {frame.segment for frame in frames} == {0}
    assert all(frame.late_s is not None and frame.late_s >= 0 for frame in frames)
    assert frames[0].size_px == (128, 96)
    assert not np.array_equal(frames[0].image, frames[-1].image)  # the ball moves
    assert (health.state, health.frames, health.reconnects, health.corrupt) == ("live", 10, 0, 0)


def test_a_camera_that_restarts_comes_back(
    serve_rtsp: Serve, free_port: int, backend: Backend, capfd: pytest.CaptureFixture[str]
) -> None:
    server = serve_rtsp(free_port)
    with live_source(address(free_port), backend=backend, patience_s=30, stall_s=10) as source:
        source.start().wait()
        before = source.read()
        server.kill()
        server.wait()
        until(lambda: state(source) == "lost")
        source.read(0)  # what came meanwhile
        serve_rtsp(free_port)
        after = source.read()
        assert state(source) == "live"
        assert source.health.reconnects == 1
        assert any("came back" in note for note in source.health.notes)
    assert before is not None
    assert after is not None
    assert (before.segment, after.segment) == (0, 1)
    assert after.t > before.t
    assert after.index > before.index
    assert capfd.readouterr() == ("", "")


def test_a_camera_that_hangs_is_lost_then_given_up_then_comes_back(
    serve_rtsp: Serve, free_port: int, backend: Backend
) -> None:
    """And closing ends the thread even when it hangs again."""
    server = serve_rtsp(free_port)
    with live_source(address(free_port), backend=backend, patience_s=20, stall_s=0.5) as source:
        source.start().wait()
        source.patience_s = 1
        server.send_signal(signal.SIGSTOP)
        until(lambda: state(source) == "lost")
        source.read(0)
        with pytest.raises(UnreachableError, match="lost rtsp://127.0.0.1.*nothing for 1 s"):
            source.read()
        source.patience_s = 20
        server.send_signal(signal.SIGCONT)
        until(lambda: state(source) == "live")
        frame = source.read()
        assert frame is not None
        assert frame.segment == source.health.reconnects >= 1
        server.send_signal(signal.SIGSTOP)
        source.close()
        assert state(source) == "ended"
        assert source.read() is None
        until(lambda: not source.running)


def test_a_camera_that_is_not_there_is_unreachable(free_port: int, backend: Backend) -> None:
    with pytest.raises(UnreachableError, match="cannot reach rtsp://127.0.0.1") as caught:
        open_source(address(free_port, "me:secret@"), backend=backend, patience_s=0.5)
    assert "secret" not in str(caught.value)
    assert "check that it is on" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wrong_password_is_not_tried_again(serve_rtsp: Serve, free_port: int) -> None:
    pytest.importorskip("av", reason="only PyAV tells why")
    serve_rtsp(free_port, "bob", "builder")
    for login in ("", "bob:wrong@"):
        with pytest.raises(UnreachableError, match="user name and password") as caught:
            open_source(address(free_port, login), backend="pyav", patience_s=300)
        assert "wrong" not in str(caught.value)
    with open_source(address(free_port, "bob:builder@"), backend="pyav", patience_s=30) as source:
        assert next(iter(source)).size_px == (128, 96)
        assert "builder" not in source.name


def test_a_wrong_path_is_said(serve_rtsp: Serve, free_port: int) -> None:
    pytest.importorskip("av", reason="only PyAV tells why")
    serve_rtsp(free_port)
    with pytest.raises(UnreachableError, match="404|[Nn]ot [Ff]ound"):
        open_source(address(free_port) + "x", backend="pyav", patience_s=0.5)

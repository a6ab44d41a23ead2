"""MPEG over UDP from FFmpeg, as encoders on drones and vehicles send it."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import UnreachableError
from airground.vision.sources import live_source, open_source
from vision.sources.films import until

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable

    from airground.vision.sources import Backend

    Send = Callable[[int], subprocess.Popen[str]]


def test_frames_come_are_lost_and_come_back(
    send_udp: Send, free_port: int, backend: Backend, capfd: pytest.CaptureFixture[str]
) -> None:
    sender = send_udp(free_port)
    url = f"udp://127.0.0.1:{free_port}"
    with live_source(url, backend=backend, patience_s=60, stall_s=0.5) as source:
        frames = list(islice(source.start(), 10))
        sender.kill()
        sender.wait()
        until(lambda: source.health.state == "lost")
        source.read(0)
        send_udp(free_port)
        after = source.read()
        assert source.health.reconnects == 1
    steps = np.diff([frame.t for frame in frames])
    dropped = np.diff([frame.index for frame in frames])
    assert_allclose(steps, 0.04 * dropped, atol=1e-4)
    assert {(frame.clock, frame.segment) for frame in frames} == {("media", 0)}
    assert after is not None
    assert after.segment == 1
    assert after.t > frames[-1].t
    assert capfd.readouterr() == ("", "")


def test_a_sender_that_restarts_at_once_begins_a_segment(send_udp: Send, free_port: int) -> None:
    pytest.importorskip("av", reason="PyAV is not installed")
    sender = send_udp(free_port)
    url = f"udp://127.0.0.1:{free_port}"
    with live_source(url, backend="pyav", patience_s=60, stall_s=20) as source:
        source.start().wait()
        until(lambda: source.health.dropped > 20)  # its times are well ahead of a new sender's
        before = source.read()
        sender.kill()
        sender.wait()
        send_udp(free_port)
        after = next(frame for frame in source if frame.segment > 0)
        assert source.health.reconnects == 0
    assert before is not None
    assert after.t > before.t


def test_nobody_sends(free_port: int, backend: Backend, monkeypatch: pytest.MonkeyPatch) -> None:
    """Patience ends while an attempt is under way; the attempt ends before the test does."""
    monkeypatch.setattr("airground.vision.sources.opening.ATTEMPT_S", 0.6)
    with pytest.raises(UnreachableError, match="cannot reach udp://127.0.0.1.*does not answer"):
        open_source(f"udp://127.0.0.1:{free_port}", backend=backend, patience_s=0.3)

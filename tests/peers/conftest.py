"""Real streams from real programs, on this computer alone."""

from __future__ import annotations

import shutil
import socket
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from airground.vision.sources.opening import Backend

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SYSTEM_PYTHON = "/usr/bin/python3"  # the bindings of GStreamer are the system's
SERVER = Path(__file__).with_name("rtsp_server.py")

Start = "Callable[..., subprocess.Popen[str]]"


@pytest.fixture(params=["opencv", "pyav"])
def backend(request: pytest.FixtureRequest) -> Backend:
    """Both, where PyAV is installed."""
    if request.param == "pyav":
        pytest.importorskip("av", reason="PyAV is not installed")
        return "pyav"
    return "opencv"


@pytest.fixture
def free_port() -> int:
    """A port of 127.0.0.1 that nobody has, for TCP and UDP."""
    with socket.socket() as tcp, socket.socket(type=socket.SOCK_DGRAM) as udp:
        tcp.bind(("127.0.0.1", 0))
        port: int = tcp.getsockname()[1]
        udp.bind(("127.0.0.1", port))
    return port


@pytest.fixture
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start programs that are gone when the test is over, stopped or not."""
    running: list[subprocess.Popen[str]] = []

    def start_(*command: str) -> subprocess.Popen[str]:
        program = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
        )
        running.append(program)
        return program

    yield start_
    for program in running:
        program.kill()
        program.wait()
        if program.stdout is not None:
            program.stdout.close()


@pytest.fixture
def send_udp(
    start: Callable[..., subprocess.Popen[str]],
) -> Callable[[int], subprocess.Popen[str]]:
    """FFmpeg sends MPEG over UDP, 25 pictures per second."""
    ffmpeg = shutil.which("ffmpeg")
    if ffmpeg is None:
        pytest.skip("ffmpeg is not installed; on Debian: apt install ffmpeg")

    def send(port: int) -> subprocess.Popen[str]:
        picture = ("-re", "-f", "lavfi", "-i", "testsrc2=size=128x96:rate=25")
        coded = ("-c:v", "mpeg2video", "-g", "5", "-f", "mpegts")
        address = f"udp://127.0.0.1:{port}?pkt_size=1316"
        return start(ffmpeg, "-nostdin", "-loglevel", "error", *picture, *coded, address)

    return send


@pytest.fixture(scope="session")
def gstreamer() -> None:
    """GStreamer's RTSP server, or the tests are skipped."""
    try:
        subprocess.run(
            [SYSTEM_PYTHON, str(SERVER), "--check"], check=True, capture_output=True, timeout=60
        )
    except (OSError, subprocess.SubprocessError):
        pytest.skip(
            "GStreamer's RTSP server is not installed; on Debian: apt install python3-gi "
            "gir1.2-gst-rtsp-server-1.0 gstreamer1.0-plugins-base gstreamer1.0-plugins-good gstreamer1.0-plugins-ugly"
        )


@pytest.fixture
def serve_rtsp(
    gstreamer: None, start: Callable[..., subprocess.Popen[str]]
) -> Callable[..., subprocess.Popen[str]]:
    """Serve rtsp://127.0.0.1:PORT/ball, 25 pictures per second; user and password may follow the port."""

    def serve(port: int, *login: str) -> subprocess.Popen[str]:
        server = start(SYSTEM_PYTHON, str(SERVER), str(port), *login)
        assert server.stdout is not None
        assert server.stdout.readline() == "ready\n"
        return server

    return serve

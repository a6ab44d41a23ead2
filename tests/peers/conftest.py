"""Real streams from real programs, on this computer alone."""

from __future__ import annotations

import shutil
import socket
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from airground.vision.sources.opening import Backend
from peers.browser import LAPTOP, Console, TrueSite, open_chromium

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Browser

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


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """A real browser, or the tests are skipped."""
    yield from open_chromium()


@pytest.fixture(scope="module")
def true_site() -> Iterator[TrueSite]:
    """The embedded world with a known camera and its console, for a whole file."""
    with TrueSite() as site:
        yield site


@pytest.fixture
def site(true_site: TrueSite) -> Iterator[TrueSite]:
    """The same, with all robots at rest before and after."""
    true_site.settle()
    yield true_site
    true_site.settle()


@pytest.fixture
def console(chromium: Browser) -> Iterator[Callable[..., Console]]:
    """Open pages that are closed when the test is over; none may have complained."""
    opened: list[tuple[Console, str]] = []

    def open_(url: str, size: tuple[int, int] = LAPTOP, allow: str = "", **options: Any) -> Console:
        context = chromium.new_context(viewport={"width": size[0], "height": size[1]}, **options)
        page = Console(context.new_page())
        opened.append((page, allow))
        return page.open(url)

    yield open_
    faults = []
    for page, allow in opened:
        faults += [one for one in page.faults if not (allow and allow in one)]
        page.page.context.close()
    assert not faults

"""Pictures over HTTP, as small cameras send them, and video files from a server."""

from __future__ import annotations

from contextlib import contextmanager
from functools import partial
from http.server import BaseHTTPRequestHandler, SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import islice, pairwise
from threading import Event, Thread
from typing import TYPE_CHECKING

import cv2
import pytest
from numpy.testing import assert_allclose

from airground.errors import UnreachableError
from airground.vision.sources import open_source
from vision.sources.films import number_of, numbered, record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from airground.vision.sources import Backend

RATE_HZ = 50.0  # not the 25 that FFmpeg makes up


class Pictures(BaseHTTPRequestHandler):
    """A stream of JPEG pictures, one part each."""

    over = Event()

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=next")
        self.end_headers()
        k = 0
        while not self.over.wait(1 / RATE_HZ):
            data = cv2.imencode(".jpg", numbered(k % 12))[1].tobytes()
            head = f"--next\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
            try:
                self.wfile.write(head.encode() + data + b"\r\n")
            except OSError:
                return
            k += 1

    def log_message(self, *arguments: object) -> None:
        pass


class Files(SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        pass


@contextmanager
def served(handler: Callable[..., BaseHTTPRequestHandler]) -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.handle_error = lambda *_: None  # type: ignore[method-assign]
    Pictures.over.clear()
    thread = Thread(target=server.serve_forever, args=(0.01,))  # looks that often whether to end
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        Pictures.over.set()
        server.shutdown()
        thread.join()
        server.server_close()


def test_pictures_without_times_have_the_time_they_came(backend: Backend) -> None:
    """FFmpeg would number them by a rate that it makes up."""
    with (
        served(Pictures) as url,
        open_source(f"{url}/mjpg", backend=backend, patience_s=30) as source,
    ):
        frames = list(islice(source, 20))
    assert {frame.clock for frame in frames} == {"arrival"}
    assert all(after.t > frame.t for frame, after in pairwise(frames))


def test_a_file_on_a_server_is_read_like_a_file(tmp_path: Path, backend: Backend) -> None:
    record(tmp_path / "a.mp4", [9000 * k for k in range(12)])
    with (
        served(partial(Files, directory=str(tmp_path))) as url,
        open_source(f"{url}/a.mp4", backend=backend) as source,
    ):
        frames = list(source)
    assert [number_of(frame.image) for frame in frames] == list(range(12))
    assert_allclose([frame.t for frame in frames], [k / 10 for k in range(12)])
    assert source.clock == "media"


def test_a_file_that_is_not_on_the_server(tmp_path: Path, backend: Backend) -> None:
    with (
        served(partial(Files, directory=str(tmp_path))) as url,
        pytest.raises(UnreachableError, match="cannot reach http://127.0.0.1:"),
    ):
        open_source(f"{url}/a.mp4?token=secret", backend=backend)

"""Images to pages: each one coded once per width, in a thread, and only as fast as they are shown."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING

from airground.vision.jpeg import encode_jpeg

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import ThreadPoolExecutor

    from airground.console.page_messages import View
    from airground.session.handle import ShownImage

__all__ = ["ImageFlow", "Pictures", "image_packet"]

# What is asked for is rounded up to these, so that many pages cost no more than a few.
WIDTHS_PX = (320, 480, 640, 960, 1280, 1920, 2560, 3840)

Key = tuple[int, float]


def image_packet(shown: ShownImage, width_px: int) -> bytes:
    """Give an image as it is sent: length of a header, the header, and JPEG.

    Parameters
    ----------
    shown : ShownImage
        Of the camera.
    width_px : int [px]
        At most so wide.

    Returns
    -------
    packet : bytes
        Binary message.
    """
    jpeg = encode_jpeg(shown.image, width_px=width_px)
    width, height = jpeg.size_px
    header = json.dumps(
        {
            "index": shown.index,
            "t": round(shown.t, 4),
            "arrived_s": round(shown.arrived_s, 4),
            "width": width,
            "height": height,
            "scale": width / shown.image.shape[1],
        },
        separators=(",", ":"),
        allow_nan=False,
    ).encode()
    return len(header).to_bytes(4, "big") + header + jpeg.data


class ImageFlow:
    """Which image one client is sent next: the newest, when it has shown the last, and not too often.

    Parameters
    ----------
    most_hz : float [1/s]
        Fastest, whatever a client asks for.
    """

    def __init__(self, most_hz: float) -> None:
        self._least_s = 1 / most_hz
        self._period_s = self._least_s
        self.wanted = False
        self._due_s = 0.0
        self._under_way: Key | None = None
        self._last: Key | None = None
        self.width_px = WIDTHS_PX[0]

    def ask(self, view: View) -> None:
        """Take what a client wants; it may get one at once.

        Parameters
        ----------
        view : View
            Of the page.
        """
        self.wanted = view.image
        self._period_s = max(1 / view.rate_hz, self._least_s)
        self.width_px = next((one for one in WIDTHS_PX if one >= view.width_px), WIDTHS_PX[-1])
        self._under_way = self._last = None

    def begin(self, shown: ShownImage, now: float) -> bool:
        """Tell whether an image is to be sent, and take it as under way if so.

        Parameters
        ----------
        shown : ShownImage
            The newest.
        now : float [s]
            Any clock that does not go back.

        Returns
        -------
        due : bool
            False while the last is not acknowledged.
        """
        key = (shown.index, shown.t)
        if not self.wanted or self._under_way is not None or key == self._last:
            return False
        if now < self._due_s:
            return False
        # What was missed by being asked at odd times is caught up, up to one image.
        self._due_s = max(self._due_s + self._period_s, now)
        self._under_way = self._last = key
        return True

    def expects(self, shown: ShownImage) -> bool:
        """Tell whether an image that is ready is still wanted.

        Parameters
        ----------
        shown : ShownImage
            That was begun.

        Returns
        -------
        wanted : bool
            False where the client has changed its mind.
        """
        return self.wanted and self._under_way == (shown.index, shown.t)

    def acknowledge(self, index: int) -> None:
        """Let the next one go, if this one was under way.

        Parameters
        ----------
        index : int
            Of the image.
        """
        if self._under_way is not None and self._under_way[0] == index:
            self._under_way = None


class Pictures:
    """Codes images in a thread; who asks for the same one at the same width shares it.

    Parameters
    ----------
    pool : ThreadPoolExecutor
        With few threads: what is late is not worth more of them.
    """

    def __init__(self, pool: ThreadPoolExecutor) -> None:
        self._pool = pool
        self._jobs: dict[int, tuple[Key, asyncio.Future[bytes]]] = {}

    def ask(
        self, shown: ShownImage, width_px: int, give: Callable[[bytes | BaseException], None]
    ) -> None:
        """Code an image, unless that is done or under way.

        Parameters
        ----------
        shown : ShownImage
            Of the camera.
        width_px : int [px]
            At most so wide.
        give : callable
            Is given the packet, or why there is none, in the event loop.
        """
        width = min(width_px, shown.image.shape[1])
        key = (shown.index, shown.t)
        known = self._jobs.get(width)
        if known is None or known[0] != key:
            loop = asyncio.get_running_loop()
            known = (key, loop.run_in_executor(self._pool, image_packet, shown, width))
            self._jobs[width] = known

        def done(future: asyncio.Future[bytes]) -> None:
            if not future.cancelled():
                give(future.exception() or future.result())

        known[1].add_done_callback(done)

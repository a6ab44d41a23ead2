"""Files, streams and USB cameras through OpenCV."""

from __future__ import annotations

import sys
from math import isfinite
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.vision.sources.decoder import OpeningError, Picture
from airground.vision.sources.quiet import quiet_opencv

if TYPE_CHECKING:
    from airground.vision.frame import Clock

__all__ = ["OpencvDecoder", "open_camera", "open_file", "open_stream"]

# OpenCV ends a file at its first broken picture, yet goes on when it is asked again.
ATTEMPTS = 30

# Their packets have times. What comes over HTTP or TCP may be pictures alone, whose times FFmpeg makes up.
TIMED = ("rtsp", "rtsps", "rtp", "udp", "srt", "rtmp")

LONGEST_S = 1e7  # a raw stream without a length claims -2e14 frames


class OpencvDecoder:
    """A `cv2.VideoCapture`, which tells neither why it failed nor which pictures are damaged.

    Parameters
    ----------
    capture : cv2.VideoCapture
        Open.
    stamped : Clock
        Which clock its stamps are of.
    attempts : int
        How many reads in a row may fail before it counts as the end.
    timed : bool
        Its stamps are to be trusted.
    """

    absolute = False

    def __init__(
        self, capture: cv2.VideoCapture, *, stamped: Clock, attempts: int, timed: bool = True
    ) -> None:
        self.stamped = stamped
        self.corrupt = 0
        self._capture = capture
        self._attempts = attempts
        self._timed = timed
        self._index = 0
        rate = capture.get(cv2.CAP_PROP_FPS)
        count = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self.rate_hz = rate if isfinite(rate) and rate > 0 else None
        length = count / self.rate_hz if self.rate_hz else 0.0
        known = 0 < length < LONGEST_S
        self.frame_count = round(count) if known else None
        self.duration_s = length if known else None

    def read(self) -> Picture | None:
        """Decode the next picture.

        Returns
        -------
        picture : Picture or None
            None at the end.
        """
        for failures in range(self._attempts):
            with quiet_opencv():
                try:
                    got, image = self._capture.read()
                except cv2.error:  # rather than False, with some backends
                    return None
            if not got:
                continue
            self.corrupt += failures
            self._index += failures + 1
            stamp = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
            bgr = np.asarray(image, dtype=np.uint8)
            if bgr.ndim == 2:
                bgr = np.asarray(cv2.cvtColor(bgr, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
            known = self._timed and isfinite(stamp)
            return Picture(bgr, stamp if known else None, self._index - 1)
        return None

    def close(self) -> None:
        """Let go of it; calling it again does nothing."""
        self._capture.release()


def open_file(path: str, *, timeout_s: float | None = None) -> OpencvDecoder:
    """Open a video file.

    Parameters
    ----------
    path : str
        The file, or its address.
    timeout_s : float, optional [s]
        How long a network may say nothing.

    Returns
    -------
    decoder : OpencvDecoder
        At its first picture.

    Raises
    ------
    OpeningError
        If OpenCV cannot read it.
    """
    limits = [] if timeout_s is None else _time_limits(timeout_s, timeout_s)
    capture = _open(path, cv2.CAP_FFMPEG, limits)
    return OpencvDecoder(capture, stamped="media", attempts=ATTEMPTS)


def open_stream(url: str, *, open_s: float, stall_s: float) -> OpencvDecoder:
    """Open a stream from the network.

    Parameters
    ----------
    url : str
        Its address.
    open_s : float [s]
        How long opening may take.
    stall_s : float [s]
        How long it may say nothing.

    Returns
    -------
    decoder : OpencvDecoder
        At its first picture.

    Raises
    ------
    OpeningError
        If it cannot be reached.
    """
    one_thread = [cv2.CAP_PROP_N_THREADS, 1]  # each one more delays pictures by one
    parameters = [*_time_limits(open_s, stall_s), *one_thread]
    capture = _open(url, cv2.CAP_FFMPEG, parameters)
    timed = url.partition(":")[0].lower() in TIMED
    return OpencvDecoder(capture, stamped="media", attempts=1, timed=timed)


def open_camera(number: int, size_px: tuple[int, int] | None) -> OpencvDecoder:
    """Open a camera of this computer.

    Parameters
    ----------
    number : int
        As the operating system counts.
    size_px : (int, int) or None
        Width and height to ask for.

    Returns
    -------
    decoder : OpencvDecoder
        Its stamps are the driver's on Linux.

    Raises
    ------
    OpeningError
        If there is none, or it is in use.
    """
    parameters: list[int] = []
    if size_px is not None:
        # Over USB 2, large pictures come at a useful rate only as JPEG.
        parameters = [
            *(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG")),
            *(cv2.CAP_PROP_FRAME_WIDTH, size_px[0]),
            *(cv2.CAP_PROP_FRAME_HEIGHT, size_px[1]),
        ]
    backend = cv2.CAP_V4L2 if sys.platform == "linux" else cv2.CAP_ANY
    capture = _open(number, backend, parameters)
    given = tuple(
        round(capture.get(side)) for side in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
    )
    if size_px is not None and given != tuple(size_px):
        capture.release()
        raise OpeningError(
            f"it gives {given[0]}x{given[1]} pixels, not {size_px[0]}x{size_px[1]}", final=True
        )
    return OpencvDecoder(capture, stamped="device", attempts=1)


def _time_limits(open_s: float, stall_s: float) -> list[int]:
    return [
        *(cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, round(open_s * 1e3)),
        *(cv2.CAP_PROP_READ_TIMEOUT_MSEC, round(stall_s * 1e3)),
    ]


def _open(target: str | int, backend: int, parameters: list[int]) -> cv2.VideoCapture:
    with quiet_opencv():
        try:
            if isinstance(target, int):
                capture = cv2.VideoCapture(target, backend, parameters)
            else:
                capture = cv2.VideoCapture(target, backend, parameters)
        except cv2.error as error:
            raise OpeningError(" ".join(str(error).split())) from None
    if not capture.isOpened():
        raise OpeningError("OpenCV cannot open it")
    return capture

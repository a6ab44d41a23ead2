"""Files and streams through PyAV: exact times, and a word on every damaged picture."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.vision.sources.decoder import OpeningError, Picture

if TYPE_CHECKING:
    from collections.abc import Generator

    import av
    from av.container import InputContainer
    from av.video.stream import VideoStream

    from airground.vision.frame import Clock, ImageArray

__all__ = ["PyavDecoder", "has_pyav", "open_file", "open_stream"]

# `nobuffer` gives pictures as they come, `fpsprobesize` opens without guessing their rate first; of a camera with a
# microphone only the pictures are wanted; a computer that cannot keep up loses pictures and not the connection.
LIVE = {
    "fflags": "nobuffer",
    "fpsprobesize": "0",
    "rtsp_flags": "prefer_tcp",
    "allowed_media_types": "video",
    "overrun_nonfatal": "1",
}


NO_TIMESTAMPS = 0x80  # AVFMT_NOTIMESTAMPS of FFmpeg's avformat.h: raw pictures, counted by a rate that it guesses
GUESSED = ("mpjpeg",)  # JPEG pictures over HTTP, likewise, without the flag


def has_pyav() -> bool:
    """Whether PyAV can be imported.

    Returns
    -------
    there : bool
        It can.
    """
    try:
        import av  # noqa: F401
    except ImportError:
        return False
    return True


class PyavDecoder:
    """An open container.

    Parameters
    ----------
    container : InputContainer
        Open.
    stream : VideoStream
        The one to decode.
    """

    stamped: Clock = "media"
    absolute = True

    def __init__(self, container: InputContainer, stream: VideoStream) -> None:
        self.corrupt = 0
        self._container = container
        form = container.format
        self._timed = not form.flags & NO_TIMESTAMPS and form.name not in GUESSED
        rate = stream.average_rate or stream.guessed_rate
        self.rate_hz = float(rate) if rate else None
        self.duration_s = container.duration / 1e6 if container.duration else None
        about = self.duration_s * self.rate_hz if self.duration_s and self.rate_hz else 0.0
        self.frame_count = stream.frames or round(about) or None
        self._pictures = self._decode(stream)

    def read(self) -> Picture | None:
        """Decode the next picture.

        Returns
        -------
        picture : Picture or None
            None at the end.
        """
        return next(self._pictures, None)

    def close(self) -> None:
        """Let go of it; calling it again does nothing."""
        self._pictures.close()
        self._container.close()

    def _decode(self, stream: VideoStream) -> Generator[Picture]:
        import av

        index = 0
        packets = self._container.demux(stream)
        while True:
            try:
                packet = next(packets)
            except (StopIteration, av.error.FFmpegError):
                return  # the end, or a stream that broke or stalled
            try:
                frames = packet.decode()
            except av.error.EOFError:
                return
            except av.error.FFmpegError:
                self.corrupt += 1
                index += 1
                continue
            for frame in frames:
                if frame.is_corrupt:
                    self.corrupt += 1
                else:
                    yield Picture(_bgr(frame), frame.time if self._timed else None, index)
                index += 1


def open_file(path: str, *, timeout_s: float | None = None) -> PyavDecoder:
    """Open a video file.

    Parameters
    ----------
    path : str
        The file, or its address.
    timeout_s : float, optional [s]
        How long a network may say nothing.

    Returns
    -------
    decoder : PyavDecoder
        At its first picture.

    Raises
    ------
    OpeningError
        If FFmpeg cannot read it, or it holds no video.
    """
    container, stream = _open(path, {}, None if timeout_s is None else (timeout_s, timeout_s))
    # Threads over pictures are fastest; FFV1 has slices for that, and repairs broken ones from whatever picture
    # another thread has ready, so that its result would depend on chance.
    stream.thread_type = "SLICE" if stream.codec_context.name == "ffv1" else "AUTO"
    return PyavDecoder(container, stream)


def open_stream(url: str, *, open_s: float, stall_s: float) -> PyavDecoder:
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
    decoder : PyavDecoder
        At its first picture.

    Raises
    ------
    OpeningError
        If it cannot be reached, or sends no video.
    """
    container, stream = _open(url, LIVE, (open_s, stall_s))
    stream.thread_type = "SLICE"  # threads over pictures delay them by one each
    return PyavDecoder(container, stream)


def _open(
    target: str, options: dict[str, str], timeout: tuple[float, float] | None
) -> tuple[InputContainer, VideoStream]:
    try:
        import av
    except ImportError:
        raise InputError("PyAV is not installed; pip install 'airground[video]'") from None

    began_s = monotonic()
    try:
        container = av.open(target, options=options, timeout=timeout)
    except av.error.FFmpegError as error:
        if timeout is not None and monotonic() - began_s >= timeout[0]:
            raise OpeningError("it does not answer") from None  # FFmpeg may call this invalid data
        reason, final = _reason(error)
        raise OpeningError(reason, final=final) from None
    if not container.streams.video:
        container.close()
        raise OpeningError("holds no video", final=True)
    return container, container.streams.video[0]


def _reason(error: av.error.FFmpegError) -> tuple[str, bool]:
    """Why, and whether that is final. Never the whole message: it would hold the address and its password."""
    import av

    if isinstance(error, av.error.HTTPUnauthorizedError):
        return (
            "it asks for a user name and password, or refuses the ones given; "
            "write them into the address, as in rtsp://user:password@host/",
            True,
        )
    if isinstance(error, av.error.HTTPForbiddenError):
        return "it forbids access", True
    return " ".join((error.strerror or type(error).__name__).split()), False


def _bgr(frame: av.VideoFrame) -> ImageArray:
    image = np.asarray(frame.to_ndarray(format="bgr24"), dtype=np.uint8)
    quarters = round(frame.rotation / 90)  # counter-clockwise
    return np.ascontiguousarray(np.rot90(image, quarters)) if quarters % 4 else image

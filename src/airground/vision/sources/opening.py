"""One door to all sources of frames."""

from __future__ import annotations

import os
import sys
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from airground.errors import InputError, UnreachableError
from airground.vision.sources import opencv_decoder, pyav_decoder
from airground.vision.sources.containers import Container
from airground.vision.sources.decoder import OpeningError
from airground.vision.sources.folder import ImageFolder
from airground.vision.sources.live import LiveSource
from airground.vision.sources.names import parse_name
from airground.vision.sources.video_file import VideoFile, check_rate, open_video

if TYPE_CHECKING:
    from airground.vision.sources.decoder import Decoder
    from airground.vision.sources.names import SourceName
    from airground.vision.sources.protocol import FrameSource

__all__ = ["Backend", "live_source", "open_source"]

Backend = Literal["auto", "opencv", "pyav"]
"""What decodes files and streams: PyAV, which knows damaged pictures, where it is installed ("auto"), else OpenCV.
Cameras of this computer are always OpenCV's.
"""

# An attempt to connect ends after this, to be made anew: a stream that starts while we wait is then found.
ATTEMPT_S = 5.0

IN_NETWORK = (
    "check that it is on, that the address is right, and that this computer is in its network"
)


def open_source(
    name: str | os.PathLike[str],
    *,
    backend: Backend = "auto",
    rate_hz: float | None = None,
    size_px: tuple[int, int] | None = None,
    patience_s: float = 10.0,
    stall_s: float = 3.0,
) -> FrameSource:
    """Open a source of frames; of a camera or stream, wait for the first one.

    Parameters
    ----------
    name : str or path-like
        A video file, a folder of images, a camera (``0``, ``usb:0``, ``/dev/video0``), or an address (``rtsp://``,
        ``udp://``, ``http://`` and so on). The address of a video file, such as ``http://host/a.mp4``, is read like a
        file, every frame of it.
    backend : {"auto", "opencv", "pyav"}
        What decodes files and streams.
    rate_hz : float, optional [Hz]
        Frame rate that replaces the source's own times; needed where it has none.
    size_px : (int, int), optional [px]
        Width and height to ask of a camera of this computer.
    patience_s : float [s]
        For how long a camera or stream may give nothing before that is an error.
    stall_s : float [s]
        For how long it may give nothing before it counts as lost, and is opened anew.

    Returns
    -------
    source : FrameSource
        To be used in a ``with`` block.

    Raises
    ------
    InputError
        If a setting is wrong, or does not fit the source.
    FileError
        If a file or folder cannot be read.
    UnreachableError
        If a camera or stream gives no frame in time.
    """
    parsed = parse_name(name)
    if parsed.kind in ("camera", "stream"):
        live = live_source(
            name,
            backend=backend,
            rate_hz=rate_hz,
            size_px=size_px,
            patience_s=patience_s,
            stall_s=stall_s,
        )
        try:
            return live.start().wait()
        except BaseException:
            live.close()
            raise
    check_rate(rate_hz)
    _refuse_size(parsed, size_px)
    library = pyav_decoder if _with_pyav(backend) else opencv_decoder
    if parsed.kind == "path":
        path = Path(parsed.target)
        if path.is_dir():
            return ImageFolder(path, rate_hz=rate_hz)
        return open_video(path, library.open_file, rate_hz=rate_hz)
    try:
        decoder: Decoder = library.open_file(parsed.target, timeout_s=patience_s)
    except OpeningError as error:
        raise UnreachableError(
            f"cannot reach {parsed.shown}: {error.reason}; {IN_NETWORK}"
        ) from None
    return VideoFile(parsed.shown, decoder, Container("other"), rate_hz=rate_hz)


def live_source(
    name: str | os.PathLike[str],
    *,
    backend: Backend = "auto",
    rate_hz: float | None = None,
    size_px: tuple[int, int] | None = None,
    patience_s: float = 10.0,
    stall_s: float = 3.0,
) -> LiveSource:
    """Make the source of a camera or stream, which begins with its `start`; nothing is waited for.

    Parameters
    ----------
    name : str or path-like
        A camera or an address.
    backend : {"auto", "opencv", "pyav"}
        What decodes streams.
    rate_hz : float, optional [Hz]
        Frame rate that replaces the source's own times.
    size_px : (int, int), optional [px]
        Width and height to ask of a camera of this computer.
    patience_s : float [s]
        For how long it may give nothing before that is an error.
    stall_s : float [s]
        For how long it may give nothing before it counts as lost, and is opened anew.

    Returns
    -------
    source : LiveSource
        Not started.

    Raises
    ------
    InputError
        If a setting is wrong, or the name is none of a camera or stream.
    """
    parsed = parse_name(name)
    check_rate(rate_hz)
    for what, value in (("patience_s", patience_s), ("stall_s", stall_s)):
        if not (isfinite(value) and value > 0):
            raise InputError(f"{what} must be a number of seconds above zero, not {value}")
    if parsed.kind == "camera":
        number = int(parsed.target)
        return LiveSource(
            parsed.shown,
            lambda: _open_camera(number, size_px),
            patience_s=patience_s,
            stall_s=stall_s,
            rate_hz=rate_hz,
            check="check that it is plugged in and that no other program uses it",
        )
    if parsed.kind != "stream":
        raise InputError(f"{parsed.shown}: expected a camera or the address of a stream")
    _refuse_size(parsed, size_px)
    library = pyav_decoder if _with_pyav(backend) else opencv_decoder
    return LiveSource(
        parsed.shown,
        lambda: library.open_stream(parsed.target, open_s=ATTEMPT_S, stall_s=stall_s),
        patience_s=patience_s,
        stall_s=stall_s,
        rate_hz=rate_hz,
        check=IN_NETWORK,
    )


def _with_pyav(backend: Backend) -> bool:
    if backend not in ("auto", "opencv", "pyav"):
        raise InputError(f"backend must be one of auto, opencv, pyav, not {backend}")
    there = pyav_decoder.has_pyav()
    if backend == "pyav" and not there:
        raise InputError("PyAV is not installed; pip install 'airground[video]'")
    return there and backend != "opencv"


def _refuse_size(parsed: SourceName, size_px: tuple[int, int] | None) -> None:
    if size_px is not None:
        raise InputError(f"{parsed.shown}: a size can be asked only of a camera of this computer")


def _open_camera(number: int, size_px: tuple[int, int] | None) -> Decoder:
    """OpenCV does not say why; the system's device file does."""
    if sys.platform == "linux":
        device = Path(f"/dev/video{number}")
        if not device.exists():
            others = sorted(str(path) for path in device.parent.glob("video*"))
            raise OpeningError(
                f"there is no {device}" + (f", only {', '.join(others)}" if others else ""),
                final=True,
            )
        if not os.access(device, os.R_OK | os.W_OK):
            raise OpeningError(
                f"no permission to use {device}; the group video may have it", final=True
            )
    return opencv_decoder.open_camera(number, size_px)

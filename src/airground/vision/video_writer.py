"""Write images to a video file: for people to watch, or lossless for programs to read."""

from __future__ import annotations

import errno
from fractions import Fraction
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Self, cast

import cv2
import numpy as np

from airground.errors import FileError, InputError
from airground.vision.sources.pyav_decoder import has_pyav
from airground.vision.sources.quiet import quiet_opencv

if TYPE_CHECKING:
    import os
    from types import TracebackType

    import av
    from av.video.stream import VideoStream

    from airground.vision.frame import ImageArray

__all__ = ["VideoWriter"]

WATCHED = (".mp4", ".mov", ".m4v")
LOSSLESS = (".mkv", ".avi")

# About as many bits as the eye asks for; the size of a file halves with every six.
QUALITY = "18"

# A third of the default's time for files of about the same size: a preview must keep up with a camera.
PRESET = "veryfast"

BT601, LIMITED = (
    6,
    1,
)  # what FFmpeg converts by; players guess BT.709 for large pictures unless told


class VideoWriter:
    """A video file that images are added to, one after the other, at a constant rate.

    ``.mp4``, ``.mov``, ``.m4v``: H.264 through PyAV, which browsers play; without PyAV, MPEG-4 part 2, which desktop
    players play. Images with an odd width or height get their last column or row twice, since these formats store
    colour for two by two pixels. ``.mkv``, ``.avi``: FFV1, which gives back every pixel as it was; ``.mkv`` rounds its
    times to milliseconds.

    The same images give the same file, byte by byte, with the same libraries (``.mkv``: only through PyAV). The file is
    whole only after `close`.

    Parameters
    ----------
    path : path-like
        The file; one that exists is replaced.
    size_px : (int, int)
        Width and height of the images.
    rate_hz : float
        Frame rate.
    pyav : bool, optional
        Whether PyAV writes it; where it is installed, if not given.

    Raises
    ------
    InputError
        If the suffix, size or rate is wrong, or the codec is missing.
    FileError
        If the file cannot be written.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        size_px: tuple[int, int],
        rate_hz: float,
        pyav: bool | None = None,
    ) -> None:
        self.path = Path(path)
        self.size_px = size_px
        suffix = self.path.suffix.lower()
        if suffix not in WATCHED + LOSSLESS:
            raise InputError(
                f"{path}: a video's name must end in {', '.join(WATCHED)}, or {' or '.join(LOSSLESS)} for lossless"
            )
        if min(size_px) < 1:
            raise InputError(
                f"a video's size must be two numbers of pixels above zero, not {size_px}"
            )
        if not (isfinite(rate_hz) and rate_hz > 0):
            raise InputError(f"a video's rate must be a number above zero [Hz], not {rate_hz}")
        try:
            self.path.open("wb").close()  # the system says best why it cannot be
        except OSError as error:
            raise _file_error(self.path, error) from None
        self._lossless = suffix in LOSSLESS
        use_pyav = has_pyav() if pyav is None else pyav
        self._encoder: _Pyav | _Opencv = (_Pyav if use_pyav else _Opencv)(
            self.path, self._stored_px(), rate_hz, lossless=self._lossless
        )

    def write(self, image: ImageArray) -> None:
        """Add an image.

        Parameters
        ----------
        image : (H, W, 3) or (H, W) array
            Blue, green, red, or grey; 8 bits.

        Raises
        ------
        InputError
            If it has another shape or type.
        """
        width, height = self.size_px
        if image.dtype != np.uint8 or image.shape not in ((height, width, 3), (height, width)):
            raise InputError(
                f"an image of this video must have shape ({height}, {width}, 3) or ({height}, {width}) and 8 bits, "
                f"not {image.shape} of {image.dtype}"
            )
        bgr = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
        stored = self._stored_px()
        if stored != self.size_px:
            more = ((0, stored[1] - height), (0, stored[0] - width), (0, 0))
            bgr = np.pad(bgr, more, mode="edge")
        self._encoder.write(np.ascontiguousarray(bgr))

    def close(self) -> None:
        """Finish the file; calling it again does nothing."""
        self._encoder.close()

    def _stored_px(self) -> tuple[int, int]:
        width, height = self.size_px
        return self.size_px if self._lossless else (width + width % 2, height + height % 2)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class _Pyav:
    def __init__(
        self, path: Path, size_px: tuple[int, int], rate_hz: float, *, lossless: bool
    ) -> None:
        try:
            import av
        except ImportError:
            raise InputError("PyAV is not installed; pip install 'airground[video]'") from None

        codec = "ffv1" if lossless else "libx264"
        if codec not in av.codecs_available:
            raise InputError(f"this PyAV has no {codec} to write {path.name} with")
        # Without `bitexact` the file would hold the library's version, and Matroska a random number.
        options = {"fflags": "+bitexact"}
        if not lossless:
            options["movflags"] = "+faststart"  # a browser can show the start before it has the end
        self._path = path
        self._container = av.open(str(path.absolute()), "w", options=options)
        self._stream = cast(
            "VideoStream",
            self._container.add_stream(
                codec,
                rate=_fraction(rate_hz),
                options={} if lossless else {"crf": QUALITY, "preset": PRESET},
            ),
        )
        context = self._stream.codec_context
        context.width, context.height = size_px
        context.pix_fmt = "bgr0" if lossless else "yuv420p"
        context.thread_count = 1  # how x264 spends its bits depends on the number of threads
        if not lossless:
            context.colorspace, context.color_range = BT601, LIMITED
        self._open = True

    def write(self, bgr: ImageArray) -> None:
        import av

        frame = av.VideoFrame.from_ndarray(bgr, format="bgr24")
        self._mux(frame)

    def close(self) -> None:
        import av

        if not self._open:
            return
        self._open = False
        self._mux(None)
        try:
            self._container.close()
        except av.error.FFmpegError as error:
            raise _file_error(self._path, error) from None

    def _mux(self, frame: av.VideoFrame | None) -> None:
        import av

        try:
            self._container.mux(self._stream.encode(frame))
        except av.error.FFmpegError as error:
            raise _file_error(self._path, error) from None


class _Opencv:
    def __init__(
        self, path: Path, size_px: tuple[int, int], rate_hz: float, *, lossless: bool
    ) -> None:
        codec = "FFV1" if lossless else "mp4v"
        if size_px[0] % 2 or size_px[1] % 2:  # it would cut a column or row off
            raise InputError(
                f"without PyAV a lossless video needs an even width and height, not {size_px[0]}x{size_px[1]}; "
                "pip install 'airground[video]'"
            )
        with quiet_opencv():
            self._writer = cv2.VideoWriter(
                str(path.absolute()),
                cv2.CAP_FFMPEG,
                cv2.VideoWriter.fourcc(*codec),
                float(_fraction(rate_hz)),
                size_px,
            )
        if not self._writer.isOpened():
            raise InputError(
                f"this OpenCV cannot write {path.name} ({codec}); pip install 'airground[video]'"
            )

    def write(self, bgr: ImageArray) -> None:
        self._writer.write(bgr)

    def close(self) -> None:
        self._writer.release()


def _fraction(rate_hz: float) -> Fraction:
    """29.97 is 30000/1001."""
    ntsc = Fraction(round(rate_hz * 1.001) * 1000, 1001)
    return (
        ntsc if abs(float(ntsc) - rate_hz) < 0.005 else Fraction(rate_hz).limit_denominator(10000)
    )


def _file_error(path: Path, error: Exception) -> FileError:
    if isinstance(error, FileNotFoundError):
        problem = f"the folder {path.parent} does not exist; create it first"
    elif isinstance(error, IsADirectoryError):
        problem = "is a folder, expected a file"
    elif isinstance(error, PermissionError):
        problem = "no permission to write it"
    elif isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        problem = "the disk is full"
    else:
        problem = f"cannot write it: {getattr(error, 'strerror', None) or error}"
    return FileError(str(path), problem)

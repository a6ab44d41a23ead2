"""Video files."""

from __future__ import annotations

from itertools import chain
from math import isfinite
from typing import TYPE_CHECKING

from airground.errors import FileError, InputError
from airground.vision.frame import Frame
from airground.vision.sources.base import PulledSource
from airground.vision.sources.containers import Container, look_into
from airground.vision.sources.decoder import OpeningError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from airground.vision.sources.decoder import Decoder, Picture

__all__ = ["VideoFile", "check_rate", "open_video"]

# Times are whole nanoseconds: finer than any container's, and the last bits no longer depend on the decoder.
DECIMALS = 9

# A file that ends this much before its own length has been cut short.
SHORT_FRAMES = 3


class VideoFile(PulledSource):
    """Frames of a video file, at their presentation times; the first is at zero.

    Files without presentation times are counted by their frame rate, on clock "rate", and a note says so: AVI files,
    raw H.264, and whatever gives its first two frames one time.

    Parameters
    ----------
    name : str
        The file, as the user calls it.
    decoder : Decoder
        Open, at the first picture; closed with the source.
    container : Container
        How the file is built.
    rate_hz : float, optional
        Frame rate that replaces the file's own times.

    Raises
    ------
    FileError
        If nothing in it can be decoded, or it has neither times nor a rate.
    """

    def __init__(
        self, name: str, decoder: Decoder, container: Container, *, rate_hz: float | None = None
    ) -> None:
        self._decoder = decoder
        self._container = container
        self._first = [picture for picture in (decoder.read(), decoder.read()) if picture]
        self._rate_hz = rate_hz
        self._last_stamp = 0.0
        try:
            why = self._choose_rate(name)
        except FileError:
            decoder.close()
            raise
        super().__init__(name, "media" if self._rate_hz is None else "rate", decoder.frame_count)
        if why:
            self._tally.note(f"{why}: counted at {self._rate_hz:g} frames per second")

    def _choose_rate(self, name: str) -> str:
        """Use the file's frame rate where it has no times; say why."""
        if not self._first:
            raise FileError(name, "none of its pictures can be decoded")
        why = _no_times(self._container, self._first) if self._rate_hz is None else ""
        if why:
            self._rate_hz = self._decoder.rate_hz
            if self._rate_hz is None:
                raise FileError(name, f"{why}, nor a frame rate; give the rate")
        return why

    def close(self) -> None:
        """Let go of the file; calling it again does nothing."""
        super().close()
        self._decoder.close()

    def _corrupt(self) -> int:
        return self._decoder.corrupt

    def _frames(self) -> Iterator[Frame]:
        zero = self._first[0].stamp_s or 0.0
        size = self._first[0].image.shape
        last = None
        for picture in chain(self._first, iter(self._decoder.read, None)):
            if picture.image.shape != size:
                raise FileError(
                    self.name,
                    f"picture {picture.number} is {_size(picture.image.shape)} pixels where those before are "
                    f"{_size(size)}; cut the video there",
                )
            t = self._time(picture, zero)
            if t is None or (last is not None and t <= last):
                self._tally.add("repeated")
                continue
            last = t
            self._last_stamp = picture.stamp_s or 0.0
            yield Frame(picture.image, t, self.clock, picture.number)
        self._first = []
        self._say_how_it_ended(last or 0.0)

    def _time(self, picture: Picture, zero: float) -> float | None:
        if self._rate_hz is not None:
            return picture.number / self._rate_hz
        return None if picture.stamp_s is None else round(picture.stamp_s - zero, DECIMALS)

    def _say_how_it_ended(self, last: float) -> None:
        health = self.health
        if health.corrupt:
            self._tally.note(
                f"{health.corrupt} damaged pictures were left out; "
                "those that follow one may show traces of the damage"
            )
        if health.repeated:
            self._tally.note(
                f"{health.repeated} pictures were left out: "
                "their times are missing or do not come after the time before"
            )
        duration, rate = self._decoder.duration_s, self._decoder.rate_hz
        # An MP4 may show only a part of what it holds; Matroska's length counts from zero, not from the first picture.
        comparable = self._container.kind == "avi" or (
            self._container.kind == "other" and self._decoder.absolute
        )
        reached = max(last, self._last_stamp)
        short = (
            comparable
            and duration is not None
            and rate is not None
            and reached + SHORT_FRAMES / rate < duration
        )
        if self._container.cut_short or short:
            announced = "" if duration is None else f" of {duration:.3f} s"
            self._tally.note(f"the file is cut short: it ends at {last:.3f} s{announced}")


def open_video(
    path: Path, open_decoder: Callable[[str], Decoder], *, rate_hz: float | None = None
) -> VideoFile:
    """Open a video file.

    Parameters
    ----------
    path : Path
        The file.
    open_decoder : callable
        Opens a file by its name; raises `OpeningError`.
    rate_hz : float, optional
        Frame rate that replaces the file's own times.

    Returns
    -------
    source : VideoFile
        At the first frame.

    Raises
    ------
    FileError
        If it is not there or holds no video that can be read.
    """
    name = str(path)
    container = _look(path)
    if path.stat().st_size == 0:
        raise FileError(name, "is empty, expected a video")
    if not container.indexed:
        raise FileError(
            name,
            "is cut short: its index (moov) is missing, as when a recording was not stopped properly",
        )
    try:
        # An absolute path: FFmpeg would take "a:b.mp4" for protocol a.
        decoder = open_decoder(str(path.absolute()))
    except OpeningError as error:
        if error.final:
            raise FileError(name, error.reason) from None
        raise FileError(name, f"is not a video that can be read: {error.reason}") from None
    return VideoFile(name, decoder, container, rate_hz=rate_hz)


def check_rate(rate_hz: float | None) -> None:
    """Refuse frame rates that are none.

    Parameters
    ----------
    rate_hz : float or None
        What somebody stated.

    Raises
    ------
    InputError
        If it is not a number above zero.
    """
    if rate_hz is not None and not (isfinite(rate_hz) and rate_hz > 0):
        raise InputError(f"the frame rate must be a number above zero [Hz], not {rate_hz}")


def _look(path: Path) -> Container:
    try:
        return look_into(path)
    except FileNotFoundError:
        problem = "there is no such file"
    except PermissionError:
        problem = "no permission to read it"
    except OSError as error:
        problem = f"cannot read it: {error.strerror or error}"
    raise FileError(str(path), problem)


def _no_times(container: Container, first: list[Picture]) -> str:
    """Why the stamps of a file are no presentation times; empty where they are."""
    if container.kind == "avi":
        return "an AVI file holds no times"
    stamps = [picture.stamp_s for picture in first]
    if container.kind == "raw" or None in stamps:
        return "the file holds no times"
    if len(stamps) > 1 and not stamps[1] > stamps[0]:  # type: ignore[operator]
        return "the times in the file do not ascend"
    return ""


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]}x{shape[0]}"

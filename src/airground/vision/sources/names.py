"""Which source a name means, and how to show it without its password."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import Literal
from urllib.parse import parse_qsl, urlencode, urlsplit, urlunsplit

from airground.errors import InputError

__all__ = ["SourceName", "parse_name", "without_password"]

STREAMS = ("rtsp", "rtsps", "rtp", "udp", "tcp", "srt", "rtmp", "http", "https")
VIDEO_SUFFIXES = (".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".ts", ".mpg", ".mpeg", ".wmv")
SECRETS = re.compile("pass|pwd|token|secret|key|auth|user|login", re.IGNORECASE)
CAMERA = re.compile(r"(?:usb:|/dev/video)?(\d{1,3})")


@dataclass(frozen=True, slots=True)
class SourceName:
    """What a name means."""

    kind: Literal["path", "camera", "stream", "download"]
    """A file or folder, a camera of this computer, a live stream, or a video file at an address."""

    target: str
    """What to open; may hold a password."""

    shown: str
    """How to call it in messages."""


def parse_name(name: str | os.PathLike[str]) -> SourceName:
    """Tell files, cameras and streams apart.

    Parameters
    ----------
    name : str or path-like
        ``video.mp4``, a folder, ``0``, ``usb:0``, ``/dev/video0``, ``rtsp://...`` and so on. A path-like is always a
        file or folder.

    Returns
    -------
    name : SourceName
        What it means.

    Raises
    ------
    InputError
        If it is empty, or an address of a kind that is not known.
    """
    text = os.fspath(name)
    if not text:
        raise InputError(
            "no source named; give a video file, a folder of images, a camera or an address"
        )
    if not isinstance(name, str):
        return SourceName("path", text, text)
    if camera := CAMERA.fullmatch(text):
        return SourceName("camera", camera[1], text)
    scheme, separator, _ = text.partition("://")
    if not separator:
        return SourceName("path", text, text)
    if scheme.lower() not in STREAMS:
        raise InputError(
            f"{without_password(text)}: addresses start with {', '.join(STREAMS)}, not {scheme}"
        )
    download = scheme.lower() in ("http", "https") and urlsplit(text).path.lower().endswith(
        VIDEO_SUFFIXES
    )
    return SourceName("download" if download else "stream", text, without_password(text))


def without_password(url: str) -> str:
    """Strip an address of user, password and whatever looks like one.

    Parameters
    ----------
    url : str
        An address.

    Returns
    -------
    shown : str
        Fit for messages and files.
    """
    try:
        parts = urlsplit(url)
        query = parse_qsl(parts.query, keep_blank_values=True)
    except ValueError:  # brackets that are no IPv6 address
        return re.sub(r"//[^/]*@", "//", url.partition("?")[0])
    host = parts.netloc.rpartition("@")[2]
    if any(SECRETS.search(key) for key, _ in query):
        hidden = urlencode(
            [(key, "***" if SECRETS.search(key) else value) for key, value in query], safe="*/:"
        )
    else:
        hidden = parts.query
    return urlunsplit(parts._replace(netloc=host, query=hidden))

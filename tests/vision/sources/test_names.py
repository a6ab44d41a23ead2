from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.errors import InputError
from airground.vision.sources.names import parse_name, without_password


@pytest.mark.parametrize(
    ("name", "kind", "target"),
    [
        ("video.mp4", "path", "video.mp4"),
        ("folder/", "path", "folder/"),
        ("C:\\videos\\a.mp4", "path", "C:\\videos\\a.mp4"),
        (Path("0"), "path", "0"),
        ("0", "camera", "0"),
        ("usb:2", "camera", "2"),
        ("/dev/video10", "camera", "10"),
        ("rtsp://camera/stream", "stream", "rtsp://camera/stream"),
        ("RTSP://camera/stream", "stream", "RTSP://camera/stream"),
        ("udp://0.0.0.0:5000", "stream", "udp://0.0.0.0:5000"),
        ("http://camera/mjpg", "stream", "http://camera/mjpg"),
        ("https://host/a/b.MP4?x=1", "download", "https://host/a/b.MP4?x=1"),
        ("tcp://host:1", "stream", "tcp://host:1"),
        ("rtp://host:2", "stream", "rtp://host:2"),
    ],
)
def test_names(name: str | Path, kind: str, target: str) -> None:
    parsed = parse_name(name)
    assert (parsed.kind, parsed.target) == (kind, target)


def test_unknown_addresses_are_refused_without_their_password() -> None:
    with pytest.raises(InputError, match="rtsp.*not gopher") as caught:
        parse_name("gopher://me:secret@host/")
    assert "secret" not in str(caught.value)


def test_no_name_is_refused() -> None:
    with pytest.raises(InputError, match="no source named"):
        parse_name("")


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("rtsp://me:secret@10.0.0.7:554/ch1", "rtsp://10.0.0.7:554/ch1"),
        ("rtsp://me:se@cret@host/ch1", "rtsp://host/ch1"),
        ("rtsp://[fe80::1]:554/a", "rtsp://[fe80::1]:554/a"),
        (
            "http://host/mjpg?user=me&pwd=secret&res=640x480",
            "http://host/mjpg?user=***&pwd=***&res=640x480",
        ),
        ("http://host/a?x=1", "http://host/a?x=1"),
        ("rtsp://me:secret@[broken/ch1?password=secret", "rtsp://[broken/ch1"),
    ],
)
def test_passwords_are_not_shown(url: str, shown: str) -> None:
    assert without_password(url) == shown


@given(st.text(st.characters(codec="ascii", exclude_characters="/?#"), min_size=1))
def test_no_password_is_ever_shown(password: str) -> None:
    marked = f"<{password}>SECRET"
    assert "SECRET" not in without_password(f"rtsp://me:{marked}@host/a")
    assert "SECRET" not in parse_name(f"rtsp://me:{marked}@host/a").shown

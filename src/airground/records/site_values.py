"""What some keys of a site file hold: paths, polygons, links."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from airground.records.site import EMBEDDED
from airground.records.site_plain import number, pair, text

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

__all__ = [
    "address",
    "color",
    "corners",
    "crossing",
    "existing",
    "link",
    "name",
    "source_beside",
    "track",
    "within",
]

MOST_CORNERS = 100
FARTHEST_PX = 1e5
LONGEST_NAME = 64
OPTIONS = ("rate_hz", "timeout_s", "lost_s")  # what may stand behind a link's question mark
_LINK = f'"embedded", or "udp://host:port" with ?{", ".join(OPTIONS)} as numbers'


def within(low: float, high: float) -> Callable[[object], float]:
    """Read a number of sensible size.

    Parameters
    ----------
    low, high : float
        Both allowed.

    Returns
    -------
    read : callable
        For `Table.get`.
    """

    def read(value: object) -> float:
        found = number(value)
        if not low <= found <= high:
            raise ValueError(f"a number from {low:g} to {high:g}")
        return found

    return read


def existing(value: object, *, folder: Path) -> Path:
    """Read the name of a file that is there.

    Parameters
    ----------
    value : object
        As parsed.
    folder : Path
        What it is relative to.

    Returns
    -------
    path : Path
        Absolute.

    Raises
    ------
    ValueError
        With what was expected.
    """
    path = folder / text(value)
    try:
        there = path.is_file()
    except OSError:
        there = False
    if not there:
        raise ValueError(f"a file; there is none at {path}")
    return path


def source_beside(value: object, *, folder: Path) -> str:
    """Read a source of images.

    Parameters
    ----------
    value : object
        As parsed.
    folder : Path
        What a file is relative to.

    Returns
    -------
    source : str
        As the command line takes it.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if isinstance(value, bool) or not isinstance(value, int | str):
        raise ValueError('a text: a file, "0", "rtsp://..." or "embedded"')
    name = text(str(value))
    if name == EMBEDDED or "://" in name or re.fullmatch(r"(?:usb:)?\d+", name):
        return name
    return str(folder / name)


def track(value: object) -> str:
    """Read the label of a mark; a tag's is a number.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    label : str
        As the tracker has it.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if isinstance(value, bool) or not isinstance(value, int | str) or value in (-1, ""):
        raise ValueError("the number of a tag, or a label in quotes")
    return text(str(value))


def name(value: object) -> str:
    """Read what a robot is called.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    name : str
        Not too long.

    Raises
    ------
    ValueError
        With what was expected.
    """
    found = text(value)
    if len(found) > LONGEST_NAME:
        raise ValueError(f"a name of up to {LONGEST_NAME} letters")
    return found


def color(value: object) -> str:
    """Read a colour.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    color : str
        As #rrggbb.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if not isinstance(value, str) or not re.fullmatch(r"#[0-9a-fA-F]{6}", value):
        raise ValueError('a colour as "#rrggbb"')
    return value.lower()


def link(value: object) -> str:
    """Read how a robot is reached.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    link : str
        As it is written.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if value == EMBEDDED:
        return EMBEDDED
    found = text(value)
    try:
        parts = urlsplit(found)
        options = dict(parse_qsl(parts.query, strict_parsing=bool(parts.query)))
        port = parts.port
        bad = [key for key, said in options.items() if key not in OPTIONS or not float(said) > 0]
    except ValueError as error:
        raise ValueError(_LINK) from error
    rest = parts.path.strip("/") or parts.fragment or "@" in parts.netloc
    if parts.scheme != "udp" or not parts.hostname or not port or rest or bad:
        raise ValueError(_LINK)
    return found


def address(link: str) -> tuple[str, int] | None:
    """Where a link leads.

    Parameters
    ----------
    link : str
        As `link` gave it; empty where it was wrong.

    Returns
    -------
    address : (str, int) or None
        Host and port; None of what has none.
    """
    parts = urlsplit(link)
    return (parts.hostname, parts.port) if parts.hostname and parts.port else None


def corners(value: object) -> tuple[tuple[float, float], ...]:
    """Read a polygon.

    Parameters
    ----------
    value : object
        As parsed.

    Returns
    -------
    corners : tuple of (float, float) [px]
        Three or more.

    Raises
    ------
    ValueError
        With what was expected.
    """
    if not isinstance(value, list) or not 3 <= len(value) <= MOST_CORNERS:
        raise ValueError(f"3 to {MOST_CORNERS} corners: [[u, v], [u, v], [u, v]]")
    try:
        polygon = tuple(map(pair, value))
    except ValueError as error:
        raise ValueError("corners of two finite numbers: [[u, v], [u, v], [u, v]]") from error
    if max(abs(c) for uv in polygon for c in uv) > FARTHEST_PX:
        raise ValueError(f"corners within {FARTHEST_PX:g} px")
    return polygon


def crossing(polygon: tuple[tuple[float, float], ...]) -> str:
    """Tell what is wrong with a polygon's shape.

    Parameters
    ----------
    polygon : tuple of (float, float) [px]
        Its corners.

    Returns
    -------
    problem : str
        Empty where nothing is.
    """
    from shapely import Polygon  # type: ignore[import-untyped]

    shape = Polygon(polygon)
    if shape.convex_hull.area == 0.0:
        return "the corners enclose nothing"
    return "" if shape.is_valid else "the sides cross each other; give the corners in order"

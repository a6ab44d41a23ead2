"""From a link, as it stands in a site's description, to a robot."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from airground.errors import InputError
from airground.robots.udp import UdpRobot

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.robots.protocol import Robot

__all__ = ["LINKS", "check_link", "open_robot"]

LINKS = ("udp",)
"""Schemes of links to real robots."""

EXAMPLE = "udp://192.168.1.20:7001"

NUMBERS = ("rate_hz", "timeout_s", "lost_s")


def check_link(name: str, link: str) -> tuple[str, int, dict[str, float]]:
    """Take a link apart, without opening anything.

    Parameters
    ----------
    name : str
        Of the robot, for messages.
    link : str
        ``udp://host:port``, with ``?timeout_s=0.5&rate_hz=20&lost_s=0.5`` where the defaults do not fit.

    Returns
    -------
    host : str
        Where the robot is.
    port : int
        Where it listens.
    numbers : dict of str to float
        What stands behind the question mark.

    Raises
    ------
    InputError
        If it is no link to a robot; one line that says what would be.
    """
    if link == "embedded" or link.startswith("embedded:"):
        raise InputError(
            f"robot {name}: the link 'embedded' belongs to the embedded world, which brings its own camera and "
            f"robots; a real robot has a link such as {EXAMPLE}"
        )
    try:
        parts = urlsplit(link)
        port = parts.port
    except ValueError as error:
        raise InputError(f"robot {name}: {link!r} is no link: {error}; such as {EXAMPLE}") from None
    if parts.scheme not in LINKS:
        raise InputError(
            f"robot {name}: there is no link {link!r}; there are {', '.join(LINKS)}, such as {EXAMPLE}"
        )
    extra = parts.username or parts.password or parts.path not in ("", "/") or parts.fragment
    if not parts.hostname or port is None or extra:
        raise InputError(f"robot {name}: {link!r} must be host and port, such as {EXAMPLE}")
    if port == 0:
        raise InputError(f"robot {name}: a port is 1 to 65535, not 0")
    numbers: dict[str, float] = {}
    for key, text in parse_qsl(parts.query, keep_blank_values=True):
        if key not in NUMBERS:
            raise InputError(
                f"robot {name}: {link!r} says {key!r}; what may be said is {', '.join(NUMBERS)}"
            )
        try:
            numbers[key] = float(text)
        except ValueError:
            raise InputError(f"robot {name}: {key} must be a number, not {text!r}") from None
    return parts.hostname, port, numbers


def open_robot(name: str, link: str, *, clock: Callable[[], float] = monotonic) -> Robot:
    """Open the link to a robot. It is told to stand until somebody tells it otherwise.

    Parameters
    ----------
    name : str
        What it is called.
    link : str
        As for `check_link`.
    clock : callable
        The session's: gives seconds.

    Returns
    -------
    robot : Robot
        Not necessarily heard yet: see its link.

    Raises
    ------
    InputError
        If it is no link to a robot.
    UnreachableError
        If there is no way to the host.
    """
    host, port, numbers = check_link(name, link)
    return UdpRobot(name, host, port, clock=clock, **numbers)

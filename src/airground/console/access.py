"""Who may talk to the console. Pure functions: what is compared with what.

A page of another site cannot read ours, but it can open a WebSocket to this computer, and by rebinding its own name's
address it can even seem to be our page. Hence: on loopback the name that the browser believes to talk to must be one of
loopback's, a WebSocket must come from our own page, and beyond loopback a token is needed too.
"""

from __future__ import annotations

import hmac
from ipaddress import IPv6Address, ip_address
from urllib.parse import urlsplit

__all__ = ["host_allowed", "is_loopback", "same_origin", "token_matches"]

PORTS = {"http": 80, "https": 443}


def is_loopback(host: str) -> bool:
    """Tell whether an address is reached from this computer only.

    Parameters
    ----------
    host : str
        An address, or ``localhost``; any other name is not taken to be one.

    Returns
    -------
    loopback : bool
        False for what is no address.
    """
    if host.lower() == "localhost":
        return True
    try:
        address = ip_address(host)
    except ValueError:
        return False
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return (mapped or address).is_loopback


def _place(text: str, scheme: str) -> tuple[str, int] | None:
    """Host and port of what stands after the scheme."""
    try:
        parts = urlsplit(f"{scheme}://{text}")
        host, port = parts.hostname, parts.port
    except ValueError:  # brackets that do not close, a port that is no number
        return None
    rest = parts.path or parts.query or parts.fragment or "@" in parts.netloc
    return None if rest or not host else (host.lower(), port or PORTS[scheme])


def host_allowed(host_header: str | None, *, loopback: bool) -> bool:
    """Tell whether a request means this server.

    Parameters
    ----------
    host_header : str or None
        As the browser sent it. Its port may be another where one is forwarded.
    loopback : bool
        Whether the server is bound to loopback. Beyond it any name may be ours, and the token tells.

    Returns
    -------
    allowed : bool
        False for a name that somebody has made to point here.
    """
    place = None if host_header is None else _place(host_header, "http")
    return place is not None and (not loopback or is_loopback(place[0]))


def same_origin(origin: str | None, host_header: str | None) -> bool:
    """Tell whether a WebSocket was opened by a page of ours.

    Parameters
    ----------
    origin : str or None
        Header ``Origin``. Browsers always send it; who writes a program of their own can send it too.
    host_header : str or None
        Header ``Host``.

    Returns
    -------
    same : bool
        Whether host and port agree, whichever of http and https is in front of us.
    """
    scheme, _, text = (origin or "").partition("://")
    if scheme not in PORTS or host_header is None:
        return False
    place = _place(text, scheme)
    return place is not None and place == _place(host_header, scheme)


def token_matches(wanted: str | None, given: str | None) -> bool:
    """Compare tokens in a time that tells nothing of where they differ.

    Parameters
    ----------
    wanted : str or None
        None where no token is needed.
    given : str or None
        What the page sent.

    Returns
    -------
    matches : bool
        True where none is needed.
    """
    if wanted is None:
        return True
    code = ("utf-8", "surrogatepass")  # JSON may hold half a character
    return hmac.compare_digest(wanted.encode(*code), (given or "").encode(*code))

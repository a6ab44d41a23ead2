"""Who may talk to the console."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.console.access import host_allowed, is_loopback, same_origin, token_matches


@pytest.mark.parametrize(
    "host", ["localhost", "LOCALHOST", "127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1"]
)
def test_loopback(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize(
    "host", ["", "0.0.0.0", "::", "192.168.1.4", "localhost.evil.example", "127.0.0.1.nip.io", "1"]
)
def test_not_loopback(host: str) -> None:
    assert not is_loopback(host)


@pytest.mark.parametrize("host", ["localhost:8000", "127.0.0.1", "[::1]:8000", "127.0.0.1:9"])
def test_hosts_of_loopback_are_ours(host: str) -> None:
    assert host_allowed(host, loopback=True)


@pytest.mark.parametrize(
    "host",
    [
        None,
        "",
        "evil.example",
        "evil.example:8000",
        "localhost:8000@evil.example",
        "localhost/evil",
        "localhost:port",
        "[::1",
        "localhost:99999",
    ],
)
def test_a_name_that_was_made_to_point_here_is_not_ours(host: str | None) -> None:
    assert not host_allowed(host, loopback=True)


def test_beyond_loopback_any_name_may_be_ours() -> None:
    assert host_allowed("robots.example:8000", loopback=False)
    assert not host_allowed(None, loopback=False)


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://localhost:8000", "localhost:8000"),
        ("http://LocalHost:8000", "localhost:8000"),
        ("https://robots.example", "robots.example"),
        ("https://robots.example", "robots.example:443"),
        ("http://[::1]:8000", "[::1]:8000"),
    ],
)
def test_the_page_of_this_server(origin: str, host: str) -> None:
    assert same_origin(origin, host)


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "",
        "null",
        "http://evil.example",
        "http://localhost",
        "http://localhost:8001",
        "https://localhost",
        "file://localhost:8000",
        "http://localhost:8000@evil.example",
        "http://127.0.0.1:8000",
        "http://localhost:8000/page",
        "localhost:8000",
    ],
)
def test_a_page_of_another(origin: str | None) -> None:
    assert not same_origin(origin, "localhost:8000")


def test_without_host_there_is_no_origin() -> None:
    assert not same_origin("http://localhost:8000", None)


def test_tokens() -> None:
    assert token_matches(None, None)
    assert token_matches(None, "anything")
    assert token_matches("secret-1", "secret-1")
    assert not token_matches("secret-1", None)
    assert not token_matches("secret-1", "")
    assert not token_matches("secret-1", "secret-2")


@given(st.text(st.characters(), max_size=20))  # surrogates too
def test_any_text_is_a_wrong_token(text: str) -> None:
    assert not token_matches("the right token", text)


@given(st.text(max_size=30), st.text(max_size=30))
def test_any_header_has_an_answer(origin: str, host: str) -> None:
    assert not same_origin(origin, host) or origin.lower().startswith("http")
    host_allowed(host, loopback=True)

"""The page's folder and nothing else, with headers that keep browsers honest. Nothing is written over HTTP."""

from __future__ import annotations

import asyncio
import os
import re
from typing import TYPE_CHECKING, Any

import httpx
import pytest

from airground.console.app import HEADERS, console_app
from airground.console.page_files import find_page_files, read_page_file
from airground.errors import FileError
from console.harness import Bench, beat, running

if TYPE_CHECKING:
    from pathlib import Path


def ask(
    page: Path, path: str, *, method: str = "GET", loopback: bool = True, **headers: str
) -> httpx.Response:
    async def request() -> httpx.Response:
        app = console_app(Bench().hub, page=page, loopback=loopback)
        names = {key.replace("_", "-"): value for key, value in headers.items()}
        async with httpx.AsyncClient(
            transport=httpx.ASGITransport(app), base_url="http://127.0.0.1:8000"
        ) as client:
            url = httpx.URL("http://127.0.0.1:8000", raw_path=path.encode())
            return await client.request(method, url, headers=names)

    return asyncio.run(request())


@pytest.mark.parametrize(
    ("path", "kind", "text"),
    [
        ("/", "text/html; charset=utf-8", "<!doctype html>"),
        ("/index.html", "text/html; charset=utf-8", "<!doctype html>"),
        ("/app.js", "text/javascript; charset=utf-8", "export"),
        ("/app.js?v=2", "text/javascript; charset=utf-8", "export"),
        ("/panels/one.css", "text/css; charset=utf-8", "body"),
    ],
)
def test_files_of_the_page(page: Path, path: str, kind: str, text: str) -> None:
    answer = ask(page, path)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == kind
    assert answer.text.startswith(text)
    assert {key: answer.headers[key] for key in HEADERS} == HEADERS


def test_the_policy_allows_nothing_from_elsewhere() -> None:
    policy = HEADERS["Content-Security-Policy"]
    assert "default-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert not re.search(r"unsafe|http|\*", policy)


def test_an_unchanged_file_is_not_sent_again_and_a_changed_one_is(page: Path) -> None:
    tag = ask(page, "/app.js").headers["etag"]
    again = ask(page, "/app.js", If_None_Match=tag)
    assert (again.status_code, again.content) == (304, b"")
    (page / "app.js").write_text("export const a = 1;", "utf-8")
    assert ask(page, "/app.js", If_None_Match=tag).status_code == 200


@pytest.fixture
def secrets(page: Path) -> Path:
    """Files that nobody shall see: beside the page, hidden in it, linked from it."""
    (page.parent / "secret.html").write_text("SECRET", "utf-8")
    (page.parent / "page-2").mkdir()
    (page.parent / "page-2" / "secret.html").write_text("SECRET", "utf-8")
    (page / ".hidden.html").write_text("SECRET", "utf-8")
    (page / ".git").mkdir()
    (page / ".git" / "config.json").write_text("SECRET", "utf-8")
    (page / "notes.txt").write_text("SECRET", "utf-8")
    (page / "code.py").write_text("SECRET", "utf-8")
    (page / "link.html").symlink_to(page.parent / "secret.html")
    (page / "linked").symlink_to(page.parent / "page-2")
    return page


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.html",
        "/panels/../../secret.html",
        "/%2e%2e/secret.html",
        "/..%2fsecret.html",
        "/..%5csecret.html",
        "/panels/%2e%2e/%2e%2e/secret.html",
        "//secret.html",
        "/../page-2/secret.html",
        "/.hidden.html",
        "/.git/config.json",
        "/notes.txt",
        "/code.py",
        "/link.html",
        "/linked/secret.html",
        "/app.js%00.html",
        "/panels",
        "/panels/",
        "/nothing.html",
        "/app.js/",
        "/%ff%fe",
        "/etc/passwd",
        "//etc/passwd",
    ],
)
def test_nothing_else_is_served(secrets: Path, path: str) -> None:
    answer = ask(secrets, path)
    assert answer.status_code == 404
    assert "SECRET" not in answer.text
    assert {key: answer.headers[key] for key in HEADERS} == HEADERS


def test_links_and_hidden_files_are_not_even_listed(secrets: Path) -> None:
    assert set(find_page_files(secrets)) == {"/", "/index.html", "/app.js", "/panels/one.css"}


def test_no_file_of_the_system_by_its_whole_path(secrets: Path) -> None:
    outside = secrets.parent / "secret.html"
    assert ask(secrets, str(outside)).status_code == 404
    assert ask(secrets, f"/{outside}").status_code == 404


def test_a_file_that_became_a_link_after_start_is_not_served(page: Path) -> None:
    files = find_page_files(page)
    (page / "app.js").unlink()
    (page / "app.js").symlink_to(page / "index.html")
    with pytest.raises(FileError, match="link"):
        read_page_file(files["/app.js"])
    os.unlink(page / "app.js")  # noqa: PTH108
    with pytest.raises(FileError, match="cannot be read"):
        read_page_file(files["/app.js"])


def test_a_folder_without_a_page_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"index\.html"):
        console_app(Bench().hub, page=tmp_path)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"])
@pytest.mark.parametrize("path", ["/", "/health", "/ws", "/app.js"])
def test_nothing_is_written_over_http(page: Path, method: str, path: str) -> None:
    assert ask(page, path, method=method).status_code in (404, 405)


def test_head_says_the_same_without_the_file(page: Path) -> None:
    answer = ask(page, "/", method="HEAD")
    assert (answer.status_code, answer.content) == (200, b"")


@pytest.mark.parametrize("path", ["/", "/health", "/app.js"])
def test_another_host_is_turned_away_on_loopback(page: Path, path: str) -> None:
    answer = ask(page, path, Host="rebound.example:8000")
    assert answer.status_code == 421
    assert "page" not in answer.text
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert ask(page, "/", Host="localhost:1234").status_code == 200
    assert ask(page, "/", loopback=False, Host="robots.example").status_code == 200


def test_health(page: Path) -> None:
    async def work() -> list[httpx.Response]:
        async with running(Bench()) as bench:
            app: Any = console_app(bench.hub, page=page)
            async with httpx.AsyncClient(
                transport=httpx.ASGITransport(app), base_url="http://localhost"
            ) as client:
                before = await client.get("/health")
                bench.session.step()
                await beat()
                bench.say(bench.join(), "nonsense")
                return [before, await client.get("/health")]

    silent, well = asyncio.run(work())
    assert (silent.status_code, silent.json()["status"]) == (503, "silent")
    assert (well.status_code, well.json()["status"]) == (200, "ok")
    assert well.json()["by_kind"] == {"malformed": 1}
    assert well.json()["clients"] == 1
    assert "robot" not in well.text

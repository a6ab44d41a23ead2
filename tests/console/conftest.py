"""A page, and a server on a port of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from airground.console.server import ConsoleServer
from console.fake_session import FakeSession

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture
def page(tmp_path: Path) -> Path:
    folder = tmp_path / "page"
    (folder / "panels").mkdir(parents=True)
    (folder / "index.html").write_text("<!doctype html><title>page</title>", "utf-8")
    (folder / "app.js").write_text("export {};", "utf-8")
    (folder / "panels" / "one.css").write_text("body {}", "utf-8")
    return folder


@pytest.fixture
def session() -> Iterator[FakeSession]:
    made = FakeSession().run()
    yield made
    made.end()


@pytest.fixture
def server(session: FakeSession, page: Path) -> Iterator[ConsoleServer]:
    with ConsoleServer(session, port=0, page=page) as made:
        yield made

"""The page's files: those that were in its folder at start, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from airground.errors import FileError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["PAGE", "PageFile", "find_page_files", "read_page_file"]

PAGE = Path(__file__).parent / "page"
"""Folder of the page."""

# Not from the system's table of types, which differs from machine to machine.
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".webmanifest": "application/manifest+json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".ico": "image/x-icon",
    ".woff2": "font/woff2",
}


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file as a browser gets it."""

    content: bytes
    """All of it."""

    media_type: str
    """As in the header ``Content-Type``."""

    tag: str
    """Changes with the content: header ``ETag``."""


def find_page_files(folder: Path) -> Mapping[str, Path]:
    """List what may be served. A request is looked up here, so that no path can lead elsewhere.

    Parameters
    ----------
    folder : Path
        Of the page.

    Returns
    -------
    files : mapping of str to Path
        By the path in the address; ``/`` is ``index.html``. No links, no hidden files, known types only.

    Raises
    ------
    FileError
        If there is no ``index.html``.
    """
    files: dict[str, Path] = {}
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        steps = [folder / Path(*inside.parts[: k + 1]) for k in range(len(inside.parts))]
        if any(step.is_symlink() or step.name.startswith(".") for step in steps):
            continue
        if path.is_file() and path.suffix in TYPES:
            files[f"/{inside.as_posix()}"] = path
    if "/index.html" not in files:
        raise FileError(str(folder / "index.html"), "the console's page is missing; install again")
    return files | {"/": files["/index.html"]}


def read_page_file(path: Path) -> PageFile:
    """Read a file of the page.

    Parameters
    ----------
    path : Path
        As `find_page_files` gave it.

    Returns
    -------
    file : PageFile
        As a browser gets it.

    Raises
    ------
    FileError
        If it has become a link, or cannot be read.
    """
    if path.is_symlink():
        raise FileError(str(path), "has become a link, and is not served")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FileError(str(path), f"cannot be read: {error.strerror or error}") from error
    return PageFile(content, TYPES[path.suffix], f'"{sha256(content).hexdigest()[:32]}"')

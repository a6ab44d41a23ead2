"""On which line of a TOML file a key stands; the parser of the standard library does not tell."""

from __future__ import annotations

import re

__all__ = ["TomlLines"]

_PART = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')"""
_PATH = rf"{_PART}(?:[ \t]*\.[ \t]*{_PART})*"
_HEADER = re.compile(rf"[ \t]*(\[\[?)[ \t]*({_PATH})[ \t]*\]")
_KEY = re.compile(rf"[ \t]*({_PATH})[ \t]*=")
_TOKEN = re.compile(
    r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*|[\[{]|[\]}]|\n|.',
    re.DOTALL,
)


class TomlLines:
    """Finds lines by the paths of their keys. Best effort: what it does not find is given the line of what holds it.

    Parameters
    ----------
    text : str
        A file that the parser has accepted.
    """

    def __init__(self, text: str) -> None:
        self._lines: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self._scan(text.replace("\r\n", "\n"))

    def line(self, path: str) -> int | None:
        """Where a key stands.

        Parameters
        ----------
        path : str
            As in messages: ``robots[1].limits.speed_mps``; tables in lists are counted from 0.

        Returns
        -------
        line : int or None
            The first is 1. None where not even the table is there.
        """
        while path:
            if path in self._lines:
                return self._lines[path]
            path = re.sub(r"(?:(?:^|\.)[^.\[\]]+|\[\d+\])$", "", path)
        return None

    def _scan(self, text: str) -> None:
        at, line, table = 0, 1, ""
        while at < len(text):
            header = _HEADER.match(text, at)
            key = None if header else _KEY.match(text, at)
            if header:
                table = self._table(_parts(header[2]), repeated=header[1] == "[[")
                self._lines.setdefault(table, line)
                end = header.end()
            elif key:
                path = ".".join([table, *_parts(key[1])] if table else _parts(key[1]))
                for whole in _prefixes(path, table):
                    self._lines.setdefault(whole, line)
                end = key.end()
            else:
                end = at
            at, line = _after_value(text, end, line)

    def _table(self, parts: list[str], *, repeated: bool) -> str:
        """Path of a table, with a number for each list on the way: the newest there is."""
        path = ""
        for k, part in enumerate(parts):
            path = f"{path}.{part}" if path else part
            if repeated and k == len(parts) - 1:
                self._counts[path] = self._counts.get(path, -1) + 1
            if path in self._counts:
                path = f"{path}[{self._counts[path]}]"
        return path


def _parts(path: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(_PART, path)]


def _prefixes(path: str, table: str) -> list[str]:
    """The path of a key with points in it, and of the tables that it makes."""
    rest = path[len(table) :].lstrip(".").split(".")
    start = [table] if table else []
    return [".".join([*start, *rest[: k + 1]]) for k in range(len(rest))]


def _after_value(text: str, at: int, line: int) -> tuple[int, int]:
    """Where the next statement begins: after a line end that is within no bracket and no text."""
    depth = 0
    while at < len(text):
        token = _TOKEN.match(text, at)
        assert token is not None  # the last alternative takes anything
        at = token.end()
        line += token[0].count("\n")
        if token[0] in "[{":
            depth += 1
        elif token[0] in "]}":
            depth -= 1
        elif token[0] == "\n" and depth <= 0:
            break
    return at, line

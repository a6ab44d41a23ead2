"""Tables of a site file, asked for their entries by name and type. Mistakes are gathered, not raised one by one."""

from __future__ import annotations

from dataclasses import fields
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from airground.errors import FileError, InputError
from airground.records.site_plain import flag, kind, number, shown, whole

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from airground.records.site_lines import TomlLines

__all__ = ["Mistakes", "SiteError", "Table"]


class SiteError(FileError):
    """A site file is wrong, in one place or several.

    Parameters
    ----------
    path : str
        The file.
    mistakes : sequence of (int or None, str)
        Line and text of each.
    """

    def __init__(self, path: str, mistakes: Sequence[tuple[int | None, str]]) -> None:
        self.lines = tuple(str(FileError(path, problem, line=line)) for line, problem in mistakes)
        """One for each mistake, as they are to be printed."""
        first, problem = mistakes[0]
        more = "".join(f"; {line}" for line in self.lines[1:])
        super().__init__(path, problem + more, line=first)


class Mistakes:
    """What is wrong with a file.

    Parameters
    ----------
    path : str
        The file.
    lines : TomlLines
        Of it.
    """

    def __init__(self, path: str, lines: TomlLines) -> None:
        self._path = path
        self._lines = lines
        self._found: list[tuple[int | None, str]] = []

    def add(self, key: str, problem: str) -> None:
        """Add one.

        Parameters
        ----------
        key : str
            Path of the key that it is about; empty for the file.
        problem : str
            What was found and what was expected.
        """
        said = (self._lines.line(key), f"{key}: {problem}" if key else problem)
        if said not in self._found:
            self._found.append(said)

    def raise_any(self) -> None:
        """Raise for all, in the order of the file.

        Raises
        ------
        SiteError
            If there is any.
        """
        if self._found:
            raise SiteError(self._path, sorted(self._found, key=lambda one: one[0] or 0))


class Table:
    """A table, asked for its entries.

    Parameters
    ----------
    mistakes : Mistakes
        Where what is wrong goes.
    path : str
        Of the table; empty for the whole file.
    value : object
        What TOML held.
    known : iterable of str
        Keys that it may have; others are mistakes.
    """

    def __init__(self, mistakes: Mistakes, path: str, value: object, known: Iterable[str]) -> None:
        self.mistakes = mistakes
        self.path = path
        self.value: dict[str, Any] = value if isinstance(value, dict) else {}
        self.known = tuple(known)
        if not isinstance(value, dict):
            mistakes.add(path, f"found {kind(value)}, expected a table")
        for key in self.value:
            if key not in self.known:
                mistakes.add(self.at(key), _unknown(key, self.known))

    def at(self, key: str) -> str:
        """Path of an entry.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        path : str
            As messages have it.
        """
        return f"{self.path}.{key}" if self.path else key

    def wrong(self, key: str, problem: str) -> None:
        """Say that an entry is wrong.

        Parameters
        ----------
        key : str
            Its name.
        problem : str
            What was found and what was expected.
        """
        self.mistakes.add(self.at(key), problem)

    def get(self, key: str, read: Callable[[object], Any], default: Any) -> Any:
        """An entry, or the default where it is missing or wrong.

        Parameters
        ----------
        key : str
            Its name.
        read : callable
            Gives what the value means; raises ValueError with what was expected.
        default : object
            Taken where there is none.

        Returns
        -------
        value : object
            Of the type that `read` gives.
        """
        if key not in self.value:
            return default
        try:
            return read(self.value[key])
        except ValueError as error:
            self.wrong(key, f"found {shown(self.value[key])}, expected {error}")
            return default

    def need(self, key: str, read: Callable[[object], Any], instead: Any) -> Any:
        """An entry that must be there.

        Parameters
        ----------
        key : str
            Its name.
        read : callable
            As for `get`.
        instead : object
            Taken where it is wrong, so that reading can go on.

        Returns
        -------
        value : object
            Of the type that `read` gives.
        """
        if key not in self.value:
            self.wrong(key, "is missing")
        return self.get(key, read, instead)

    def table(self, key: str, known: Iterable[str]) -> Table:
        """A table within; an empty one where there is none.

        Parameters
        ----------
        key : str
            Its name.
        known : iterable of str
            Keys that it may have.

        Returns
        -------
        table : Table
            To be asked.
        """
        return Table(self.mistakes, self.at(key), self.value.get(key, {}), known)

    def tables(self, key: str, known: Iterable[str]) -> list[Table]:
        """Tables of a list; none where there is no list.

        Parameters
        ----------
        key : str
            Its name.
        known : iterable of str
            Keys that each may have.

        Returns
        -------
        tables : list of Table
            In order.
        """
        value = self.value.get(key, [])
        if not isinstance(value, list):
            self.wrong(key, f"found {kind(value)}, expected a list of tables: [[{self.at(key)}]]")
            return []
        known = tuple(known)
        path = self.at(key)
        return [Table(self.mistakes, f"{path}[{k}]", one, known) for k, one in enumerate(value)]

    def build(self, make: Callable[..., Any]) -> Any:
        """An object whose fields are this table's keys, and which checks them itself.

        Parameters
        ----------
        make : type
            A dataclass; fields that are not in the table keep their defaults.

        Returns
        -------
        value : object
            With defaults where a key was wrong.
        """
        good: dict[str, Any] = {}
        for key in self.known:
            default = next(one.default for one in fields(make) if one.name == key)  # type: ignore[arg-type]
            read = flag if isinstance(default, bool) else whole if type(default) is int else number
            value = self.get(key, read, None)
            if value is None:
                continue
            try:
                make(**{key: value})
            except InputError as error:
                self.wrong(key, _rewritten(key, str(error)))
            else:
                good[key] = value
        try:
            return make(**good)
        except InputError as error:  # about several of them
            self.mistakes.add(self.path, str(error))
            return make()


def _unknown(key: str, known: tuple[str, ...]) -> str:
    near = get_close_matches(key, known, 1, 0.6)
    if near:
        return f"unknown key; did you mean {near[0]}?"
    return f"unknown key; known are {', '.join(known)}"


def _rewritten(key: str, message: str) -> str:
    """A dataclass names its field; here the path does."""
    return message.removeprefix(f"{key} ") if message.startswith(f"{key} ") else message

"""JSON objects, asked for their entries by name and type."""

from __future__ import annotations

import json
import math
from typing import Any

from airground.errors import FileError

__all__ = ["JsonReader"]


class JsonReader:
    """A JSON object whose entries are asked for by name and type; a mistake is named by its path.

    All methods raise FileError for an entry that is missing or of another type; those whose name ends in
    ``_or_none`` give None for one that is missing or null.

    Parameters
    ----------
    name : str
        What to call the file in an error.
    value : object
        What JSON held.
    where : str
        Path to it, with a point at its end; empty for the whole file.
    """

    def __init__(self, name: str, value: object, where: str = "") -> None:
        self.name = name
        self.where = where
        if not isinstance(value, dict):
            key = f"key {where.removesuffix('.')}: " if where else ""
            raise FileError(name, f"{key}expected a JSON object, found {_kind(value)}")
        self.value: dict[str, Any] = value

    def wrong(self, key: str, expected: str, found: object) -> FileError:
        """Error for an entry.

        Parameters
        ----------
        key : str
            Its name.
        expected : str
            What it should have been.
        found : object
            What it is.

        Returns
        -------
        error : FileError
            One line.
        """
        return FileError(
            self.name, f"key {self.where}{key}: expected {expected}, found {_kind(found)}"
        )

    def get(self, key: str) -> Any:
        """Entry as it is.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        value : Any
            May be null.
        """
        if key not in self.value:
            raise FileError(self.name, f"key {self.where}{key} is missing")
        return self.value[key]

    def has(self, key: str) -> bool:
        """Whether an entry is there and not null.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        there : bool
            False for null.
        """
        return self.value.get(key) is not None

    def text(self, key: str) -> str:
        """Entry that is a text.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        text : str
            May be empty.
        """
        value = self.get(key)
        if not isinstance(value, str):
            raise self.wrong(key, "a text", value)
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """Entry that is a list of texts.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        texts : tuple of str
            May be empty.
        """
        value = self.get(key)
        if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
            raise self.wrong(key, "a list of texts", value)
        return tuple(value)

    def number(self, key: str) -> float:
        """Entry that is a number.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        number : float
            Finite.
        """
        value = self.get(key)
        if not _is_number(value):
            raise self.wrong(key, "a number", value)
        return float(value)

    def count_or_none(self, key: str) -> int | None:
        """Entry that is a whole number, if it is there.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        count : int, optional
            Rounded towards zero.
        """
        return int(self.number(key)) if self.has(key) else None

    def number_or_none(self, key: str) -> float | None:
        """Entry that is a number, if it is there.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        number : float, optional
            Finite.
        """
        return self.number(key) if self.has(key) else None

    def sigma_or_none(self, key: str) -> float | None:
        """Entry that is a standard deviation, if it is there.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        sigma : float, optional
            Finite, not negative.
        """
        value = self.number_or_none(key)
        if value is not None and value < 0:
            raise self.wrong(key, "a number from 0 on", value)
        return value

    def pair_or_none(self, key: str, *, least: float = -math.inf) -> tuple[float, float] | None:
        """Entry that is two numbers, if it is there.

        Parameters
        ----------
        key : str
            Its name.
        least : float
            The smallest to accept.

        Returns
        -------
        pair : (float, float), optional
            Finite.
        """
        if not self.has(key):
            return None
        first, second = map(float, self.numbers(key, 2))
        if min(first, second) < least:
            raise self.wrong(key, f"2 numbers from {least:g} on", self.value[key])
        return first, second

    def numbers(self, key: str, count: int | None = None) -> Any:
        """Entry that is a list of so many numbers.

        Parameters
        ----------
        key : str
            Its name.
        count : int, optional
            How many; any number of them where not given.

        Returns
        -------
        numbers : tuple of float or int
            Finite.
        """
        value = self.get(key)
        fine = isinstance(value, list) and count in {None, len(value)}
        if not fine or not all(map(_is_number, value)):
            wanted = "a list of numbers" if count is None else f"{count} numbers"
            raise self.wrong(key, wanted, value)
        return tuple(value)

    def choice(self, key: str, known: tuple[str, ...]) -> Any:
        """Entry that is one of some words.

        Parameters
        ----------
        key : str
            Its name.
        known : tuple of str
            The words.

        Returns
        -------
        word : str
            One of them.
        """
        value = self.text(key)
        if value not in known:
            raise self.wrong(key, " or ".join(known), value)
        return value

    def part(self, key: str) -> JsonReader:
        """Entry that is an object.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        part : JsonReader
            Its entries.
        """
        return JsonReader(self.name, self.get(key), f"{self.where}{key}.")

    def parts(self) -> list[tuple[str, JsonReader]]:
        """All entries, which are objects.

        Returns
        -------
        parts : list of (str, JsonReader)
            Name and object.
        """
        return [(key, self.part(key)) for key in self.value]

    def items(self, key: str) -> list[JsonReader]:
        """Entry that is a list of objects.

        Parameters
        ----------
        key : str
            Its name.

        Returns
        -------
        items : list of JsonReader
            In order.
        """
        value = self.get(key)
        if not isinstance(value, list):
            raise self.wrong(key, "a list", value)
        return [JsonReader(self.name, v, f"{self.where}{key}[{k}].") for k, v in enumerate(value)]


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)  # JSON has no infinity, but 1e999 reads as one
    except OverflowError:
        return False


def _kind(value: object) -> str:
    try:
        text = json.dumps(value)
    except RecursionError:
        return "brackets in brackets"
    return text if len(text) <= 40 else f"{text[:37]}..."

"""The exception tree: as drawn, with its exit codes."""

from __future__ import annotations

import inspect
import re

import pytest

from airground import errors


def drawn() -> dict[str, tuple[str | None, int | None]]:
    """Name -> (name of the parent, exit code), read off the module's docstring."""
    assert errors.__doc__ is not None
    tree: dict[str, tuple[str | None, int | None]] = {}
    above: list[tuple[int, str]] = []
    for line in errors.__doc__.splitlines():
        match = re.match(r"    ([│ ]*(?:├── |└── )?)([A-Z]\w+Error)\b[^0-9]*(\d)?", line)
        if not match:
            continue
        indent, name, code = match.groups()
        depth = len(indent) // 4
        above = [(d, n) for d, n in above if d < depth]
        tree[name] = (above[-1][1] if above else None, int(code) if code else None)
        above.append((depth, name))
    return tree


CLASSES = {
    name: value
    for name, value in vars(errors).items()
    if inspect.isclass(value) and issubclass(value, errors.AirgroundError)
}


def test_the_drawing_holds_all_classes_and_no_others() -> None:
    assert set(drawn()) == set(CLASSES) == set(errors.__all__)


@pytest.mark.parametrize("name", CLASSES)
def test_parent_and_exit_code_are_as_drawn(name: str) -> None:
    parent, code = drawn()[name]
    cls = CLASSES[name]
    assert cls.__bases__[0].__name__ == (parent or "Exception")
    assert cls.exit_code == (1 if code is None else code)  # a bare AirgroundError is a bug of ours


def test_wrong_input_is_a_value_error_too() -> None:
    assert issubclass(errors.InputError, ValueError)


@pytest.mark.parametrize(
    ("where", "want"),
    [
        ({}, "t.csv: no rows"),
        ({"line": 3}, "t.csv:3: no rows"),
        ({"line": 3, "column": "u_px"}, "t.csv:3: column u_px: no rows"),
        ({"column": "u_px"}, "t.csv: column u_px: no rows"),
    ],
)
def test_file_errors_name_the_place(where: dict[str, int | str], want: str) -> None:
    error = errors.FileError("t.csv", "no rows", **where)  # type: ignore[arg-type]
    assert str(error) == want
    assert (error.path, error.problem) == ("t.csv", "no rows")
    assert (error.line, error.column) == (where.get("line"), where.get("column"))


def test_unobservable_motion_keeps_its_numbers() -> None:
    error = errors.UnobservableMotionError(
        "too few", rank=3, headings_deg=[1.0, 2.0], advice="drive on"
    )
    assert str(error) == "too few; drive on"
    assert (error.reason, error.rank, error.headings_deg, error.advice) == (
        "too few",
        3,
        (1.0, 2.0),
        "drive on",
    )

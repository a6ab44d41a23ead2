"""Rules about the text of the source: fields, sizes."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[2] / "src"
FILES = sorted(SRC.rglob("*.py"))
IDS = [str(path.relative_to(SRC)) for path in FILES]

MOST_LINES = 350


def is_dataclass(cls: ast.ClassDef) -> bool:
    for decorator in cls.decorator_list:
        call = decorator.func if isinstance(decorator, ast.Call) else decorator
        if getattr(call, "attr", getattr(call, "id", None)) == "dataclass":
            return True
    return False


def fields_without_a_string(tree: ast.AST) -> list[str]:
    missing = []
    for cls in ast.walk(tree):
        if not isinstance(cls, ast.ClassDef) or not is_dataclass(cls):
            continue
        for statement, after in zip(cls.body, [*cls.body[1:], None], strict=True):
            if not isinstance(statement, ast.AnnAssign):
                continue
            if "ClassVar" in ast.unparse(statement.annotation):
                continue
            told = (
                isinstance(after, ast.Expr)
                and isinstance(after.value, ast.Constant)
                and isinstance(after.value.value, str)
                and after.value.value.strip()
            )
            if not told:
                missing.append(f"{cls.name}.{ast.unparse(statement.target)}")
    return missing


def test_the_check_of_fields_can_fail() -> None:
    code = "@dataclass(frozen=True)\nclass A:\n    x: int\n    '''Told.'''\n    y: int\n    z: int = 0\n"
    assert fields_without_a_string(ast.parse(code)) == ["A.y", "A.z"]


@pytest.mark.parametrize("path", FILES, ids=IDS)
def test_every_field_of_a_dataclass_has_a_string_under_it(path: Path) -> None:
    assert fields_without_a_string(ast.parse(path.read_text("utf-8"))) == []


@pytest.mark.parametrize("path", FILES, ids=IDS)
def test_files_are_small(path: Path) -> None:
    assert len(path.read_text("utf-8").splitlines()) < MOST_LINES

"""Every public name is exported where it is defined, and every exported name exists."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

import pytest

import airground
from airground import errors
from walk import BROKEN, MODULES

if TYPE_CHECKING:
    from types import ModuleType


def public(module: ModuleType) -> list[str]:
    """Classes and functions that the module itself defines, without an underscore."""
    return [
        name
        for name, value in vars(module).items()
        if (inspect.isclass(value) or inspect.isfunction(value))
        and value.__module__ == module.__name__
        and not name.startswith("_")
    ]


def test_all_modules_can_be_imported() -> None:
    assert BROKEN == {}


def test_there_are_modules_to_look_at() -> None:
    assert {"airground", "airground.errors", "airground.geometry.velocity"} <= set(MODULES)


@pytest.mark.parametrize("name", sorted(MODULES))
def test_exported_names_exist_once_and_in_order(name: str) -> None:
    module = MODULES[name]
    exported = getattr(module, "__all__", [])
    assert [n for n in exported if not hasattr(module, n)] == []
    assert len(exported) == len(set(exported))


@pytest.mark.parametrize("name", sorted(MODULES))
def test_public_names_are_exported(name: str) -> None:
    module = MODULES[name]
    assert sorted(set(public(module)) - set(getattr(module, "__all__", []))) == []


@pytest.mark.parametrize("name", sorted(MODULES))
def test_modules_say_what_they_are_for(name: str) -> None:
    module = MODULES[name]
    assert (module.__doc__ or "").strip()


def test_the_package_exports_its_errors_if_any() -> None:
    """A user catches ag.InputError: all of the tree or none of it."""
    tree = set(errors.__all__)
    exported = tree & set(airground.__all__)
    assert exported in (set(), tree)

"""All modules of the package, for the tests of the project itself."""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING

import airground

if TYPE_CHECKING:
    from types import ModuleType

MODULES: dict[str, ModuleType] = {"airground": airground}
BROKEN: dict[str, str] = {}
"""Modules that cannot be imported, and why."""


def _walk(package: ModuleType) -> None:
    for info in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        if info.name == "airground.__main__":  # runs the command
            continue
        try:
            MODULES[info.name] = importlib.import_module(info.name)
        except ImportError as error:
            BROKEN[info.name] = repr(error)
        else:
            if info.ispkg:
                _walk(MODULES[info.name])


_walk(airground)

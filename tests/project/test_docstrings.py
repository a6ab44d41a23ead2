"""Every public function and class has a docstring, and it names exactly the parameters there are."""

from __future__ import annotations

import dataclasses
import inspect
from typing import TYPE_CHECKING, Any

import pytest
from numpydoc.docscrape import FunctionDoc, NumpyDocString  # type: ignore[import-untyped]

from walk import MODULES

if TYPE_CHECKING:
    from collections.abc import Callable


def own(value: Any, module: Any) -> bool:
    return bool(getattr(value, "__module__", None) == module.__name__)


CLASSES: dict[str, type] = {}
FUNCTIONS: dict[str, Callable[..., Any]] = {}
PROPERTIES: dict[str, property] = {}

for module in MODULES.values():
    for name, value in vars(module).items():
        if name.startswith("_") or not own(value, module):
            continue
        path = f"{module.__name__}.{name}"
        if inspect.isfunction(value):
            FUNCTIONS[path] = value
        elif inspect.isclass(value):
            CLASSES[path] = value
            for cls in value.__mro__:  # a private base's public methods are the public class's
                if not cls.__module__.startswith("airground."):
                    continue
                for key, raw in vars(cls).items():
                    member = getattr(raw, "__func__", raw)  # classmethod, staticmethod
                    if key.startswith("_"):
                        continue
                    if inspect.isfunction(member):
                        FUNCTIONS[f"{path}.{key}"] = member
                    elif isinstance(member, property):
                        PROPERTIES[f"{path}.{key}"] = member


def signature_names(function: Callable[..., Any]) -> list[str]:
    stars: dict[Any, str] = {
        inspect.Parameter.VAR_POSITIONAL: "*",
        inspect.Parameter.VAR_KEYWORD: "**",
    }
    return [
        stars.get(p.kind, "") + p.name
        for p in inspect.signature(function).parameters.values()
        if p.name not in ("self", "cls") and not p.name.startswith("_")
    ]


def documented_names(doc: NumpyDocString) -> list[str]:
    names = [p.name for p in [*doc["Parameters"], *doc["Other Parameters"]]]
    return [n.strip().replace("\\", "") for joined in names for n in joined.split(",")]


def summary(value: object) -> str:
    return " ".join(inspect.cleandoc(value.__doc__ or "").split("\n\n")[0].split())


def test_there_is_something_to_look_at() -> None:
    assert "airground.geometry.limited.LimitedHomography.image_velocity" in FUNCTIONS
    assert "airground.geometry.limited.LimitedHomography.from_homography" in FUNCTIONS
    assert "airground.calibration.recordings.Tracks.rows" in FUNCTIONS
    assert "airground.geometry.limited.LimitedHomography.horizon" in PROPERTIES


@pytest.mark.parametrize("path", sorted({*CLASSES, *FUNCTIONS, *PROPERTIES}))
def test_docstring_opens_with_a_sentence(path: str) -> None:
    value = CLASSES.get(path) or FUNCTIONS.get(path) or PROPERTIES.get(path)
    text = summary(value)
    assert text
    assert text[-1] in ".:?", f"{text!r} is no sentence"
    assert not text.startswith(f"{path.rsplit('.', 1)[-1]}("), "a generated docstring"


@pytest.mark.parametrize("path", sorted(FUNCTIONS))
def test_parameters_of_functions(path: str) -> None:
    function = FUNCTIONS[path]
    assert documented_names(FunctionDoc(function)) == signature_names(function)


@pytest.mark.parametrize("path", sorted(FUNCTIONS))
def test_what_comes_out_is_documented(path: str) -> None:
    function = FUNCTIONS[path]
    returned = inspect.signature(function).return_annotation
    doc = FunctionDoc(function)
    if returned in ("None", None, "NoReturn", "Never"):
        assert not doc["Returns"]
    elif signature_names(function):
        assert doc["Returns"] or doc["Yields"]


@pytest.mark.parametrize("path", sorted(CLASSES))
def test_parameters_of_classes(path: str) -> None:
    """Fields of dataclasses have their own strings (test_fields.py); others name what __init__ takes."""
    cls = CLASSES[path]
    doc = NumpyDocString(inspect.cleandoc(cls.__doc__ or ""))
    init = vars(cls).get("__init__")
    by_hand = inspect.isfunction(init) and not dataclasses.is_dataclass(cls)
    by_hand = by_hand and not getattr(cls, "_is_protocol", False)
    wanted = signature_names(init) if by_hand and init is not None else []
    assert documented_names(doc) == wanted

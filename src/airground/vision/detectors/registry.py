"""Detectors by name, as the command line takes them: ``name``, ``name:key=value,key=value``, a function or a model."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from airground.vision.detectors.protocol import Detector

__all__ = ["make_detector", "names_of_detectors"]


class _Kind(NamedTuple):
    """A named detector: how it is made, and what its keys take."""

    make: Callable[..., Detector]
    keys: Mapping[str, Callable[[str], Any]]


def make_detector(text: str) -> Detector:
    """Make a detector from what a user typed.

    Parameters
    ----------
    text : str
        ``auto``, ``apriltag``, ``aruco``, ``tag:family=36h11+25h9``, ``led``, ``blob:color=red``, ``moving``,
        ``point:at=640,360+100,200``, ``package.module:function`` or ``model.onnx``. Options follow a colon.

    Returns
    -------
    detector : Detector
        Fresh: it remembers no frame.

    Raises
    ------
    InputError
        If there is no such detector, or it has no such key, or a value is wrong; the message lists what there is.
    """
    text = text.strip()
    model = re.fullmatch(r"(?P<path>.+\.onnx)(?::(?P<options>[^\\/]*))?", text, re.IGNORECASE)
    if model:
        return _make(_MODEL, "model.onnx", model["options"] or "", path=model["path"])
    name, _, rest = text.partition(":")
    if name.lower() in _KINDS:
        return _make(_KINDS[name.lower()], name.lower(), rest)
    if re.fullmatch(r"[A-Za-z_][\w.]*:[A-Za-z_][\w.]*", text):
        return _function(text)
    raise InputError(f"no detector {text!r}; there are {', '.join(names_of_detectors())}")


def names_of_detectors() -> list[str]:
    """What `make_detector` takes.

    Returns
    -------
    names : list of str
        The names, then the two forms for detectors of the user's own.
    """
    return [*_KINDS, "package.module:function", "model.onnx"]


def _make(kind: _Kind, name: str, options: str, **fixed: Any) -> Detector:
    values: dict[str, Any] = dict(fixed)
    for option in re.split(r",(?=\s*[A-Za-z_]+\s*=)", options) if options.strip() else []:
        key, equals, value = (part.strip() for part in option.partition("="))
        if not equals or key not in kind.keys:
            raise InputError(
                f"detector {name} has no key {key!r}; it has {', '.join(kind.keys) or 'none'}, "
                "written key=value"
            )
        if key in values:
            raise InputError(f"detector {name}: {key} is given twice")
        try:
            values[key] = kind.keys[key](value)
        except (ValueError, OverflowError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(
                f"detector {name}: {key}={value!r} is not understood: {error}"
            ) from error
    return kind.make(**values)


def _auto(family: tuple[str, ...] = ()) -> Detector:
    from airground.vision.detectors.auto import AutoDetector

    return AutoDetector(family) if family else AutoDetector()


def _probe(names: tuple[str, ...]) -> Callable[..., Detector]:
    def make() -> Detector:
        from airground.vision.detectors.auto import AutoDetector

        return AutoDetector(names, otherwise_moving=False)

    return make


def _apriltag() -> Detector:
    from airground.vision.detectors.tag_families import APRILTAG

    return _probe(APRILTAG)()


def _aruco() -> Detector:
    from airground.vision.detectors.tag_families import ARUCO

    return _probe(ARUCO)()


def _tag(family: tuple[str, ...] = ("36h11",), **options: Any) -> Detector:
    from airground.vision.detectors.tags import TagDetector

    return TagDetector(family, **options)


def _led(**options: Any) -> Detector:
    from airground.vision.detectors.leds import LedDetector

    return LedDetector(**options)


def _blob(color: str = "red", **options: Any) -> Detector:
    from airground.vision.detectors.blobs import BlobDetector

    return BlobDetector(color, **options)


def _moving(**options: Any) -> Detector:
    from airground.vision.detectors.moving import MovingDetector

    return MovingDetector(**options)


def _point(at: tuple[tuple[float, float], ...] = ()) -> Detector:
    from airground.vision.detectors.flow import PointDetector

    if not at:
        raise InputError("detector point needs the points to follow: point:at=640,360+100,200")
    return PointDetector(at)


def _function(text: str) -> Detector:
    from airground.vision.detectors.custom import FunctionDetector

    return FunctionDetector.load(text)


def _onnx(path: str, score: float = 0.25, classes: tuple[int, ...] = ()) -> Detector:
    from airground.vision.detectors.onnx import OnnxDetector

    return OnnxDetector(path, least_score=score, classes=classes)


def _yes(text: str) -> bool:
    if text not in ("yes", "no"):
        raise ValueError("expected yes or no")
    return text == "yes"


def _names(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split("+") if part.strip())


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split("+"))


def _points(text: str) -> tuple[tuple[float, float], ...]:
    points = []
    for part in text.split("+"):
        u, comma, v = part.partition(",")
        if not comma:
            raise ValueError(f"{part!r} is not u,v")
        points.append((float(u), float(v)))
    return tuple(points)


_KINDS: dict[str, _Kind] = {
    "auto": _Kind(_auto, {"family": _names}),
    "apriltag": _Kind(_apriltag, {}),
    "aruco": _Kind(_aruco, {}),
    "tag": _Kind(
        _tag,
        {
            "family": _names,
            "least_side_px": float,
            "least_correlation": float,
            "rescan_frames": int,
        },
    ),
    "led": _Kind(_led, {"least_contrast": float, "most_size_px": float, "most": int}),
    "blob": _Kind(
        _blob, {"color": str, "least_size_px": float, "most_size_px": float, "single": _yes}
    ),
    "moving": _Kind(
        _moving, {"least_size_px": float, "most_size_px": float, "warm_up_frames": int, "at": str}
    ),
    "point": _Kind(_point, {"at": _points}),
}
_MODEL = _Kind(_onnx, {"score": float, "classes": _numbers})

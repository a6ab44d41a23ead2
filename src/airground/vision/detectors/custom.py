"""A detector of the user's own: any Python function from an image to points."""

from __future__ import annotations

import importlib
import inspect
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.errors import InputError
from airground.vision.detectors.images import colour_of
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.vision.frame import Frame

__all__ = ["FunctionDetector", "load_function"]

SIGMA_PX = 1.0


def load_function(text: str) -> Callable[..., Any]:
    """Import a function by name.

    Parameters
    ----------
    text : str
        ``package.module:function``; the module is looked for where Python looks.

    Returns
    -------
    function : callable
        That function, or what a class of that name makes when called without arguments, where that can be called.

    Raises
    ------
    InputError
        If the module or the function is not there, or cannot be called.
    """
    module_name, _, name = text.partition(":")
    if not module_name or not name:
        raise InputError(f"{text!r} must be package.module:function")
    try:
        value: Any = importlib.import_module(module_name)
    except ImportError as error:
        raise InputError(
            f"cannot import {module_name!r} of {text!r}: {error}; "
            "install it, or add its folder to PYTHONPATH"
        ) from error
    for part in name.split("."):
        if not hasattr(value, part):
            there = sorted(
                key
                for key, item in vars(value).items()
                if inspect.isfunction(item) and key[0] != "_"
            )
            more = ", ..." if len(there) > 8 else ""
            raise InputError(
                f"{module_name!r} has no {name!r}; it has {', '.join(there[:8]) or 'no functions'}{more}"
            )
        value = getattr(value, part)
    if inspect.isclass(value):
        try:
            value = value()
        except TypeError as error:
            raise InputError(f"{text!r} cannot be made without arguments: {error}") from error
    if not callable(value):
        raise InputError(f"{text!r} is {type(value).__name__}, not a function")
    function: Callable[..., Any] = value
    return function


class FunctionDetector:
    """Calls a function for each frame.

    The function takes the image, (H, W, 3) of 8 bits in the order blue, green, red, and the time [s] too where it has
    a second parameter. It gives an (N, 2) array of u and v [px], or (N, 3) of u, v and their standard deviation [px],
    or `Sightings`, or None for nothing.

    Parameters
    ----------
    function : callable
        As above.
    sigma_px : float
        Standard deviation [px] for answers that state none.
    name : str
        What to call it in errors; its own name if empty.
    """

    def __init__(
        self, function: Callable[..., Any], *, sigma_px: float = SIGMA_PX, name: str = ""
    ) -> None:
        if not callable(function):
            raise InputError(f"a detector must be a function, not {type(function).__name__}")
        if not (np.isfinite(sigma_px) and sigma_px > 0):
            raise InputError(f"sigma_px must be positive, not {sigma_px}")
        self._function = function
        self._name = name or getattr(function, "__name__", type(function).__name__)
        self._sigma_px = sigma_px
        self._wants_time = _wants_time(function)

    @classmethod
    def load(cls, text: str, *, sigma_px: float = SIGMA_PX) -> FunctionDetector:
        """Import the function by name.

        Parameters
        ----------
        text : str
            ``package.module:function``.
        sigma_px : float
            Standard deviation [px] for answers that state none.

        Returns
        -------
        detector : FunctionDetector
            That calls it.

        Raises
        ------
        InputError
            If there is no such function.
        """
        return cls(load_function(text), sigma_px=sigma_px, name=text)

    def detect(self, frame: Frame) -> Sightings:
        """Ask the function.

        Parameters
        ----------
        frame : Frame
            The next frame.

        Returns
        -------
        sightings : Sightings
            At the frame's time.

        Raises
        ------
        InputError
            If the answer has another shape, NaN, or a deviation that is not positive.
        """
        image = colour_of(frame)
        answer = self._function(image, frame.t) if self._wants_time else self._function(image)
        if answer is None:
            return Sightings.none(frame.t)
        if isinstance(answer, Sightings):
            return _at(answer, frame.t)
        return self._from_array(answer, frame.t)

    def _from_array(self, answer: Any, t: float) -> Sightings:
        where = f"detector {self._name} at t = {t:.3f} s"
        try:
            array = np.asarray(answer, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"{where}: found no array of numbers: {error}") from error
        if array.size == 0:
            return Sightings.none(t)
        if array.ndim != 2 or array.shape[1] not in (2, 3):
            raise InputError(
                f"{where}: found shape {array.shape}, expected (N, 2) of u, v or (N, 3) of u, v, sigma"
            )
        if not np.isfinite(array).all():
            row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
            raise InputError(f"{where}: row {row} has NaN or infinite entries; leave it out")
        sigma = array[:, 2] if array.shape[1] == 3 else np.full(len(array), self._sigma_px)
        if not (sigma > 0).all():
            row = int(np.flatnonzero(sigma <= 0)[0])
            raise InputError(f"{where}: row {row} has sigma {sigma[row]:g}, expected more than 0")
        return Sightings.round(t, array[:, :2], sigma)


def _at(sightings: Sightings, t: float) -> Sightings:
    """The frame's time, whatever the function wrote there."""
    if sightings.t == t:
        return sightings
    return Sightings(
        t,
        sightings.uv,
        sightings.covariance,
        sightings.labels,
        sightings.angle,
        sightings.angle_sigma,
        sightings.score,
        sightings.outline,
    )


def _wants_time(function: Callable[..., Any]) -> bool:
    """Whether it has a second positional parameter."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # some functions written in C
        return False
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    needed = [p for p in parameters if p.kind in kinds]
    return len(needed) >= 2 and (
        needed[1].default is inspect.Parameter.empty or needed[1].name == "t"
    )

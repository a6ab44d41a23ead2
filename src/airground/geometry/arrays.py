"""Arrays at the door: copied, checked, made read-only."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["LARGEST", "FloatArray", "homogeneous", "numbers", "points", "readonly", "refuse_huge"]

FloatArray = NDArray[np.float64]

LARGEST = 1e15
"""No pixel, metre or second of ours is beyond it, and products of several numbers within it stay finite."""


def numbers(value: ArrayLike, name: str) -> FloatArray:
    """Give an array of float64, copied only where it has to be.

    Parameters
    ----------
    value : array_like
        What the caller gave.
    name : str
        What to call it in an error.

    Returns
    -------
    array : array
        As float64; NaN passes.

    Raises
    ------
    InputError
        If it does not hold real numbers, or its rows differ in length.
    """
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:  # an int may be too large
        raise InputError(f"{name} must be an array of numbers: {error}") from error


def readonly(value: ArrayLike, shape: tuple[int | None, ...], name: str) -> FloatArray:
    """Our own read-only copy of a finite array.

    Parameters
    ----------
    value : array_like
        What the caller gave.
    shape : tuple of int or None
        Wanted shape; None admits any length.
    name : str
        What to call it in an error.

    Returns
    -------
    array : array
        A float64 copy that cannot be written to.

    Raises
    ------
    InputError
        If the shape differs or an entry is NaN or infinite.
    """
    array = np.array(numbers(value, name))
    same = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not same:
        wanted = "(" + ", ".join("N" if n is None else str(n) for n in shape) + ")"
        raise InputError(f"{name} must have shape {wanted}, not {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{name} has NaN or infinite entries")
    array.flags.writeable = False
    return array


def refuse_huge(array: ArrayLike, name: str) -> None:
    """Raise for numbers whose products would overflow.

    Parameters
    ----------
    array : array_like
        Finite numbers.
    name : str
        What to call them in an error.

    Raises
    ------
    InputError
        If one of them is beyond `LARGEST`.
    """
    largest = float(np.max(np.abs(array), initial=0.0))
    if largest > LARGEST:
        raise InputError(
            f"{name}: found {largest:.3g}, expected at most {LARGEST:g}; check the units"
        )


def points(value: ArrayLike, name: str) -> FloatArray:
    """Give an array whose last axis holds two coordinates.

    Parameters
    ----------
    value : (..., 2) array_like
        Points or vectors of the plane.
    name : str
        What to call it in an error.

    Returns
    -------
    array : (..., 2) array
        As float64; NaN passes, as a batch may hold points that are not known.

    Raises
    ------
    InputError
        If it does not hold numbers, or its last axis does not have two entries.
    """
    array = numbers(value, name)
    if array.ndim == 0 or array.shape[-1] != 2:
        raise InputError(f"{name} must have two entries on its last axis, not shape {array.shape}")
    return array


def homogeneous(xy: FloatArray, last: float = 1.0) -> FloatArray:
    """Append a coordinate: 1 for points, 0 for directions.

    Parameters
    ----------
    xy : (..., 2) array
        Points or directions.
    last : float
        The coordinate to append.

    Returns
    -------
    array : (..., 3) array
        Homogeneous coordinates.
    """
    return np.concatenate([xy, np.full((*xy.shape[:-1], 1), last)], axis=-1)

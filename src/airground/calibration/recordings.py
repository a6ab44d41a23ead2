"""What recordings hold: sightings of targets in the image, and readings of how they move on the ground.

Rows of several targets share one set of columns, sorted by target and time, so that everything below works on
whole columns.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from airground.geometry.arrays import LARGEST, FloatArray, readonly, refuse_huge

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

__all__ = ["IntArray", "Motion", "Tracks", "refuse_extremes"]

IntArray = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Rows of several targets, sorted by target and then by time."""

    targets: tuple[str, ...]
    """Names of the targets, each once."""

    target_index: IntArray
    """(N,). Which of `targets` a row belongs to; ascending."""

    t: FloatArray
    """(N,) [s]. Time; strictly ascending within a target."""

    def _check_rows(self) -> int:
        """Bring the shared columns into form; give the number of rows."""
        t = readonly(self.t, (None,), "t")
        index = np.array(self.target_index, dtype=np.intp)
        targets = tuple(str(name) for name in self.targets)
        if len(set(targets)) != len(targets) or "" in targets:
            raise InputError("target names must be distinct and not empty")
        if index.shape != t.shape:
            raise InputError(f"target_index must have shape {t.shape}, not {index.shape}")
        if len(t) == 0:
            raise InputError("there are no rows")
        if index.min() < 0 or index.max() >= len(targets):
            raise InputError(f"target_index must lie in 0..{len(targets) - 1}")
        step = np.diff(index)
        if (step < 0).any() or (np.diff(t)[step == 0] <= 0).any():
            raise InputError(
                "rows must be sorted by target, and times ascend strictly; use from_rows"
            )
        index.flags.writeable = False
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "target_index", index)
        object.__setattr__(self, "targets", targets)
        return len(t)

    def __len__(self) -> int:
        return len(self.t)

    def rows(self, target: str) -> slice:
        """Where a target's rows stand.

        Parameters
        ----------
        target : str
            Its name.

        Returns
        -------
        rows : slice
            Empty for a name that does not occur.
        """
        if target not in self.targets:
            return slice(0, 0)
        k = self.targets.index(target)
        first, last = np.searchsorted(self.target_index, [k, k + 1])
        return slice(int(first), int(last))


def _order(
    target: Sequence[str] | NDArray[np.str_], t: ArrayLike
) -> tuple[tuple[str, ...], IntArray, IntArray]:
    """Names in the order of their first row, index of each row, and the order that sorts rows."""
    times = readonly(t, (None,), "t")
    column = np.asarray(target, dtype=np.str_)
    if column.shape != times.shape:
        raise InputError(
            f"target must have shape {times.shape}, one name for each time, not {column.shape}"
        )
    names, first, inverse = np.unique(column, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    index = rank[inverse]
    order = np.lexsort((times, index))
    return tuple(str(names[k]) for k in np.argsort(first)), index[order], order


def _optional(
    value: ArrayLike | None, count: int, name: str, *, positive: bool = False
) -> FloatArray | None:
    if value is None:
        return None
    column = readonly(value, (count,), name)
    if positive and not (column > 0).all():
        raise InputError(f"{name} must be positive")
    return column


def _take(
    value: ArrayLike | None, order: IntArray, name: str, width: tuple[int, ...] = ()
) -> FloatArray | None:
    """Bring a column into order, once its shape is known to fit."""
    return None if value is None else readonly(value, (len(order), *width), name)[order]


@dataclass(frozen=True, slots=True, eq=False)
class Tracks(_Rows):
    """Sightings: where targets were seen in the image, and when."""

    uv: FloatArray
    """(N, 2) [px]. Position; (0, 0) is the centre of the top-left pixel, and v points down."""

    sigma: FloatArray | None = None
    """(N,) [px]. Standard deviation of each coordinate, where the detector states it."""

    def __post_init__(self) -> None:
        count = self._check_rows()
        object.__setattr__(self, "uv", readonly(self.uv, (count, 2), "uv"))
        object.__setattr__(self, "sigma", _optional(self.sigma, count, "sigma", positive=True))

    @classmethod
    def from_rows(
        cls,
        t: ArrayLike,
        target: Sequence[str] | NDArray[np.str_],
        uv: ArrayLike,
        sigma: ArrayLike | None = None,
    ) -> Self:
        """Sort rows that come in any order.

        Parameters
        ----------
        t : (N,) array_like [s]
            Times.
        target : sequence of str
            Names, one for each row.
        uv : (N, 2) array_like [px]
            Positions.
        sigma : (N,) array_like, optional [px]
            Standard deviations.

        Returns
        -------
        tracks : Tracks
            The same rows, sorted by target and time.

        Raises
        ------
        InputError
            If shapes differ, an entry is not finite, or a target has two rows at one time.
        """
        names, index, order = _order(target, t)
        return cls(
            targets=names,
            target_index=index,
            t=np.asarray(t, dtype=np.float64)[order],
            uv=readonly(uv, (len(order), 2), "uv")[order],
            sigma=_take(sigma, order, "sigma"),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Motion(_Rows):
    """Readings: how targets said that they move on the ground.

    Either `xy_dot`, or `heading` with `speed` or `distance` or both.
    """

    xy_dot: FloatArray | None = None
    """(N, 2) [m/s]. Ground velocity in a frame that does not turn."""

    heading: FloatArray | None = None
    """(N,) [rad]. Counter-clockwise from x; may wrap, and its zero is arbitrary."""

    speed: FloatArray | None = None
    """(N,) [m/s]. Along the heading; negative in reverse."""

    distance: FloatArray | None = None
    """(N,) [m]. Cumulative odometer; used in preference to the speed."""

    sigma_speed: FloatArray | None = None
    """(N,) [m/s]. Standard deviation of the speed, where the robot states it."""

    sigma_heading: FloatArray | None = None
    """(N,) [rad]. Standard deviation of the heading, where the robot states it."""

    def __post_init__(self) -> None:
        count = self._check_rows()
        if self.xy_dot is not None:
            object.__setattr__(self, "xy_dot", readonly(self.xy_dot, (count, 2), "xy_dot"))
        for name in ("heading", "speed", "distance"):
            object.__setattr__(self, name, _optional(getattr(self, name), count, name))
        for name in ("sigma_speed", "sigma_heading"):
            object.__setattr__(
                self, name, _optional(getattr(self, name), count, name, positive=True)
            )
        along = self.speed is not None or self.distance is not None
        if (self.xy_dot is None) == (self.heading is None) or along != (self.heading is not None):
            raise InputError("give either xy_dot, or heading with speed or distance or both")

    @classmethod
    def from_rows(
        cls,
        t: ArrayLike,
        target: Sequence[str] | NDArray[np.str_],
        *,
        xy_dot: ArrayLike | None = None,
        heading: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        distance: ArrayLike | None = None,
        sigma_speed: ArrayLike | None = None,
        sigma_heading: ArrayLike | None = None,
    ) -> Self:
        """Sort rows that come in any order.

        Parameters
        ----------
        t : (N,) array_like [s]
            Times.
        target : sequence of str
            Names, one for each row.
        xy_dot : (N, 2) array_like, optional [m/s]
            Ground velocities.
        heading : (N,) array_like, optional [rad]
            Headings.
        speed : (N,) array_like, optional [m/s]
            Speeds along the heading.
        distance : (N,) array_like, optional [m]
            Cumulative odometer.
        sigma_speed : (N,) array_like, optional [m/s]
            Standard deviations of the speed.
        sigma_heading : (N,) array_like, optional [rad]
            Standard deviations of the heading.

        Returns
        -------
        motion : Motion
            The same rows, sorted by target and time.

        Raises
        ------
        InputError
            If shapes differ, an entry is not finite, or a target has two rows at one time.
        """
        names, index, order = _order(target, t)
        return cls(
            targets=names,
            target_index=index,
            t=np.asarray(t, dtype=np.float64)[order],
            xy_dot=_take(xy_dot, order, "xy_dot", (2,)),
            heading=_take(heading, order, "heading"),
            speed=_take(speed, order, "speed"),
            distance=_take(distance, order, "distance"),
            sigma_speed=_take(sigma_speed, order, "sigma_speed"),
            sigma_heading=_take(sigma_heading, order, "sigma_heading"),
        )


def refuse_extremes(rows: Tracks | Motion, what: str) -> None:
    """Raise for recordings whose numbers can be kept in a file, but not computed with.

    Parameters
    ----------
    rows : Tracks or Motion
        Recordings.
    what : str
        What to call them in an error.

    Raises
    ------
    InputError
        If a number is beyond `LARGEST`, or two times of a target are closer than one over it.
    """
    for field in fields(rows):
        if field.name != "targets" and (column := getattr(rows, field.name)) is not None:
            refuse_huge(column, f"{what}, {field.name}")
    step = np.diff(rows.t)[np.diff(rows.target_index) == 0]
    if (step < 1 / LARGEST).any():
        raise InputError(
            f"{what}: two times of a target are {step.min():.3g} s apart; check the units"
        )

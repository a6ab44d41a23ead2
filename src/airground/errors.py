"""Everything that airground raises on purpose.

::

    AirgroundError                      exit code of the command line
    ├── InputError (ValueError)         2   a command, file or array is wrong
    │   ├── SampleError                 2   motion correspondences are not well formed
    │   ├── FileError                   2   a file is wrong, at a line and column
    │   └── NoWayError                  2   no way leads to a goal, round what is in between
    ├── UndeterminedError               3   the data are well formed but do not determine the answer
    │   ├── UnobservableMotionError     3   more than one g explains the motion
    │   └── UndeterminedCameraError     3   g is known, but not the camera's focal length
    └── UnreachableError                4   a camera, robot or server cannot be reached or was lost

A message is one line: what is wrong, where, what was expected, what to do. The numbers in it are attributes too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = [
    "AirgroundError",
    "FileError",
    "InputError",
    "NoWayError",
    "SampleError",
    "UndeterminedCameraError",
    "UndeterminedError",
    "UnobservableMotionError",
    "UnreachableError",
]


class AirgroundError(Exception):
    """Base of all errors that airground raises on purpose."""

    exit_code: ClassVar[int] = 1


class InputError(AirgroundError, ValueError):
    """A command, a file or an array is wrong; the message says what would have been right."""

    exit_code: ClassVar[int] = 2


class SampleError(InputError):
    """Motion correspondences are not well formed: a wrong shape, a NaN."""


class FileError(InputError):
    """A file is wrong.

    Parameters
    ----------
    path : str
        The file.
    problem : str
        What was found and what was expected.
    line : int, optional
        Line in the file, the first is 1.
    column : str, optional
        Name of the column.
    """

    def __init__(
        self, path: str, problem: str, *, line: int | None = None, column: str | None = None
    ) -> None:
        where = path if line is None else f"{path}:{line}"
        where = where if column is None else f"{where}: column {column}"
        super().__init__(f"{where}: {problem}")
        self.path = path
        self.problem = problem
        self.line = line
        self.column = column


class NoWayError(InputError):
    """No way leads from a start to a goal.

    Parameters
    ----------
    problem : str
        What is wrong with which of them.
    nearest_uv : (float, float), optional [px]
        Place nearest to what was asked for, on the ground, that the robot can reach or set out from.
    """

    def __init__(self, problem: str, nearest_uv: tuple[float, float] | None = None) -> None:
        where = ""
        if nearest_uv is not None:
            where = f"; nearest is ({nearest_uv[0]:.1f}, {nearest_uv[1]:.1f}) px"
        super().__init__(problem + where)
        self.nearest_uv = nearest_uv


class UndeterminedError(AirgroundError):
    """The data are well formed, but do not determine what was asked for."""

    exit_code: ClassVar[int] = 3


class UnobservableMotionError(UndeterminedError):
    """The motion leaves more than one g possible.

    Parameters
    ----------
    reason : str
        What is missing.
    rank : int
        Independent constraints that the motion gives; eq. 16 needs 5.
    headings_deg : sequence of float
        Distinct ground headings that were driven, modulo 180 degrees.
    advice : str
        What to drive next.
    """

    def __init__(
        self, reason: str, *, rank: int, headings_deg: Sequence[float], advice: str
    ) -> None:
        super().__init__(f"{reason}; {advice}")
        self.reason = reason
        self.rank = rank
        self.headings_deg = tuple(headings_deg)
        self.advice = advice


class UndeterminedCameraError(UndeterminedError):
    """g does not determine the focal length: the camera looks straight down, or its pixels are not square."""


class UnreachableError(AirgroundError):
    """A camera, a robot or a server cannot be reached, or was lost."""

    exit_code: ClassVar[int] = 4

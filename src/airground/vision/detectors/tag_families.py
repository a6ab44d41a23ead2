"""Names of the tag families, and what their tags look like."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.geometry.arrays import FloatArray

__all__ = ["APRILTAG", "ARUCO", "TagFamily", "families_named", "family"]

APRILTAG = ("36h11", "25h9", "16h5", "36h10")
"""The AprilTag families; the first is the usual one."""

ARUCO = ("4x4", "5x5", "6x6", "7x7", "original", "mip36h12")
"""The ArUco dictionaries, whole: those of 50, 100 and 250 tags are the beginnings of these, of 1000."""

_COUNTS = ("50", "100", "250", "1000")
_OPENCV = {
    **{name: f"DICT_APRILTAG_{name}" for name in APRILTAG},
    "original": "DICT_ARUCO_ORIGINAL",
    "mip36h12": "DICT_ARUCO_MIP_36h12",
    **{f"{n}x{n}": f"DICT_{n}X{n}_1000" for n in (4, 5, 6, 7)},
    **{f"{n}x{n}_{count}": f"DICT_{n}X{n}_{count}" for n in (4, 5, 6, 7) for count in _COUNTS},
}


@dataclass(frozen=True, slots=True, eq=False)
class TagFamily:
    """The tags of one dictionary."""

    name: str
    """Such as "36h11" or "4x4_50"."""

    dictionary: cv2.aruco.Dictionary
    """OpenCV's table of them."""

    @property
    def cells(self) -> int:
        """Cells along a side of the black square, its border included."""
        return int(self.dictionary.markerSize) + 2

    def pattern(self, number: int) -> FloatArray:
        """What a tag looks like.

        Parameters
        ----------
        number : int
            Which tag.

        Returns
        -------
        pattern : (cells, cells) array
            0 where it is black, 1 where it is white; the first row is the top as printed.
        """
        return _pattern(self.name, number)


@cache
def _pattern(name: str, number: int) -> FloatArray:
    tags = family(name)
    image = cv2.aruco.generateImageMarker(tags.dictionary, number, tags.cells)
    pattern = np.asarray(image, dtype=np.float64) / 255.0
    pattern.flags.writeable = False
    return pattern


@cache
def family(name: str) -> TagFamily:
    """Look a family up.

    Parameters
    ----------
    name : str
        One of `APRILTAG` or `ARUCO`, or a smaller ArUco dictionary such as "4x4_50".

    Returns
    -------
    family : TagFamily
        With OpenCV's dictionary.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in _OPENCV:
        raise InputError(
            f"no tag family {name!r}; there are {', '.join((*APRILTAG, *ARUCO))}, "
            "and 4x4_50 to 7x7_1000"
        )
    number = getattr(cv2.aruco, _OPENCV[name])
    return TagFamily(name, cv2.aruco.getPredefinedDictionary(number))


def families_named(names: Sequence[str]) -> tuple[TagFamily, ...]:
    """Look families up, each once.

    Parameters
    ----------
    names : sequence of str
        Names as `family` takes them.

    Returns
    -------
    families : tuple of TagFamily
        In the order asked for.

    Raises
    ------
    InputError
        If one is not known, or none is named.
    """
    if isinstance(names, str):
        names = (names,)
    if not names:
        raise InputError("name one tag family or more, such as 36h11")
    return tuple(family(name) for name in dict.fromkeys(name.lower() for name in names))

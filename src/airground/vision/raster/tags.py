"""Cells of printed tags: AprilTag and ArUco families."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError

__all__ = ["FAMILIES", "tag_cells"]

FAMILIES = {
    "16h5": "DICT_APRILTAG_16h5",
    "25h9": "DICT_APRILTAG_25h9",
    "36h10": "DICT_APRILTAG_36h10",
    "36h11": "DICT_APRILTAG_36h11",
    **{
        f"{n}x{n}_{count}": f"DICT_{n}X{n}_{count}"
        for n in (4, 5, 6, 7)
        for count in (50, 100, 250, 1000)
    },
}
"""Our names of the families, and OpenCV's."""


def tag_cells(family: str, number: int) -> NDArray[np.bool_]:
    """Black and white cells of an upright tag, with its black border and without the white around it.

    Parameters
    ----------
    family : str
        One of `FAMILIES`.
    number : int
        Of the tag within its family.

    Returns
    -------
    cells : (N, N) array of bool
        True for white; row 0 is the top.

    Raises
    ------
    InputError
        If the family is not known or has no such tag.
    """
    if family not in FAMILIES:
        raise InputError(f"tag family must be one of {', '.join(FAMILIES)}, not {family!r}")
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, FAMILIES[family]))
    count = len(dictionary.bytesList)
    if not 0 <= number < count:
        raise InputError(f"tags of {family} have numbers 0 to {count - 1}, not {number}")
    side = dictionary.markerSize + 2
    picture = cv2.aruco.generateImageMarker(dictionary, number, side, borderBits=1)
    return np.asarray(picture > 127)

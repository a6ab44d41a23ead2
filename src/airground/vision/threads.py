"""How many threads OpenCV may use."""

from __future__ import annotations

import cv2

__all__ = ["use_threads"]


def use_threads(count: int) -> None:
    """Set how many threads OpenCV uses for one image, in this process.

    Where a loop must not wait, one is best: several threads of one image wait for each other on a busy machine.

    Parameters
    ----------
    count : int
        1 or more; 0 for as many as there are cores.
    """
    cv2.setNumThreads(count if count > 0 else -1)

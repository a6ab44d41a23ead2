"""Memory that two processes share, for some images of one size: one writes, the other reads."""

from __future__ import annotations

from multiprocessing.shared_memory import SharedMemory
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.vision.frame import ImageArray

__all__ = ["SharedImages"]

MARK_BYTES = 8
NO_MARK = -1


class SharedImages:
    """Room for images of one size. Who makes it lets go of it last.

    Parameters
    ----------
    shape : tuple of int
        Of one image: (H, W, 3) or (H, W).
    count : int
        How many.
    name : str, optional
        Of memory that another process has made; new memory where not given.
    """

    def __init__(self, shape: tuple[int, ...], count: int = 1, name: str | None = None) -> None:
        self.shape = shape
        """Of one image."""
        self.count = count
        """How many there is room for."""
        self._made = name is None
        marks = count * MARK_BYTES
        size = marks + count * int(np.prod(shape))
        self._memory = SharedMemory(name, create=self._made, size=size)
        self._marks: NDArray[np.int64] | None = np.ndarray(count, np.int64, self._memory.buf)
        self._images: ImageArray | None = np.ndarray(
            (count, *shape), np.uint8, self._memory.buf, offset=marks
        )
        if self._made:
            self._marks[:] = NO_MARK

    @property
    def name(self) -> str:
        """By which another process opens it."""
        return self._memory.name

    def write(self, mark: int, image: ImageArray) -> None:
        """Put an image in, in place of the oldest.

        Parameters
        ----------
        mark : int
            Its number: 0, 1, 2, ...
        image : array
            Of the shape of all.
        """
        assert self._images is not None
        assert self._marks is not None
        slot = mark % self.count
        self._marks[slot] = NO_MARK  # while it is half written
        self._images[slot] = image
        self._marks[slot] = mark

    def read(self, mark: int) -> ImageArray | None:
        """Take an image out.

        Parameters
        ----------
        mark : int
            Its number.

        Returns
        -------
        image : array or None
            A copy; None where newer ones have taken its place, or it was never written.
        """
        assert self._images is not None
        assert self._marks is not None
        slot = mark % self.count
        if self._marks[slot] != mark:
            return None
        image: ImageArray = self._images[slot].copy()
        # It may have been overwritten meanwhile.
        return image if self._marks[slot] == mark else None

    def close(self) -> None:
        """Let go of it; calling it again does nothing."""
        if self._images is None:
            return
        self._images = self._marks = None
        self._memory.close()
        if self._made:
            self._memory.unlink()

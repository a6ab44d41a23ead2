"""An image, and when it was taken."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from airground.geometry.arrays import LARGEST

__all__ = ["Clock", "Frame", "ImageArray"]

ImageArray = NDArray[np.uint8]

Clock = Literal["media", "device", "arrival", "wall", "name", "rate", "world"]
"""Where a frame's time comes from.

- media: presentation times of a file or a stream, from its first frame;
- device: the camera's own clock;
- arrival: this computer's monotonic clock when the frame came in: later than the light by the camera's latency;
- wall: UTC, seconds since 1970;
- name: written in the file's name;
- rate: counted, by a frame rate that somebody stated;
- world: the embedded world's.
"""

CHANNELS = (1, 3)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One image of a camera. The image is not copied, but cannot be written to through the frame."""

    image: ImageArray
    """(H, W, 3) blue, green, red, or (H, W) grey; 8 bits."""

    t: float
    """When it was taken [s], on `clock`; ascends strictly within a segment."""

    clock: Clock = "rate"
    """Which clock that is."""

    index: int = 0
    """Number of the frame as the camera counts: a gap tells of frames that were dropped."""

    segment: int = 0
    """Grows when a camera went away and came back: times before and after need not be comparable."""

    late_s: float | None = None
    """How much later than usual the frame came in [s], where that is known; zero or more."""

    def __post_init__(self) -> None:
        image = self.image
        grey_or_colour = image.ndim == 2 or (image.ndim == 3 and image.shape[2] in CHANNELS)
        if image.dtype != np.uint8 or not grey_or_colour or 0 in image.shape:
            raise InputError(
                "an image must have shape (H, W) or (H, W, 3) and 8 bits, "
                f"not {image.shape} of {image.dtype}"
            )
        if not (isfinite(self.t) and abs(self.t) < LARGEST):
            raise InputError(f"a frame's time must be a number of seconds, not {self.t}")
        if self.clock not in get_args(Clock):
            raise InputError(f"clock must be one of {', '.join(get_args(Clock))}, not {self.clock}")
        view = image[..., 0].view() if image.ndim == 3 and image.shape[2] == 1 else image.view()
        view.flags.writeable = False
        object.__setattr__(self, "image", view)

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.image.shape[1], self.image.shape[0]

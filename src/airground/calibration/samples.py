"""Motion correspondences: the input of the paper's calibration (section 2.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.errors import InputError, SampleError
from airground.geometry.arrays import FloatArray, readonly

__all__ = ["MotionSamples"]


@dataclass(frozen=True, slots=True, eq=False)
class MotionSamples:
    """N measurements of where robots are in the image, and how they move there and on the ground."""

    uv: FloatArray
    """(N, 2) [px]. Position; (0, 0) is the centre of the top-left pixel, and v points down."""

    uv_dot: FloatArray
    """(N, 2) [px/s]. Velocity of that position."""

    xy_dot: FloatArray
    """(N, 2) [m/s]. Ground velocity at the same time, in a frame that does not turn."""

    def __post_init__(self) -> None:
        count: int | None = None
        for name in ("uv", "uv_dot", "xy_dot"):
            try:
                array = readonly(getattr(self, name), (count, 2), name)
            except InputError as error:
                raise SampleError(str(error)) from error
            count = len(array)  # the first array says how many samples there are
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.uv)

    def take(self, rows: object) -> MotionSamples:
        """Some of the samples.

        Parameters
        ----------
        rows : index
            Slice, integer or boolean array, as NumPy takes it.

        Returns
        -------
        samples : MotionSamples
            Those rows.
        """
        index = np.arange(len(self))[rows]  # type: ignore[call-overload]
        return MotionSamples(self.uv[index], self.uv_dot[index], self.xy_dot[index])

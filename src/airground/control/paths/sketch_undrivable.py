"""What of a path cannot be driven, where and why, told before a robot is released."""

from __future__ import annotations

from dataclasses import dataclass

from airground.geometry.arrays import FloatArray, numbers

__all__ = ["Undrivable"]


@dataclass(frozen=True, slots=True, eq=False)
class Undrivable:
    """One stretch that cannot be driven."""

    kind: str
    """In one word: not_finite, horizon, far, outside, curvature, cusp, fence, short or departs."""

    reason: str
    """In one line, for the operator."""

    first: int
    """First sample of the stretch: of the path, or of the drawing where `drawn`."""

    last: int
    """Last sample of it, included."""

    s_m: tuple[float, float]
    """Arc lengths where it begins and ends [m]; NaN for what of the drawing is not in the path."""

    uv: FloatArray
    """(2,) [px]. Its worst point in the image; NaN where the drawing had none."""

    drawn: bool = False
    """Whether it is about points as they were drawn."""

    def __post_init__(self) -> None:
        uv = numbers(self.uv, "uv").copy()
        uv.flags.writeable = False
        object.__setattr__(self, "uv", uv)

    def __str__(self) -> str:
        return self.reason

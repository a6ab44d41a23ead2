"""Things that stand or drive on the ground: upright prisms with marks on their roofs, and lamps."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly
from airground.sim.body_poses import PoseOfTime

__all__ = ["Body", "Colour", "Disc", "Lamp", "Mark", "Part", "Patch", "Tag"]

Colour = tuple[float, float, float]
"""Blue, green, red; 0 to 255."""


@dataclass(frozen=True, slots=True)
class Tag:
    """A printed tag. Its upper edge points forward, along the body's x."""

    family: str
    """Such as `36h11` or `4x4_50`; see `airground.vision.raster.tags.FAMILIES`."""

    number: int
    """Of the tag within the family."""

    size_m: float
    """Side of its black square [m]."""

    at_m: tuple[float, float] = (0.0, 0.0)
    """Its middle on the body: ahead, and to the left [m]."""

    margin_m: float | None = None
    """Width of the white around it [m]; by default that of one cell."""


@dataclass(frozen=True, slots=True)
class Disc:
    """A round patch of one colour."""

    radius_m: float
    """Of the disc [m]."""

    colour: Colour
    """Its paint."""

    at_m: tuple[float, float] = (0.0, 0.0)
    """Its middle on the body: ahead, and to the left [m]."""


@dataclass(frozen=True, slots=True)
class Patch:
    """A rectangle of one colour: a stripe, a windscreen."""

    size_m: tuple[float, float]
    """Along and across the body [m]."""

    colour: Colour
    """Its paint."""

    at_m: tuple[float, float] = (0.0, 0.0)
    """Its middle on the body: ahead, and to the left [m]."""


Mark = Tag | Disc | Patch


@dataclass(frozen=True, slots=True)
class Lamp:
    """A light-emitting diode."""

    at_m: tuple[float, float, float]
    """Ahead, to the left, up [m]."""

    colour: Colour = (60.0, 60.0, 255.0)
    """Of its light."""

    power: float = 2.0
    """Its image's peak over white: above 1 it saturates the sensor."""

    radius_m: float = 0.01
    """Standard deviation of its glow [m]; in the image at least 0.8 px."""

    period_s: float = 0.0
    """Of its blinking [s]; 0 for steady light."""

    duty: float = 0.5
    """Share of the period it is on."""

    phase_s: float = 0.0
    """When a period begins [s]."""

    def __post_init__(self) -> None:
        if not (self.radius_m > 0 and self.period_s >= 0 and 0 <= self.duty <= 1):
            raise InputError(
                "a lamp's radius_m must be positive, period_s not negative, duty in 0..1"
            )

    def light(self, start_s: float, end_s: float) -> float:
        """Share of an exposure in which it is on.

        Parameters
        ----------
        start_s, end_s : float [s]
            Of the exposure; may be the same.

        Returns
        -------
        share : float
            0 to 1.
        """
        if self.period_s == 0:
            return 1.0

        def lit(t: float) -> float:
            whole, into = divmod(t - self.phase_s, self.period_s)
            return (whole * self.duty + min(into / self.period_s, self.duty)) * self.period_s

        if end_s <= start_s:
            return float((start_s - self.phase_s) % self.period_s < self.duty * self.period_s)
        return (lit(end_s) - lit(start_s)) / (end_s - start_s)


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """An upright prism over a convex outline."""

    outline: FloatArray
    """(N, 2) [m]. Corners, counter-clockwise, in the body's frame: x ahead, y to the left."""

    bottom_m: float
    """Height of its underside above the ground [m]."""

    top_m: float
    """Height of its roof [m]."""

    colour: Colour
    """Of its walls and, where nothing is painted, of its roof."""

    marks: tuple[Mark, ...] = ()
    """What is painted on the roof, one over the other."""

    def __post_init__(self) -> None:
        outline = readonly(self.outline, (None, 2), "outline")
        if len(outline) < 3 or not 0 <= self.bottom_m < self.top_m:
            raise InputError("a part needs three corners, and 0 <= bottom_m < top_m")
        step = np.roll(outline, -1, axis=0) - outline
        after = np.roll(step, -1, axis=0)
        if (step[:, 0] * after[:, 1] - step[:, 1] * after[:, 0] < -1e-12).any():
            raise InputError("a part's outline must be convex and counter-clockwise")
        object.__setattr__(self, "outline", outline)


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A robot, a car, a box, a pillar."""

    name: str
    """Its name in the truth."""

    pose: PoseOfTime
    """Where it is: the ground point below its frame's origin, and its heading."""

    parts: tuple[Part, ...]
    """From the ground upwards."""

    lamps: tuple[Lamp, ...] = field(default=())
    """Its lights."""

    moves: bool = True
    """False for what never moves: it is drawn once."""

    reference_m: tuple[float, float, float] | None = None
    """The point that a tracker is meant to find: ahead, to the left, up [m]; by default the middle of the first tag or
    disc, or else the middle of the roof."""

    def __post_init__(self) -> None:
        if not (self.parts or self.lamps):
            raise InputError(f"{self.name}: a body needs a part or a lamp")
        if self.reference_m is not None and not all(map(isfinite, self.reference_m)):
            raise InputError(f"{self.name}: reference_m must be finite")

    @property
    def reference(self) -> FloatArray:
        """(3,) [m]. The point that a tracker is meant to find, in the body's frame."""
        if self.reference_m is not None:
            return np.array(self.reference_m)
        for part in self.parts:
            for mark in part.marks:
                if not isinstance(mark, Patch):
                    return np.array([*mark.at_m, part.top_m])
        if not self.parts:
            return np.asarray(np.mean([lamp.at_m for lamp in self.lamps], axis=0))
        return np.array([0.0, 0.0, max(part.top_m for part in self.parts)])

    @property
    def tags(self) -> tuple[tuple[Tag, float], ...]:
        """Its tags and their heights [m]."""
        return tuple(
            (mark, part.top_m)
            for part in self.parts
            for mark in part.marks
            if isinstance(mark, Tag)
        )

    @property
    def radius_m(self) -> float:
        """Of the upright cylinder around its frame's origin that holds all of it [m]."""
        corners = [np.hypot(*part.outline.T).max() for part in self.parts]
        return float(max(corners + [np.hypot(*lamp.at_m[:2]) for lamp in self.lamps]))

    @property
    def height_m(self) -> float:
        """Of its highest point [m]."""
        return max([part.top_m for part in self.parts] + [lamp.at_m[2] for lamp in self.lamps])

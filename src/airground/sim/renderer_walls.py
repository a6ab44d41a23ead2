"""Walls of upright prisms: which of them a camera sees, and how much light they get."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.sim.body import Part

__all__ = ["Walls"]

AMBIENT = 0.55  # of the light comes from all around


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """The walls of a part."""

    first: int
    """Row of its first corner among all corners of the body: underside, then roof."""

    count: int
    """How many."""

    start: FloatArray
    """(N, 2) [m]. Where each begins."""

    outward: FloatArray
    """(N, 2). Unit normals."""

    @classmethod
    def of(cls, part: Part, first: int) -> Walls:
        """Take a part's walls.

        Parameters
        ----------
        part : Part
            The part.
        first : int
            Row of its first corner among all corners of the body.

        Returns
        -------
        walls : Walls
            In the order of its corners.
        """
        step = np.roll(part.outline, -1, axis=0) - part.outline
        length = np.maximum(np.hypot(*step.T), 1e-12)
        outward = np.column_stack([step[:, 1], -step[:, 0]]) / length[:, None]
        return cls(first, len(step), part.outline, outward)

    def seen(self, eye: FloatArray, sun: FloatArray) -> list[tuple[int, float]]:
        """Find those that face the camera.

        Parameters
        ----------
        eye : (2,) array [m]
            Where the camera is, seen from above, in the body's frame.
        sun : (2,) array
            Horizontal part of the unit vector to the sun, in that frame.

        Returns
        -------
        seen : list of (int, float)
            Their numbers, and how bright they are.
        """
        faces = np.flatnonzero(((eye - self.start) * self.outward).sum(axis=1) > 0)
        shade = AMBIENT + (1 - AMBIENT) * np.maximum(self.outward @ sun, 0.0)
        return list(zip(faces.tolist(), (0.9 * shade[faces]).tolist(), strict=True))

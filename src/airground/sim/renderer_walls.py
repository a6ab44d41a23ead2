"""Walls of upright prisms: which of them a camera sees, and how much light they get."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.sim.body import Part

__all__ = ["Walls"]

AMBIENT = 0.55  # of the light comes from all around
WALL = 0.9  # how bright a wall in full sun is against the roof


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """The walls of all parts of a body."""

    corners: NDArray[np.intp]
    """(N, 4). Rows of a wall's corners among all corners of the body: underside, then roof, part by part."""

    outward: FloatArray
    """(N, 2). Unit normals."""

    reach: FloatArray
    """(N,) [m]. How far along its normal each wall stands."""

    firsts: tuple[int, ...]
    """First wall of each part; it is also half of the part's first corner. Then the number of walls."""

    @classmethod
    def of(cls, parts: tuple[Part, ...]) -> Walls:
        """Take a body's walls.

        Parameters
        ----------
        parts : tuple of Part
            The parts.

        Returns
        -------
        walls : Walls
            In the order of their corners.
        """
        firsts, quads, normals, reaches = [0], [], [], []
        for part in parts:
            count = len(part.outline)
            step = np.roll(part.outline, -1, axis=0) - part.outline
            length = np.maximum(np.hypot(*step.T), 1e-12)
            outward = np.column_stack([step[:, 1], -step[:, 0]]) / length[:, None]
            low = 2 * firsts[-1] + np.arange(count)
            after = np.roll(low, -1)
            quads.append(np.stack([low, after, after + count, low + count], axis=1))
            normals.append(outward)
            reaches.append((part.outline * outward).sum(axis=1))
            firsts.append(firsts[-1] + count)
        return cls(
            np.concatenate([*quads, np.zeros((0, 4))]).astype(np.intp),
            np.concatenate([*normals, np.zeros((0, 2))]),
            np.concatenate([*reaches, np.zeros(0)]),
            tuple(firsts),
        )

    def seen(self, eye: FloatArray, sun: FloatArray) -> tuple[list[bool], FloatArray]:
        """Find those that face the camera.

        Parameters
        ----------
        eye : (2,) array [m]
            Where the camera is, seen from above, in the body's frame.
        sun : (2,) array
            Horizontal part of the unit vector to the sun, in that frame.

        Returns
        -------
        faces : list of bool
            For each wall: does it?
        shades : (N,) array
            How bright each is.
        """
        shade = AMBIENT + (1 - AMBIENT) * np.maximum(self.outward @ sun, 0.0)
        return (self.outward @ eye > self.reach).tolist(), np.asarray(WALL * shade)

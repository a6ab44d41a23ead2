"""A small flight over a flat picture, for tests: plain matrices and OpenCV's warp, nothing of airground."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

SIZE = (640, 360)


def ground(rng: np.random.Generator, side: int = 1800) -> Image:
    """Blotches of many sizes: texture everywhere, nothing that repeats."""
    total = np.zeros((side, side))
    for cells, weight in ((30, 1.0), (90, 0.8), (300, 0.8), (700, 0.6)):
        blotch = rng.normal(size=(cells, cells)).astype(np.float32)
        total += weight * cv2.resize(blotch, (side, side), interpolation=cv2.INTER_CUBIC)
    total = 128 + 35 * total / total.std()
    return np.asarray(np.clip(total, 0, 255), dtype=np.uint8)


def camera(
    middle: tuple[float, float],
    *,
    zoom: float = 1.0,
    turn: float = 0.0,
    tilt: float = 0.0,
    size: tuple[int, int] = SIZE,
) -> Array:
    """Image from ground: a pinhole that looks at a point of the picture, tilted about the image's u axis."""
    focal = 1.2 * size[0]
    height = focal / zoom
    c, s = np.cos(turn), np.sin(turn)
    spin = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    ct, st = np.cos(tilt), np.sin(tilt)
    lean = np.array([[1, 0, 0], [0, ct, -st], [0, st, ct]])
    R = lean @ spin
    # The point looked at lies on the axis, at a distance of `height`.
    ground_point = np.array([[1, 0, -middle[0]], [0, 1, -middle[1]], [0, 0, 0.0]])
    K = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1.0]])
    G = R @ ground_point + np.array([[0, 0, 0], [0, 0, 0], [0, 0, height]])
    return np.asarray(K @ G)


@dataclass
class Vehicle:
    """A patch that lies on the ground and may move."""

    start: tuple[float, float]
    velocity: tuple[float, float]  # of the ground's pixels, per frame
    half: tuple[float, float] = (22.0, 11.0)

    def corners(self, k: int) -> Array:
        middle = np.array(self.start) + k * np.array(self.velocity)
        a, b = self.half
        return np.asarray(middle + np.array([[-a, -b], [a, -b], [a, b], [-a, b]]))


@dataclass
class Flight:
    """Frames and the truth."""

    cameras: list[Array]
    texture: Image
    vehicles: list[Vehicle] = field(default_factory=list)
    size: tuple[int, int] = SIZE
    noise: float = 2.0
    seed: int = 1
    blurred: dict[int, int] = field(default_factory=dict)  # frame: length of the smear [px]

    def truth(self, k: int) -> Array:
        """Stable from image."""
        return np.asarray(self.cameras[0] @ np.linalg.inv(self.cameras[k]))

    def outlines(self, k: int) -> Array:
        return np.array([project(self.cameras[k], v.corners(k)) for v in self.vehicles]).reshape(
            -1, 4, 2
        )

    def image(self, k: int) -> Image:
        fine = 2
        up = np.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1.0]])
        G = up @ self.cameras[k]
        big = cv2.warpPerspective(
            self.texture,
            G,
            (fine * self.size[0], fine * self.size[1]),
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REFLECT,
        )
        for number, vehicle in enumerate(self.vehicles):
            shade = 40.0 + 170.0 * (number % 2)
            corners = np.rint(8 * project(G, vehicle.corners(k))).astype(np.int32)
            cv2.fillConvexPoly(big, corners, shade, shift=3)
            inner = np.rint(
                8 * project(G, vehicle.corners(k) * 0.5 + vehicle.corners(k).mean(0) * 0.5)
            )
            cv2.fillConvexPoly(big, inner.astype(np.int32), 255.0 - shade, shift=3)
        small = cv2.resize(big, self.size, interpolation=cv2.INTER_AREA).astype(np.float64)
        if k in self.blurred:
            length = self.blurred[k]
            small = np.asarray(
                cv2.blur(small, (length, 3)), dtype=np.float64
            )  # odd, so that it is centred
        rng = np.random.default_rng([self.seed, k])
        return np.clip(np.rint(small + rng.normal(0, self.noise, small.shape)), 0, 255).astype(
            np.uint8
        )


def project(matrix: Array, uv: Array) -> Array:
    w = np.column_stack([uv, np.ones(len(uv))]) @ matrix.T
    return np.asarray(w[:, :2] / w[:, 2:])


def hover(rng: np.random.Generator, count: int, *, size: tuple[int, int] = SIZE) -> list[Array]:
    """A camera that stands and shakes: several pixels from frame to frame."""
    walk = np.zeros(5)
    cameras: list[Array] = []
    for _ in range(count):
        walk = 0.85 * walk + rng.normal(0, [4.0, 4.0, 0.004, 0.004, 0.004])
        if not cameras:
            walk = np.zeros(5)
        cameras.append(
            camera(
                (900 + walk[0], 900 + walk[1]),
                zoom=1 + walk[2],
                turn=walk[3],
                tilt=0.35 + walk[4],
                size=size,
            )
        )
    return cameras


def orbit(count: int, *, size: tuple[int, int] = SIZE, turns: float = 1.0) -> list[Array]:
    """A camera that circles about a point and looks at it."""
    angles = np.linspace(0, turns * 2 * np.pi, count)
    return [camera((900, 900), turn=a, tilt=0.4 + 0.02 * np.sin(3 * a), size=size) for a in angles]


def out_and_home(count: int, *, size: tuple[int, int] = SIZE, reach: float = 700.0) -> list[Array]:
    """A camera that flies a round and comes home by another way."""
    s = np.linspace(0, 1, count)
    u = 550 + reach * 0.5 * (1 - np.cos(2 * np.pi * s))
    v = 900 + 0.4 * reach * np.sin(2 * np.pi * s)
    return [
        camera((a, b), zoom=1 + 0.1 * np.sin(5 * x), turn=0.3 * np.sin(6 * x), tilt=0.25, size=size)
        for a, b, x in zip(u, v, s, strict=True)
    ]

"""Images whose truth is known: tags, lights and discs drawn by area sampling, apart from the code under test.

Every pixel is the mean of `supersample`**2 point samples of an analytic scene; (0, 0) is the centre of the first pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.vision.frame import Frame

FloatArray = NDArray[np.float64]

OPENCV_NAMES = {
    "36h11": "DICT_APRILTAG_36h11",
    "25h9": "DICT_APRILTAG_25h9",
    "16h5": "DICT_APRILTAG_16h5",
    "4x4": "DICT_4X4_1000",
    "5x5": "DICT_5X5_1000",
    "6x6": "DICT_6X6_1000",
    "original": "DICT_ARUCO_ORIGINAL",
}


@dataclass(frozen=True)
class Tag:
    """A printed tag under a homography from its own plane: its black square is [-1, 1] squared, y down."""

    image_from_tag: FloatArray
    number: int = 7
    family: str = "36h11"
    margin_cells: float = 1.0
    black: float = 25.0
    white: float = 220.0

    def cells(self) -> FloatArray:
        dictionary = cv2.aruco.getPredefinedDictionary(
            getattr(cv2.aruco, OPENCV_NAMES[self.family])
        )
        size = int(dictionary.markerSize) + 2
        return cv2.aruco.generateImageMarker(dictionary, self.number, size).astype(float) / 255

    def points(self, xy: object) -> FloatArray:
        """Image of points of the tag's plane."""
        xy = np.asarray(xy, dtype=float)
        q = np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], axis=-1) @ self.image_from_tag.T
        return np.asarray(q[..., :2] / q[..., 2:])

    @property
    def centre(self) -> FloatArray:
        return self.points([0.0, 0.0])

    @property
    def corners(self) -> FloatArray:
        return self.points([[-1, -1], [1, -1], [1, 1], [-1, 1]])

    def sample(self, uv: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Grey level at image points, and whether the sheet covers them."""
        cells = self.cells()
        size = len(cells)
        q = np.concatenate([uv, np.ones((*uv.shape[:-1], 1))], axis=-1)
        q = q @ np.linalg.inv(self.image_from_tag).T
        xy = q[..., :2] / q[..., 2:]
        reach = 1 + self.margin_cells * 2 / size
        sheet = (np.abs(xy) <= reach).all(axis=-1)
        inside = (np.abs(xy) < 1).all(axis=-1)
        index = np.clip(((xy + 1) / 2 * size).astype(int), 0, size - 1)
        bright = np.where(inside, cells[index[..., 1], index[..., 0]], 1.0)
        return self.black + (self.white - self.black) * bright, sheet


def tilted(
    centre: object,
    side_px: float,
    *,
    tilt_deg: float = 0.0,
    turn_deg: float = 0.0,
    lean_deg: float = 20.0,
) -> FloatArray:
    """Homography of a square that a camera of 900 px focal length sees `side_px` large, turned and tilted."""
    focal, size = 900.0, 1.0
    distance = focal * size / side_px
    turn, tilt, lean = np.radians([turn_deg, tilt_deg, lean_deg])

    def about_z(a: float) -> FloatArray:
        return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1.0]])

    about_x = np.array(
        [[1.0, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]]
    )
    R = about_z(lean) @ about_x @ about_z(turn - lean)
    u, v = np.asarray(centre, dtype=float)
    K = np.array([[focal, 0, u], [0, focal, v], [0, 0, 1.0]])
    columns = np.column_stack([R[:, 0] * size / 2, R[:, 1] * size / 2, [0, 0, distance]])
    return np.asarray(K @ columns)


def draw_tags(
    tags: list[Tag],
    size_px: tuple[int, int] = (1280, 720),
    *,
    background: float | NDArray[np.uint8] = 110.0,
    blur_px: float = 0.0,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
    supersample: int = 8,
) -> NDArray[np.uint8]:
    """A grey image of tags; the blur is Gaussian and precedes the sampling."""
    width, height = size_px
    image = np.broadcast_to(np.asarray(background, dtype=float), (height, width)).copy()
    for tag in tags:
        _draw(image, tag, blur_px, supersample)
    return to_bytes(image, noise, rng)


def _draw(image: FloatArray, tag: Tag, blur_px: float, n: int) -> None:
    height, width = image.shape
    reach = 1 + tag.margin_cells * 2 / len(tag.cells())
    hull = tag.points(reach * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]))
    pad = 3 + 4 * blur_px
    u0, v0 = np.floor(np.clip(hull.min(axis=0) - pad, 0, None)).astype(int)
    u1, v1 = np.ceil(hull.max(axis=0) + pad).astype(int) + 1
    u1, v1 = min(u1, width), min(v1, height)
    if u1 <= u0 or v1 <= v0:
        return
    u = u0 + (np.arange((u1 - u0) * n) + 0.5) / n - 0.5
    v = v0 + (np.arange((v1 - v0) * n) + 0.5) / n - 0.5
    grey, sheet = tag.sample(np.stack(np.meshgrid(u, v), axis=-1))
    under = np.repeat(np.repeat(image[v0:v1, u0:u1], n, axis=0), n, axis=1)
    fine = np.where(sheet, grey, under)
    if blur_px > 0:
        fine = cv2.GaussianBlur(fine, (0, 0), blur_px * n, borderType=cv2.BORDER_REPLICATE)
    image[v0:v1, u0:u1] = fine.reshape(v1 - v0, n, u1 - u0, n).mean(axis=(1, 3))


def draw_spots(
    spots: list[tuple[float, float, float, float]], size_px: tuple[int, int], ground: float = 30.0
) -> FloatArray:
    """Gaussian lights (u, v, sigma px, peak), unclipped."""
    from scipy.special import erf  # type: ignore[import-untyped]

    width, height = size_px
    image = np.full((height, width), ground)
    for u, v, sigma, peak in spots:
        edges_u = (np.arange(width + 1) - 0.5 - u) / (sigma * np.sqrt(2))
        edges_v = (np.arange(height + 1) - 0.5 - v) / (sigma * np.sqrt(2))
        pu, pv = np.diff(erf(edges_u)) / 2, np.diff(erf(edges_v)) / 2
        image += peak * 2 * np.pi * sigma**2 * pv[:, None] * pu[None, :]
    return image


def coverage(
    size_px: tuple[int, int],
    centre: object,
    half: tuple[float, float],
    angle: float = 0.0,
    *,
    n: int = 8,
    round_: bool = True,
) -> FloatArray:
    """Share of each pixel that an ellipse or a rectangle of these half axes covers."""
    width, height = size_px
    u, v = np.asarray(centre, dtype=float)
    reach = float(np.hypot(*half)) + 2
    u0, v0 = max(int(u - reach), 0), max(int(v - reach), 0)
    u1, v1 = min(int(u + reach) + 2, width), min(int(v + reach) + 2, height)
    cover = np.zeros((height, width))
    if u1 <= u0 or v1 <= v0:
        return cover
    fu = u0 + (np.arange((u1 - u0) * n) + 0.5) / n - 0.5 - u
    fv = v0 + (np.arange((v1 - v0) * n) + 0.5) / n - 0.5 - v
    U, V = np.meshgrid(fu, fv)
    a = (U * np.cos(angle) + V * np.sin(angle)) / half[0]
    b = (-U * np.sin(angle) + V * np.cos(angle)) / half[1]
    inside = (a**2 + b**2 <= 1) if round_ else (np.maximum(np.abs(a), np.abs(b)) <= 1)
    cover[v0:v1, u0:u1] = inside.reshape(v1 - v0, n, u1 - u0, n).mean(axis=(1, 3))
    return cover


def to_bytes(
    image: FloatArray, noise: float = 0.0, rng: np.random.Generator | None = None
) -> NDArray[np.uint8]:
    """Sensor noise, then 8 bits."""
    if noise > 0:
        assert rng is not None
        image = image + noise * rng.standard_normal(image.shape, dtype=np.float32)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def frame(image: NDArray[np.uint8], t: float = 0.0) -> Frame:
    return Frame(image, t)


def texture(
    rng: np.random.Generator, size_px: tuple[int, int], grain_px: float = 3.0
) -> NDArray[np.uint8]:
    """Random smooth texture of full contrast."""
    width, height = size_px
    noise = rng.standard_normal((height, width)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), grain_px)
    return to_bytes(128 + 45 * (smooth / smooth.std()).astype(float))

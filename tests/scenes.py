"""Random cameras over a plane, for all tests.

Nothing here uses airground.geometry: the camera is a pinhole in three dimensions, and the ground is embedded in them.
Everything is a product of plain matrices, so that the tests have a second opinion, and it takes complex numbers too,
so that derivatives by a complex step are exact to rounding.

World: X, Y, Z with Z up; the ground is Z = 0. Camera: right, down, forward. Image: u right, v down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

if TYPE_CHECKING:
    from hypothesis.strategies import DrawFn, SearchStrategy
    from numpy.typing import ArrayLike

Array = NDArray[np.float64]

LEAST_DEPRESSION_DEG = 3.0
"""Ground seen at a flatter angle than this, from the horizontal, is too near the horizon to be asked about."""

IMAGE_SIZES = ((640, 480), (1280, 720), (1024, 768), (1920, 1080), (3840, 2160))


@dataclass(frozen=True)
class Scene:
    """A pinhole camera over a plane, with a ground frame on the plane."""

    focal_length: float
    """[px], along u."""

    aspect: float
    """Focal length along v over that along u; 1 for square pixels."""

    skew: float
    """Over the focal length; 0 for square pixels."""

    principal_point: tuple[float, float]
    """[px]."""

    image_size: tuple[int, int]
    """Width and height [px]."""

    tilt: float
    """Of the optical axis from straight down [rad]."""

    roll: float
    """Turn of "up" in the image, from -v towards +u [rad]."""

    heading: float
    """Of the camera's gaze, in the world, counter-clockwise from X [rad]."""

    height: float
    """[m]."""

    handedness: str
    """Of the ground frame seen from above, "right" or "left"."""

    frame_heading: float
    """Heading of the ground frame's x axis in the world [rad]."""

    frame_origin: tuple[float, float]
    """Origin of the ground frame in the world, the camera's foot being (0, 0), in heights."""

    @cached_property
    def K(self) -> Array:  # noqa: N802
        f, (u0, v0) = self.focal_length, self.principal_point
        return np.array([[f, f * self.skew, u0], [0.0, f * self.aspect, v0], [0.0, 0.0, 1.0]])

    @cached_property
    def camera_from_world(self) -> Array:
        """(3, 3) rotation: rows are right, down and forward in the world."""
        ct, st_ = math.cos(self.tilt), math.sin(self.tilt)
        ch, sh = math.cos(self.heading), math.sin(self.heading)
        cr, sr = math.cos(self.roll), math.sin(self.roll)
        forward = np.array([st_ * ch, st_ * sh, -ct])
        right = np.array([sh, -ch, 0.0])
        down = np.array([-ct * ch, -ct * sh, -st_])
        return np.array([cr * right - sr * down, sr * right + cr * down, forward])

    @cached_property
    def centre(self) -> Array:
        """(3,) [m]. The camera, in the world."""
        return np.array([0.0, 0.0, self.height])

    @cached_property
    def world_from_ground(self) -> Array:
        """(3, 3). Takes (x, y, 1) of the ground frame to X, Y, Z."""
        mirror = 1.0 if self.handedness == "right" else -1.0
        c, s = math.cos(self.frame_heading), math.sin(self.frame_heading)
        x0, y0 = (self.height * k for k in self.frame_origin)
        return np.array([[c, -mirror * s, x0], [s, mirror * c, y0], [0.0, 0.0, 0.0]])

    @cached_property
    def G(self) -> Array:  # noqa: N802
        """(3, 3) image_from_ground, at the scale K [R | t] gives it: w of G (x, y, 1) is the depth in metres."""
        P = self.K @ self.camera_from_world
        shift = np.zeros((3, 3))
        shift[:, 2] = self.centre
        return P @ (self.world_from_ground - shift)

    @cached_property
    def G1(self) -> Array:  # noqa: N802
        """(3, 3) image_from_ground with determinant one."""
        det = float(np.linalg.det(self.G))
        return self.G / math.copysign(abs(det) ** (1 / 3), det)

    @property
    def g(self) -> Array:
        """(3, 2) truth of eq. 21."""
        return self.G1[:, :2]

    def rays(self, xy: ArrayLike) -> NDArray[Any]:
        """(..., 3) [m]. From the camera to ground points, in camera axes; may be complex."""
        xy = np.asarray(xy)
        ground = np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], axis=-1)
        return (ground @ self.world_from_ground.T - self.centre) @ self.camera_from_world.T

    def depth(self, xy: ArrayLike) -> NDArray[Any]:
        """(...) [m]. Along the optical axis; negative behind the camera."""
        return self.rays(xy)[..., 2]

    def project(self, xy: ArrayLike) -> NDArray[Any]:
        """(..., 2) [px]. The whole projection: ground, world, camera, image; may be complex."""
        p = self.rays(xy) @ self.K.T
        return np.asarray(p[..., :2] / p[..., 2:])

    def push(self, xy: ArrayLike, xy_dot: ArrayLike) -> Array:
        """(..., 2) [px/s]. Derivative of `project` along `xy_dot`, by a complex step."""
        step = 1e-30
        return np.asarray(self.project(np.asarray(xy) + 1j * step * np.asarray(xy_dot)).imag / step)

    def unproject(self, uv: ArrayLike) -> Array:
        """(..., 2) [m]. Ground under image points, by cutting their rays with the ground; NaN above the horizon."""
        uv = np.asarray(uv, dtype=np.float64)
        ones = np.ones((*uv.shape[:-1], 1))
        rays = (
            np.concatenate([uv, ones], axis=-1) @ np.linalg.inv(self.K).T @ self.camera_from_world
        )
        down = np.where(rays[..., 2:] < 0, -rays[..., 2:], np.nan)
        world = rays[..., :2] / down * self.height
        frame = self.world_from_ground
        return np.asarray((world - frame[:2, 2]) @ frame[:2, :2])

    def sees_ground(self, uv: ArrayLike) -> NDArray[np.bool_]:
        """(...). Is an image point clearly below the horizon?"""
        uv = np.asarray(uv, dtype=np.float64)
        ones = np.ones((*uv.shape[:-1], 1))
        rays = (
            np.concatenate([uv, ones], axis=-1) @ np.linalg.inv(self.K).T @ self.camera_from_world
        )
        sine = -rays[..., 2] / np.linalg.norm(rays, axis=-1)
        return np.asarray(sine > math.sin(math.radians(LEAST_DEPRESSION_DEG)))

    def in_image(self, uv: ArrayLike) -> NDArray[np.bool_]:
        """(...). Does an image point lie in the image?"""
        uv = np.asarray(uv, dtype=np.float64)
        return np.asarray(((uv >= 0) & (uv <= np.array(self.image_size) - 1)).all(axis=-1))

    def pixels(self, rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
        """(*shape, 2) [px]. Image points that show ground."""
        size = np.array(self.image_size, dtype=np.float64) - 1
        uv = rng.uniform(0.0, 1.0, (*shape, 2)) * size
        middle = np.array(self.principal_point)  # shows ground up to a tilt of 87 degrees
        while not (ok := self.sees_ground(uv)).all():
            uv = np.where(ok[..., None], uv, (uv + middle) / 2)
        return uv

    def ground(self, rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
        """(*shape, 2) [m]. Ground points visible in the image."""
        return self.unproject(self.pixels(rng, shape))

    def velocities(self, rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
        """(*shape, 2) [m/s]. Any heading; slow or fast, in proportion to the height."""
        angle = rng.uniform(-math.pi, math.pi, shape)
        speed = self.height * rng.uniform(0.02, 0.5, shape)
        return np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=-1)

    def place(self, drive: ArrayLike) -> tuple[Array, float]:
        """Shrink and move a drive of about unit size until all of it is in the image.

        Gives the centre (2,) [m] and the scale [m] to apply: ``centre + scale * drive``.
        """
        shape = np.asarray(drive, dtype=np.float64)
        centre = self.unproject(np.array(self.image_size) * 0.5 - 0.5)
        if not self.sees_ground(np.array(self.image_size) * 0.5 - 0.5):
            centre = self.unproject(self.principal_point)
        scale = 2.0 * self.height
        for _ in range(60):
            xy = centre + scale * shape
            ahead = (self.depth(xy) > 0).all()
            uv = self.project(xy) if ahead else None
            if uv is not None and (self.in_image(uv) & self.sees_ground(uv)).all():
                return centre, scale
            scale *= 0.8
        raise AssertionError("no place for the drive")  # pragma: no cover


def scene(
    *,
    tilt_deg: float = 40.0,
    roll_deg: float = 0.0,
    heading_deg: float = 0.0,
    height: float = 10.0,
    focal_length: float = 900.0,
    handedness: str = "right",
    image_size: tuple[int, int] = (1280, 720),
    offset: tuple[float, float] = (0.0, 0.0),
    aspect: float = 1.0,
    skew: float = 0.0,
    frame_heading_deg: float = 0.0,
    frame_origin: tuple[float, float] = (0.0, 0.0),
) -> Scene:
    """One scene by hand; angles in degrees, the principal point off the middle by `offset` of the image size."""
    width, tall = image_size
    middle = ((0.5 + offset[0]) * width - 0.5, (0.5 + offset[1]) * tall - 0.5)
    return Scene(
        focal_length=focal_length,
        aspect=aspect,
        skew=skew,
        principal_point=middle,
        image_size=image_size,
        tilt=math.radians(tilt_deg),
        roll=math.radians(roll_deg),
        heading=math.radians(heading_deg),
        height=height,
        handedness=handedness,
        frame_heading=math.radians(frame_heading_deg),
        frame_origin=frame_origin,
    )


def random_scene(
    rng: np.random.Generator, *, tilt_deg: tuple[float, float] = (0.0, 75.0), square: bool = True
) -> Scene:
    """One scene at random, from the same ranges as `scenes`."""
    u = rng.uniform
    return scene(
        tilt_deg=u(*tilt_deg),
        roll_deg=u(-180, 180),
        heading_deg=u(-180, 180),
        height=float(np.exp(u(0.0, math.log(200.0)))),
        focal_length=u(500, 3000),
        handedness=str(rng.choice(["right", "left"])),
        image_size=IMAGE_SIZES[rng.integers(len(IMAGE_SIZES))],
        offset=(u(-0.2, 0.2), u(-0.2, 0.2)),
        aspect=1.0 if square else u(0.5, 2.0),
        skew=0.0 if square else u(-0.2, 0.2),
        frame_heading_deg=u(-180, 180),
        frame_origin=(u(-5, 5), u(-5, 5)),
    )


def _between(low: float, high: float) -> SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_subnormal=False)


@st.composite
def scenes(
    draw: DrawFn,
    *,
    min_tilt_deg: float = 0.0,
    max_tilt_deg: float = 75.0,
    square: bool = True,
    handedness: str | None = None,
) -> Scene:
    """Draw scenes; they shrink to a right-handed frame, few pixels, and a plain pose."""
    whole_turn = _between(-180.0, 180.0)
    return scene(
        handedness=handedness or draw(st.sampled_from(["right", "left"])),
        image_size=draw(st.sampled_from(IMAGE_SIZES)),
        tilt_deg=draw(_between(min_tilt_deg, max_tilt_deg)),
        roll_deg=draw(whole_turn),
        heading_deg=draw(whole_turn),
        height=draw(_between(1.0, 200.0)),
        focal_length=draw(_between(500.0, 3000.0)),
        offset=(draw(_between(-0.2, 0.2)), draw(_between(-0.2, 0.2))),
        aspect=1.0 if square else draw(_between(0.5, 2.0)),
        skew=0.0 if square else draw(_between(-0.2, 0.2)),
        frame_heading_deg=draw(whole_turn),
        frame_origin=(draw(_between(-5.0, 5.0)), draw(_between(-5.0, 5.0))),
    )


def generators() -> SearchStrategy[np.random.Generator]:
    """Generators with a seed that hypothesis knows and shrinks."""
    return st.integers(0, 2**32 - 1).map(np.random.default_rng)


# Drives, as positions and velocities around (0, 0), of about unit size


def circle(count: int, start: float = 0.0, turn: float = 2 * math.pi) -> tuple[Array, Array]:
    """Counter-clockwise, over an angle `turn`."""
    a = start + turn * np.arange(count) / count
    return np.column_stack([np.cos(a), np.sin(a)]), np.column_stack([-np.sin(a), np.cos(a)])


def figure_eight(count: int) -> tuple[Array, Array]:
    """Lemniscate of Gerono, which crosses itself at its middle."""
    a = 2 * math.pi * (np.arange(count) + 0.5) / count
    xy = np.column_stack([np.sin(a), np.sin(a) * np.cos(a)])
    return xy, np.column_stack([np.cos(a), np.cos(2 * a)])


def legs(corners: ArrayLike, per_leg: int = 6) -> tuple[Array, Array]:
    """Straight lines from corner to corner, at unit speed, sampled inside each leg."""
    corner = np.asarray(corners, dtype=np.float64)
    share = (np.arange(per_leg) + 0.5) / per_leg
    way = np.diff(corner, axis=0)
    xy = corner[:-1, None, :] + share[None, :, None] * way[:, None, :]
    direction = way / np.linalg.norm(way, axis=1, keepdims=True)
    return xy.reshape(-1, 2), np.repeat(direction, per_leg, axis=0)


def polygon(headings_deg: ArrayLike) -> Array:
    """Corners of a drive of unit legs along the given headings, moved to middle (0, 0) and size one."""
    a = np.radians(np.asarray(headings_deg, dtype=np.float64))
    steps = np.column_stack([np.cos(a), np.sin(a)])
    corner = np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    corner -= (corner.max(axis=0) + corner.min(axis=0)) / 2
    return np.asarray(corner / np.abs(corner).max())

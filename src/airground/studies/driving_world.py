"""The embedded world to drive in: the demo's, or one that a calibration could have come from.

The truth never enters what drives: it plays camera and robot, and is compared with.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.calibration.lens_uncertainty import joint_covariance
from airground.errors import InputError
from airground.geometry import LimitedHomography, align_rotation, velocity_map_error
from airground.geometry.arrays import FloatArray, readonly
from airground.sim import Lens, Scene, SimCamera, demo_scene, demo_world

if TYPE_CHECKING:
    from airground.calibration import Calibration

__all__ = ["DrivingWorld", "demo_driving_world", "world_for", "world_of_calibration"]

SAME = (
    0.1  # relative error of ground velocities up to which a calibration is one of the demo's camera
)
ACROSS_S = 12.0  # a robot crosses the region of the calibration in about so long, where nothing else is said


@dataclass(frozen=True, slots=True, eq=False)
class DrivingWorld:
    """Camera, ground and where the robot starts: the truth."""

    name: Literal["demo", "calibration", "paper", "mujoco"]
    """Which one."""

    camera: SimCamera
    """Of the plane in which the robot's mark moves, without the lens."""

    lens: Lens | None
    """Takes raw pixels to those of `camera`."""

    ground_uv: FloatArray
    """(2,) [px]. A point of the visible ground, undistorted."""

    start_m: tuple[float, float]
    """Where the robot's axle is at first [m]."""

    heading_rad: float
    """Its heading then [rad]."""

    speed_mps: float
    """A sensible speed there [m/s]."""

    compass_bias_rad: float = 0.0
    """What the compass reads more than the heading in the camera's ground frame [rad]."""

    clock_offset_s: float = 0.0
    """To be added to a time of the camera for that of the robot's readings [s]."""

    scene: Scene | None = None
    """What the camera sees, where it can be rendered; the robot is in it."""

    robot: str = "robot"
    """Name of the robot."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "ground_uv", readonly(self.ground_uv, (2,), "ground_uv"))

    @property
    def model(self) -> LimitedHomography:
        """The true relation between image and ground."""
        return LimitedHomography(self.camera.g)

    def distorted(self, uv: FloatArray) -> FloatArray:
        """Give raw pixels.

        Parameters
        ----------
        uv : (..., 2) array [px]
            As `camera` sees them.

        Returns
        -------
        uv : (..., 2) array [px]
            As they are in the image.
        """
        return uv if self.lens is None else self.lens.distort(uv)

    def undistorted(self, uv: FloatArray) -> FloatArray:
        """Give the pixels of `camera`.

        Parameters
        ----------
        uv : (..., 2) array [px]
            As they are in the image.

        Returns
        -------
        uv : (..., 2) array [px]
            As `camera` sees them.
        """
        return uv if self.lens is None else self.lens.undistort(uv)


def demo_driving_world(seed: int = 0, *, clock_offset_s: float = 0.0) -> DrivingWorld:
    """The demo's warehouse, with the robot where its calibration drive begins.

    Parameters
    ----------
    seed : int
        Of the floor.
    clock_offset_s : float [s]
        Of the robot's clock.

    Returns
    -------
    world : DrivingWorld
        With a scene; the cart is not in it.
    """
    world = demo_world()
    scene = demo_scene(seed, world=world)
    cart = world.cart.target
    scene = replace(scene, bodies=tuple(body for body in scene.bodies if body.name != cart))
    height = float(scene.body(world.robot).reference[2])
    camera = scene.plane(height)
    return DrivingWorld(
        "demo",
        camera=camera,
        lens=None,
        ground_uv=camera.project(np.array(world.path.centre_m)),
        start_m=world.path.centre_m,
        heading_rad=float(np.pi / 4),
        speed_mps=world.path.speed_mps,
        clock_offset_s=clock_offset_s,
        scene=scene,
        robot=world.robot,
    )


def world_of_calibration(
    calibration: Calibration, rng: np.random.Generator, shown_px: FloatArray | None = None
) -> DrivingWorld:
    """Make a world that the calibration could have come from: its g and lens, off by what they are uncertain.

    Parameters
    ----------
    calibration : Calibration
        Says where the camera is, and how sure that is.
    rng : Generator
        Draws the truth from the calibration's covariance.
    shown_px : (N, 2) array, optional [px]
        Raw pixels that the image must hold, where the calibration does not say how large it is.

    Returns
    -------
    world : DrivingWorld
        Without a scene; the robot starts in the middle of where targets were seen.

    Raises
    ------
    InputError
        If what was drawn does not look like a camera over ground: the calibration is too uncertain.
    """
    c = calibration
    covariance = c.covariance
    if c.k1_covariance is not None:
        covariance = joint_covariance(c.covariance, c.k1_covariance)
    # Units differ by orders of magnitude between rows: scale before the decomposition.
    unit = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / unit[:, None] / unit)
    draw = unit * (vectors @ (np.sqrt(np.maximum(values, 0.0)) * rng.normal(size=len(unit))))
    lens = None
    if c.lens is not None:
        k1 = c.lens.k1 + (float(draw[6]) if len(draw) > 6 else 0.0)
        lens = Lens(k1, (float(c.lens.center[0]), float(c.lens.center[1])))
    middle, size = _region(c, shown_px)
    ground_uv = middle if lens is None else lens.undistort(middle)
    try:
        model = LimitedHomography(c.model.g + draw[:6].reshape(3, 2))
        camera = SimCamera(model.image_from_ground(ground_uv), size)
    except InputError as error:
        raise InputError(
            f"the calibration is too uncertain to drive with, or its image shows no ground in the middle: {error}"
        ) from error
    corners = _corners(c) if lens is None else lens.undistort(_corners(c))
    spread = np.nanmax(np.ptp(camera.unproject(corners), axis=0))
    return DrivingWorld(
        "calibration",
        camera=camera,
        lens=lens,
        ground_uv=ground_uv,
        start_m=(0.0, 0.0),
        heading_rad=0.0,
        speed_mps=float(spread / ACROSS_S),
    )


def world_for(
    calibration: Calibration, *, seed: int, shown_px: FloatArray | None = None
) -> tuple[DrivingWorld, str]:
    """Choose the world to drive in.

    Parameters
    ----------
    calibration : Calibration
        To drive with.
    seed : int
        Of the floor, and of the truth that is drawn.
    shown_px : (N, 2) array, optional [px]
        Raw pixels that the image must hold, where the calibration does not say how large it is.

    Returns
    -------
    world : DrivingWorld
        The demo's, if the calibration is one of the demo's camera; otherwise one that it could have come from.
    why : str
        Which one and why, in one line.
    """
    rng = np.random.default_rng([seed, 0x57])
    clock = calibration.time_offset_s + calibration.time_offset_sigma_s * float(rng.normal())
    demo = demo_driving_world(seed, clock_offset_s=clock)
    aligned, angle = align_rotation(demo.camera.g, calibration.model)
    low, high = (share * np.array(demo.camera.image_size_px) for share in (0.35, 0.85))  # floor
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 4).T), axis=-1)
    error = velocity_map_error(demo.camera.g, aligned, grid)
    if calibration.image_size_px in (None, demo.camera.image_size_px) and error < SAME:
        # A small angle is an error of the estimate; a large one is another zero of the compass.
        bias = angle if abs(angle) > SAME else 0.0
        return replace(demo, compass_bias_rad=bias), "the demo's warehouse"
    return (
        replace(world_of_calibration(calibration, rng, shown_px), clock_offset_s=clock),
        "a world drawn from the calibration and its uncertainty, as it is not one of the demo's camera",
    )


def _region(
    calibration: Calibration, shown_px: FloatArray | None
) -> tuple[FloatArray, tuple[int, int]]:
    """Middle of where targets were seen, and a size for the image."""
    corners = _corners(calibration)
    middle = (corners[0] + corners[2]) / 2
    if calibration.image_size_px is not None:
        return middle, calibration.image_size_px
    held = corners if shown_px is None else np.concatenate([corners, shown_px])
    size = np.ceil(np.maximum(held.max(axis=0) * 1.1, 16)).astype(int)
    return middle, (int(size[0]), int(size[1]))


def _corners(calibration: Calibration) -> FloatArray:
    """(4, 2) [px]. Of the region where targets were seen, or about the origin where that is not known."""
    region = calibration.fit.region_px
    if region is None:
        u, v = calibration.distort(calibration.origin_px).tolist()
        reach = 0.1 * max(calibration.image_size_px or (1000, 1000))
        region = (u - reach, v - reach, u + reach, v + reach)
    u0, v0, u1, v1 = region
    return np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]])

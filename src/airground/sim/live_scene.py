"""The embedded world's warehouse: the demo's, with several robots and a cart that never comes to an end."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from airground.sim.body import Body, Part, Tag
from airground.sim.body_kinds import box, pillar, rectangle, robot
from airground.sim.body_poses import parked
from airground.sim.ground_texture import Ground, ground
from airground.sim.live_options import CART_TAG, FAMILY
from airground.sim.scene import Scene, Sun
from airground.sim.scene_camera import Pinhole
from airground.sim.world import demo_world

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from airground.geometry.arrays import FloatArray
    from airground.sim.body_poses import PoseOfTime
    from airground.sim.live_options import RobotPlace

__all__ = ["CART", "CLOTH", "ROBOT_M", "live_bodies", "live_scene", "racetrack"]

CART = "cart"
"""Name of somebody else's vehicle."""

CLOTH = "cloth-"
"""What names of the cloths begin with that may cover tags; a robot's follows."""

ROBOT_M = (0.64, 0.54, 0.24)
"""Length, width and height of a robot [m]; its tag is in the middle of its roof."""

TAG_M = 0.4
CART_M, CART_TAG_M = (1.0, 0.7, 0.24), 0.52  # large, as it drives far from the camera
CART_TRACK = ((-0.2, 6.9), 4.6, 0.75)  # behind the robots, in front of the pillar's image
CART_MPS = 0.5
CLOTH_M = (0.5, 0.5)


def racetrack(
    centre_m: tuple[float, float], straight_m: float, radius_m: float, speed_mps: float
) -> PoseOfTime:
    """Drive round for ever, counter-clockwise: two straights along x with half circles between them.

    Parameters
    ----------
    centre_m : (float, float) [m]
        Of the track.
    straight_m : float [m]
        Length of each straight.
    radius_m : float [m]
        Of the half circles.
    speed_mps : float [m/s]
        Along it.

    Returns
    -------
    pose : callable
        At any time; at zero in the middle of the near straight.
    """
    bend = np.pi * radius_m
    lap = 2 * (straight_m + bend)

    def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        laps, way = np.divmod(speed_mps * t + straight_m / 2, lap)
        near = np.minimum(way, straight_m)
        first = np.clip(way - straight_m, 0.0, bend)
        far = np.clip(way - straight_m - bend, 0.0, straight_m)
        last = np.maximum(way - 2 * straight_m - bend, 0.0)
        theta = (first + last) / radius_m
        x = near - far - straight_m / 2 + radius_m * np.sin(theta)
        y = -radius_m * np.cos(theta)
        return np.column_stack([x, y]) + centre_m, theta + 2 * np.pi * laps

    return pose


def live_bodies(
    robots: Sequence[RobotPlace],
    shown: Callable[[str], PoseOfTime],
    cloth: Callable[[str], PoseOfTime],
    *,
    cart: bool,
) -> tuple[Body, ...]:
    """Give all that stands and drives in the warehouse.

    Parameters
    ----------
    robots : sequence of RobotPlace
        Names, tags and colours.
    shown : callable
        From a robot's name to where it is seen.
    cloth : callable
        From a robot's name to where the cloth is that may cover its tag.
    cart : bool
        Whether somebody else's vehicle is there.

    Returns
    -------
    bodies : tuple of Body
        All tags in one plane, for which a calibration holds.
    """
    bodies = [
        box("box-1", parked(-3.3, 3.1, 0.4), (0.6, 0.5, 0.45)),
        box("box-2", parked(-3.1, 3.8, 0.2), (0.5, 0.4, 0.35), (125.0, 165.0, 200.0)),
        box("box-3", parked(2.75, 2.35, -0.2), (0.7, 0.5, 0.5), (95.0, 140.0, 180.0)),
        pillar("pillar", parked(3.9, 6.6), radius_m=0.14, height_m=1.6),
    ]
    for one in robots:
        tag = Tag(FAMILY, one.tag, TAG_M)
        bodies.append(robot(one.name, shown(one.name), tag, size_m=ROBOT_M, colour=one.colour))
    if cart:
        bodies.append(
            robot(
                CART,
                racetrack(*CART_TRACK, CART_MPS),
                Tag(FAMILY, CART_TAG, CART_TAG_M),
                size_m=CART_M,
                colour=(120.0, 70.0, 130.0),
            )
        )
    for one in robots:
        cover = Part(rectangle(*CLOTH_M), ROBOT_M[2], ROBOT_M[2] + 0.01, (150.0, 150.0, 155.0))
        bodies.append(Body(f"{CLOTH}{one.name}", cloth(one.name), (cover,)))
    return tuple(bodies)


@lru_cache(maxsize=1)
def _floor(seed: int) -> Ground:
    return ground("warehouse", seed=seed, tile_m=12.0, texel_m=0.0055)


def live_scene(bodies: tuple[Body, ...], seed: int) -> Scene:
    """Put bodies into the demo's warehouse, below its camera.

    Parameters
    ----------
    bodies : tuple of Body
        What is in it.
    seed : int
        Of the floor, which takes a second to paint.

    Returns
    -------
    scene : Scene
        To be drawn.
    """
    return Scene(
        camera=Pinhole.of_world(demo_world()),
        ground=_floor(seed),
        bodies=bodies,
        sun=Sun(azimuth_rad=np.radians(-35), elevation_rad=np.radians(50)),
        exposure_s=0.006,
    )

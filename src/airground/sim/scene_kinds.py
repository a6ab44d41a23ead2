"""Ready-made scenes: a warehouse, robot soccer from the ceiling, a street, lights in the dark, a drone's view."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.body import Body, Disc, Lamp, Tag
from airground.sim.body_kinds import box, car, person, pillar, robot, round_robot
from airground.sim.body_poses import PoseOfTime, along_path, crossing, parked
from airground.sim.calibration_drive import drive_eight
from airground.sim.flights import Shake, fly_over, hover, orbit
from airground.sim.ground_texture import ground
from airground.sim.scene import CameraOfTime, Scene, Sun
from airground.sim.scene_camera import Pinhole
from airground.sim.world import FigureEight, Transit, World, demo_world

__all__ = ["Flight", "demo_scene", "drone_scene", "lamp_scene", "soccer_scene", "street_scene"]

Flight = Literal["still", "hover", "orbit", "fly_over"]
"""How the drone of `drone_scene` flies."""

SLOTS = 21  # an odd number passes the middle of an eight in turns
DOTS = ((180.0, 60.0, 220.0), (70.0, 190.0, 60.0))
TEAMS = ((215.0, 110.0, 20.0), (30.0, 210.0, 245.0))


def demo_scene(seed: int = 0, *, world: World | None = None, duration_s: float = 120.0) -> Scene:
    """The world of `airground demo`: a warehouse, a robot with a tag, a cart, boxes and a pillar.

    Parameters
    ----------
    seed : int
        Of the floor.
    world : World, optional
        Another one than `demo_world`.
    duration_s : float [s]
        How long the robot drives.

    Returns
    -------
    scene : Scene
        The robot has tag 0, the cart tag 1 of `36h11`.
    """
    world = world or demo_world()
    bodies = (
        robot(
            world.robot,
            along_path(drive_eight(world.path, duration_s)),
            Tag("36h11", 0, 0.4),
            size_m=(0.64, 0.54, 0.24),
        ),
        robot(
            world.cart.target,
            crossing(world.cart),
            Tag("36h11", 1, 0.42),
            # Its tag is in the plane of the robot's, for which a calibration holds.
            size_m=(0.8, 0.6, 0.24),
            colour=(60.0, 70.0, 175.0),
        ),
        box("box-1", parked(-3.3, 3.1, 0.4), (0.6, 0.5, 0.45)),
        box("box-2", parked(-3.1, 3.8, 0.2), (0.5, 0.4, 0.35), (125.0, 165.0, 200.0)),
        box("box-3", parked(2.75, 2.35, -0.2), (0.7, 0.5, 0.5), (95.0, 140.0, 180.0)),
        pillar("pillar", parked(3.9, 6.6), radius_m=0.14, height_m=1.6),
    )
    return Scene(
        camera=Pinhole.of_world(world),
        ground=ground(world.floor, seed=seed, tile_m=12.0, texel_m=0.0055),
        bodies=bodies,
        sun=Sun(azimuth_rad=np.radians(-35), elevation_rad=np.radians(50)),
        exposure_s=0.006,
    )


def soccer_scene(seed: int = 0, *, robots: int = 20, tags: bool = False) -> Scene:
    """A ceiling camera over robots that weave through each other: neighbours pass at 0.4 m, from middle to middle.

    Parameters
    ----------
    seed : int
        Of the carpet and of which place each robot takes.
    robots : int
        1 to 21.
    tags : bool
        Do they carry tags of `4x4_50`? Otherwise coloured discs: a team's in the middle, four dots around it.

    Returns
    -------
    scene : Scene
        Robots `robot-1`, `robot-2`, ... with tags 0, 1, ...

    Raises
    ------
    InputError
        If there are too many robots.
    """
    if not 1 <= robots <= SLOTS:
        raise InputError(f"soccer_scene takes 1 to {SLOTS} robots, not {robots}")
    slots = np.random.default_rng([seed, 0x50]).permutation(SLOTS)[:robots]
    bodies = []
    for k, slot in enumerate(slots.tolist()):
        pose = _weaving(slot / SLOTS)
        if tags:
            marks: tuple[Tag | Disc, ...] = (Tag("4x4_50", k, 0.1),)
        else:
            corners = ((0.045, 0.035), (-0.03, 0.05), (-0.03, -0.05), (0.045, -0.035))
            marks = (
                Disc(0.025, TEAMS[k % 2]),
                *(Disc(0.02, DOTS[k >> (n + 1) & 1], at) for n, at in enumerate(corners)),
            )
        bodies.append(round_robot(f"robot-{k + 1}", pose, *marks))
    camera = Pinhole.looking_down(
        focal_length_px=900.0,
        tilt_rad=np.radians(4),
        height_m=4.3,
        image_size_px=(1280, 720),
        heading_rad=np.pi / 2,
        xy_m=(0.0, -0.3),
    )
    return Scene(
        camera=camera,
        ground=ground("carpet", seed=seed, tile_m=4.0, texel_m=0.004),
        bodies=tuple(bodies),
        sun=Sun(azimuth_rad=0.5, elevation_rad=1.2, shadow=0.3, softness=0.2),
        exposure_s=0.004,
    )


def street_scene(seed: int = 0, *, cars: int = 10) -> Scene:
    """A camera on a pole beside a street: cars in two directions, a person, a lamp post in front.

    Parameters
    ----------
    seed : int
        Of the asphalt, the cars' speeds and when they come.
    cars : int
        How many pass, one every 3 s in each direction.

    Returns
    -------
    scene : Scene
        Cars `car-1`, `car-2`, ...; their reference is the middle of the roof.
    """
    rng = np.random.default_rng([seed, 0x57])
    paints = (
        (190.0, 90, 50),
        (50, 50, 190),
        (225, 225, 225),
        (85, 85, 90),
        (160, 170, 175),
        (80, 130, 70),
    )
    speeds = (rng.uniform(8, 10), rng.uniform(9, 12))
    bodies: list[Body] = []
    for k in range(cars):
        way = k % 2
        start = 3.0 * (k // 2) + 1.3 * way + rng.uniform(0, 0.6)
        transit = Transit(
            f"car-{k + 1}",
            (-26.0 if way == 0 else 26.0, 7.0 if way == 0 else 10.5),
            0.0 if way == 0 else np.pi,
            float(speeds[way]),
            float(start),
        )
        scale = rng.uniform(0.92, 1.08)
        size = (4.4 * scale, 1.8, 1.45 * scale)
        bodies.append(
            car(transit.target, crossing(transit), size_m=size, colour=paints[int(rng.integers(6))])
        )
    bodies += [
        person("walker", crossing(Transit("walker", (-7.0, 4.9), 0.0, 1.3, 0.0))),
        pillar(
            "post", parked(-3.0, 5.3), radius_m=0.07, height_m=4.0, colour=(120.0, 120.0, 118.0)
        ),
    ]
    camera = Pinhole.looking_down(
        focal_length_px=700.0,
        tilt_rad=np.radians(50),
        height_m=8.0,
        image_size_px=(1280, 720),
        heading_rad=np.radians(82),
        roll_rad=np.radians(-1.5),
    )
    return Scene(
        camera=camera,
        ground=ground("asphalt", seed=seed, tile_m=14.0, texel_m=0.007),
        bodies=tuple(bodies),
        sun=Sun(azimuth_rad=np.radians(215), elevation_rad=np.radians(48), softness=0.02),
        exposure_s=0.004,
    )


def lamp_scene(seed: int = 0, *, robots: int = 4) -> Scene:
    """Dim light from the ceiling; each robot has a red lamp ahead and a green one behind, some of them blinking.

    Parameters
    ----------
    seed : int
        Of the floor.
    robots : int
        1 to 21.

    Returns
    -------
    scene : Scene
        Robots `robot-1`, ...; from the third on they blink, each at its own rate.
    """
    bright = soccer_scene(seed, robots=robots)
    bodies = []
    for k, body in enumerate(bright.bodies):
        blink = 0.0 if k < 2 else 0.4 + 0.1 * k
        lamps = (
            Lamp((0.05, 0.0, 0.15), (60.0, 60.0, 255.0), 1.6, 0.008, blink, 0.6, 0.03 * k),
            Lamp((-0.05, 0.0, 0.15), (80.0, 255.0, 70.0), 1.6, 0.008),
        )
        bodies.append(round_robot(body.name, body.pose, lamps=lamps))
    return replace(
        bright,
        bodies=tuple(bodies),
        ground=ground("checked", seed=seed, tile_m=4.0, texel_m=0.004),
        brightness=0.22,
        noise=3.0,
    )


def drone_scene(
    seed: int = 0,
    *,
    flight: Flight = "hover",
    floor: str = "asphalt",
    shake: Shake | None = None,
    duration_s: float = 120.0,
) -> Scene:
    """A drone 12 m above a vehicle with a tag, poles and boxes beside its way.

    Parameters
    ----------
    seed : int
        Of the ground and of the wind.
    flight : {"still", "hover", "orbit", "fly_over"}
        How it flies; `fly_over` leaves its first view wholly and comes back, once a minute.
    floor : str
        What is below.
    shake : Shake, optional
        The wind.
    duration_s : float [s]
        How long the vehicle drives.

    Returns
    -------
    scene : Scene
        The vehicle is `robot`, with tag 0 of `36h11`; it stays in view but for `fly_over`.

    Raises
    ------
    InputError
        If there is no such flight.
    """
    if flight not in get_args(Flight):
        raise InputError(f"flight must be one of {', '.join(get_args(Flight))}, not {flight!r}")
    size = (1280, 720)
    tilt, height = np.radians(35), 12.0
    middle = (0.0, float(height * np.tan(tilt)))
    base = Pinhole.looking_down(
        focal_length_px=1100.0,
        tilt_rad=tilt,
        height_m=height,
        image_size_px=size,
        heading_rad=np.pi / 2,
    )
    camera: Pinhole | CameraOfTime = base
    if flight == "hover":
        camera = hover(base, seed=seed, shake=shake)
    elif flight == "orbit":
        camera = orbit(
            centre_m=middle,
            radius_m=middle[1],
            height_m=height,
            period_s=90.0,
            focal_length_px=1100.0,
            image_size_px=size,
            seed=seed,
            shake=shake,
        )
    elif flight == "fly_over":
        camera = fly_over(
            base, to_m=(22.0, 0.0), period_s=60.0, pause_s=4.0, seed=seed, shake=shake
        )
    eight = FigureEight(middle, (3.2, 2.2), 1.0)
    bodies = (
        robot(
            "robot",
            along_path(drive_eight(eight, duration_s)),
            Tag("36h11", 0, 0.72, (-0.06, 0.0)),
            size_m=(1.2, 0.96, 0.5),
            colour=(40.0, 110.0, 220.0),
        ),
        box("crate", parked(-5.2, middle[1] + 2.2, 0.5), (1.0, 0.8, 0.8)),
        pillar("pole-1", parked(5.0, middle[1] + 1.0), radius_m=0.09, height_m=2.5),
        pillar("pole-2", parked(-4.6, middle[1] - 2.4), radius_m=0.09, height_m=2.5),
    )
    return Scene(
        camera=camera,
        ground=ground(floor, seed=seed, tile_m=16.0, texel_m=0.008),
        bodies=bodies,
        sun=Sun(azimuth_rad=0.9, elevation_rad=0.9),
        exposure_s=0.004,
    )


def _weaving(share: float) -> PoseOfTime:
    """Drive round an eight, a share of a round ahead."""

    def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        phase = 2 * np.pi * (share + t / 24.0)
        xy = np.column_stack([2.6 * np.sin(phase), 1.3 * np.sin(2 * phase)])
        return xy, np.arctan2(2.6 * np.cos(2 * phase), 2.6 * np.cos(phase))

    return pose

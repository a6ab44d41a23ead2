"""The scene as MJCF, MuJoCo's own description of worlds, and the paint on its floor and tags."""

from __future__ import annotations

from functools import lru_cache
from math import degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.sim.ground_texture import ground
from airground.sim3d.options import FAMILY, Other3d, Robot3d, RobotOptions3d, World3dOptions
from airground.vision.raster.tags import tag_cells

if TYPE_CHECKING:
    from collections.abc import Iterable

    from airground.sim3d.canvas import Canvas
    from airground.vision.frame import ImageArray

__all__ = ["POINT_GROUP", "POINT_RADIUS_M", "build_scene", "paint_scene"]

POINT_GROUP = 4
"""Of the point that is shown alone in a survey."""

POINT_RADIUS_M = 0.02
"""Of that point."""

TILE_M = 8.0  # of the floor's texture
TEXELS = 2048
FLOOR_M = 40.0  # side
CELL_TEXELS = 32  # of a tag, and its white margin is one cell wide
BLACK, WHITE = 18.0, 232.0  # printer's ink and paper
FIELD = (0.2, 0.0, -0.45)
"""The earth's magnetic field [gauss]: north is x, and most of it points down."""


def build_scene(options: World3dOptions, canvas: Canvas) -> str:
    """Write the scene.

    Parameters
    ----------
    options : World3dOptions
        What there is.
    canvas : Canvas
        What is drawn.

    Returns
    -------
    mjcf : str
        XML. Textures are flat: `paint_scene` fills them.
    """
    placed = [*_placed(options)]
    side = _tag_texels()
    tags = "".join(
        f"""
    <texture name="tag_{name}" type="2d" builtin="flat" width="{side}" height="{side}"/>
    <material name="tag_{name}" texture="tag_{name}" specular="0" shininess="0"/>"""
        for name, *_ in placed
    )
    repeat = FLOOR_M / TILE_M
    width, height = canvas.size_px
    return f"""<mujoco model="airground">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{options.step_s}" integrator="Euler" cone="elliptic" impratio="20"
    magnetic="{_numbers(*FIELD)}"/>
  <visual>
    <global offwidth="{width}" offheight="{height}"/>
    <quality offsamples="{options.camera.samples}"/>
    <headlight ambient="0.55 0.55 0.55" diffuse="0.1 0.1 0.1" specular="0 0 0"/>
    <map znear="0.02" zfar="20"/>
  </visual>
  <statistic extent="5" center="0 0 0"/>
  <asset>
    <texture name="floor" type="2d" builtin="flat" width="{TEXELS}" height="{TEXELS}"/>
    <material name="floor" texture="floor" texrepeat="{repeat} {repeat}" specular="0" shininess="0"/>{tags}
    <material name="point" rgba="1 1 1 1" emission="1" specular="0" shininess="0"/>
  </asset>
  <worldbody>
    <light directional="true" pos="0 0 6" dir="0.2 0.15 -1" castshadow="false" diffuse="0.4 0.4 0.4"
      specular="0 0 0"/>
    <geom name="floor" type="plane" size="{FLOOR_M / 2} {FLOOR_M / 2} 1" material="floor" friction="0.5 0.005 0.0001"/>
    <body name="camera" mocap="true"><camera name="camera" fovy="{_fovy(canvas)}"/></body>
    <body name="point" mocap="true">
      <geom name="point" type="sphere" size="{POINT_RADIUS_M}" group="{POINT_GROUP}" material="point" contype="0"
        conaffinity="0"/>
    </body>{"".join(_vehicle(*one) for one in placed)}
  </worldbody>
  <actuator>{"".join(_motors(name, built) for name, _, _, _, built in placed)}
  </actuator>
  <sensor>{"".join(_sensors(name) for name, *_ in placed)}
  </sensor>
</mujoco>
"""


def paint_scene(model: Any, mujoco: Any, options: World3dOptions, seed: int) -> None:
    """Fill the textures of a model that nothing has drawn yet.

    Parameters
    ----------
    model : MjModel
        Of `build_scene`.
    mujoco : module
        MuJoCo.
    options : World3dOptions
        The same.
    seed : int
        Of the floor's grain.
    """
    _fill(model, mujoco, "floor", _floor(options.floor, seed)[::-1, :, ::-1])
    for one in options.vehicles:
        cells = np.pad(tag_cells(FAMILY, one.tag), 1, constant_values=True)
        ink = np.where(cells, WHITE, BLACK)[::-1].T  # the tag's up is forward, its right is right
        texels = np.kron(ink, np.ones((CELL_TEXELS, CELL_TEXELS)))
        _fill(model, mujoco, f"tag_{one.name}", np.repeat(texels[..., None], 3, axis=-1))


def _placed(
    options: World3dOptions,
) -> Iterable[tuple[str, tuple[float, float], float, tuple[float, float, float], RobotOptions3d]]:
    """Name, place, heading, colour and build of all vehicles."""
    one: Robot3d | Other3d
    for one in options.robots:
        yield one.name, one.start_m, one.heading_rad, one.colour, one.options
    for one in options.others:
        (x, y), (x2, y2) = one.route_m[:2]
        yield one.name, (x, y), float(np.arctan2(y2 - y, x2 - x)), one.colour, one.options


def _vehicle(
    name: str,
    at: tuple[float, float],
    heading: float,
    colour: tuple[float, float, float],
    built: RobotOptions3d,
) -> str:
    """Axle in the body's origin; two wheels, a caster behind, a tag on top."""
    r, half = built.wheel_radius_m, built.track_m / 2
    length, width, height = built.body_m
    plate = _plate_m(built) / 2
    caster = 0.5 * r
    behind = length / 2 - caster  # of the caster; the body's middle is half way there
    across = min(width, 2 * half - 0.03) / 2
    top = built.tag_height_m - r  # above the axle
    wheels = _wheel(name, "left", half, built) + _wheel(name, "right", -half, built)
    mast = (top - 0.008 - height / 2) / 2
    return f"""
    <body name="{name}" pos="{_numbers(*at, r)}" euler="0 0 {heading}">
      <freejoint name="{name}"/>
      <geom name="{name}_body" type="box" size="{length / 2} {across} {height / 2}"
        pos="{-behind / 2} 0 {height / 2 - 0.01}" mass="{built.mass_kg}" rgba="{_numbers(*colour)} 1"/>
      <geom name="{name}_mast" type="cylinder" size="0.02 {mast}" pos="{built.tag_ahead_m} 0 {height / 2 + mast}"
        mass="0.1" contype="0" conaffinity="0" rgba="0.3 0.3 0.3 1"/>
      <geom name="{name}_caster" type="sphere" size="{caster}" pos="{-behind} 0 {caster - r}" mass="0.1" priority="1"
        friction="{built.caster_friction} 0.001 0.0001" rgba="0.2 0.2 0.2 1"/>
      <geom name="{name}_tag" type="box" size="{plate} {plate} 0.004" pos="{built.tag_ahead_m} 0 {top - 0.004}"
        mass="0.1" contype="0" conaffinity="0" material="tag_{name}"/>
      <site name="{name}_tag" pos="{built.tag_ahead_m} 0 {top}" size="0.001" rgba="0 0 0 0"/>
      <site name="{name}_senses" size="0.001" rgba="0 0 0 0"/>{wheels}
    </body>"""


def _wheel(name: str, side: str, y: float, built: RobotOptions3d) -> str:
    return f"""
      <body name="{name}_{side}" pos="0 {y} 0">
        <joint name="{name}_{side}" type="hinge" axis="0 1 0" damping="0.01" armature="0.01"/>
        <geom name="{name}_{side}" type="cylinder" size="{built.wheel_radius_m} 0.008" euler="1.5707963267948966 0 0"
          mass="0.3" priority="2" friction="{built.wheel_friction} 0.003 0.0001" rgba="0.1 0.1 0.1 1"/>
      </body>"""


def _motors(name: str, built: RobotOptions3d) -> str:
    """Servos for the wheels' rates, whose goals lag behind what they are told."""
    gain, most = 4.0, built.motor_torque_nm
    return "".join(
        f"""
    <general name="{name}_{side}" joint="{name}_{side}" dyntype="filterexact" dynprm="{built.motor_lag_s}"
      gainprm="{gain}" biastype="affine" biasprm="0 0 {-gain}" forcerange="{-most} {most}"/>"""
        for side in ("left", "right")
    )


def _sensors(name: str) -> str:
    return f"""
    <magnetometer name="{name}_compass" site="{name}_senses"/>
    <gyro name="{name}_gyro" site="{name}_senses"/>"""


@lru_cache(maxsize=2)
def _floor(name: str, seed: int) -> ImageArray:
    return ground(name, seed=seed, tile_m=TILE_M, texel_m=TILE_M / TEXELS).picture


def _tag_texels() -> int:
    return (len(tag_cells(FAMILY, 0)) + 2) * CELL_TEXELS


def _plate_m(built: RobotOptions3d) -> float:
    cells = len(tag_cells(FAMILY, 0))
    return built.tag_m * (cells + 2) / cells


def _fovy(canvas: Canvas) -> float:
    return degrees(canvas.fovy_rad)  # in degrees whatever the compiler's angles are


def _fill(model: Any, mujoco: Any, name: str, picture: ImageArray) -> None:
    k = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXTURE, name)
    first, count = int(model.tex_adr[k]), picture.size
    model.tex_data[first : first + count] = np.ascontiguousarray(picture, dtype=np.uint8).ravel()


def _numbers(*values: float) -> str:
    return " ".join(f"{value:.9g}" for value in values)

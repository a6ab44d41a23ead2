"""The simulated world: plays the camera, the robot and their noise; seeded, and apart from what is estimated."""

from airground.sim.body import Body, Disc, Lamp, Part, Patch, Tag
from airground.sim.calibration_drive import (
    CalibrationDrive,
    DriveNoise,
    Path,
    calibration_drive,
    drive_eight,
)
from airground.sim.camera import SimCamera
from airground.sim.flights import Shake, fly_over, hover, orbit
from airground.sim.ground_texture import Ground, ground
from airground.sim.lens import Lens
from airground.sim.live import LiveWorld
from airground.sim.live_faults import Faults
from airground.sim.live_options import EmbeddedOptions
from airground.sim.live_world import EmbeddedWorld
from airground.sim.point_eye import EyeOptions, PointEye, Sighting
from airground.sim.renderer import Renderer
from airground.sim.scene import Scene, Sun
from airground.sim.scene_camera import Pinhole
from airground.sim.scene_kinds import (
    demo_scene,
    drone_scene,
    lamp_scene,
    soccer_scene,
    street_scene,
)
from airground.sim.scene_truth import BodyTruth
from airground.sim.unicycle import SegmentDrive, arc, roll_out
from airground.sim.vehicle_drives import VehicleKind
from airground.sim.vehicle_odometry import Odometer, OdometryNoise, Reading
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant
from airground.sim.world import FigureEight, Transit, World, demo_world
from airground.sim.world_camera import WorldCamera

__all__ = [
    "Body",
    "BodyTruth",
    "CalibrationDrive",
    "Disc",
    "DriveNoise",
    "EmbeddedOptions",
    "EmbeddedWorld",
    "EyeOptions",
    "Faults",
    "FigureEight",
    "Ground",
    "Lamp",
    "Lens",
    "LiveWorld",
    "Odometer",
    "OdometryNoise",
    "Part",
    "Patch",
    "Path",
    "Pinhole",
    "PlantOptions",
    "PointEye",
    "Reading",
    "Renderer",
    "Scene",
    "SegmentDrive",
    "Shake",
    "Sighting",
    "SimCamera",
    "Sun",
    "Tag",
    "Transit",
    "VehicleKind",
    "VehiclePlant",
    "World",
    "WorldCamera",
    "arc",
    "calibration_drive",
    "demo_scene",
    "demo_world",
    "drive_eight",
    "drone_scene",
    "fly_over",
    "ground",
    "hover",
    "lamp_scene",
    "orbit",
    "roll_out",
    "soccer_scene",
    "street_scene",
]

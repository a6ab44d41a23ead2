"""What kinds of vehicles can do, and what their actuators must do for it."""

from airground.control.vehicles.car import Ackermann, SpeedSteering
from airground.control.vehicles.omni import Omnidirectional
from airground.control.vehicles.wheels import DifferentialDrive, Unicycle, Vehicle, WheelSpeeds

__all__ = [
    "Ackermann",
    "DifferentialDrive",
    "Omnidirectional",
    "SpeedSteering",
    "Unicycle",
    "Vehicle",
    "WheelSpeeds",
]

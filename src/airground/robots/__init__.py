"""Robots: what every driver of one is, and the drivers."""

from airground.robots.opening import LINKS, check_link, open_robot
from airground.robots.protocol import Robot, RobotLink, RobotReading
from airground.robots.stamp_clock import StampClock
from airground.robots.udp import UdpRobot
from airground.robots.watchdog import Watchdog

__all__ = [
    "LINKS",
    "Robot",
    "RobotLink",
    "RobotReading",
    "StampClock",
    "UdpRobot",
    "Watchdog",
    "check_link",
    "open_robot",
]

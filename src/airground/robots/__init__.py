"""Robots: what every driver of one is, and the drivers."""

from airground.robots.protocol import Robot, RobotLink, RobotReading

__all__ = ["Robot", "RobotLink", "RobotReading"]

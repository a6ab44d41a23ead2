"""What a robot knows of its own motion: ticks of two encoders, a compass and a gyro."""

from __future__ import annotations

from math import atan2, cos, floor, pi, remainder, sin, tau
from typing import TYPE_CHECKING, Any

from airground.robots.protocol import RobotReading
from airground.sim3d.scene import FIELD

if TYPE_CHECKING:
    import numpy as np

    from airground.sim3d.options import RobotOptions3d

__all__ = ["Senses"]


class Senses:
    """Readings of one robot.

    Parameters
    ----------
    name : str
        Of the robot.
    options : RobotOptions3d
        How well it knows.
    wheel_radii_m : (float, float) [m]
        What it takes its wheels' for, left and right.
    track_m : float [m]
        What it takes the way between them for.
    rng : Generator
        Of all noise.
    """

    def __init__(
        self,
        name: str,
        options: RobotOptions3d,
        wheel_radii_m: tuple[float, float],
        track_m: float,
        rng: np.random.Generator,
    ) -> None:
        self._name = name
        self._options = options
        self._per_tick_m = [tau * radius / options.ticks for radius in wheel_radii_m]
        self._track = track_m
        self._rng = rng
        north = 2 * pi * rng.random()
        field = options.compass_iron * FIELD[0]
        self._iron = field * cos(north), field * sin(north)
        self._gyro_bias = options.gyro_bias_radps * rng.standard_normal()
        self._ticks: tuple[int, int] | None = None
        self._t = 0.0

    def read(self, data: Any, t: float) -> RobotReading | None:
        """Measure.

        Parameters
        ----------
        data : MjData
            Of now, with its sensors.
        t : float [s]
            Now.

        Returns
        -------
        reading : RobotReading or None
            Stamped as it arrives. None at first: a speed needs two counts.
        """
        o, name = self._options, self._name
        left, right = (
            floor(float(data.joint(f"{name}_{side}").qpos[0]) / tau * o.ticks)
            for side in ("left", "right")
        )
        mx, my, _ = data.sensor(f"{name}_compass").data.tolist()
        turning = float(data.sensor(f"{name}_gyro").data[2])
        white, still, walk = self._rng.standard_normal(3).tolist()
        before, dt = self._ticks, t - self._t
        self._ticks, self._t = (left, right), t
        if before is None:
            return None
        self._gyro_bias += o.gyro_drift * dt**0.5 * walk
        heading = -atan2(my + self._iron[1], mx + self._iron[0])
        way_left, way_right = (
            (now - then) * each
            for now, then, each in zip((left, right), before, self._per_tick_m, strict=True)
        )
        if o.turn_rate == "encoders":
            turning = (way_right - way_left) / self._track / dt
        else:
            turning += self._gyro_bias + o.gyro_radps * still
        return RobotReading(
            t=t + o.latency_s,
            heading=remainder(heading + o.compass_bias_rad + o.compass_rad * white, tau),
            speed=(way_left + way_right) / 2 / dt,
            turn_rate=turning,
        )

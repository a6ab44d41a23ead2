"""Motions of an image point that a robot can be asked to follow: ellipses, functions, and what moves on the ground."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, inf, isfinite, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from airground.control.image_law import ImageLaw
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from airground.control.floor import Floor

__all__ = ["FunctionTrajectory", "GroundEllipse", "GroundTrajectory", "ImageEllipse"]

Motion = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class FunctionTrajectory:
    """Whatever a function says, which must be smooth: no more is checked than shapes at the start."""

    function: Callable[[float], tuple[ArrayLike, ArrayLike, ArrayLike]]
    """Image point [px], velocity [px/s] and acceleration [px/s^2] at a time [s] in 0..duration."""

    duration: float = inf
    """Of the motion [s]; infinite where it goes round."""

    period: float = inf
    """After which it repeats [s]; infinite where it does not."""

    def __post_init__(self) -> None:
        _check_times(self.duration, self.period)
        for name, value in zip(("point", "velocity", "acceleration"), self.at(0.0), strict=True):
            readonly(value, (2,), f"the {name} that function(0.0) gives")

    def at(self, t: float) -> Motion:
        """Where it is.

        Parameters
        ----------
        t : float [s]
            Since its start.

        Returns
        -------
        uv : (2,) array [px]
            Point; before and after the motion, its ends.
        uv_dot : (2,) array [px/s]
            Its velocity; zero before and after the motion.
        uv_ddot : (2,) array [px/s^2]
            Its acceleration; zero before and after the motion.
        """
        uv, uv_dot, uv_ddot = self.function(min(max(t, 0.0), self.duration))
        motion = (np.asarray(uv), np.asarray(uv_dot), np.asarray(uv_ddot))
        if 0 <= t <= self.duration:
            return motion
        return motion[0], np.zeros(2), np.zeros(2)


@dataclass(frozen=True, slots=True, eq=False)
class GroundTrajectory:
    """What moves on the ground, seen in the image."""

    floor: Floor
    """Gives the ground its coordinates."""

    function: Callable[[float], tuple[ArrayLike, ArrayLike, ArrayLike]]
    """Ground point [m], velocity [m/s] and acceleration [m/s^2] at a time [s] in 0..duration, in the floor's frame."""

    duration: float = inf
    """Of the motion [s]; infinite where it goes round."""

    period: float = inf
    """After which it repeats [s]; infinite where it does not."""

    _image: ImageLaw = field(init=False, repr=False)
    """Image rates of ground rates."""

    def __post_init__(self) -> None:
        _check_times(self.duration, self.period)
        object.__setattr__(self, "_image", ImageLaw(self.floor))
        for name, value in zip(
            ("point", "velocity", "acceleration"), self.function(0.0), strict=True
        ):
            readonly(value, (2,), f"the {name} that function(0.0) gives")

    def at(self, t: float) -> Motion:
        """Where it is.

        Parameters
        ----------
        t : float [s]
            Since its start.

        Returns
        -------
        uv : (2,) array [px]
            Point; before and after the motion, its ends. NaN for ground that is not in view.
        uv_dot : (2,) array [px/s]
            Its velocity; zero before and after the motion.
        uv_ddot : (2,) array [px/s^2]
            Its acceleration; zero before and after the motion.
        """
        xy, w, w_dot = (np.asarray(a) for a in self.function(min(max(t, 0.0), self.duration)))
        uv = self.floor.pixel(xy)
        if not 0 <= t <= self.duration:
            return uv, np.zeros(2), np.zeros(2)
        u, v = uv.tolist()
        (x_dot, y_dot), (x_ddot, y_ddot) = w.tolist(), w_dot.tolist()
        image = self._image
        uv_dot = image.to_image(u, v, x_dot, y_dot)
        bend = image.bend((u, v), uv_dot, (x_dot, y_dot))
        pull = image.to_image(u, v, x_ddot, y_ddot)
        return uv, np.array(uv_dot), np.array([bend[0] + pull[0], bend[1] + pull[1]])


@dataclass(frozen=True, slots=True, eq=False)
class ImageEllipse:
    """An ellipse in the image, driven evenly in its parameter: its ground speed follows the perspective."""

    centre_uv: FloatArray
    """(2,) [px]. Its centre."""

    semi_px: tuple[float, float]
    """Semi-axes [px]; those of a circle are equal."""

    period_s: float
    """Of one turn [s]; negative to go the other way."""

    angle_rad: float = 0.0
    """Of the first axis, from u towards v [rad]."""

    phase_rad: float = 0.0
    """Parameter at the start [rad]: 0 at the end of the first axis."""

    turns: float = inf
    """How often it goes round."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_uv", readonly(self.centre_uv, (2,), "centre_uv"))
        _check_ellipse(self.semi_px, "semi_px", self.period_s, self.turns)

    @property
    def duration(self) -> float:
        """Of the motion [s]; infinite where it goes round."""
        return self.turns * abs(self.period_s)

    @property
    def period(self) -> float:
        """After which it repeats [s]."""
        return abs(self.period_s)

    def at(self, t: float) -> Motion:
        """Where it is.

        Parameters
        ----------
        t : float [s]
            Since its start.

        Returns
        -------
        uv : (2,) array [px]
            Point; before and after the motion, its ends.
        uv_dot : (2,) array [px/s]
            Its velocity; zero before and after the motion.
        uv_ddot : (2,) array [px/s^2]
            Its acceleration; zero before and after the motion.
        """
        point, rate, rate2 = _ellipse(self, self.semi_px, t)
        return self.centre_uv + point, np.array(rate), np.array(rate2)


@dataclass(frozen=True, slots=True, eq=False)
class GroundEllipse:
    """An ellipse on the ground, driven evenly in its parameter, as the image shows it (figure 9)."""

    floor: Floor
    """What is known of image and ground."""

    centre_uv: FloatArray
    """(2,) [px]. Image of its centre, which is not the centre of its image."""

    semi_m: tuple[float, float]
    """Semi-axes [m]; those of a circle are equal."""

    period_s: float
    """Of one turn [s]; negative to go the other way."""

    angle_rad: float = 0.0
    """Heading of the first axis in the ground frame [rad]."""

    phase_rad: float = 0.0
    """Parameter at the start [rad]: 0 at the end of the first axis."""

    turns: float = inf
    """How often it goes round."""

    _ground: GroundTrajectory = field(init=False, repr=False)
    """The same as a function."""

    def __post_init__(self) -> None:
        centre = readonly(self.centre_uv, (2,), "centre_uv")
        _check_ellipse(self.semi_m, "semi_m", self.period_s, self.turns)
        x, y = self.floor.position(centre).tolist()
        if not (isfinite(x) and isfinite(y)):
            raise InputError(
                f"centre_uv {centre.tolist()} is on or beyond the horizon, expected ground: move it down"
            )

        def function(t: float) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
            point, rate, rate2 = _ellipse(self, self.semi_m, t)
            return (x + point[0], y + point[1]), rate, rate2

        object.__setattr__(self, "centre_uv", centre)
        ground = GroundTrajectory(self.floor, function, self.duration, self.period)
        object.__setattr__(self, "_ground", ground)

    @property
    def duration(self) -> float:
        """Of the motion [s]; infinite where it goes round."""
        return self.turns * abs(self.period_s)

    @property
    def period(self) -> float:
        """After which it repeats [s]."""
        return abs(self.period_s)

    def at(self, t: float) -> Motion:
        """Where it is.

        Parameters
        ----------
        t : float [s]
            Since its start.

        Returns
        -------
        uv : (2,) array [px]
            Point; before and after the motion, its ends. NaN for ground that is not in view.
        uv_dot : (2,) array [px/s]
            Its velocity; zero before and after the motion.
        uv_ddot : (2,) array [px/s^2]
            Its acceleration; zero before and after the motion.
        """
        return self._ground.at(t)


def _ellipse(
    owner: ImageEllipse | GroundEllipse, semi: tuple[float, float], t: float
) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    """Point from the centre and its rates."""
    inside = 0 <= t <= owner.duration
    t = min(max(t, 0.0), owner.duration)
    rate = 2 * pi / owner.period_s
    c, s = cos(owner.phase_rad + rate * t), sin(owner.phase_rad + rate * t)
    ca, sa = cos(owner.angle_rad), sin(owner.angle_rad)
    a, b = semi
    x, y = a * c, b * s
    point = (ca * x - sa * y, sa * x + ca * y)
    if not inside:
        return point, (0.0, 0.0), (0.0, 0.0)
    x_dot, y_dot = -a * s * rate, b * c * rate
    velocity = (ca * x_dot - sa * y_dot, sa * x_dot + ca * y_dot)
    return point, velocity, (-(rate**2) * point[0], -(rate**2) * point[1])


def _check_ellipse(semi: tuple[float, float], name: str, period_s: float, turns: float) -> None:
    axes = readonly(semi, (2,), name)
    if not (axes > 0).all():
        raise InputError(f"{name} must be positive, not {tuple(axes.tolist())}")
    if not (isfinite(period_s) and period_s != 0):
        raise InputError(f"period_s must be a number other than 0, not {period_s}")
    if not turns > 0:
        raise InputError(f"turns must be positive, not {turns}")


def _check_times(duration: float, period: float) -> None:
    if not duration > 0:
        raise InputError(f"duration must be positive, not {duration} s")
    if not period > 0:
        raise InputError(f"period must be positive, not {period} s")

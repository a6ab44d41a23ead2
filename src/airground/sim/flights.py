"""How cameras fly: hovering in wind, around a point, over and back; closed forms of time, seeded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.scene_camera import Pinhole

if TYPE_CHECKING:
    from airground.sim.scene import CameraOfTime

__all__ = ["Shake", "fly_over", "hover", "orbit"]

WAVES = 12  # sines in each random motion
GUSTS_HZ = (0.6, 3.0)
DRIFT_HZ = (0.02, 0.12)


@dataclass(frozen=True, slots=True)
class Shake:
    """How much wind and motors move a camera that should be steady; standard deviations."""

    gust_deg: float = 0.12
    """Of the attitude between 0.6 and 3 Hz, about each axis [deg]; at a focal length of 1000 px, 0.12 is 2 px."""

    gust_m: float = 0.02
    """Of the position between 0.6 and 3 Hz, along each axis [m]."""

    drift_deg: float = 0.5
    """Of the attitude between 0.02 and 0.12 Hz [deg]."""

    drift_m: float = 0.25
    """Of the position between 0.02 and 0.12 Hz [m]; height a third of it."""

    @classmethod
    def none(cls) -> Shake:
        """No shake at all.

        Returns
        -------
        shake : Shake
            A camera on rails.
        """
        return cls(0.0, 0.0, 0.0, 0.0)


def hover(base: Pinhole, *, seed: int = 0, shake: Shake | None = None) -> CameraOfTime:
    """Hold a place against the wind.

    Parameters
    ----------
    base : Pinhole
        Where and how the camera should be.
    seed : int
        Of the wind.
    shake : Shake, optional
        How strong it is.

    Returns
    -------
    camera : callable
        The camera at any time.
    """
    wind = _Wind(seed, shake or Shake())

    def camera(t: float) -> Pinhole:
        return wind.moves(base, t)

    return camera


def orbit(
    *,
    centre_m: tuple[float, float],
    radius_m: float,
    height_m: float,
    period_s: float,
    focal_length_px: float,
    image_size_px: tuple[int, int],
    start_rad: float = -np.pi / 2,
    aim_height_m: float = 0.0,
    seed: int = 0,
    shake: Shake | None = None,
) -> CameraOfTime:
    """Fly slowly around a point and look at it.

    Parameters
    ----------
    centre_m : (float, float) [m]
        Ground point looked at.
    radius_m, height_m : float [m]
        Of the circle.
    period_s : float [s]
        Of a turn, counter-clockwise; negative for clockwise.
    focal_length_px : float [px]
        Of the camera.
    image_size_px : (int, int) [px]
        Width and height.
    start_rad : float [rad]
        Where on the circle it is at time 0.
    aim_height_m : float [m]
        Height of the point that is looked at.
    seed : int
        Of the wind.
    shake : Shake, optional
        How strong it is.

    Returns
    -------
    camera : callable
        The camera at any time.

    Raises
    ------
    InputError
        If the radius or the height is not positive, or the period is 0.
    """
    if not (radius_m >= 0 and height_m > aim_height_m and period_s != 0):
        raise InputError("orbit: radius and height must be positive, and the period not 0")
    wind = _Wind(seed, shake or Shake())
    tilt = float(np.arctan2(radius_m, height_m - aim_height_m))

    def camera(t: float) -> Pinhole:
        turn = start_rad + 2 * np.pi * t / period_s
        x, y = centre_m[0] + radius_m * np.cos(turn), centre_m[1] + radius_m * np.sin(turn)
        base = Pinhole.looking_down(
            focal_length_px=focal_length_px,
            tilt_rad=tilt,
            height_m=height_m,
            image_size_px=image_size_px,
            heading_rad=turn + np.pi,
            xy_m=(x, y),
        )
        return wind.moves(base, t)

    return camera


def fly_over(
    base: Pinhole,
    *,
    to_m: tuple[float, float],
    period_s: float,
    pause_s: float = 0.0,
    seed: int = 0,
    shake: Shake | None = None,
) -> CameraOfTime:
    """Fly to another place and back, again and again, looking the same way all the time.

    Parameters
    ----------
    base : Pinhole
        Where it is at time 0.
    to_m : (float, float) [m]
        How far it flies; more than the image shows, and the first view leaves it.
    period_s : float [s]
        Of flying there and back, pauses included.
    pause_s : float [s]
        How long it waits at either end.
    seed : int
        Of the wind.
    shake : Shake, optional
        How strong it is.

    Returns
    -------
    camera : callable
        The camera at any time; velocity and acceleration have no steps.

    Raises
    ------
    InputError
        If the pauses leave no time to fly.
    """
    if not 0 <= 2 * pause_s < period_s:
        raise InputError("fly_over: two pauses must be shorter than the period")
    wind = _Wind(seed, shake or Shake())
    leg = period_s / 2 - pause_s

    def camera(t: float) -> Pinhole:
        into = (t + pause_s / 2) % period_s
        back = into >= period_s / 2
        x = np.clip(((into - (period_s / 2 if back else 0.0)) - pause_s) / leg, 0.0, 1.0)
        share = x**3 * (10 - 15 * x + 6 * x**2)
        share = 1 - share if back else share
        shift = share * np.array([*to_m, 0.0])
        moved = Pinhole(
            base.focal_length_px, base.camera_from_world, base.centre_m + shift, base.image_size_px
        )
        return wind.moves(moved, t)

    return camera


class _Wind:
    """Random motion: sums of sines, so that any time can be asked for by itself."""

    def __init__(self, seed: int, shake: Shake) -> None:
        rng = np.random.default_rng([seed, 0x3A])
        self._gusts, self._drift = _Waves(rng, GUSTS_HZ), _Waves(rng, DRIFT_HZ)
        self._shake = shake

    def moves(self, base: Pinhole, t: float) -> Pinhole:
        shake = self._shake
        gust, drift = self._gusts.at(t), self._drift.at(t)
        step = shake.gust_m * gust[:3] + shake.drift_m * drift[:3] * np.array([1, 1, 1 / 3])
        turn = np.radians(shake.gust_deg * gust[3:] + shake.drift_deg * drift[3:])
        return Pinhole(
            base.focal_length_px,
            _rotation(turn) @ base.camera_from_world,
            base.centre_m + step,
            base.image_size_px,
        )


class _Waves:
    """Six independent smooth signals of unit variance, within a band of frequencies."""

    def __init__(self, rng: np.random.Generator, band_hz: tuple[float, float]) -> None:
        low, high = np.log(band_hz)
        self._omega = 2 * np.pi * np.exp(rng.uniform(low, high, (6, WAVES)))
        self._phase = rng.uniform(0, 2 * np.pi, (6, WAVES))

    def at(self, t: float) -> FloatArray:
        waves = np.sin(self._omega * t + self._phase).sum(axis=1)
        return np.asarray(waves * np.sqrt(2 / WAVES))


def _rotation(turn: FloatArray) -> FloatArray:
    """Rotation about an axis by its length [rad] (Rodrigues)."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = turn / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)

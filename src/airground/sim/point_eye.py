"""A simulated camera with a tracker behind it, for one point: sightings that come late, noisy, or not at all."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, inf, isfinite
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.sim.body_poses import PoseOfTime
    from airground.sim.camera import SimCamera
    from airground.sim.lens import Lens

__all__ = ["EyeOptions", "PointEye", "Sighting"]


@dataclass(frozen=True, slots=True)
class EyeOptions:
    """How well, how often and how late a point is seen."""

    rate_hz: float = 30.0
    """Pictures per second."""

    start_s: float = 0.0
    """Exposure of the first picture [s]."""

    latency_s: float = 0.08
    """From exposure to arrival of what was found in the picture [s]."""

    jitter_s: float = 0.0
    """Mean of what comes on top of the latency by chance [s], exponential; pictures do not overtake each other."""

    sigma_px: float = 1.0
    """Standard deviation of a sighting, in u and in v [px]; white, normal."""

    mark_m: tuple[float, float] = (0.0, 0.0)
    """Of the tracked point from the vehicle's position, forward and along the heading plus 90 degrees [m]."""

    dropout_share: float = 0.0
    """Share of the time in which it is not seen."""

    dropout_s: float = 0.3
    """Mean duration of a dropout [s]."""

    hidden_s: tuple[tuple[float, float], ...] = ()
    """Spans in which it is not seen [s]."""

    outlier_share: float = 0.0
    """Share of sightings that are anywhere in the image instead."""

    def __post_init__(self) -> None:
        for name in ("rate_hz", "dropout_s"):
            if not 0 < getattr(self, name) < inf:
                raise InputError(f"{name} must be positive, not {getattr(self, name)}")
        for name in ("latency_s", "jitter_s", "sigma_px"):
            if not 0 <= getattr(self, name) < inf:
                raise InputError(f"{name} must be 0 or more, not {getattr(self, name)}")
        for name in ("dropout_share", "outlier_share"):
            if not 0 <= getattr(self, name) < 1:
                raise InputError(f"{name} must be in 0..1, not {getattr(self, name)}")
        if not all(map(isfinite, (self.start_s, *self.mark_m))):
            raise InputError("start_s and mark_m must be finite")
        if not all(first <= last for first, last in self.hidden_s):
            raise InputError(f"hidden_s must hold (from, to), not {self.hidden_s}")


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """A point as a tracker reports it."""

    t: float
    """Exposure of its picture [s]."""

    arrives_t: float
    """When it is told [s]."""

    uv: FloatArray
    """(2,) [px]. In the pixels of the image, distorted where there is a lens."""


class PointEye:
    """Sightings of one point on a vehicle, each given once.

    Parameters
    ----------
    camera : SimCamera
        Where pictures are taken from.
    pose : callable
        Where the vehicle is at times: `VehiclePlant.pose`, for one.
    options : EyeOptions
        How well it sees.
    rng : Generator
        Where all noise comes from.
    lens : Lens, optional
        Of the camera; none where not given.
    """

    def __init__(
        self,
        camera: SimCamera,
        pose: PoseOfTime,
        options: EyeOptions,
        rng: np.random.Generator,
        *,
        lens: Lens | None = None,
    ) -> None:
        self.camera = camera
        self.pose = pose
        self.options = options
        self.lens = lens
        self._rng = rng.spawn(1)[0]
        self._next = 0  # picture
        self._arrival = -inf  # of the newest picture
        self._away = bool(self._rng.random() < options.dropout_share)
        self._coming: list[tuple[float, float]] = []  # exposure, arrival
        self.frames: int = 0
        """Pictures that have arrived, with a sighting or without."""

    def sightings(self, t: float) -> list[Sighting]:
        """Give what has arrived since one last asked.

        Parameters
        ----------
        t : float [s]
            Now.

        Returns
        -------
        sightings : list of Sighting
            In order; none for pictures in which it is hidden or outside.

        Raises
        ------
        InputError
            If the vehicle has not been driven so far yet.
        """
        o = self.options
        # As soon as an exposure can have arrived, its delay is drawn, in order.
        last = (t - o.latency_s - o.start_s) * o.rate_hz + 1e-6
        while self._next <= last:
            exposed = o.start_s + self._next / o.rate_hz
            late = o.jitter_s * float(self._rng.exponential()) if o.jitter_s else 0.0
            self._arrival = max(self._arrival, exposed + o.latency_s + late)
            self._coming.append((exposed, self._arrival))
            self._next += 1
        found = []
        while self._coming and self._coming[0][1] <= t + 1e-9:
            exposed, arrival = self._coming.pop(0)
            uv = self._seen(exposed)
            self.frames += 1
            if uv is not None:
                found.append(Sighting(exposed, arrival, uv))
        return found

    def _seen(self, t: float) -> FloatArray | None:
        o = self.options
        # The same number of draws for each picture, so that one event does not shift the rest.
        chance, outlier = self._rng.random(2)
        noise, anywhere = self._rng.normal(size=2), self._rng.random(2)
        self._change(float(chance))
        xy, theta = self.pose(np.array([t]))
        cos, sin = np.cos(theta[0]), np.sin(theta[0])
        ahead, aside = o.mark_m
        point = xy[0] + np.array([cos * ahead - sin * aside, sin * ahead + cos * aside])
        uv = self.camera.project(point)
        if self.lens is not None:
            uv = self.lens.distort(uv)
        size = np.array(self.camera.image_size_px)
        hidden = self._away or any(first <= t < last for first, last in o.hidden_s)
        # NaN, of what is not in front of the camera, compares as False.
        if hidden or not bool(((uv >= -0.5) & (uv <= size - 0.5)).all()):
            return None
        if outlier < o.outlier_share:
            return np.asarray(anywhere * size - 0.5)
        return np.asarray(uv + o.sigma_px * noise)

    def _change(self, chance: float) -> None:
        """Enter or leave a dropout: two states whose rates give the share and the mean duration."""
        o = self.options
        if o.dropout_share == 0:
            return
        end = 1 / o.dropout_s
        begin = end * o.dropout_share / (1 - o.dropout_share)
        if chance < 1 - exp(-(end if self._away else begin) / o.rate_hz):
            self._away = not self._away

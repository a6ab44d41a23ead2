"""Eyes in the embedded world while a robot is being driven: its camera's images, detected and tracked, and late."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from airground.sim import Renderer
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.frame import Frame
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.geometry.arrays import FloatArray
    from airground.sim import Scene
    from airground.sim.body_poses import PoseOfTime
    from airground.vision.eyes import Look

__all__ = ["RenderedEye", "Seen"]


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Where a robot's mark was in a picture."""

    t: float
    """Exposure of the picture [s]."""

    uv: FloatArray
    """(2,) [px]. In the pixels of the image."""

    covariance: FloatArray
    """(2, 2) [px2]. Of the position."""


class RenderedEye:
    """Sightings of one tagged robot in rendered images, each given once, when it has arrived.

    Parameters
    ----------
    scene : Scene
        What the camera looks at, with the robot in it.
    robot : str
        Name of the robot; its pose in the scene is replaced.
    pose : callable
        Where it is at times up to now: `VehiclePlant.pose`.
    label : str
        Number of its tag.
    rate_hz : float [Hz]
        Pictures per second.
    latency_s : float [s]
        From exposure to arrival.
    seed : int
        Of the sensor's noise.
    each : callable, optional
        Told of every picture and what was made of it.
    """

    def __init__(
        self,
        scene: Scene,
        robot: str,
        pose: PoseOfTime,
        *,
        label: str,
        rate_hz: float,
        latency_s: float,
        seed: int,
        each: Callable[[Look], None] | None = None,
    ) -> None:
        bodies = tuple(replace(b, pose=pose) if b.name == robot else b for b in scene.bodies)
        self.scene = replace(scene, bodies=bodies)
        self._renderer = Renderer(self.scene, seed)
        self._eyes = Eyes(make_detector("tag:family=36h11"), Tracker())
        self._label = label
        self._rate_hz = rate_hz
        # A picture cannot arrive before its last row has been exposed.
        self._latency_s = max(latency_s, scene.exposure_s + scene.readout_s)
        self._each = each
        self._next = 0
        self.frames: int = 0
        """Pictures that have arrived, with a sighting or without."""

    def sightings(self, t: float) -> list[Seen]:
        """Give what has arrived since one last asked.

        Parameters
        ----------
        t : float [s]
            Now; the robot must have been driven to here.

        Returns
        -------
        sightings : list of Seen
            In order; none for pictures in which it was not found.
        """
        found = []
        while self._next / self._rate_hz + self._latency_s <= t + 1e-9:
            exposed, index = self._next / self._rate_hz, self._next
            self._next += 1
            look = self._eyes.look(
                Frame(self._renderer.image(exposed, index), exposed, "world", index)
            )
            self.frames += 1
            if self._each is not None:
                self._each(look)
            for track in look.state.tracks:
                if track.label == self._label and track.sighting is not None:
                    row = track.sighting
                    found.append(
                        Seen(exposed, look.sightings.uv[row], look.sightings.covariance[row])
                    )
        return found

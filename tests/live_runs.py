"""Runs of the embedded world in simulated time, for tests: robots that are told something 50 times a second."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from airground.control import STOP, VelocityCommand
from airground.sim.live_options import EmbeddedOptions
from airground.sim.live_world import EmbeddedWorld
from airground.sim.vehicle_odometry import OdometryNoise
from airground.sim.vehicle_options import PlantOptions

if TYPE_CHECKING:
    from collections.abc import Mapping

    from airground.robots import RobotReading
    from airground.vision.sightings import Sightings

EXACT = OdometryNoise(
    heading_rad=0.0, speed_share=0.0, speed_mps=0.0, turn_share=0.0, turn_rate_radps=0.0
)
SMOOTH = EmbeddedOptions(plant=PlantOptions(), odometry=EXACT, sigma_px=0.0)
"""Two robots that do not slip, and are known without noise."""

CURVE = VelocityCommand(0.3, 0.35)


@dataclass
class Run:
    """A world, and all that came out of it."""

    world: EmbeddedWorld
    commands: Mapping[str, VelocityCommand] = field(default_factory=dict)
    ticks: int = 0
    told: dict[str, list[RobotReading]] = field(default_factory=lambda: defaultdict(list))
    seen: list[Sightings] = field(default_factory=list)
    arrived: list[float] = field(default_factory=list)
    look: bool = True

    @property
    def t(self) -> float:
        return self.ticks / 50

    def go(self, seconds: float) -> Run:
        """Let time pass."""
        for _ in range(round(seconds * 50)):
            t = self.t
            self.world.advance(t)
            for place in self.world.robots:
                self.told[place.name] += self.world.readings(place.name, t)
                self.world.command(place.name, t, self.commands.get(place.name, STOP))
            if self.look:
                new = self.world.sightings(t)
                self.seen += new
                self.arrived += [t] * len(new)
            self.ticks += 1
        return self

    def fresh(self) -> Run:
        """Forget what came so far."""
        self.told.clear()
        self.seen.clear()
        self.arrived.clear()
        return self


def run(options: EmbeddedOptions = SMOOTH, seed: int = 3, **commands: VelocityCommand) -> Run:
    """A world whose robots are told to do something."""
    return Run(EmbeddedWorld(options, seed), commands)

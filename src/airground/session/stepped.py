"""A session in the embedded world, in simulated time: the same core, without threads, as fast as it computes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from airground.control import Limits
from airground.control.estimation.options import StateOptions
from airground.session.inputs import CameraNews, Finished, Heard, Ordered, Seen
from airground.session.options import RobotOptions, SessionOptions
from airground.session.orders import Alive
from airground.session.session import Session
from airground.session.workers import done
from airground.sim.live_world import EmbeddedWorld
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.calibration import Calibration
    from airground.session.inputs import Input
    from airground.session.orders import Order
    from airground.session.tick import Job, SessionTick

__all__ = ["SteppedSession", "embedded_robots"]

FROZEN_S = 0.1


def embedded_robots(world: EmbeddedWorld, *, speed_mps: float = 0.3) -> tuple[RobotOptions, ...]:
    """What a session is told of the robots of the embedded world.

    Parameters
    ----------
    world : EmbeddedWorld
        Theirs.
    speed_mps : float [m/s]
        How fast they drive until somebody says otherwise.

    Returns
    -------
    robots : tuple of RobotOptions
        With delays a little off the truth, as a data sheet is.
    """
    state = StateOptions(
        actuation_delay_s=0.05, speed_lag_s=0.12, turn_lag_s=0.1, heading_sigma_rad=0.02
    )
    return tuple(
        RobotOptions(
            place.name,
            str(place.tag),
            world.options.kind,
            radius_m=world.radius_m,
            limits=Limits(),
            speed_mps=speed_mps,
            state=state,
        )
        for place in world.robots
    )


class SteppedSession:
    """Steps world and session together. Pictures are not drawn: the world says what would be seen in them.

    Parameters
    ----------
    world : EmbeddedWorld
        Camera and robots.
    calibration : Calibration, optional
        What is known of the camera already.
    options : SessionOptions, optional
        Of the session; those of the world's robots where not given.
    job_s : float [s]
        How long work outside the loop takes.
    """

    def __init__(
        self,
        world: EmbeddedWorld,
        calibration: Calibration | None = None,
        *,
        options: SessionOptions | None = None,
        job_s: float = 0.05,
    ) -> None:
        self.world = world
        self.session = Session(options or SessionOptions(embedded_robots(world)), calibration)
        self.tick: SessionTick | None = None
        self.inputs: list[Input] = []
        """Of the last step."""
        self.orders: list[tuple[str, Order]] = []
        """To be carried out at the next step."""
        self.said: list[str] = []
        """Lines of all events so far."""
        self.refused: list[str] = []
        """Lines of all orders that were refused."""
        self.operator = ""
        """Who is at the controls, and alive; nobody where empty."""
        self._job_s = job_s
        self._jobs: list[tuple[float, Job]] = []
        self._tracker = Tracker()
        self._segment = 0
        self._frozen_s = 0.0
        self._step = 0

    @property
    def t(self) -> float:
        """Now [s]."""
        return self.world.now

    def order(self, order: Order, client: str = "me") -> None:
        """Ask for something at the next step.

        Parameters
        ----------
        order : Order
            What for.
        client : str
            Who asks.
        """
        self.orders.append((client, order))

    def step(self) -> SessionTick:
        """Let a control period pass.

        Returns
        -------
        tick : SessionTick
            What was decided; the robots have been told.
        """
        self._step += 1
        t = self._step * self.session.options.period_s
        self.world.advance(t)
        self.inputs = self._see(t)
        for place in self.world.robots:
            readings = self.world.readings(place.name, t)
            if readings:
                self.inputs.append(Heard(place.name, tuple(readings)))
        if self.operator:
            self.inputs.append(Ordered(self.operator, Alive()))
        self.inputs += [Ordered(client, order) for client, order in self.orders]
        self.orders = []
        self.inputs += [Finished(job.number, done(job)) for when, job in self._jobs if when <= t]
        self._jobs = [one for one in self._jobs if one[0] > t]
        tick = self.session.step(t, self.inputs)
        for name, command in tick.commands.items():
            self.world.command(name, t, command)
        self._jobs += [(t + self._job_s, job) for job in tick.jobs]
        self.said += [event.line for event in tick.events]
        self.refused += [line for _, line in tick.refused]
        self.tick = tick
        return tick

    def run(
        self, seconds: float, until: Callable[[SessionTick], bool] | None = None
    ) -> SessionTick:
        """Let time pass.

        Parameters
        ----------
        seconds : float [s]
            At most so long.
        until : callable, optional
            Ends it where it is true of a tick.

        Returns
        -------
        tick : SessionTick
            The last.
        """
        for _ in range(max(1, round(seconds * self.session.options.control_hz))):
            tick = self.step()
            if until is not None and until(tick):
                break
        return tick

    def _see(self, t: float) -> list[Input]:
        inputs: list[Input] = []
        for picture in self.world.pictures(t):
            sightings = self.world.look(picture)
            if picture.segment != self._segment:
                self._tracker.restart()
                self._segment = picture.segment
            self._frozen_s = (
                self._frozen_s + 1 / self.world.options.camera_hz if picture.frozen else 0
            )
            if picture.frozen or self._frozen_s == 0:
                inputs.append(CameraNews("live", frozen_s=self._frozen_s))
            tracks = self._tracker.update(sightings)
            size = self.world.camera.image_size_px
            inputs.append(
                Seen(sightings.t, t, picture.index, size, sightings, tracks, picture.segment)
            )
        return inputs

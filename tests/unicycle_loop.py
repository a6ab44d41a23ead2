"""A robot under a controller, by arcs and the simulated camera: no ground coordinates of the code under test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from airground.control import Limits, RobotState
from airground.sim.unicycle import arc

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.control import Controller, Guidance
    from airground.sim import SimCamera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """A drive; one row a tick, before its command is driven."""

    t: Array
    xy: Array
    theta: Array
    command: Array
    """(N, 3): v, omega, lateral."""

    progress: Array
    error_m: Array
    guidance: Guidance
    """The last."""

    def turned(self, after: int = 0) -> float:
        """All turns either way [rad]."""
        return float(np.abs(np.diff(self.theta[after:])).sum())


def drive(
    controller: Controller,
    camera: SimCamera,
    xy: ArrayLike,
    theta: float,
    *,
    seconds: float = 60.0,
    dt: float = 0.04,
    noise_px: float = 0.0,
    covariance: Array | None = None,
    rng: np.random.Generator | None = None,
    until_done: bool = True,
) -> Run:
    xy, v, omega, lateral, progress = np.array(xy, dtype=np.float64), 0.0, 0.0, 0.0, 0.0
    rows: list[Any] = []
    for k in range(int(seconds / dt)):
        uv = camera.project(xy)
        if rng is not None and noise_px:
            uv = uv + rng.normal(0, noise_px, 2)
        state = RobotState(k * dt, uv, theta, v, omega, lateral, covariance)
        guidance = controller.step(state, progress, dt)
        progress, command = guidance.progress, guidance.command
        v, omega, lateral = command.v, command.omega, command.lateral
        rows.append((k * dt, *xy, theta, v, omega, lateral, progress, guidance.error_m))
        if guidance.trouble or (guidance.done and until_done):
            break
        xy = xy + arc(theta, v, omega, dt) + arc(theta + np.pi / 2, lateral, omega, dt)
        theta += omega * dt
    table = np.array(rows)
    return Run(
        table[:, 0], table[:, 1:3], table[:, 3], table[:, 4:7], table[:, 7], table[:, 8], guidance
    )


def within(limits: Limits, run: Run, dt: float = 0.04) -> None:
    """Assert that a drive from rest kept to the limits, but for the last tick's stop."""
    v, omega = run.command[:, 0], run.command[:, 1]
    slack = 1e-9
    assert v.max() <= limits.speed_mps + slack
    assert v.min() >= -limits.reverse_mps - slack
    assert np.abs(omega).max() <= limits.turn_rate_radps + slack
    assert np.abs(v * omega).max() <= limits.lateral_acceleration_mps2 + slack
    assert (np.abs(omega) * limits.turn_radius_m <= np.abs(v) + slack).all()
    steps = np.diff(np.concatenate([[0.0], np.abs(v[:-1])]))  # through rest they are less
    assert steps.max(initial=0.0) <= limits.acceleration_mps2 * dt + slack
    assert steps.min(initial=0.0) >= -limits.deceleration_mps2 * dt - slack
    if limits.turn_radius_m == 0:  # else the circle that the speed allows comes first
        swings = np.abs(np.diff(np.concatenate([[0.0], omega[:-1]])))
        # A turn is also bounded by the lateral acceleration, which the speed gains on.
        assert swings.max(initial=0.0) <= limits.turn_acceleration_radps2 * dt + 0.05

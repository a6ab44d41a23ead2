"""Other ways to have measured image velocities in the paper's simulation, for the sweep over what it leaves open."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.samples import MotionSamples
from airground.errors import InputError
from airground.studies.simulation import Measurement, PaperSimulation

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.sim.camera import SimCamera

__all__ = ["Measure", "measure_differences", "measure_exactly", "measure_fits"]

Measure = Callable[[PaperSimulation, "SimCamera", np.random.Generator], Measurement]


def measure_exactly(
    simulation: PaperSimulation, camera: SimCamera, rng: np.random.Generator
) -> Measurement:
    """Take the true image velocity in the middle of each segment: only positions and ground velocities are noisy.

    Parameters
    ----------
    simulation : PaperSimulation
        Drive and noise.
    camera : SimCamera
        The truth.
    rng : Generator
        Where the noise comes from.

    Returns
    -------
    measurement : Measurement
        One sample per segment.
    """
    corners, xy_dot = simulation.drive.corners, simulation.drive.xy_dot
    middle = (corners[1:] + corners[:-1]) / 2
    uv, uv_dot = camera.project(middle), camera.project_velocity(middle, xy_dot)
    samples = MotionSamples(
        uv + rng.uniform(-simulation.pixel_bound_px, simulation.pixel_bound_px, uv.shape),
        uv_dot,
        _read(simulation, xy_dot, rng),
    )
    return Measurement(samples, uv_dot)


def measure_differences(rate_hz: float, *, one_reading: bool) -> Measure:
    """Difference successive frames of each segment.

    Parameters
    ----------
    rate_hz : float [1/s]
        Frames per second.
    one_reading : bool
        Whether the ground velocity is read once in a segment, or once for each difference.

    Returns
    -------
    measure : callable
        Gives one sample per pair of successive frames of one segment.
    """

    def measure(
        simulation: PaperSimulation, camera: SimCamera, rng: np.random.Generator
    ) -> Measurement:
        xy, dt = _frames(simulation, rate_hz)
        uv = camera.project(xy)
        uv = uv + rng.uniform(-simulation.pixel_bound_px, simulation.pixel_bound_px, uv.shape)
        xy_dot = np.broadcast_to(simulation.drive.xy_dot[:, None], xy[:, 1:].shape)
        if one_reading:
            read = np.broadcast_to(
                _read(simulation, simulation.drive.xy_dot, rng)[:, None], xy_dot.shape
            )
        else:
            read = _read(simulation, xy_dot, rng)
        middle = (xy[:, 1:] + xy[:, :-1]) / 2
        samples = MotionSamples(
            ((uv[:, 1:] + uv[:, :-1]) / 2).reshape(-1, 2),
            (np.diff(uv, axis=1) / dt).reshape(-1, 2),
            read.reshape(-1, 2),
        )
        return Measurement(samples, camera.project_velocity(middle, xy_dot).reshape(-1, 2))

    return measure


def measure_fits(rate_hz: float, *, one_reading: bool) -> Measure:
    """Fit a straight line over time to all frames of each segment.

    Parameters
    ----------
    rate_hz : float [1/s]
        Frames per second.
    one_reading : bool
        Whether the ground velocity is read once in a segment, or is the mean of one reading per frame.

    Returns
    -------
    measure : callable
        Gives one sample per segment.
    """

    def measure(
        simulation: PaperSimulation, camera: SimCamera, rng: np.random.Generator
    ) -> Measurement:
        xy, dt = _frames(simulation, rate_hz)
        uv = camera.project(xy)
        uv = uv + rng.uniform(-simulation.pixel_bound_px, simulation.pixel_bound_px, uv.shape)
        t = dt * (np.arange(xy.shape[1]) - (xy.shape[1] - 1) / 2)
        true = simulation.drive.xy_dot
        readings = 1 if one_reading else xy.shape[1]
        read = _read(simulation, np.repeat(true[:, None], readings, axis=1), rng).mean(axis=1)
        slope = np.einsum("f,sfk->sk", t, uv) / np.sum(t**2)
        middle = (xy[:, 0] + xy[:, -1]) / 2
        samples = MotionSamples(uv.mean(axis=1), slope, read)
        return Measurement(samples, camera.project_velocity(middle, true))

    return measure


def _frames(simulation: PaperSimulation, rate_hz: float) -> tuple[FloatArray, float]:
    """Ground positions in each segment at equal steps, both ends included: (segments, frames, 2)."""
    drive = simulation.drive
    steps = round(drive.duration_s * rate_hz)
    if steps < 1:
        raise InputError(f"a segment of {drive.duration_s} s holds no two frames at {rate_hz} Hz")
    share = np.linspace(0.0, 1.0, steps + 1)[:, None]
    ends = drive.corners[:, None]
    return ends[:-1] + share * (ends[1:] - ends[:-1]), drive.duration_s / steps


def _read(simulation: PaperSimulation, xy_dot: FloatArray, rng: np.random.Generator) -> FloatArray:
    bound = simulation.speed_bound_mps
    return np.asarray(xy_dot + rng.uniform(-bound, bound, xy_dot.shape))

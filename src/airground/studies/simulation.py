"""The paper's simulated calibration (section 3.1): 8 segments, noise in pixels and velocities, many trials.

The paper leaves two things open: how long a segment takes, and how an image velocity is measured. We take 5 s, and
the difference of a segment's end points over its duration; `airground.studies.sweep` shows what else would give.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from airground.calibration.linear import estimate_linear
from airground.calibration.samples import MotionSamples
from airground.errors import InputError, UndeterminedError, UnobservableMotionError
from airground.geometry.arrays import FloatArray
from airground.sim.unicycle import SegmentDrive
from airground.studies.paper_camera import paper_camera
from airground.studies.workers import HERE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from airground.sim.camera import SimCamera
    from airground.studies.workers import Workers

__all__ = [
    "BLOCK",
    "PAPER",
    "Measurement",
    "PaperSimulation",
    "Progress",
    "Trials",
    "measure_end_points",
    "require_trials",
    "run_trials",
    "trial_generators",
]

BLOCK = 25
"""Trials of one task."""


class Progress(Protocol):
    """What long work calls to say how far it is."""

    def __call__(self, done: int, total: int, /) -> None:
        """Take the news: `done` of `total` trials."""


@dataclass(frozen=True, slots=True)
class PaperSimulation:
    """Numbers of section 3.1, and our choice where it gives none."""

    drive: SegmentDrive = field(default_factory=SegmentDrive)
    """8 segments, 30 degrees apart, at 0.12 m/s; ours: of 5 s, the first along x."""

    pixel_bound_px: float = 5.0
    """Noise of an image point is uniform in +- this, in u and in v [px]."""

    speed_bound: float = 0.1
    """Noise of a ground velocity is uniform in +- this share of the speed, in x and in y."""

    shift_px: tuple[float, float] = (0.0, 0.0)
    """Where the middle of the drive is seen, from the middle of the image [px]; ours."""

    @property
    def speed_bound_mps(self) -> float:
        """Bound of the noise in x and in y [m/s]."""
        return self.speed_bound * self.drive.speed_mps

    def camera(self) -> SimCamera:
        """Table 1's camera, with the drive in its image.

        Returns
        -------
        camera : SimCamera
            The truth.
        """
        return paper_camera(self.drive.corners, self.shift_px)


PAPER = PaperSimulation()
"""As published, with 5 s for a segment."""


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What one trial measures, and what it would have measured without noise."""

    samples: MotionSamples
    """One sample per segment."""

    ideal_uv_dot: FloatArray
    """(N, 2) [px/s]. True image velocity in the middle of each segment."""


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """Estimates of many trials, and the truth."""

    g: FloatArray
    """(3, 2). Truth."""

    g_hat: FloatArray
    """(M, 3, 2). Linear estimates, of the trials that gave one."""

    samples: tuple[MotionSamples, ...]
    """M. What they were estimated from."""

    ideal_uv_dot: FloatArray
    """(M, N, 2) [px/s]. True image velocities."""

    unobservable: int
    """Trials without an estimate, as their motion left more than one g."""

    @property
    def trials(self) -> int:
        """How many were run."""
        return len(self.g_hat) + self.unobservable


def trial_generators(seed: int, trials: int, first: int = 0) -> Iterator[np.random.Generator]:
    """Independent random numbers for each trial; trial k is the same however many there are.

    Parameters
    ----------
    seed : int
        Not negative.
    trials : int
        How many.
    first : int
        Number of the first of them.

    Yields
    ------
    rng : Generator
        For one trial.
    """
    require_trials(trials, seed)
    for k in range(first, first + trials):  # the k-th child that the seed would spawn
        yield np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(k,)))


def require_trials(trials: int, seed: int) -> None:
    """Refuse numbers that cannot be.

    Parameters
    ----------
    trials : int
        At least one.
    seed : int
        Not negative.

    Raises
    ------
    InputError
        Naming the one that is wrong.
    """
    if trials < 1:
        raise InputError(f"trials must be 1 or more, not {trials}")
    if seed < 0:
        raise InputError(f"seed must be 0 or more, not {seed}")


def measure_end_points(
    simulation: PaperSimulation, camera: SimCamera, rng: np.random.Generator
) -> Measurement:
    """See the robot at the ends of its segments, and read its velocity once in each.

    The image velocity is the difference of a segment's two end points over its duration, and stands for their middle.
    This is the velocity there only nearly: perspective changes the scale along a segment.

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
        8 samples from 9 noisy points; neighbours share a point, so their noise is correlated.
    """
    drive = simulation.drive
    corners, xy_dot = drive.corners, drive.xy_dot
    uv = camera.project(corners)
    uv = uv + rng.uniform(-simulation.pixel_bound_px, simulation.pixel_bound_px, uv.shape)
    bound = simulation.speed_bound_mps
    samples = MotionSamples(
        uv=(uv[1:] + uv[:-1]) / 2,
        uv_dot=np.diff(uv, axis=0) / drive.duration_s,
        xy_dot=xy_dot + rng.uniform(-bound, bound, xy_dot.shape),
    )
    middle = (corners[1:] + corners[:-1]) / 2
    return Measurement(samples, camera.project_velocity(middle, xy_dot))


def run_trials(
    simulation: PaperSimulation = PAPER,
    *,
    trials: int = 100,
    seed: int = 0,
    progress: Progress | None = None,
    measure: Callable[
        [PaperSimulation, SimCamera, np.random.Generator], Measurement
    ] = measure_end_points,
    workers: Workers = HERE,
) -> Trials:
    """Simulate and estimate by the linear method, again and again.

    Parameters
    ----------
    simulation : PaperSimulation
        Drive and noise.
    trials : int
        How many.
    seed : int
        Of all of them; trial k depends on the seed and on k only.
    progress : callable, optional
        Told of the trials done, block by block.
    measure : callable
        How samples are taken; a function of a module where others than this process work.
    workers : Workers
        Who works; the outcome does not depend on it.

    Returns
    -------
    outcome : Trials
        Estimates of the trials that gave one, and how many did not.

    Raises
    ------
    InputError
        If `trials` is less than one, `seed` is negative, or the drive does not fit into the image.
    UndeterminedError
        If no trial gave an estimate.
    """
    camera = simulation.camera()
    require_trials(trials, seed)
    firsts = range(0, trials, BLOCK)
    tasks = ((simulation, seed, k, min(BLOCK, trials - k), measure) for k in firsts)
    blocks: list[_Block] = []
    done = 0
    for block in workers.map(_run_block, tasks, len(firsts)):
        blocks.append(block)
        done += len(block.g_hat) + block.unobservable
        if progress is not None:
            progress(done, trials)
    unobservable = sum(block.unobservable for block in blocks)
    if unobservable == trials:
        raise UndeterminedError(f"none of the {trials} trials determines g; drive more headings")
    return Trials(
        camera.g,
        np.concatenate([block.g_hat for block in blocks if len(block.g_hat)]),
        tuple(samples for block in blocks for samples in block.samples),
        np.concatenate([block.ideal_uv_dot for block in blocks if len(block.g_hat)]),
        unobservable,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Block:
    """Some trials in a row: parts of `Trials`."""

    g_hat: FloatArray
    """(M, 3, 2). Or empty."""

    samples: tuple[MotionSamples, ...]
    """M."""

    ideal_uv_dot: FloatArray
    """(M, N, 2) [px/s]. Or empty."""

    unobservable: int
    """Without an estimate."""


def _run_block(
    simulation: PaperSimulation,
    seed: int,
    first: int,
    count: int,
    measure: Callable[[PaperSimulation, SimCamera, np.random.Generator], Measurement],
) -> _Block:
    camera = simulation.camera()
    estimates: list[FloatArray] = []
    samples: list[MotionSamples] = []
    ideal: list[FloatArray] = []
    for rng in trial_generators(seed, count, first):
        measurement = measure(simulation, camera, rng)
        try:
            estimates.append(estimate_linear(measurement.samples).g)
        except UnobservableMotionError:
            continue
        samples.append(measurement.samples)
        ideal.append(measurement.ideal_uv_dot)
    return _Block(np.array(estimates), tuple(samples), np.array(ideal), count - len(estimates))

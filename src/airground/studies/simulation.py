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

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from airground.sim.camera import SimCamera

__all__ = [
    "PAPER",
    "Measurement",
    "PaperSimulation",
    "Progress",
    "Trials",
    "measure_end_points",
    "run_trials",
    "trial_generators",
]

PROGRESS_STEPS = 100


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


def trial_generators(seed: int, trials: int) -> Iterator[np.random.Generator]:
    """Independent random numbers for each trial; trial k is the same however many there are.

    Parameters
    ----------
    seed : int
        Not negative.
    trials : int
        How many.

    Yields
    ------
    rng : Generator
        For one trial.
    """
    if trials < 1:
        raise InputError(f"trials must be 1 or more, not {trials}")
    if seed < 0:
        raise InputError(f"seed must be 0 or more, not {seed}")
    for child in np.random.SeedSequence(seed).spawn(trials):
        yield np.random.default_rng(child)


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
        Told of the trials done, about a hundred times.
    measure : callable
        How samples are taken.

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
    estimates: list[FloatArray] = []
    samples: list[MotionSamples] = []
    ideal: list[FloatArray] = []
    unobservable = 0
    for k, rng in enumerate(trial_generators(seed, trials)):
        measurement = measure(simulation, camera, rng)
        try:
            estimates.append(estimate_linear(measurement.samples).g)
        except UnobservableMotionError:
            unobservable += 1
        else:
            samples.append(measurement.samples)
            ideal.append(measurement.ideal_uv_dot)
        if progress is not None and (
            k + 1 == trials or (k + 1) % max(trials // PROGRESS_STEPS, 1) == 0
        ):
            progress(k + 1, trials)
    if not estimates:
        raise UndeterminedError(f"none of the {trials} trials determines g; drive more headings")
    return Trials(camera.g, np.stack(estimates), tuple(samples), np.stack(ideal), unobservable)

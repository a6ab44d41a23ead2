"""What figures 8 to 11 share: the paper's camera to drive under, and g as a calibration before found it.

The paper does not say how large noise and limits were while the robot was being controlled. Ours: 0.12 m/s as in its
calibration, sightings with 1 px of white noise at 20 Hz and 100 ms late, odometry with 10 % slow noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.geometry import LimitedHomography, n_error
from airground.studies.drive_measures import rms
from airground.studies.driving_world import DrivingWorld
from airground.studies.rig import Rig
from airground.studies.rig_options import RigOptions, limits_for
from airground.studies.simulation import PAPER, run_trials
from airground.studies.whole_drive import whole_drive_trial

if TYPE_CHECKING:
    from collections.abc import Mapping

    from airground.geometry.arrays import FloatArray
    from airground.studies.rig import Drive

__all__ = [
    "OPTIONS",
    "SPEED_MPS",
    "TOP_MPS",
    "Models",
    "Tracked",
    "convergence",
    "paper_models",
    "paper_rig",
    "paper_world",
]

SPEED_MPS = 0.12
"""Of the robot along a trajectory: that of the paper's calibration drive."""

TOP_MPS = 0.2
"""The robot's limit: some room to catch up."""

OPTIONS = RigOptions(sigma_px=1.0)

CLOSE_PX = 8.0  # an error below it is one of noise and curves, no longer of the start


@dataclass(frozen=True, slots=True, eq=False)
class Models:
    """The true g, and what a calibration by the paper's simulation found."""

    truth: LimitedHomography
    """Table 1, "ideal"."""

    linear: LimitedHomography
    """By the paper's method."""

    whole: LimitedHomography
    """From the whole drive."""

    def items(self) -> tuple[tuple[str, LimitedHomography], ...]:
        """Give all three by name.

        Returns
        -------
        items : tuple of (str, LimitedHomography)
            The estimates first.
        """
        return (("linear", self.linear), ("trajectory", self.whole), ("oracle", self.truth))

    def errors(self) -> dict[str, float]:
        """Say how far off the estimates are.

        Returns
        -------
        errors : dict
            n of eq. 22 by name.
        """
        return {name: float(n_error(self.truth, model)) for name, model in self.items()[:2]}


def paper_models(seed: int) -> Models:
    """Calibrate once by the paper's simulated drive (section 3.1).

    Parameters
    ----------
    seed : int
        Of its noise.

    Returns
    -------
    models : Models
        Of the first trial that determines g.
    """
    trials = run_trials(PAPER, trials=3, seed=seed)
    whole, _ = whole_drive_trial(trials.samples[0], trials.g_hat[0], PAPER)
    return Models(
        LimitedHomography(trials.g),
        LimitedHomography(trials.g_hat[0]),
        LimitedHomography(whole),
    )


def paper_world(start_uv: FloatArray, heading_rad: float) -> DrivingWorld:
    """Table 1's camera, and a robot under it.

    Parameters
    ----------
    start_uv : (2,) array [px]
        Where the robot is seen at first.
    heading_rad : float [rad]
        Its heading.

    Returns
    -------
    world : DrivingWorld
        Without pictures to render.
    """
    camera = PAPER.camera()
    x, y = camera.unproject(start_uv).tolist()
    width, height = camera.image_size_px
    return DrivingWorld(
        "paper",
        camera=camera,
        lens=None,
        ground_uv=np.array([(width - 1) / 2, (height - 1) / 2]),
        start_m=(x, y),
        heading_rad=heading_rad,
        speed_mps=SPEED_MPS,
    )


def paper_rig(world: DrivingWorld, model: LimitedHomography, seed: int) -> Rig:
    """Set up the closed loop.

    Parameters
    ----------
    world : DrivingWorld
        The truth.
    model : LimitedHomography
        What the pilot is given.
    seed : int
        Of the noise.

    Returns
    -------
    rig : Rig
        At rest, knowing where the robot is.
    """
    rig = Rig(world, model, None, limits=limits_for(TOP_MPS), options=OPTIONS, seed=seed)
    rig.settle()
    return rig


def convergence(drives: Mapping[str, Tracked]) -> dict[str, dict[str, Any]]:
    """Figures of drives that start off a trajectory and shall come to it.

    Parameters
    ----------
    drives : mapping of str to Tracked
        By the g they were given.

    Returns
    -------
    figures : dict of dict
        By the same names: error at the start, time until it stays close, and root mean squares from when the last
        of them has come close.
    """
    settle = {name: one.settled_s() for name, one in drives.items()}
    all_s = max((s for s in settle.values() if s is not None), default=0.0)
    figures = {}
    for name, one in drives.items():
        after = one.drive.t - one.drive.t[0] >= all_s
        figures[name] = {
            "start_error_px": float(one.error_px[0]),
            "settled": settle[name] is not None,
            "settle_s": settle[name],
            "path_rms_px": rms(one.error_px[after]),
            "path_rms_m": rms(one.error_m[after]),
            "stops": len(one.drive.stops),
        }
    return figures


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """A drive along a trajectory."""

    drive: Drive
    """What was driven."""

    error_px: FloatArray
    """(N,) [px]. Distance from the trajectory's line at the ticks."""

    error_m: FloatArray
    """(N,) [m]. The same on the ground."""

    def settled_s(self) -> float | None:
        """Tell when it has come close to stay.

        Returns
        -------
        settled : float or None [s]
            Since its start; None where it did not.
        """
        far = np.flatnonzero(self.error_px > CLOSE_PX)
        first = 0 if len(far) == 0 else int(far[-1]) + 1
        if first >= len(self.error_px) - 1:
            return None
        return float(self.drive.t[first] - self.drive.t[0])

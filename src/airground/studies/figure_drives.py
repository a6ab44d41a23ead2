"""What figures 8 to 10 share: the paper's camera to drive under, and g as a calibration before found it.

The paper does not say how large noise and limits were while the robot was being controlled. Ours: 0.12 m/s as in its
calibration, sightings with 1 px of white noise at 20 Hz and 100 ms late, odometry with 10 % slow noise.
"""

from __future__ import annotations

from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry import LimitedHomography, n_error
from airground.studies.driving_world import DrivingWorld
from airground.studies.figure_paths import SPEED_MPS
from airground.studies.rig import Rig
from airground.studies.rig_options import RigOptions, limits_for
from airground.studies.simulation import PAPER, run_trials
from airground.studies.stage import Known, Layout
from airground.studies.whole_drive import whole_drive_trial

if TYPE_CHECKING:
    from collections.abc import Iterator

    from airground.geometry.arrays import FloatArray

__all__ = [
    "OPTIONS",
    "TOP_MPS",
    "PaperStage",
    "paper_stage",
]

TOP_MPS = 0.2
"""The robot's limit: some room to catch up."""

OPTIONS = RigOptions(sigma_px=1.0)


def _wave() -> FloatArray:
    """(N, 2) [px]. One and a half periods, from left to right."""
    u = np.linspace(180.0, 860.0, 18)
    return np.column_stack([u, 380.0 + 110.0 * np.sin((u - 180.0) / 680.0 * 3 * np.pi)])


class PaperStage:
    """Table 1's camera in the embedded world; g as the first trial of the paper's simulation finds it.

    Parameters
    ----------
    seed : int
        Of the trial's noise, and of the drives'.
    """

    layout = Layout(
        wave_uv=_wave(),
        wave_start_uv=np.array([300.0, 640.0]),
        wave_heading_rad=2.6,
        ellipse_centre_uv=np.array([511.5, 400.0]),
        ellipse_semi_m=(0.75, 0.45),
        ellipse_angle_rad=0.4,
        ellipse_start_uv=np.array([760.0, 610.0]),
        ellipse_heading_rad=2.2,
    )
    """Where things lie."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        trials = run_trials(PAPER, trials=3, seed=seed)
        whole, _ = whole_drive_trial(trials.samples[0], trials.g_hat[0], PAPER)
        self.known = {
            "linear": Known(LimitedHomography(trials.g_hat[0])),
            "trajectory": Known(LimitedHomography(whole)),
            "oracle": Known(LimitedHomography(trials.g)),
        }
        """What pilots are told."""
        truth = self.known["oracle"].model
        self.errors = {
            name: float(n_error(truth, one.model))
            for name, one in self.known.items()
            if name != "oracle"
        }
        """n of eq. 22 of the estimates."""

    def world(self, start_uv: FloatArray, heading_rad: float) -> DrivingWorld:
        """Place the robot.

        Parameters
        ----------
        start_uv : (2,) array [px]
            Where its mark is seen.
        heading_rad : float [rad]
            How it stands.

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

    @contextmanager
    def rig(self, name: str, start_uv: FloatArray, heading_rad: float) -> Iterator[Rig]:
        """Set up the closed loop.

        Parameters
        ----------
        name : str
            Of what the pilot is told.
        start_uv : (2,) array [px]
            Where the robot's mark is seen.
        heading_rad : float [rad]
            How it stands.

        Yields
        ------
        rig : Rig
            At rest, knowing where the robot is.
        """
        rig = Rig(
            self.world(start_uv, heading_rad),
            self.known[name].model,
            None,
            limits=limits_for(TOP_MPS),
            options=OPTIONS,
            seed=self._seed,
        )
        rig.settle()
        yield rig


@lru_cache(maxsize=2)
def paper_stage(seed: int) -> PaperStage:
    """Calibrate once by the paper's simulated drive (section 3.1).

    Parameters
    ----------
    seed : int
        Of its noise.

    Returns
    -------
    stage : PaperStage
        The same one for the same seed.
    """
    return PaperStage(seed)

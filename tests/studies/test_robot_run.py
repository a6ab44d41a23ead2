"""The robot experiment with fewer pictures: our eyes on MuJoCo's images, and n_e of what is calibrated from them."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

from airground.errors import UnreachableError
from airground.sim3d.options import World3dOptions
from airground.studies.robot_run import calibration_run, run_errors
from worlds3d import small_camera


def test_eight_segments_calibrate_to_one_per_cent() -> None:
    if find_spec("mujoco") is None:
        pytest.skip("MuJoCo is not installed: pip install airground[sim3d]")
    camera = small_camera(image_size_px=(960, 540), rate_hz=4.0)
    try:
        run = calibration_run(1, World3dOptions(camera=camera))
    except UnreachableError as error:
        pytest.skip(str(error))
    assert set(run.tracks.targets) == {"red", "cart"}
    assert run.motion.targets == ("red",)
    heading = np.unwrap(run.motion.heading if run.motion.heading is not None else [])
    assert np.ptp(heading) == pytest.approx(7 * np.pi / 6, abs=0.15)
    n = run_errors(run)
    assert n["trajectory"] < 0.012
    assert n["trajectory"] < n["no lens"] < 0.1, "the lens is seen"
    assert n["linear"] < 0.1

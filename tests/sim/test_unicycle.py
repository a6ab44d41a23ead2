"""The unicycle against brute-force integration, and the paper's segments against their description."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.sim import SegmentDrive, arc, roll_out


@pytest.mark.parametrize("omega", [0.0, 1e-9, 0.7, -2.0])
def test_an_arc_is_what_small_steps_sum_to(omega: float) -> None:
    theta, v, T, steps = 0.4, -0.8, 1.7, 200_000
    t = (np.arange(steps) + 0.5) * T / steps  # midpoint rule
    heading = theta + omega * t
    summed = v * T / steps * np.array([np.cos(heading).sum(), np.sin(heading).sum()])
    assert_allclose(arc(theta, v, omega, T), summed, rtol=1e-9, atol=1e-12)


def test_arcs_broadcast() -> None:
    assert arc(np.zeros((3, 1)), np.ones(4), 0.1, 0.5).shape == (3, 4, 2)


def test_a_full_circle_closes() -> None:
    xy, theta = roll_out((1.0, 2.0), 0.3, 0.5, np.full(64, 2 * np.pi / 6.4), 0.1)
    assert xy.shape == (65, 2)
    assert_allclose(xy[-1], xy[0], atol=1e-12)
    assert theta[-1] - theta[0] == pytest.approx(2 * np.pi)
    radius = 0.5 / (2 * np.pi / 6.4)
    centre = xy[0] + radius * np.array(
        [-np.sin(0.3), np.cos(0.3)]
    )  # to the left: counter-clockwise
    assert_allclose(np.linalg.norm(xy - centre, axis=1), radius, rtol=1e-12)


def test_the_default_drive_is_the_papers() -> None:
    drive = SegmentDrive()
    steps = np.diff(drive.corners, axis=0)
    assert len(steps) == 8
    assert_allclose(np.linalg.norm(steps, axis=1), 0.12 * drive.duration_s, rtol=1e-12)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    assert_allclose(np.degrees(np.diff(headings)), 30.0, rtol=1e-9)
    assert_allclose(drive.xy_dot, steps / drive.duration_s, atol=1e-15)
    assert drive.total_s == 40.0


def test_at_runs_along_the_segments() -> None:
    drive = SegmentDrive(segments=3, duration_s=2.0, start_m=(1.0, -1.0), heading_rad=0.5)
    xy, theta = drive.at([0.0, 1.0, 2.0, 6.0])
    assert_allclose(xy[0], [1.0, -1.0])
    assert_allclose(xy[1], (drive.corners[0] + drive.corners[1]) / 2)
    assert_allclose(xy[2], drive.corners[1])
    assert_allclose(xy[3], drive.corners[3])
    assert_allclose(theta, [0.5, 0.5, 0.5 + np.pi / 6, 0.5 + np.pi / 3])
    t = np.linspace(0, 6, 601)
    speed = np.linalg.norm(np.diff(drive.at(t)[0], axis=0), axis=1) / 0.01
    assert_allclose(speed, 0.12, rtol=1e-6)  # the steps end on the corners


@pytest.mark.parametrize("t", [-0.1, 40.1, float("nan")])
def test_there_is_no_robot_before_or_after_the_drive(t: float) -> None:
    with pytest.raises(InputError, match="times"):
        SegmentDrive().at(t)


@pytest.mark.parametrize("change", [{"segments": 0}, {"duration_s": 0.0}])
def test_a_drive_must_go_somewhere(change: dict[str, float]) -> None:
    with pytest.raises(InputError, match="one segment"):
        SegmentDrive(**change)  # type: ignore[arg-type]

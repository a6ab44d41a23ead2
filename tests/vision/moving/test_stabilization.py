"""What is referred to the stable frame: against products of plain matrices and differences."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError, UndeterminedError
from airground.geometry import DivisionLens
from airground.vision.moving import Stabilization, rate_between
from airground.vision.moving.small_motion import move
from airground.vision.sightings import Sightings
from vision.moving.flight import camera, project

ORIGIN = camera((900, 900), tilt=0.3)
NOW = camera((930, 870), turn=0.3, tilt=0.35)
H = ORIGIN @ np.linalg.inv(NOW)
UV = np.array([[100.0, 80.0], [500.0, 300.0]])
LENS = DivisionLens(-2e-7, np.array([319.5, 179.5]))


def stabilization(lens: DivisionLens | None = None, root: float = 1e-4) -> Stabilization:
    return Stabilization(2.0, "ok", H, root**2 * np.eye(8), lens=lens)


@pytest.mark.parametrize("lens", [None, LENS])
def test_refer_maps_positions_angles_and_outlines(lens: DivisionLens | None) -> None:
    outline = UV[:, None] + np.array([[-9.0, -5.0], [9.0, -5.0], [9.0, 5.0], [-9.0, 5.0]])
    angle = np.array([0.3, np.nan])
    seen = Sightings(
        2.0,
        UV,
        np.tile(np.eye(2), (2, 1, 1)),
        ("a", "b"),
        angle,
        np.array([0.1, np.nan]),
        outline=outline,
    )
    there = stabilization(lens).refer(seen)

    def full(uv: np.ndarray) -> np.ndarray:
        return project(H, uv if lens is None else lens.undistort(uv))

    assert_allclose(there.uv, full(UV))
    assert_allclose(there.outline[0], full(outline[0]))
    assert there.labels == ("a", "b")
    step = 1e-4
    heading = np.array([[np.cos(0.3), np.sin(0.3)]])
    ahead = full(UV[:1] + step * heading) - full(UV[:1] - step * heading)
    assert there.angle[0] == pytest.approx(np.arctan2(ahead[0, 1], ahead[0, 0]), abs=1e-6)
    assert np.isnan(there.angle[1])
    assert np.isnan(there.angle_sigma[1])
    turned = 0.3 + step
    heading = np.array([[np.cos(turned), np.sin(turned)]])
    ahead = full(UV[:1] + step * heading) - full(UV[:1] - step * heading)
    rate = (np.arctan2(ahead[0, 1], ahead[0, 0]) - there.angle[0]) / step
    assert there.angle_sigma[0] == pytest.approx(0.1 * abs(rate), rel=1e-2)


def test_refer_states_position_and_homography_together(rng: np.random.Generator) -> None:
    root = 5e-4
    spread = np.array([[0.5, 0.1], [0.1, 0.2]])
    seen = Sightings(2.0, UV, np.tile(spread, (2, 1, 1)))
    stated = stabilization(root=root).refer(seen).covariance
    noise = rng.multivariate_normal([0, 0], spread, 5000)
    moved = np.array([project(move(H, root * rng.normal(size=8)), UV + off) for off in noise])
    for k in range(2):
        assert_allclose(np.cov(moved[:, k].T), stated[k], rtol=0.12, atol=0.02)


def test_what_stands_has_no_velocity_in_the_stable_frame() -> None:
    """Seen by a camera that moves, a ground point runs through the image; referred, it stands; and others move."""
    dt = 1e-3
    ground_uv = np.array([[905.0, 890.0], [960.0, 850.0]])

    def cam(t: float) -> np.ndarray:
        return camera((930 + 40 * t, 870 - 25 * t), turn=0.3 + 0.5 * t, tilt=0.35 + 0.1 * t)

    def at(t: float) -> Stabilization:
        return Stabilization(t, "ok", ORIGIN @ np.linalg.inv(cam(t)), np.zeros((8, 8)))

    velocity = np.array([[0.0, 0.0], [12.0, -7.0]])  # of the ground's pixels, per second
    uv = project(cam(0.0), ground_uv)
    later, before = (project(cam(s * dt), ground_uv + s * dt * velocity) for s in (1, -1))
    uv_dot = (later - before) / (2 * dt)
    rate = rate_between(at(-dt), at(dt))
    stable = at(0.0).refer_velocity(uv, uv_dot, rate)
    truth = (
        project(ORIGIN, ground_uv + dt * velocity) - project(ORIGIN, ground_uv - dt * velocity)
    ) / (2 * dt)
    assert_allclose(stable, truth, atol=1e-3)
    assert np.hypot(*uv_dot[0]) > 10  # the camera does move


def test_a_frame_without_homography_says_so() -> None:
    lost = Stabilization(1.0, "lost")
    assert not lost.ok
    for refuse in (
        lambda: lost.refer(Sightings.none(1.0)),
        lambda: lost.refer_velocity(UV, UV, np.eye(3)),
        lambda: lost.point_covariance(UV),
        lambda: rate_between(lost, stabilization()),
    ):
        with pytest.raises(UndeterminedError, match="no homography"):
            refuse()


def test_what_does_not_fit_together_is_an_error() -> None:
    with pytest.raises(InputError, match="belong to status ok"):
        Stabilization(0.0, "lost", np.eye(3), np.eye(8))
    with pytest.raises(InputError, match="belong to status ok"):
        Stabilization(0.0, "ok")
    with pytest.raises(InputError, match="status must be one of"):
        Stabilization(0.0, "fine")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="do not belong"):
        stabilization().refer(Sightings.none(3.0))
    assert len(stabilization().refer(Sightings.none(2.0))) == 0

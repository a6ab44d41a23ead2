"""Which way is down, from homographies of a pinhole camera whose pose is known."""

from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError, UndeterminedError
from airground.geometry.arrays import FloatArray
from airground.sim.flights import Shake, hover
from airground.sim.scene_camera import Pinhole
from airground.vision.moving import find_level

SIZE = (1280, 720)
MIDDLE = np.array([639.5, 359.5])
BASE = Pinhole.looking_down(
    focal_length_px=800.0, tilt_rad=0.5, height_m=6.0, image_size_px=SIZE, roll_rad=0.1
)
TIMES = np.arange(0, 40, 0.2)


def ground(camera: Pinhole) -> FloatArray:
    """Image from ground, written out: K R (x, y, -centre)."""
    K = np.array(
        [[camera.focal_length_px, 0, 639.5], [0, camera.focal_length_px, 359.5], [0, 0, 1]]
    )
    R = camera.camera_from_world
    return np.asarray(K @ np.column_stack([R[:, 0], R[:, 1], -R @ camera.centre_m]))


def flight(rng: np.random.Generator, shake: Shake, noise_px: float = 0.0) -> FloatArray:
    """Homographies to the first picture; their corners are off by so much."""
    camera = hover(BASE, seed=4, shake=shake)
    first = ground(camera(0.0))
    H = np.stack([first @ np.linalg.inv(ground(camera(t))) for t in TIMES])
    bend = np.eye(3) + rng.normal(0, 1, (len(TIMES), 3, 3)) * noise_px * np.array(
        [[2e-3, 2e-3, 0.7], [2e-3, 2e-3, 0.7], [3e-6, 3e-6, 0.0]]
    )
    return np.asarray(bend @ H)


def down(shake: Shake) -> FloatArray:
    return np.asarray(
        hover(BASE, seed=4, shake=shake)(0.0).camera_from_world @ np.array([0.0, 0.0, -1.0])
    )


def off_deg(a: FloatArray, b: FloatArray) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b, -1, 1))))


def guessed(truth: FloatArray, off_rad: float) -> FloatArray:
    wrong = truth + off_rad * np.array([0.6, 0.7, -0.4])
    return wrong / np.linalg.norm(wrong)


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("noise_px", [0.0, 0.02])
def test_a_flight_in_wind_levels_itself(
    noise_px: float, *, told: bool, rng: np.random.Generator
) -> None:
    shake = Shake()
    truth = down(shake)
    guess = guessed(truth, 0.02) if told else None
    assert guess is None or off_deg(guess, truth) > 0.5
    found = find_level(
        flight(rng, shake, noise_px),
        guess=guess,
        guess_sigma_rad=0.035,
        focal_length_px=800.0,
        principal_point=MIDDLE,
        noise_px=0.02,
    )
    assert off_deg(found.normal, truth) < (0.001 if noise_px == 0 else 0.05)
    assert found.sigma_rad < 0.002


def test_the_deviation_is_that_of_the_errors(rng: np.random.Generator) -> None:
    shake = Shake(drift_m=0.1)
    truth = down(shake)
    errors, stated = [], []
    for _ in range(25):
        found = find_level(
            flight(rng, shake, 0.1),
            guess=guessed(truth, 0.01),
            guess_sigma_rad=0.035,
            focal_length_px=800.0,
            principal_point=MIDDLE,
            noise_px=0.1,
        )
        errors.append(np.radians(off_deg(found.normal, truth)))
        stated.append(found.sigma_rad)
    assert np.sqrt(np.mean(np.square(errors))) < 2 * np.median(stated)


def test_a_camera_that_only_turns_learns_nothing(rng: np.random.Generator) -> None:
    shake = Shake(gust_m=0.0, drift_m=0.0)
    guess = guessed(down(shake), 0.02)
    found = find_level(
        flight(rng, shake),
        guess=guess,
        guess_sigma_rad=0.035,
        focal_length_px=800.0,
        principal_point=MIDDLE,
    )
    assert off_deg(found.normal, guess) < 0.01
    assert found.sigma_rad == pytest.approx(0.035, rel=0.01)
    with pytest.raises(UndeterminedError, match="moved too little to show its tilt"):
        find_level(flight(rng, shake), focal_length_px=800.0, principal_point=MIDDLE)


def test_what_cannot_be_levelled_is_refused(rng: np.random.Generator) -> None:
    shake = Shake()
    H, truth = flight(rng, shake), down(shake)
    how = {"guess_sigma_rad": 0.01, "focal_length_px": 800.0, "principal_point": MIDDLE}
    with pytest.raises(UndeterminedError, match="fit no level near the one given"):
        find_level(H, guess=guessed(truth, 0.15), **how)  # type: ignore[arg-type]
    with pytest.raises(UndeterminedError, match="3 pictures could be placed"):
        find_level(H[:3], guess=truth, **how)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="must be positive"):
        find_level(H, guess=truth, **(how | {"focal_length_px": 0.0}))  # type: ignore[arg-type]

"""Readings integrated to a path: forms, turns, gaps, odometers that jump."""

from __future__ import annotations

import numpy as np
import pytest

from airground.calibration import Motion
from airground.calibration.ground_path import ground_path, reading_noise
from drives import Drive, read

DRIVE = Drive((3.0, -2.0), (4.0, 2.0), 30.0)


def displacement(motion: Motion, t: np.ndarray) -> np.ndarray:
    path = ground_path(motion, "robot")
    assert path is not None
    xy, stretch = path.at(t)
    assert (stretch == 0).all()
    return np.asarray(xy - xy[0])


@pytest.mark.parametrize("form", ["velocity", "speed", "distance"])
@pytest.mark.parametrize("rate_hz", [10.0, 50.0])
def test_displacement_is_that_of_the_drive(form: str, rate_hz: float) -> None:
    motion = read(DRIVE, np.arange(0, 20, 1 / rate_hz), form=form)
    t = np.linspace(0.013, 19.8, 400)  # between readings too
    truth = DRIVE.xy(t) - DRIVE.xy(t[:1])
    # The trapezoid's error over a window is of second order in the interval: 1.4 m/s, turning within seconds.
    np.testing.assert_allclose(displacement(motion, t), truth, atol=1.5 / rate_hz**2)


def test_halving_the_interval_quarters_the_error() -> None:
    t = np.linspace(0.2, 19.0, 300)
    truth = DRIVE.xy(t) - DRIVE.xy(t[:1])
    error = [
        np.abs(displacement(read(DRIVE, np.arange(0, 20, dt), form="speed"), t) - truth).max()
        for dt in (0.2, 0.1)
    ]
    assert 3.0 < error[0] / error[1] < 5.0


def test_a_circle_is_integrated_exactly_from_heading_and_distance() -> None:
    # A chord is shorter than its arc; without that factor the error at 0.5 s would be 2 per cent.
    t = np.arange(0, 10, 0.5)
    omega, radius = 0.7, 2.0
    motion = Motion.from_rows(
        t, ["robot"] * len(t), heading=omega * t + np.pi / 2, distance=omega * radius * t
    )
    truth = radius * np.column_stack([np.cos(omega * t), np.sin(omega * t)])
    np.testing.assert_allclose(displacement(motion, t), truth - truth[0], atol=1e-12)


def test_headings_may_wrap() -> None:
    plain = read(DRIVE, np.arange(0, 20, 0.1), form="speed")
    assert plain.heading is not None
    wrapped = Motion.from_rows(
        plain.t,
        ["robot"] * len(plain),
        heading=plain.heading + 2 * np.pi * (np.arange(len(plain)) % 3),
        speed=plain.speed,
    )
    t = np.linspace(0, 19, 100)
    np.testing.assert_allclose(displacement(wrapped, t), displacement(plain, t), atol=1e-9)


def test_reverse_is_driven_backwards() -> None:
    t = np.arange(0, 4, 0.1)
    speed = np.where(t < 2, 1.0, -1.0)
    heading = np.zeros_like(t)
    by_speed = Motion.from_rows(t, ["robot"] * len(t), heading=heading, speed=speed)
    counting_up = Motion.from_rows(
        t, ["robot"] * len(t), heading=heading, speed=speed, distance=t.copy()
    )
    signed = np.where(t < 2, t, 4 - t)
    signed_odometer = Motion.from_rows(t, ["robot"] * len(t), heading=heading, distance=signed)
    for motion in (by_speed, counting_up, signed_odometer):
        x = displacement(motion, np.array([0.0, 1.9, 3.8]))[:, 0]
        np.testing.assert_allclose(
            x, [0.0, 1.9, 0.2], atol=0.11
        )  # the reading in which it turns is ambiguous


def test_distance_is_preferred_to_speed() -> None:
    t = np.arange(0, 5, 0.1)
    motion = Motion.from_rows(
        t,
        ["robot"] * len(t),
        heading=np.zeros_like(t),
        speed=np.full_like(t, 9.0),
        distance=2.0 * t,
    )
    np.testing.assert_allclose(displacement(motion, t)[-1], [2.0 * t[-1], 0.0], atol=1e-12)


def test_nothing_is_said_across_gaps_and_outside() -> None:
    t = np.concatenate([np.arange(0, 5, 0.1), np.arange(8, 12, 0.1)])
    path = ground_path(read(DRIVE, t, form="speed"), "robot")
    assert path is not None
    _, stretch = path.at(np.array([-0.1, 0.0, 4.9, 6.0, 8.0, 11.85, 12.5]))
    assert stretch.tolist() == [-1, 0, -1, -1, 1, 1, -1]


@pytest.mark.parametrize("jump", [1000.0, -17.0])
def test_an_odometer_that_jumps_breaks_the_path(jump: float) -> None:
    t = np.arange(0, 10, 0.1)
    distance = 20.0 + 0.5 * t
    distance[50:] += jump
    path = ground_path(
        Motion.from_rows(t, ["robot"] * len(t), heading=np.zeros_like(t), distance=distance),
        "robot",
    )
    assert path is not None
    _, stretch = path.at(np.array([4.0, 4.95, 6.0]))
    assert stretch.tolist() == [0, -1, 1]


def test_a_turn_that_could_go_either_way_breaks_the_path() -> None:
    t = np.arange(0, 4, 1.0)
    motion = Motion.from_rows(t, ["robot"] * 4, heading=[0.0, 0.1, 2.5, 2.6], speed=[1.0] * 4)
    path = ground_path(motion, "robot")
    assert path is not None
    assert path.stretch.tolist() == [0, -1, 1]


def test_one_reading_is_no_path() -> None:
    assert ground_path(Motion.from_rows([0.0], ["a"], xy_dot=[[1.0, 0.0]]), "a") is None


def test_reading_noise_is_the_noise_put_in(rng: np.random.Generator) -> None:
    t = np.arange(0, 60, 0.05)
    straight = Drive((0, 0), (1000.0, 0.0), 1e5)
    motion = read(straight, t, form="velocity", speed_noise=0.1, rng=rng)
    path = ground_path(motion, "robot")
    assert path is not None
    # Along one axis of two: the root mean square per axis is 0.1 / sqrt(2).
    assert reading_noise(path) == pytest.approx(0.1 / np.sqrt(2), rel=0.15)

"""Scatter of readings, on series whose white noise is known."""

from __future__ import annotations

import numpy as np
import pytest

from airground.calibration.recordings import Motion
from airground.calibration.trajectory.scatter import FEWEST, reading_scatter

COUNT = 8000  # so that the deviation of a level is 1 %
DT = 0.04
SPEED = 1.3


def motion(
    rng: np.random.Generator,
    form: str,
    *,
    along: float = 0.03,
    across: float = 0.02,
    stop: float = 0.0,
    count: int = COUNT,
    unit: float = 0.0,
) -> Motion:
    """A robot that turns slowly, and stands for the first `stop` of the time; levels per square root of a second."""
    t = DT * np.arange(count, dtype=np.float64)
    true = np.where(np.arange(count) < stop * count, 0.0, SPEED)
    heading = 0.3 * np.sin(0.2 * t)
    speed = true + rng.normal(0.0, along * SPEED / np.sqrt(DT), count) * (true > 0)
    read = heading + rng.normal(0.0, across / np.sqrt(DT), count)
    target = np.zeros(count, dtype=int)
    if form == "xy_dot":
        v = speed[:, None] * np.column_stack([np.cos(read), np.sin(read)])
        return Motion(("a",), target, t, xy_dot=v)
    if form == "speed":
        return Motion(("a",), target, t, heading=read, speed=speed)
    way = np.cumsum(speed) * DT
    if unit:
        way = np.floor(way / unit) * unit
    return Motion(("a",), target, t, heading=read, distance=way)


FORMS = ["xy_dot", "speed", "distance"]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("along", "across"), [(0.03, 0.02), (0.002, 0.03), (0.02, 0.001)])
def test_white_noise_is_recovered(
    form: str, along: float, across: float, rng: np.random.Generator
) -> None:
    found = reading_scatter(motion(rng, form, along=along, across=across), "a")
    assert found is not None
    # Across a velocity that heads wrong by 0.15 rad, some of what is across counts as along.
    atol = 0.2 * across if form == "xy_dot" else 0.0
    assert found[0] == pytest.approx(along, rel=0.1, abs=atol)
    assert found[1] == pytest.approx(across, rel=0.1)


@pytest.mark.parametrize("form", FORMS)
def test_a_robot_that_stands_half_of_the_time_is_as_noisy_as_it_drives(
    form: str, rng: np.random.Generator
) -> None:
    found = reading_scatter(motion(rng, form, stop=0.5), "a")
    assert found is not None
    assert found[0] == pytest.approx(0.03, rel=0.2)
    assert found[1] == pytest.approx(0.02, rel=0.2)


@pytest.mark.parametrize("form", FORMS)
def test_a_robot_that_never_moves_tells_nothing(form: str, rng: np.random.Generator) -> None:
    assert reading_scatter(motion(rng, form, stop=1.0, count=200), "a") is None


@pytest.mark.parametrize("form", FORMS)
def test_too_few_readings_tell_nothing(form: str, rng: np.random.Generator) -> None:
    assert reading_scatter(motion(rng, form, count=FEWEST - 1), "a") is None
    assert reading_scatter(motion(rng, form, count=FEWEST), "a") is not None
    assert reading_scatter(motion(rng, form, count=50), "stranger") is None


@pytest.mark.parametrize("unit", [0.003, 0.007, 0.01])
def test_steps_of_an_odometer_count_as_noise(unit: float, rng: np.random.Generator) -> None:
    """A rounded odometer looks no better than it is; a step of this drive is 0.052 m."""
    found = reading_scatter(motion(rng, "distance", along=0.001, unit=unit), "a")
    assert found is not None
    per_step = SPEED * DT
    spread = unit / np.sqrt(12) * np.sqrt(2)  # of the difference of two rounded readings
    assert found[0] > 0.5 * spread / per_step * np.sqrt(DT)


def test_an_odometer_coarser_than_its_steps_is_noisy(rng: np.random.Generator) -> None:
    found = reading_scatter(motion(rng, "distance", unit=0.2), "a")
    # It reads nothing or a whole unit: the deviation of that, over the way in a reading, is at least one.
    assert found is not None
    assert found[0] > 0.5 * np.sqrt(DT)


@pytest.mark.parametrize("form", ["speed", "distance"])
def test_what_the_robot_states_goes_before_what_its_readings_scatter(
    form: str, rng: np.random.Generator
) -> None:
    plain = motion(rng, form)
    stated = Motion(
        plain.targets,
        plain.target_index,
        plain.t,
        heading=plain.heading,
        speed=plain.speed,
        distance=plain.distance,
        sigma_speed=np.full(COUNT, 0.5),
        sigma_heading=np.full(COUNT, 0.3),
    )
    measured, found = reading_scatter(plain, "a"), reading_scatter(stated, "a")
    assert measured is not None
    assert found is not None
    assert found[1] == pytest.approx(0.3 * np.sqrt(DT))
    if form == "speed":
        assert found[0] == pytest.approx(0.5 / SPEED * np.sqrt(DT), rel=0.02)
    else:  # a speed's deviation says nothing of an odometer
        assert found[0] == measured[0]


def test_each_robot_has_its_own(rng: np.random.Generator) -> None:
    a, b = motion(rng, "speed", along=0.01), motion(rng, "speed", along=0.05)
    assert a.heading is not None
    assert a.speed is not None
    assert b.heading is not None
    assert b.speed is not None
    both = Motion(
        ("a", "b"),
        np.repeat([0, 1], COUNT),
        np.concatenate([a.t, b.t]),
        heading=np.concatenate([a.heading, b.heading]),
        speed=np.concatenate([a.speed, b.speed]),
    )
    assert reading_scatter(both, "a") == reading_scatter(a, "a")
    assert reading_scatter(both, "b") == reading_scatter(b, "a")

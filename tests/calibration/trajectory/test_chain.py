"""Odometry at the sightings, against drives in closed form; links across gaps, against loops."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.calibration.recordings import Motion, Tracks
from airground.calibration.trajectory.chain import IDLE, chains
from arcs import arcs_under, drive
from scenes import scene

OFFSETS = [0.0, 0.237, -0.31]


@pytest.mark.parametrize("reading", ["speed", "distance", "xy_dot"])
@pytest.mark.parametrize("offset", OFFSETS)
def test_odometry_is_the_drive(reading: str, offset: float) -> None:
    case = drive(count=40, hz=7.0, offset=offset, reading=reading, reading_hz=100.0)
    (arc,), (chain,) = case.arcs, case.chains
    t = chain.t
    found = chain.odometry(offset)
    # Between readings a cubic, and velocities read as straight lines: third powers of 0.01 s.
    atol = 1e-4 * arc.radius
    assert_allclose(found.xy - found.xy[0], arc.xy(t) - arc.xy(t[0]), atol=atol)
    a = arc.angle(t)
    v = arc.rate(t)[:, None] * np.column_stack([np.cos(a), np.sin(a)])
    # An odometer tells the mean speed between two readings only.
    assert_allclose(found.xy_dot, v, atol=(1e-2 if reading == "distance" else 1e-4) * arc.speed)
    full_turns = np.round((found.heading - a) / (2 * np.pi))
    assert np.ptp(full_turns) == 0  # unwrapped
    assert_allclose(found.heading - 2 * np.pi * full_turns, a, atol=1e-3)
    # Without headings the turn rate is the slope over the sightings, one-sided at the ends.
    inner = slice(1, -1)
    assert_allclose(found.turn_rate[inner], (arc.rate(t) / arc.radius)[inner], rtol=5e-3)
    assert (found.stretch == 0).all()


@pytest.mark.parametrize("reading", ["speed", "xy_dot"])
def test_velocity_and_turn_rate_are_derivatives_by_the_offset(reading: str) -> None:
    (chain,) = drive(count=20, hz=7.0, reading=reading).chains
    h = 1e-6
    here, more, less = (chain.odometry(0.0031 + d) for d in (0.0, h, -h))
    assert_allclose(here.xy_dot, (more.xy - less.xy) / (2 * h), rtol=1e-7, atol=1e-7)
    slope = (more.heading - less.heading) / (2 * h)
    if reading == "speed":
        assert_allclose(here.turn_rate, slope, rtol=1e-6)
    else:  # a slope over neighbours 1 / 7 s apart
        assert_allclose(here.turn_rate[1:-1], slope[1:-1], rtol=2e-2)


def test_power_is_the_integral_of_the_squared_speed() -> None:
    case = drive(count=30, hz=5.0)
    (arc,), (chain,) = case.arcs, case.chains
    power = chain.odometry(0.0).power

    def integral(t: np.ndarray) -> np.ndarray:
        return np.asarray(arc.rate(t) ** 3 / (3 * arc.gain) + (IDLE * chain.usual_speed) ** 2 * t)

    end = case.motion.t[-1]
    # Speeds are smoothed chords: a mean is exact where there are neighbours on both sides, a chord 0.1 % short.
    inner = (chain.t[:-1] > case.motion.t[0] + 1.0) & (chain.t[1:] < end - 1.0)
    assert inner.sum() > 10
    assert_allclose(np.diff(power)[inner], np.diff(integral(chain.t))[inner], rtol=2e-3)
    assert_allclose(chain.usual_speed, arc.rate(end / 2), rtol=1e-2)  # median of a straight line


def test_a_standing_robot_has_some_power_left() -> None:
    t = np.arange(0, 20, 0.1)
    speed = np.where(t < 10, 1.0, 0.0)
    motion = Motion(("a",), np.zeros(200, int), t, heading=0 * t, speed=speed)
    tracks = Tracks(("a",), np.zeros(50, int), np.linspace(1, 18, 50), np.zeros((50, 2)))
    (chain,) = chains(tracks, motion, 0.0)
    assert chain.usual_speed == pytest.approx(1.0)
    rate = np.diff(chain.odometry(0.0).power) / np.diff(chain.t)
    assert_allclose(rate[chain.t[1:] < 9], 1 + IDLE**2, rtol=1e-6)
    assert_allclose(rate[chain.t[:-1] > 11], IDLE**2, rtol=1e-6)


def with_gap(start: float, end: float) -> tuple[Tracks, Motion]:
    case = drive(count=40, hz=4.0)
    m = case.motion
    keep = (m.t < start) | (m.t > end)
    return case.tracks, Motion(
        m.targets,
        m.target_index[keep],
        m.t[keep],
        heading=None if m.heading is None else m.heading[keep],
        speed=None if m.speed is None else m.speed[keep],
    )


@given(st.sets(st.integers(0, 200), min_size=2))
def test_some_sightings_are_linked_where_all_between_them_are(rows: set[int]) -> None:
    tracks, motion = with_gap(4.0, 5.2)
    (chain,) = chains(tracks, motion, 0.0)
    assert ((chain.t < 4.0) | (chain.t > 5.2)).all()  # in the gap nobody knows
    assert (~chain.link).sum() == 1
    index = np.array(sorted({r % len(chain) for r in rows}))
    few = chain.take(index)
    assert_allclose(few.t, chain.t[index])
    assert_allclose(few.uv, chain.uv[index])
    linked = [all(chain.link[i:j]) for i, j in pairwise(index)]
    assert list(few.link) == linked
    again = few.take(slice(None, None, 2))  # a part of a part
    assert list(again.link) == [all(chain.link[i:j]) for i, j in pairwise(index[::2])]
    odometry, all_of_it = few.odometry(0.1), chain.odometry(0.1)
    assert_allclose(odometry.xy, all_of_it.xy[index], rtol=1e-12)
    assert_allclose(odometry.power, all_of_it.power[index], rtol=1e-12)


def test_masks_take_sightings_too() -> None:
    tracks, motion = with_gap(4.0, 5.2)
    (chain,) = chains(tracks, motion, 0.0)
    odd = np.arange(len(chain)) % 2 == 1
    assert_allclose(chain.take(odd).t, chain.t[1::2])


def test_what_lies_outside_the_readings_at_any_offset_in_reach_is_left_out() -> None:
    tracks, motion = with_gap(4.0, 5.2)
    reach, offset = 0.4, 0.15
    (chain,) = chains(tracks, motion, offset, reach=reach)
    when = tracks.t + offset
    gap = (when > 4.0 - reach) & (when < 5.2 + reach)
    wanted = tracks.t[~gap & (when < motion.t[-1] - reach) & (when > motion.t[0] + reach)]
    # Readings come every 0.02 s, so that the gap itself is a little larger.
    assert_allclose(chain.t, wanted)


def test_only_robots_in_both_files_and_rows_to_keep() -> None:
    camera = scene()
    case = drive(camera, arcs_under(camera, 3), count=10)
    tracks = replace(case.tracks, targets=("robot-1", "stranger", "robot-3"))
    keep = np.ones(30, dtype=bool)
    keep[[0, 3]] = False
    keep[21:] = False  # one sighting is no chain
    found = chains(tracks, case.motion, 0.0, keep=keep)
    assert [c.name for c in found] == ["robot-1"]
    assert_allclose(found[0].t, np.delete(tracks.t[:10], [0, 3]))
    assert_allclose(found[0].uv, np.delete(tracks.uv[:10], [0, 3], axis=0))
    assert found[0].link.all()


def test_spreads_are_relative_to_the_usual_one(rng: np.random.Generator) -> None:
    case = drive(count=11)
    sigma = rng.uniform(0.5, 3.0, 11)
    (chain,) = chains(replace(case.tracks, sigma=sigma), case.motion, 0.0)
    assert_allclose(chain.spread, sigma / np.median(sigma))
    assert (case.chains[0].spread == 1).all()


def test_headings_are_unwrapped_over_the_gap_of_pi() -> None:
    case = drive(count=30, hz=2.0)
    assert case.motion.heading is not None
    assert np.abs(np.diff(case.motion.heading)).max() > 6  # the readings wrap
    (chain,) = case.chains
    assert chain.heading is not None
    assert np.abs(np.diff(chain.heading)).max() < 0.1


@pytest.mark.parametrize("reading", ["xy_dot", "distance"])
def test_short_increments_share_noise(reading: str, rng: np.random.Generator) -> None:
    """Variance of increments of white readings is sigma^2 dt (tau - lag), by sampling."""
    dt, sigma, count = 0.1, 0.02, 60_000
    t = dt * np.arange(count, dtype=np.float64)
    v = 1.0 + rng.normal(0.0, sigma, (count, 2)) * (1, 1)
    if reading == "xy_dot":
        motion = Motion(("a",), np.zeros(count, int), t, xy_dot=v)
    else:  # white in each step of the odometer
        motion = Motion(
            ("a",), np.zeros(count, int), t, heading=0 * t, distance=np.cumsum(v[:, 0]) * dt
        )
    when = np.arange(1.0, t[-1] - 1, 0.2718)
    tracks = Tracks(("a",), np.zeros(len(when), int), when, np.zeros((len(when), 2)))
    (chain,) = chains(tracks, motion, 0.0)
    chain = chain.sharing(motion)
    assert chain.take(slice(None, None, 2)).shared == chain.shared
    moved = np.diff(chain.odometry(0.0).xy[:, 0])
    tau = 0.2718
    if reading == "xy_dot":
        assert np.var(moved) == pytest.approx(sigma**2 * dt * (tau - chain.shared[0]), rel=0.03)
    else:  # piecewise constant: lag of a triangle, 1 / 3, taken as none
        assert chain.shared[0] == 0
        assert np.var(moved) == pytest.approx(sigma**2 * dt * (tau - dt / 3), rel=0.03)
    assert chain.shared[1] == pytest.approx(7 / 15 * dt)

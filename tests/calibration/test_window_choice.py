"""Windows from the data's rate and noise."""

from __future__ import annotations

import numpy as np

from airground.calibration.window_choice import choose_count, unbroken
from drives import fit_drive, see
from scenes import scene

SCENE = scene(tilt_deg=35)
DRIVE = fit_drive(SCENE)
T = np.arange(0, 40, 1 / 30)


def test_window_grows_with_noise(rng: np.random.Generator) -> None:
    counts = []
    for noise in (0.0, 0.3, 2.0):
        tracks = see(SCENE, DRIVE, T, noise=noise, rng=rng)
        counts.append(choose_count(tracks.t, tracks.uv))
    assert counts[0] < counts[1] < counts[2]


def test_window_covers_a_tenth_of_the_track_at_most(rng: np.random.Generator) -> None:
    tracks = see(SCENE, DRIVE, T, noise=20.0, rng=rng)
    count = choose_count(tracks.t, tracks.uv)
    span = T[count - 1]
    way = np.median(np.linalg.norm(SCENE.push(DRIVE.xy(T), DRIVE.xy_dot(T)), axis=1)) * span
    assert way < 0.15 * np.linalg.norm(np.ptp(tracks.uv, axis=0))


def test_stated_noise_is_used(rng: np.random.Generator) -> None:
    tracks = see(SCENE, DRIVE, T, noise=1.0, rng=rng)
    assert choose_count(tracks.t, tracks.uv, sigma=0.01) < choose_count(
        tracks.t, tracks.uv, sigma=3.0
    )


def test_windows_do_not_span_gaps() -> None:
    t = np.concatenate([np.arange(0, 1, 0.1), np.arange(3, 4, 0.1)])
    first = unbroken(t, 4)
    assert first.tolist() == [*range(7), *range(10, 17)]
    assert unbroken(t, 11).tolist() == []


def test_window_stays_within_a_turn(rng: np.random.Generator) -> None:
    # The same way at the same speed; one goes round in a small circle, the other goes straight.
    t = np.arange(0, 40, 1 / 30)
    round_and_round = (
        400 + 60 * np.column_stack([np.cos(2 * t), np.sin(2 * t)]) + rng.normal(0, 0.5, (len(t), 2))
    )
    straight = np.column_stack([120 * (t % 10), 0 * t]) + rng.normal(0, 0.5, (len(t), 2))
    turning = choose_count(t, round_and_round)
    assert turning < choose_count(t[:290], straight[:290])
    assert turning / 30 * 2 < 1.0  # turns by less than a radian within a window


def test_a_gap_is_judged_by_the_usual_interval() -> None:
    slow = np.concatenate([np.arange(0, 50, 5.0), np.arange(100, 150, 5.0)])
    assert unbroken(slow, 2).tolist() == [*range(9), *range(10, 19)]
    assert unbroken(slow[:1], 2).tolist() == []

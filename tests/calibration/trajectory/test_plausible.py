"""Gross errors go, good sightings stay; the lines through neighbours, against loops."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration.recordings import Tracks
from airground.calibration.trajectory.plausible import (
    FEWEST,
    SIDE,
    _second_nearest,
    plausible_sightings,
)
from airground.sim.recordings import RecordingNoise, RecordingPlan, record

SIZE = np.array([1280.0, 720.0])


def tracks(uv: np.ndarray, t: np.ndarray | None = None) -> Tracks:
    t = np.arange(len(uv)) / 30 if t is None else t
    return Tracks(("a",), np.zeros(len(uv), dtype=int), t, uv)


def smooth(count: int, rng: np.random.Generator, pixel: float = 1.0) -> np.ndarray:
    """A robot that goes round at a few pixels for each picture."""
    a = 2 * np.pi * np.arange(count) / 400
    uv = np.column_stack([640 + 400 * np.cos(a), 360 + 250 * np.sin(2 * a)])
    return np.asarray(uv + rng.normal(0.0, pixel, uv.shape))


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("drive", ["figure_eight", "rectangle"])
def test_gross_errors_go_and_the_rest_stays(
    share: float, drive: str, rng: np.random.Generator
) -> None:
    plan = RecordingPlan(drive=drive, duration_s=60.0)
    seen = record(plan, RecordingNoise(pixel_px=1.0, outlier_share=share), seed=rng)
    found = plausible_sightings(seen.tracks, "robot-1")
    truth = seen.truth
    good = ~truth.wrong
    off = np.linalg.norm(seen.tracks.uv - truth.camera.project(truth.xy), axis=1)
    if share == 0:
        assert found.all()
    # Where half are wrong, some good ones have too few good neighbours.
    assert found[good].mean() > {0.0: 0.999, 0.2: 0.995, 0.5: 0.9}[share]
    # Of 1,800 some fall near the path by chance, the more the fewer neighbours are good.
    far = ~good & (off > 25)
    assert found[far].sum() <= {0.0: 0, 0.2: 2, 0.5: 0.02 * far.sum()}[share]


@pytest.mark.parametrize("count", [0, 1, 5, FEWEST - 1])
def test_short_tracks_are_kept_whole(count: int, rng: np.random.Generator) -> None:
    uv = rng.uniform(0, 1, (max(count, 1), 2)) * SIZE
    if count == 0:
        assert plausible_sightings(tracks(uv), "stranger").shape == (0,)
    else:
        assert plausible_sightings(tracks(uv), "a").all()


@pytest.mark.parametrize("place", [0, 1, 2, 20, -3, -2, -1])
def test_an_error_is_found_at_the_ends_too(place: int, rng: np.random.Generator) -> None:
    uv = smooth(60, rng)
    uv[place] += (150.0, -90.0)
    found = plausible_sightings(tracks(uv), "a")
    assert not found[place]
    inside = np.delete(np.arange(60), place)[1:-1]
    assert found[inside].all()


def test_good_ends_stay(rng: np.random.Generator) -> None:
    """An end is led to by what lies on one side of it only, five times as uncertain; some may go."""
    lost = 0
    for _ in range(100):
        uv = smooth(60, rng)
        uv[30] = (0.0, 0.0)  # so that the second look is taken
        found = plausible_sightings(tracks(uv), "a")
        lost += int((~found[[0, -1]]).sum())
        assert found[2:29].all()
    assert lost <= 40


def test_gaps_and_uneven_times_do_no_harm(rng: np.random.Generator) -> None:
    uv, t = smooth(400, rng), np.arange(400) / 30
    keep = rng.random(400) < 0.5
    keep[100:140] = False
    assert plausible_sightings(tracks(uv[keep], t[keep]), "a").all()


def test_the_distance_is_a_loop_over_pairs_of_neighbours(rng: np.random.Generator) -> None:
    count = 40
    t = np.cumsum(rng.uniform(0.02, 0.06, count))
    uv = smooth(count, rng)
    uv[rng.random(count) < 0.3] = rng.uniform(0, 700, 2)
    found = _second_nearest(t, uv, SIDE)
    for k in range(SIDE, count - SIDE):
        away = []
        for i in range(k - SIDE, k):
            for j in range(k + 1, k + SIDE + 1):
                to = [np.interp(t[k], [t[i], t[j]], [uv[i, c], uv[j, c]]) for c in (0, 1)]
                away.append(float(np.hypot(*(uv[k] - to))))
        assert_allclose(found[k], sorted(away)[1], atol=1e-9)

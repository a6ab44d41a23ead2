"""Nothing is skipped that matters: where all is plain the tracker takes shortcuts, with the same answer."""

from __future__ import annotations

import numpy as np
import pytest

from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker, TrackerState
from airground.vision.tracker.beliefs import transition
from airground.vision.tracker.looks import Looks, log_sizes

BOX = np.array([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]])


def seen(t: float, rng: np.random.Generator, labelled: bool, stranger: bool) -> Sightings:
    """Three things in circles, and one far away."""
    phase = np.array([0.0, 2.0, 4.0]) + t
    middle = np.array([[200.0, 200.0], [420.0, 200.0], [300.0, 420.0]])
    uv = middle + 80.0 * np.column_stack([np.cos(phase), np.sin(phase)])
    uv += rng.normal(0, 0.3, uv.shape)
    heading = (phase + np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
    outline = uv[:, None] + BOX + rng.normal(0, 0.1, (3, 4, 2))
    labels: tuple[str, ...] = ("1", "2", "3") if labelled else ("", "", "")
    if stranger:
        far = np.array([[3000.0, 3000.0]])
        uv, heading = np.concatenate([uv, far]), np.append(heading, 0.0)
        outline = np.concatenate([outline, far[:, None] + BOX])
        labels = (*labels, "9" if labelled else "")
    count = len(uv)
    return Sightings(
        t,
        uv,
        np.tile(0.09 * np.eye(2), (count, 1, 1)),
        labels,
        heading,
        np.full(count, 0.03),
        np.full(count, 0.95),
        outline,
    )


@pytest.mark.parametrize("labelled", [True, False])
def test_a_stranger_far_away_that_is_lost_changes_nothing(labelled: bool) -> None:
    """As long as one is lost the tracker goes the whole way for all; without it, it takes every shortcut."""

    def run(stranger: bool) -> list[TrackerState]:
        rng, others, tracker = np.random.default_rng(3), np.random.default_rng(4), Tracker()
        states = []
        for k in range(60):
            sightings = seen(k / 20, rng, labelled, stranger and 5 <= k < 20)
            if k in (30, 31, 44):  # somebody is missed, too
                sightings = sightings.take(np.flatnonzero(others.random(3) > 0.4))
            states.append(tracker.update(sightings))
        return states

    for with_it, without in zip(run(True), run(False), strict=True):
        assert with_it.serial[:3].tolist() == without.serial[:3].tolist()
        assert with_it.sighting[:3].tolist() == without.sighting[:3].tolist()
        assert with_it.confirmed[:3].tolist() == without.confirmed[:3].tolist()
        for name in ("uv", "uv_dot", "covariance", "angle", "angle_sigma", "quality", "lost_for"):
            mine, other = getattr(with_it, name)[:3], getattr(without, name)[:3]
            np.testing.assert_allclose(mine, other, rtol=1e-9, atol=1e-9, err_msg=name)


def test_no_time_changes_no_looks(rng: np.random.Generator) -> None:
    looks = Looks.begin(seen(0.0, rng, labelled=True, stranger=False))
    soon, now = looks.predict(1e-12), looks.predict(0.0)
    for name in ("angle", "spread", "size", "scatter"):
        np.testing.assert_allclose(getattr(soon, name), getattr(now, name), atol=1e-9)


def test_two_half_steps_are_a_whole_one() -> None:
    step, noise = transition(0.1, 0.5)
    half, part = transition(0.05, 0.5)
    np.testing.assert_allclose(half @ half, step, atol=1e-12)
    np.testing.assert_allclose(half @ part @ half.T + part, noise, atol=1e-12)


def test_the_size_is_the_root_of_the_area(rng: np.random.Generator) -> None:
    corners = np.array([[0.0, 0.0], [4.0, 1.0], [5.0, 5.0], [1.0, 3.0]])
    u, v = corners.T
    area = 0.5 * abs(sum(u[k] * v[(k + 1) % 4] - v[k] * u[(k + 1) % 4] for k in range(4)))
    turned = corners[None, ::-1]
    unknown = np.full((1, 4, 2), np.nan)
    found = log_sizes(np.concatenate([corners[None], turned, unknown]))
    np.testing.assert_allclose(found[:2], 0.5 * np.log(area))
    assert np.isnan(found[2])

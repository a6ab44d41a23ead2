"""Key frames tied in a ring: closing it removes the drift, and the stated covariance fits what is left."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from airground.vision.moving.pose_graph import Link, PoseGraph
from airground.vision.moving.small_motion import difference, move
from vision.moving.flight import Array, out_and_home

COUNT = 10


def ring(rng: np.random.Generator, size: float) -> tuple[PoseGraph, list[Array], Link]:
    """A chain of key frames, the truth, and the link that closes it."""
    cameras = out_and_home(COUNT + 1)[:COUNT]
    truth = [cameras[0] @ np.linalg.inv(c) for c in cameras]
    root = size * np.diag([1.0, 1.0, 0.3, 1.0, 1.0, 0.3, 1.0, 1.0])

    def link(i: int, j: int) -> Link:
        exact = np.linalg.solve(truth[i], truth[j])
        return Link(i, j, move(exact, root @ rng.normal(size=8)), root @ root.T)

    graph = PoseGraph()
    for k in range(1, COUNT):
        graph.add(k, link(k - 1, k))
    return graph, truth, link(0, COUNT - 1)


def nees(graph: PoseGraph, truth: list[Array], k: int) -> float:
    delta = difference(graph.matrix[k], truth[k])
    return float(delta @ np.linalg.solve(graph.covariance[k], delta))


def test_a_closed_loop_takes_out_drift_and_says_how_well(rng: np.random.Generator) -> None:
    before, after, chi = [], [], []
    for _ in range(25):
        graph, truth, last = ring(rng, 2e-4)
        before.append(np.linalg.norm(difference(graph.matrix[COUNT - 1], truth[-1])))
        assert np.trace(graph.covariance[COUNT - 1]) > np.trace(graph.covariance[1])
        graph.close(last)
        after.append(np.linalg.norm(difference(graph.matrix[COUNT - 1], truth[-1])))
        chi.append([nees(graph, truth, k) for k in range(1, COUNT)])
    assert np.median(after) < 0.5 * np.median(before)
    # Eight degrees of freedom; 25 rings leave a deviation of the mean of 0.8.
    assert_allclose(np.mean(chi, axis=0), 8.0, atol=3.0)


def test_a_consistent_loop_changes_nothing(rng: np.random.Generator) -> None:
    graph, _, last = ring(rng, 0.0)
    cov = 1e-8 * np.eye(8)
    graph.links = [Link(k.to, k.of, k.matrix, cov) for k in graph.links]
    before = dict(graph.matrix)
    graph.close(Link(last.to, last.of, last.matrix, cov))
    for k, matrix in before.items():
        assert_allclose(graph.matrix[k], matrix, rtol=1e-9, atol=1e-9)


def test_a_dropped_key_frame_leaves_its_neighbours_tied(rng: np.random.Generator) -> None:
    graph, truth, last = ring(rng, 1e-6)
    for key in (3, 4, 7):
        graph.drop(key)
    assert set(graph.matrix) == set(range(COUNT)) - {3, 4, 7}
    assert graph.linked(2, 5)
    assert graph.linked(6, 8)
    graph.close(last)
    for k in graph.matrix:
        assert np.abs(difference(graph.matrix[k], truth[k])).max() < 1e-4

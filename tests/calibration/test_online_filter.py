"""The recursive filter against a brute-force least-squares solution that shares no algebra with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration.online_filter import DriveFilter
from airground.calibration.online_model import ImageFrame
from airground.calibration.online_rows import Frame
from airground.calibration.online_start import refine
from scenes import scene

if TYPE_CHECKING:
    from scenes import Array, Scene

SIGMA_PX = 0.5
NOISE = 0.01  # sqrt(s)


class World:
    """A few robots on curves, seen and read with noise; small enough to be solved densely."""

    def __init__(
        self, rng: np.random.Generator, robots: int = 2, count: int = 40, bias: float = 0.0
    ) -> None:
        self.camera: Scene = scene(tilt_deg=45.0, height=6.0, heading_deg=20.0)
        self.image = ImageFrame(np.array([640.0, 360.0]), 1.0 / 300.0)
        self.x = self.image.from_pixels(self.camera.g)
        t = np.arange(count) * 0.25
        self.dt = 0.25
        middle = self.camera.unproject(self.image.centre)
        self.xy, self.path, self.uv = [], [], []
        for k in range(robots):
            a = t * (0.45 + 0.1 * k) + 2.0 * k
            xy = middle + np.column_stack([1.1 * np.sin(a), 0.9 * np.sin(2 * a + 0.3 + k)])
            step = np.diff(xy, axis=0)
            power = np.sum(step**2, axis=1) / self.dt
            noisy = step + NOISE * np.sqrt(power)[:, None] * rng.normal(size=step.shape)
            turn = bias * (k > 0)
            turned = noisy @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            path = np.zeros((count, 8))
            path[1:, :2] = np.cumsum(turned, axis=0)
            path[:, 2:4] = np.gradient(path[:, :2], self.dt, axis=0)
            path[1:, 4] = path[1:, 6] = NOISE**2 * np.cumsum(power)
            self.xy.append(xy)
            self.path.append(path)
            seen = np.asarray(self.camera.project(xy))
            self.uv.append(seen + SIGMA_PX * rng.normal(size=seen.shape))
        self.robots, self.count = robots, count

    def frames(self, *, together: bool = True) -> list[Frame]:
        """One of each time, with all robots in it, or one of each sighting."""
        variance = np.array([(SIGMA_PX * self.image.scale) ** 2])
        frames = []
        for i in range(self.count):
            rows = [
                Frame(
                    np.array([k]),
                    self.image.normalised(self.uv[k][i])[None],
                    variance,
                    self.path[k][i][None],
                    np.array([self.dt if i else 0.0]),
                )
                for k in range(self.robots)
            ]
            if together:
                columns = zip(*rows, strict=True)
                frames.append(Frame(*(np.concatenate(c) for c in columns)))
            else:
                frames += rows
        return frames

    def brute_force(self) -> tuple[Array, Array]:
        """Maximum likelihood of g and all positions at once, by SciPy; g and its covariance."""
        from scipy.optimize import least_squares  # type: ignore[import-untyped,unused-ignore]

        unit = np.abs(self.camera.g).max(axis=1, keepdims=True) * np.ones((1, 2))

        def residuals(p: Array) -> Array:
            g = (p[:6].reshape(3, 2)) * unit
            n = np.cross(g[:, 0], g[:, 1])
            c = np.append(self.image.centre, 1.0)
            G = np.column_stack([g, c / (n @ c)])
            rows = []
            for k in range(self.robots):
                P = p[6 + 2 * k * self.count : 6 + 2 * (k + 1) * self.count].reshape(-1, 2)
                w = np.column_stack([P, np.ones(self.count)]) @ G.T
                rows.append((w[:, :2] / w[:, 2:] - self.uv[k]).ravel() / SIGMA_PX)
                sigma = np.sqrt(np.diff(self.path[k][:, 4]))[:, None]
                rows.append(
                    ((np.diff(P, axis=0) - np.diff(self.path[k][:, :2], axis=0)) / sigma).ravel()
                )
            return np.concatenate(rows)

        origin = self.camera.unproject(self.image.centre)
        begin = np.concatenate(
            [(self.camera.g / unit).ravel(), *[(xy - origin).ravel() for xy in self.xy]]
        )
        found = least_squares(residuals, begin, x_scale="jac", method="trf", xtol=1e-12)
        covariance = np.linalg.inv(found.jac.T @ found.jac)[:6, :6]
        scale = unit.ravel()
        g = found.x[:6].reshape(3, 2) * unit
        return g, covariance * np.outer(scale, scale)


def close_to_batch(world: World, x: Array, covariance: Array, tolerance: float) -> None:
    g, C = world.brute_force()
    D = world.image.jacobian()
    e = (world.image.to_pixels(x[:6]) - g).ravel()
    size = np.sqrt(np.diag(C))
    off = np.sqrt(e / size @ np.linalg.solve(C / np.outer(size, size), e / size) / 6)
    assert off < tolerance
    stated = np.sqrt(np.diag(D @ covariance[:6, :6] @ D.T))
    assert_allclose(stated, size, rtol=0.1)


def test_passes_over_a_recording_are_the_batch_answer(rng: np.random.Generator) -> None:
    world = World(rng)
    begin = world.x * (1 + 0.05 * rng.normal(size=6))
    frames = world.frames()
    refined = refine(begin, lambda _: frames, np.zeros((6, 6)), mean=begin)
    assert refined is not None
    close_to_batch(world, refined.filter.x, refined.filter.covariance, 0.25)
    assert refined.share == 1.0


def test_one_pass_from_a_fair_start_is_nearly_so(rng: np.random.Generator) -> None:
    """Start on the first half, then each sighting once: what runs online."""
    world = World(rng, count=60)
    frames = world.frames(together=False)
    refined = refine(world.x * 1.03, lambda _: frames[:60], np.zeros((6, 6)), mean=world.x)
    assert refined is not None
    for frame in frames[60:]:
        refined.filter.update(frame)
    close_to_batch(world, refined.filter.x, refined.filter.covariance, 0.5)


def test_a_robot_alone_takes_the_same_way_as_a_frame(rng: np.random.Generator) -> None:
    """`follow_one` and the batch do the same algebra; a heading bias that is known to be 0 forces the batch."""
    world = World(rng, robots=1)
    world.uv[0][20] += 3.0  # is weighted down
    world.uv[0][30] += 300.0  # is refused
    prior = 1e2 * np.eye(6)
    alone, batch = DriveFilter(world.x, prior), DriveFilter(world.x, prior, bias_sigma=1e-9)
    weights = []
    for frame in world.frames():
        one, two = alone.update(frame), batch.update(frame)
        for name in ("robots", "nis", "weight", "score", "spread", "residual"):
            left, right = getattr(one, name), getattr(two, name)
            assert_allclose(left, right, rtol=1e-6, atol=1e-9 * np.abs(right).max(initial=1.0))
        weights += one.weight.tolist()
    assert min(weights) == 0.0
    assert any(0.0 < weight < 1.0 for weight in weights)
    assert_allclose(alone.x, batch.x, rtol=1e-9)
    assert_allclose(alone.covariance, np.linalg.inv(batch.information), rtol=1e-6, atol=1e-12)


def test_innovations_are_white_and_as_large_as_stated(rng: np.random.Generator) -> None:
    world = World(rng, robots=3, count=200)
    filter_ = DriveFilter(world.x, 1e8 * np.eye(6))
    outcomes = [filter_.update(frame) for frame in world.frames()]
    nis = np.concatenate([o.nis for o in outcomes])
    assert abs(nis.mean() - 2.0) < 4 * 2 / np.sqrt(len(nis))  # variance of chi-square is 4
    score = np.sum([o.score.sum(axis=0) for o in outcomes], axis=0)
    spread = np.sum([o.spread.sum(axis=0) for o in outcomes], axis=0)
    assert score @ np.linalg.solve(spread, score) < 25.0  # chi-square, 6 degrees of freedom: 3e-4


def test_a_robot_that_comes_in_tells_nothing_about_g(rng: np.random.Generator) -> None:
    world = World(rng, robots=2)
    filter_ = DriveFilter(world.x, np.eye(6))
    filter_.update(world.frames()[0])
    assert_allclose(filter_.information, np.eye(6))
    assert_allclose(filter_.x, world.x)


def test_a_heading_bias_is_found_between_robots(rng: np.random.Generator) -> None:
    world = World(rng, robots=2, count=80, bias=0.1)
    frames = world.frames()
    refined = refine(world.x, lambda _: frames, np.zeros((6, 6)), mean=world.x, bias_sigma=0.2)
    assert refined is not None
    bias, sigma = refined.filter.bias(1)
    assert abs(bias - 0.1) < 4 * sigma < 0.05
    assert refined.filter.bias(0) == (0.0, 0.0)
    blind = refine(world.x, lambda _: frames, np.zeros((6, 6)), mean=world.x)
    assert blind is None or blind.nis > 2 * refined.nis or blind.share < 0.9


@pytest.mark.parametrize("together", [True, False])
def test_wild_sightings_are_refused(together: bool, rng: np.random.Generator) -> None:
    world = World(rng, robots=2, count=80)
    for uv in world.uv:
        wrong = rng.choice(80, 12, replace=False)
        uv[wrong] = rng.uniform([0, 0], [1280, 720], (12, 2))
    frames = world.frames(together=together)
    refined = refine(world.x * 1.02, lambda _: frames, np.zeros((6, 6)), mean=world.x)
    assert refined is not None
    assert refined.share < 0.95
    e = refined.filter.x - world.x
    C = refined.filter.covariance
    assert e @ np.linalg.solve(C, e) < 40.0


def test_forgetting_and_doubt_only_widen(rng: np.random.Generator) -> None:
    world = World(rng)
    filter_ = DriveFilter(world.x, np.eye(6))
    for frame in world.frames():
        filter_.update(frame)
    before = filter_.covariance.copy()
    filter_.forget(0.5)
    assert_allclose(filter_.covariance, 2 * before, rtol=1e-9)
    filter_.disturb(np.full(6, 1e-4))
    assert_allclose(filter_.covariance, 2 * before + 1e-4 * np.eye(6), rtol=1e-6, atol=1e-12)

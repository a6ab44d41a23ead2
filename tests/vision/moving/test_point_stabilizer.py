"""Named points, some fixed and some not: which are found, how well, and how honestly."""

from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError
from airground.geometry import DivisionLens
from airground.vision.moving import PointOptions, PointStabilizer, Stabilization
from airground.vision.moving.small_motion import difference
from vision.moving.flight import SIZE, Array, hover, orbit, project

SIGMA = 0.4


class Yard:
    """Marks on the ground, and things that drive about."""

    def __init__(
        self, rng: np.random.Generator, cameras: list[Array], *, marks: int = 14, movers: int = 0
    ) -> None:
        self.rng, self.cameras = rng, cameras
        self.marks = rng.uniform([680, 780], [1120, 1020], (marks, 2))
        self.movers = rng.uniform([680, 780], [1120, 1020], (movers, 2))
        self.speeds = rng.uniform(0.8, 4.0, movers)[:, None] * np.array([1.0, 0.1])
        self.leaves = len(cameras)  # frame in which the first mark, a parked car, drives off

    def see(self, k: int) -> tuple[list[str], Array]:
        marks = self.marks.copy()
        marks[0] += max(0, k - self.leaves) * np.array([1.5, 1.0])
        ground = np.concatenate([marks, self.movers + k * self.speeds])
        uv = project(self.cameras[k], ground)
        uv += self.rng.normal(0, SIGMA, uv.shape)
        ids = [f"m{j}" for j in range(len(marks))] + [f"v{j}" for j in range(len(self.movers))]
        inside = np.all((uv > 0) & (uv < np.array(SIZE)), axis=1).tolist()
        return [name for name, ok in zip(ids, inside, strict=True) if ok], uv[inside]

    def truth(self, k: int) -> Array:
        H = self.cameras[0] @ np.linalg.inv(self.cameras[k])
        return np.asarray(H / np.cbrt(np.linalg.det(H)))

    def run(self, stabilizer: PointStabilizer) -> list[Stabilization]:
        return [stabilizer.update(k / 30, *self.see(k)) for k in range(len(self.cameras))]


def nees(yard: Yard, results: list[Stabilization], frames: range) -> Array:
    values = []
    for k in frames:
        r = results[k]
        if r.stable_from_image is not None and r.covariance is not None:
            delta = difference(r.stable_from_image, yard.truth(k))
            values.append(delta @ np.linalg.solve(r.covariance, delta) / 8)
    return np.array(values)


def test_the_stated_covariance_holds_though_the_first_frame_s_noise_never_averages_out(
    rng: np.random.Generator,
) -> None:
    options = PointOptions(sigma_px=SIGMA, wander_px_per_sqrt_s=0.0)
    last = []
    for _ in range(6):  # the error of a run's frames is mostly one: each run is one sample
        yard = Yard(rng, hover(rng, 20))
        results = yard.run(PointStabilizer(options))
        assert all(r.ok for r in results)
        last.append(nees(yard, results, range(15, 20)).mean())
    # Mean of 6 runs with 8 degrees of freedom each: deviation 0.2.
    assert 0.6 < np.mean(last) < 1.6


def test_vehicles_among_the_points_are_told_apart(rng: np.random.Generator) -> None:
    yard = Yard(rng, hover(rng, 35), marks=14, movers=20)
    stabilizer = PointStabilizer(PointOptions(sigma_px=SIGMA))
    results = yard.run(stabilizer)
    assert {r.status for r in results} <= {"ok", "no agreement"}
    assert all(r.ok for r in results[20:])
    assert all(str(name).startswith("m") for name in stabilizer.fixed)
    assert len(stabilizer.fixed) >= 12
    assert nees(yard, results, range(20, 35)).mean() < 2.5


def test_a_parked_car_that_drives_off_is_left_out(rng: np.random.Generator) -> None:
    yard = Yard(rng, hover(rng, 55), marks=8)
    yard.leaves = 25
    stabilizer = PointStabilizer(PointOptions(sigma_px=SIGMA))
    results = [stabilizer.update(k / 30, *yard.see(k)) for k in range(25)]
    assert "m0" in stabilizer.fixed
    results += [stabilizer.update(k / 30, *yard.see(k)) for k in range(25, 55)]
    assert "m0" not in stabilizer.fixed
    assert nees(yard, results, range(40, 55)).mean() < 2.5


def test_new_points_carry_on_where_the_first_ones_go_out_of_view(rng: np.random.Generator) -> None:
    yard = Yard(rng, orbit(60, turns=0.4))
    yard.marks = rng.uniform([560, 560], [1240, 1240], (60, 2))
    results = yard.run(PointStabilizer(PointOptions(sigma_px=SIGMA)))
    assert all(r.ok for r in results)
    assert np.mean(nees(yard, results, range(50, 60))) < 3


def test_four_marks_are_enough_and_three_are_not(rng: np.random.Generator) -> None:
    yard = Yard(rng, hover(rng, 5), marks=4)
    yard.marks = np.array([[720.0, 800.0], [1080.0, 800.0], [1080.0, 990.0], [720.0, 990.0]])
    stabilizer = PointStabilizer(PointOptions(sigma_px=SIGMA))
    for k in range(3):
        result = stabilizer.update(k / 30, *yard.see(k))
        assert (result.ok, result.inliers) == (True, 4)
    ids, uv = yard.see(3)
    result = stabilizer.update(0.2, ids[:3], uv[:3])
    assert (result.status, result.stable_from_image) == ("too few points", None)
    assert stabilizer.update(0.3, *yard.see(4)).ok  # and it goes on


def test_marks_in_line_are_refused(rng: np.random.Generator) -> None:
    line = np.linspace(0, 1, 6)[:, None] * np.array([500.0, 200.0]) + 50
    result = PointStabilizer().update(0.0, list("abcdef"), line)
    assert result.status == "points in line"
    ids = list("abcdef")
    stabilizer = PointStabilizer()
    spread = rng.uniform(0, 300, (6, 2))
    assert stabilizer.update(0.0, ids, spread).ok
    spread[1:5] = spread[0] + np.linspace(0.2, 1, 4)[:, None] * (spread[5] - spread[0])
    assert not stabilizer.update(0.1, ids, spread).ok


def test_one_of_five_that_moved_cannot_be_told_and_is_not_guessed(rng: np.random.Generator) -> None:
    yard = Yard(rng, hover(rng, 3), marks=5)
    yard.marks[:4] = [[720.0, 800.0], [1080.0, 800.0], [1080.0, 990.0], [720.0, 990.0]]
    stabilizer = PointStabilizer(PointOptions(sigma_px=SIGMA))
    assert stabilizer.update(0.0, *yard.see(0)).ok
    ids, uv = yard.see(1)
    uv[2] += 40.0
    assert stabilizer.update(0.1, ids, uv).status == "no agreement"


def test_a_lens_is_taken_out(rng: np.random.Generator) -> None:
    lens = DivisionLens(-3e-7, np.array([319.5, 179.5]))
    yard = Yard(rng, orbit(30, turns=0.1), marks=20)
    stabilizer = PointStabilizer(PointOptions(sigma_px=SIGMA), lens=lens)
    results = []
    for k in range(30):
        ids, uv = yard.see(k)
        results.append(stabilizer.update(k / 30, ids, lens.distort(uv)))
    assert all(r.ok for r in results)
    assert nees(yard, results, range(20, 30)).mean() < 3


def test_the_same_points_give_the_same_bits(rng: np.random.Generator) -> None:
    yard = Yard(rng, hover(rng, 6), movers=6)
    frames = [yard.see(k) for k in range(6)]
    runs = []
    for _ in range(2):
        stabilizer = PointStabilizer()
        runs.append([stabilizer.update(k / 30, *f) for k, f in enumerate(frames)])
    for a, b in zip(*runs, strict=True):
        assert a.status == b.status
        if a.stable_from_image is not None:
            assert np.array_equal(a.stable_from_image, b.stable_from_image)


def test_wrong_input_is_an_error() -> None:
    stabilizer = PointStabilizer()
    uv = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]])
    with pytest.raises(InputError, match="comes twice"):
        stabilizer.update(0.0, ["a", "a", "b", "c"], uv)
    with pytest.raises(InputError, match="shape"):
        stabilizer.update(0.0, ["a", "b"], uv)
    with pytest.raises(InputError, match="NaN"):
        stabilizer.update(0.0, list("abcd"), uv * np.nan)
    with pytest.raises(InputError, match="positive definite"):
        stabilizer.update(0.0, list("abcd"), uv, np.zeros((4, 2, 2)))
    assert stabilizer.update(1.0, list("abcd"), uv).ok
    with pytest.raises(InputError, match="ascend"):
        stabilizer.update(1.0, list("abcd"), uv)
    assert stabilizer.update(2.0, [], np.empty((0, 2))).status == "too few points"
    for wrong in ({"least": 3}, {"sigma_px": 0.0}, {"patience": 0}, {"wander_px_per_sqrt_s": -1.0}):
        with pytest.raises(InputError, match=next(iter(wrong))):
            PointOptions(**wrong)

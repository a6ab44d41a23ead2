"""Flights over a flat picture: how still it is held, how honestly, and what happens when it cannot be."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from airground.errors import InputError
from airground.geometry import DivisionLens
from airground.vision.frame import Frame
from airground.vision.moving import Stabilization, Stabilizer, StabilizerOptions
from airground.vision.moving.small_motion import difference
from vision.moving import flight as fl
from vision.moving.flight import Flight, Vehicle, camera, project

GRID = np.stack(np.meshgrid(np.linspace(0, 639, 7), np.linspace(0, 359, 5)), -1).reshape(-1, 2)
VEHICLES = [Vehicle((700 + 60 * k, 800 + 40 * (k % 4)), (1.5 * (-1) ** k, 0)) for k in range(8)]


@cache
def picture() -> fl.Image:
    return fl.ground(np.random.default_rng(3))


def film(flight: Flight) -> list[Frame]:
    return [Frame(flight.image(k), k / 30, index=k) for k in range(len(flight.cameras))]


@cache
def round_trip() -> tuple[Flight, list[Frame]]:
    flight = Flight(fl.out_and_home(45), picture(), VEHICLES)
    return flight, film(flight)


def run(
    flight: Flight,
    stabilizer: Stabilizer | None = None,
    *,
    masked: bool = True,
    frames: list[Frame] | None = None,
) -> list[Stabilization]:
    stabilizer = stabilizer or Stabilizer()
    return [
        stabilizer.update(frame, flight.outlines(k) if masked else None)
        for k, frame in enumerate(frames or film(flight))
    ]


def error(flight: Flight, k: int, result: Stabilization) -> float:
    """Rms over the image, in pixels of the frame."""
    assert result.stable_from_image is not None
    back = np.linalg.inv(flight.truth(k)) @ result.stable_from_image
    return float(np.sqrt(np.mean((project(back, GRID) - GRID) ** 2)))


def nees(flight: Flight, k: int, result: Stabilization) -> float:
    assert result.stable_from_image is not None
    assert result.covariance is not None
    truth = flight.truth(k)
    delta = difference(result.stable_from_image, truth)
    return float(delta @ np.linalg.solve(result.covariance, delta)) / 8


@pytest.mark.parametrize("masked", [True, False])
def test_hover_is_held_to_a_hundredth_of_a_pixel(rng: np.random.Generator, masked: bool) -> None:
    flight = Flight(fl.hover(rng, 15), picture(), VEHICLES)
    results = run(flight, masked=masked)
    assert all(r.ok for r in results)
    assert max(error(flight, k, r) for k, r in enumerate(results)) < 0.02
    assert 0.4 < np.mean([nees(flight, k, r) for k, r in enumerate(results) if k]) < 1.8


def test_what_the_camera_did_is_not_small(rng: np.random.Generator) -> None:
    """Else the test above could not fail."""
    flight = Flight(fl.hover(rng, 25), picture())
    moved = [project(flight.truth(k), GRID) - GRID for k in range(25)]
    assert np.abs(moved).max() > 8


def test_a_round_trip_closes_and_its_covariance_grows_and_falls() -> None:
    flight, frames = round_trip()
    stabilizer = Stabilizer()
    results = run(flight, stabilizer, frames=frames)
    assert all(r.ok for r in results)
    assert len(stabilizer.key_frames) > 4
    errors = [error(flight, k, r) for k, r in enumerate(results)]
    assert max(errors) < 0.4
    assert errors[-1] < 0.03  # home again: the first frame is seen, and nothing has added up
    spread = [float(np.trace(r.point_covariance(GRID).mean(axis=0))) for r in results]
    assert max(spread) > 9 * spread[-1]
    assert np.mean([nees(flight, k, r) for k, r in enumerate(results) if k]) < 3


def test_a_turn_and_a_jump_are_found_by_descriptors(rng: np.random.Generator) -> None:
    away = [camera((300, 320), turn=2.0, tilt=0.3)] * 4
    back = [camera((960, 940), turn=1.0, tilt=0.3)] * 3
    flight = Flight([*fl.hover(rng, 4), *away, *back], picture(), VEHICLES)
    results = run(flight)
    assert [r.status for r in results] == ["ok"] * 4 + ["lost"] * 4 + ["ok"] * 3
    assert all(r.stable_from_image is None for r in results[4:8])
    assert max(error(flight, k, results[k]) for k in (8, 9, 10)) < 0.05


def test_a_blurred_frame_is_marked_and_the_next_one_found(rng: np.random.Generator) -> None:
    flight = Flight(fl.hover(rng, 14), picture(), blurred={6: 5, 10: 81, 11: 81})
    results = run(flight)
    assert results[6].ok
    assert error(flight, 6, results[6]) < 0.05
    assert [r.status for r in results[9:13]] == ["ok", "blurred", "blurred", "ok"]
    assert error(flight, 13, results[13]) < 0.02


@pytest.mark.parametrize("what", ["nothing", "lines"])
def test_ground_that_says_too_little_is_refused(rng: np.random.Generator, what: str) -> None:
    texture = np.full((1800, 1800), 110, np.uint8)
    if what == "lines":
        for k in range(3):
            texture[k::40] = 200
    results = run(Flight(fl.hover(rng, 3), texture))
    assert {r.status for r in results} == {"too few points"}


def test_given_points_only(rng: np.random.Generator) -> None:
    flight = Flight(fl.hover(rng, 8), picture())
    points = [[100, 90], [520, 80], [530, 290], [95, 300], [310, 180], [330, 60], [200, 250]]
    results = run(flight, Stabilizer(points=points))
    assert all(r.ok for r in results)
    assert {r.points for r in results} == {7}
    assert max(error(flight, k, r) for k, r in enumerate(results)) < 0.2


def test_a_large_image_is_worked_on_small_and_answered_large(rng: np.random.Generator) -> None:
    flight = Flight(fl.hover(rng, 4), picture())
    small = run(flight, Stabilizer(StabilizerOptions(largest_px=400)))
    assert max(error(flight, k, r) for k, r in enumerate(small)) < 0.06
    assert np.mean([nees(flight, k, r) for k, r in enumerate(small) if k]) < 4


class Bent(Flight):
    """The same through a lens."""

    lens = DivisionLens(-8e-7, np.array([319.5, 179.5]))

    def image(self, k: int) -> fl.Image:
        import cv2

        flat = super().image(k)
        v, u = np.mgrid[:360, :640].astype(np.float64)
        at = self.lens.undistort(np.stack([u, v], -1)).astype(np.float32)
        u_raw, v_raw = np.ascontiguousarray(at[..., 0]), np.ascontiguousarray(at[..., 1])
        return np.asarray(
            cv2.remap(flat, u_raw, v_raw, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT),
            dtype=np.uint8,
        )


def test_a_lens_is_taken_out_or_told_of() -> None:
    cameras = [camera((900 + 9 * k, 900 + 3 * k), turn=0.05 * k, tilt=0.3) for k in range(12)]
    flight = Bent(cameras, picture())
    frames = film(flight)
    known = run(flight, Stabilizer(lens=Bent.lens), frames=frames)
    assert all(r.ok and not r.note for r in known)
    inner = GRID[(np.abs(GRID - [319.5, 179.5]) < [260, 150]).all(axis=1)]
    r = known[-1]
    assert r.stable_from_image is not None
    gap = project(r.stable_from_image, inner) - project(flight.truth(11), inner)
    assert np.abs(gap).max() < 0.15
    unknown = run(flight, frames=frames)
    assert any("barrel" in r.note for r in unknown)
    straight = Flight(cameras, picture())
    assert not any(r.note for r in run(straight))


def test_the_same_images_give_the_same_bits(rng: np.random.Generator) -> None:
    flight = Flight(fl.hover(rng, 6), picture(), VEHICLES)
    for a, b in zip(run(flight), run(flight), strict=True):
        assert a.stable_from_image is not None
        assert b.stable_from_image is not None
        assert np.array_equal(a.stable_from_image, b.stable_from_image)


def test_wrong_input_is_an_error(rng: np.random.Generator) -> None:
    image = Flight(fl.hover(rng, 1), picture()).image(0)
    stabilizer = Stabilizer()
    assert stabilizer.update(Frame(image, 0.0)).ok
    with pytest.raises(InputError, match="ascend"):
        stabilizer.update(Frame(image, 0.0))
    with pytest.raises(InputError, match="begin anew"):
        stabilizer.update(Frame(image[:-2], 1.0))
    with pytest.raises(InputError, match="ignore must have shape"):
        stabilizer.update(Frame(image, 2.0), np.zeros((3, 2)))
    assert stabilizer.update(Frame(image, 3.0), np.full((1, 4, 2), np.nan)).ok
    with pytest.raises(InputError, match="needs 4 or more"):
        Stabilizer(points=[[0, 0], [9, 9], [5, 3]])
    for name, value in (
        ("largest_px", 10),
        ("least", 3),
        ("least_share", 1.5),
        ("most_key_frames", 1),
    ):
        with pytest.raises(InputError, match=name):
            StabilizerOptions(**{name: value})  # type: ignore[arg-type]


def test_memory_is_bounded() -> None:
    flight, frames = round_trip()
    stabilizer = Stabilizer(StabilizerOptions(most_key_frames=4))
    results = run(flight, stabilizer, frames=frames)
    assert all(r.ok for r in results)
    assert len(stabilizer.key_frames) <= 4
    assert stabilizer.key_frames[0] == 0
    assert error(flight, 44, results[-1]) < 0.05

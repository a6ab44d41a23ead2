"""Vehicles among LED points: place and heading, against a camera that shares nothing with the detector."""

from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError, UndeterminedError
from airground.geometry.arrays import FloatArray
from airground.sim import SimCamera
from airground.vision.detectors.constellation import (
    Constellation,
    ConstellationDetector,
    constellation_sightings,
    find_constellations,
)
from airground.vision.detectors.protocol import Detector
from airground.vision.frame import Frame
from airground.vision.sightings import Sightings

LEDS = np.array([[0.0, 0.016], [0.0, -0.016], [0.16, 0.0], [0.07, 0.004]])
ALWAYS = np.array([True, True, True, False])
PATTERN = Constellation(LEDS, ALWAYS)
SIGMA = 0.2


def camera(tilt_deg: float) -> SimCamera:
    return SimCamera.looking_down(
        focal_length_px=1500.0,
        tilt_rad=np.radians(tilt_deg),
        roll_rad=0.1,
        heading_rad=0.7,
        height_m=3.0,
        image_size_px=(2048, 2048),
    )


class Drive:
    """Vehicles on circles, seen as points; every third frame the fourth LED is lit."""

    def __init__(self, tilt_deg: float, rng: np.random.Generator, *, vehicles: int = 2) -> None:
        self.camera, self.rng, self.vehicles = camera(tilt_deg), rng, vehicles
        x, y = 3.0 * np.tan(np.radians(tilt_deg)) * np.array([np.cos(0.7), np.sin(0.7)])
        self.middle = np.array([x, y])  # where the camera looks

    def pose(self, vehicle: int, k: int) -> tuple[FloatArray, float]:
        angle = (0.04 - 0.013 * vehicle) * k + 3.1 * vehicle  # not together
        out = np.array([np.cos(angle), np.sin(angle)])
        return self.middle + (0.5 + 0.4 * vehicle) * out, angle + np.pi / 2

    def seen(self, vehicle: int, k: int, points: FloatArray) -> FloatArray:
        place, heading = self.pose(vehicle, k)
        c, s = np.cos(heading), np.sin(heading)
        return np.asarray(self.camera.project(place + points @ np.array([[c, s], [-s, c]])))

    def points(self, k: int, *, missing: float = 0.0, spurious: int = 0) -> FloatArray:
        all_of_them = []
        for vehicle in range(self.vehicles):
            lit = ALWAYS | ((k + vehicle) % 3 == 0)
            uv = self.seen(vehicle, k, LEDS)[lit]
            all_of_them.append(uv[self.rng.random(len(uv)) >= missing])
        all_of_them.append(self.rng.uniform(0, 2048, (spurious, 2)))
        uv = np.concatenate(all_of_them)
        return np.asarray(self.rng.permutation(uv + self.rng.normal(0, SIGMA, uv.shape)))


def errors(drive: Drive, found: Sightings, k: int, origin: FloatArray) -> list[tuple[float, float]]:
    """Of each vehicle: distance and heading of the sighting that is nearest."""
    result = []
    for vehicle in range(drive.vehicles):
        place, ahead = drive.seen(vehicle, k, np.array([origin, origin + [1e-3, 0.0]]))
        off = np.linalg.norm(found.uv - place, axis=1)
        j = int(np.argmin(off))
        truth = np.arctan2(*(ahead - place)[::-1])
        turn = (found.angle[j] - truth + np.pi) % (2 * np.pi) - np.pi
        result.append((float(off[j]), float(turn)))
    return result


@pytest.mark.parametrize("tilt_deg", [0, 50])
def test_described_pattern(tilt_deg: float, rng: np.random.Generator) -> None:
    drive = Drive(tilt_deg, rng)
    frames = [drive.points(k, spurious=4) for k in range(60)]
    found = constellation_sightings(np.arange(60) / 50, frames, PATTERN, sigma_px=SIGMA)
    assert sum(len(s) == 2 for s in found) > 57  # spurious points may make a pattern by chance
    off = np.array([errors(drive, s, k, np.zeros(2)) for k, s in enumerate(found)]).reshape(-1, 2)
    assert np.median(off[:, 0]) < 2 * SIGMA
    assert np.quantile(off[:, 0], 0.97) < 4 * SIGMA
    assert np.quantile(np.abs(off[:, 1]), 0.97) < 0.05


def test_stated_covariance_is_what_it_scatters_by(rng: np.random.Generator) -> None:
    drive = Drive(0.0, rng, vehicles=1)
    frames = [drive.points(k) for k in range(300)]
    found = constellation_sightings(np.arange(300) / 50, frames, PATTERN, sigma_px=SIGMA)
    z, w = [], []
    for k, s in enumerate(found):
        truth = drive.seen(0, k, np.array([[0.0, 0.0], [0.16, 0.0]]))
        off = s.uv[0] - truth[0]
        z.append(off @ np.linalg.solve(s.covariance[0], off) / 2)
        heading = np.arctan2(*(truth[1] - truth[0])[::-1])
        w.append((((s.angle[0] - heading + np.pi) % (2 * np.pi) - np.pi) / s.angle_sigma[0]) ** 2)
    # Means of 300 chi-squares over their degrees of freedom: within 5 deviations of one.
    assert np.mean(z) == pytest.approx(1, abs=0.3)
    assert np.mean(w) == pytest.approx(1, abs=0.4)


@pytest.mark.parametrize("tilt_deg", [0, 40])
def test_learned_pattern(tilt_deg: float, rng: np.random.Generator) -> None:
    drive = Drive(tilt_deg, rng)
    frames = [drive.points(k, missing=0.02, spurious=3) for k in range(160)]
    pattern = Constellation.learned(frames)
    assert pattern.points.shape == (4, 2)
    assert pattern.always.sum() == 3
    assert pattern.size == pytest.approx(1)
    # The pattern's own scale is free; its sides are to each other as the LEDs' are.
    mine, its = pattern.points[pattern.always], LEDS[:3]
    sides = [np.sort(np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1)) for p in (mine, its)]
    assert sides[0] / sides[0][2] == pytest.approx(sides[1] / sides[1][2], abs=0.08)
    some = range(0, 160, 2)
    seen = [frames[k] for k in some]
    found = constellation_sightings(np.array(some) / 50, seen, pattern, sigma_px=SIGMA)
    middle = LEDS[:3].mean(axis=0)
    off = [errors(drive, s, k, middle) for k, s in zip(some, found, strict=True) if len(s) >= 2]
    assert len(off) > 65
    distance, turn = np.array(off).reshape(-1, 2).T
    assert np.median(distance) < 1.0
    assert (
        np.median(np.abs(turn)) < 0.08
    )  # forward is where it drives, to the front and not to the back


def test_what_does_not_move_is_no_pattern(rng: np.random.Generator) -> None:
    lamps = rng.uniform(0, 1000, (5, 2))
    frames = [lamps + rng.normal(0, SIGMA, lamps.shape) for _ in range(50)]
    with pytest.raises(UndeterminedError, match="move rigidly together; record while"):
        Constellation.learned(frames)
    with pytest.raises(UndeterminedError, match="no three points"):
        Constellation.learned([lamps[:2]] * 50)


def test_nothing_in_nothing_out() -> None:
    frames = [np.empty((0, 2)), np.ones((1, 2)), np.array([[1.0, 2], [3, 4]]), np.zeros((4, 2))]
    found = constellation_sightings(np.arange(4.0), frames, PATTERN)
    assert [len(s) for s in found] == [0, 0, 0, 0]
    assert [s.t for s in found] == [0, 1, 2, 3]


def test_a_mirror_image_is_not_the_pattern(rng: np.random.Generator) -> None:
    crooked = Constellation(np.array([[0.0, 0.0], [1.0, 0.0], [0.15, 0.2]]))
    seen = crooked.points @ np.array([[60.0, 0.0], [0.0, -60.0]])  # v points down
    one = find_constellations(Sightings.round(0.0, seen + 500, 0.1), crooked)
    assert one.angle == pytest.approx([0.0], abs=1e-6)
    assert one.uv == pytest.approx(np.array([[500.0, 500.0]]))
    # Turned over, its corners fit only out of order, which a far stretch would need.
    other = find_constellations(Sightings.round(0.0, seen * [1, -1] + 500, 0.1), crooked)
    assert len(other) == 0 or other.score[0] < 0.5 * one.score[0]


def test_a_pattern_that_looks_the_same_turned_has_no_heading() -> None:
    square = Constellation(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))
    assert square.ambiguous
    assert not PATTERN.ambiguous
    seen = Sightings.round(0.0, square.points @ np.diag([50.0, -50.0]) + 300, 0.1)
    found = find_constellations(seen, square)
    assert len(found) == 1
    assert np.isnan(found.angle).all()


class Points:
    """A detector that gives what it was told, frame by frame."""

    def __init__(self, frames: list[FloatArray]) -> None:
        self.frames = frames

    def detect(self, frame: Frame) -> Sightings:
        return Sightings.round(frame.t, self.frames[frame.index], SIGMA)


def test_as_a_detector_it_learns_on_the_way(rng: np.random.Generator) -> None:
    drive = Drive(20.0, rng, vehicles=1)
    detector = ConstellationDetector(Points([drive.points(k) for k in range(230)]))
    assert isinstance(detector, Detector)
    image = np.zeros((2, 2), dtype=np.uint8)
    found = [detector.detect(Frame(image, k / 50, index=k)) for k in range(230)]
    assert not any(len(s) for s in found[:199])
    # Places not seen yet may be stretched otherwise.
    assert sum(len(s) == 1 for s in found[200:]) >= 28


@pytest.mark.parametrize(
    "points", [[[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [[0.0, np.nan]] * 3]
)
def test_patterns_that_are_none(points: list[list[float]]) -> None:
    with pytest.raises(InputError):
        Constellation(points)  # type: ignore[arg-type]


def test_wrong_arguments() -> None:
    with pytest.raises(InputError, match="always"):
        Constellation(LEDS, np.array([True]))
    with pytest.raises(InputError, match="one time for each"):
        constellation_sightings(np.zeros(2), [np.zeros((3, 2))], PATTERN)
    with pytest.raises(InputError, match="sigma_px"):
        constellation_sightings(np.zeros(1), [np.zeros((3, 2))], PATTERN, sigma_px=0.0)

"""The next leg: inside the image, as good as it says, and better than what one would drive otherwise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from airground.calibration.calibration import Calibration, Fit
from airground.calibration.guidance import next_leg
from airground.calibration.guidance_types import Leg, LegOptions
from airground.calibration.observability import Observability
from airground.calibration.online import OnlineCalibrator
from airground.calibration.online_state import OnlineOptions
from airground.errors import InputError, UndeterminedError
from airground.geometry import LimitedHomography
from airground.sim.camera import SimCamera

SIZE = (1024, 768)
SIGMA_PX, HZ, SPEED, SHARE = 2.0, 10.0, 0.12, 0.05
NOISE = SHARE / math.sqrt(HZ)
OPTIONS = LegOptions(
    sigma_px=SIGMA_PX,
    speed_mps=SPEED,
    sightings_hz=HZ,
    odometry_noise=NOISE,
    speed_scale_sigma=0.0,
)


def camera(tilt_deg: float) -> SimCamera:
    return SimCamera.looking_down(
        focal_length_px=1000.0,
        tilt_rad=np.radians(tilt_deg),
        height_m=5.0,
        image_size_px=SIZE,
        heading_rad=0.4,
    )


def calibration(true: SimCamera, rng: np.random.Generator, error: float = 0.1) -> Calibration:
    """The truth, as if it were known from a drive in the middle of the image."""
    scale = np.abs(true.g).max(axis=1, keepdims=True) * np.ones((1, 2))
    root = error * scale.ravel()[:, None] * rng.normal(size=(6, 6))
    root[4:] *= 0.1
    return Calibration(
        model=LimitedHomography(true.g),
        covariance=root @ root.T,
        origin_px=np.array([511.5, 383.5]),
        fit=Fit(method="trajectory", rms_px=1.0, sightings=100, inlier_fraction=1.0),
        observability=Observability("ok", 0.1, (1.0,) * 6, ""),
    )


class Driver:
    """Drives legs under a camera, with noise, and tells the estimator."""

    def __init__(self, true: SimCamera, rng: np.random.Generator) -> None:
        self.true, self.rng = true, rng
        self.at = true.unproject(np.array([511.5, 383.5]))
        self.t, self.metres, self.legs = 0.0, 0.0, 0
        self.calibrator = OnlineCalibrator(
            OnlineOptions(
                sigma_px=SIGMA_PX, speed_noise=NOISE, heading_noise=NOISE, speed_scale_sigma=0.0
            )
        )

    @property
    def uv(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return self.true.project(self.at)

    def drive(self, leg: Leg) -> None:
        step = np.array(leg.step_m)
        time = leg.length_m / SPEED
        count = math.ceil(time * HZ)
        for k in range(count + 1):
            t = self.t + time * k / count + 1e-4 * (k == 0)
            noise = SHARE * SPEED * self.rng.normal(size=2)
            self.calibrator.reading(t, "robot", xy_dot=step / time + noise)
            place = self.at + step * k / count
            if self.true.visible(place):
                uv = self.true.project(place) + SIGMA_PX * self.rng.normal(size=2)
                self.calibrator.sighting(t, "robot", uv)
        self.at, self.t = self.at + step, self.t + time
        self.metres += leg.length_m
        self.legs += leg.end_px is None

    def error(self) -> float:
        """Of g, row by row relative to the truth's rows; infinite without a calibration."""
        found = self.calibrator.calibration()
        if found is None:
            return math.inf
        middle = np.array([[1, 0, -511.5], [0, 1, -383.5], [0, 0, 500.0]]) / 500.0
        true = middle @ self.true.g
        return float(np.linalg.norm(middle @ found.model.g - true) / np.linalg.norm(true))


@pytest.mark.parametrize("tilt", [0.0, 40.0, 70.0])
def test_legs_stay_inside_the_margin_and_shrink_the_uncertainty(
    tilt: float, rng: np.random.Generator
) -> None:
    true = camera(tilt)
    known = calibration(true, rng)
    for uv in ([511.0, 383.0], [150.0, 600.0], [10.0, 740.0]):  # the last is outside the margin
        leg = next_leg(known, uv, SIZE, margin_px=50.0, options=OPTIONS)
        assert leg.end_px is not None
        end = true.project(true.unproject(np.array(uv)) + leg.step_m)
        np.testing.assert_allclose(end, leg.end_px, atol=1e-6)
        assert 49.5 - 1e-6 <= end[0] <= SIZE[0] - 50.5 + 1e-6
        assert 49.5 - 1e-6 <= end[1] <= SIZE[1] - 50.5 + 1e-6
        assert leg.length_m >= OPTIONS.shortest_m - 1e-9
        assert leg.expected_sigma < leg.relative_sigma
        worst = next_leg(known, uv, SIZE, margin_px=50.0, options=replace(OPTIONS, criterion="max"))
        assert worst.relative_sigma >= leg.relative_sigma


def test_a_leg_tells_nothing_of_the_speeds_scale(rng: np.random.Generator) -> None:
    true = camera(30.0)
    sure = calibration(true, rng, 0.001)
    row = true.g.ravel()
    known = replace(sure, covariance=sure.covariance + (0.05 / 3) ** 2 * np.outer(row, row))
    leg = next_leg(known, [500.0, 400.0], SIZE, options=replace(OPTIONS, speed_scale_sigma=0.05))
    assert leg.expected_sigma > 0.05 * 0.99


def test_before_anything_is_known_a_closed_figure_is_driven() -> None:
    legs = [next_leg(None, [500.0, 400.0], SIZE, driven=k) for k in range(12)]
    assert all(leg.end_px is None for leg in legs)
    steps = np.array([leg.step_m for leg in legs])
    np.testing.assert_allclose(steps[:6].sum(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(steps[6:].sum(axis=0), 0.0, atol=1e-9)
    turn = math.remainder(legs[1].heading_rad - legs[0].heading_rad, math.pi)
    assert abs(turn) > math.radians(30)
    assert next_leg(OnlineCalibrator(), [5.0, 4.0], SIZE).end_px is None


def test_impossible_wishes(rng: np.random.Generator) -> None:
    known = calibration(camera(60.0), rng)
    with pytest.raises(InputError, match="margin"):
        next_leg(known, [500.0, 400.0], SIZE, margin_px=500.0)
    with pytest.raises(UndeterminedError, match="leads into the image"):
        next_leg(known, [500.0, 400.0], SIZE, options=replace(OPTIONS, shortest_m=50.0))
    with pytest.raises(UndeterminedError, match="not on the ground"):
        next_leg(known, [500.0, -5000.0], SIZE)
    with pytest.raises(InputError):
        LegOptions(longest_m=0.1)


def test_planned_legs_beat_random_ones(rng: np.random.Generator) -> None:
    """The same start, the same estimator, the same metres: legs as planned, and to random places in the image."""
    planned, random = [], []
    for tilt in (10.0, 50.0):
        for _ in range(3):
            one = Driver(camera(tilt), rng)
            while one.metres < 3.5:
                one.drive(
                    next_leg(
                        one.calibrator,
                        one.uv,
                        SIZE,
                        margin_px=60.0,
                        driven=one.legs,
                        options=OPTIONS,
                    )
                )
            planned.append(one.error() * one.metres**1.5)  # at best errors shrink about like that
            other = Driver(camera(tilt), rng)
            while other.metres < 3.5:
                leg = next_leg(None, other.uv, SIZE, driven=other.legs, options=OPTIONS)
                if other.calibrator.calibration() is not None:
                    angle = rng.uniform(-np.pi, np.pi)
                    length = rng.uniform(0.3, 1.0)
                    step = length * np.array([np.cos(angle), np.sin(angle)])
                    if not other.true.visible(other.at + step, 60.0):
                        continue
                    leg = replace(leg, heading_rad=float(angle), length_m=float(length))
                other.drive(leg)
            random.append(other.error() * other.metres**1.5)
    assert np.median(planned) < 0.8 * np.median(random)

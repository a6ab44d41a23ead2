"""Closed loop: a lagging, slipping robot with a noisy compass, seen late; from anywhere in view to a calibration."""

from __future__ import annotations

from dataclasses import replace
from math import degrees

import numpy as np
import pytest

from airground.control import Limits
from airground.control.legs import DriveLeg, LegDriver
from airground.geometry import n_error
from airground.sim import SimCamera
from leg_loop import READINGS, LegLoop, World, ceiling, mirrored, start_in, tilted

EXACT = replace(READINGS, speed_share=0.0)


@pytest.mark.parametrize(
    ("camera", "kind", "limits"),
    [
        (tilted(), "differential", Limits()),
        (mirrored(tilted()), "unicycle", Limits()),
        (ceiling(), "ackermann", Limits(turn_radius_m=0.7)),
    ],
)
def test_from_the_border_heading_out_to_a_calibration(
    camera: SimCamera, kind: str, limits: Limits, rng: np.random.Generator
) -> None:
    xy, theta = start_in(camera, rng, edge=True)
    loop = LegLoop(World(camera, xy, theta, 3, kind, limits))  # type: ignore[arg-type]
    assert loop.calibrate(8), loop.lines
    assert loop.closest_px > 25, loop.lines  # 40 wanted; a metre in the image is learned on the way
    assert loop.stops == []
    found = loop.calibrator.calibration()
    assert found is not None
    assert n_error(camera.g, found.model) < 1.0  # good where it drove, rough elsewhere
    for leg in loop.ended:
        if leg.whole:
            assert abs(degrees(leg.heading_error_rad)) < 3
            assert abs(leg.length_m - leg.wanted.length_m) < 0.03 + 0.06 * leg.wanted.length_m


@pytest.mark.parametrize(
    ("camera", "limits"), [(tilted(), Limits()), (ceiling(), Limits(reverse_mps=0.0))]
)
def test_marks_stay_in_the_image_from_any_start(
    camera: SimCamera, limits: Limits, rng: np.random.Generator
) -> None:
    for seed in range(2):
        xy, theta = start_in(camera, rng, edge=True, margin_px=50.0)
        loop = LegLoop(World(camera, xy, theta, seed, limits=limits), calibrates=False)
        leg = loop.leg(DriveLeg(theta, 4.0))  # out of the image
        assert leg is not None
        assert not leg.whole
        assert loop.closest_px > 20, (seed, loop.lines)
        assert loop.stops == []


def test_legs_are_as_long_as_wanted(rng: np.random.Generator) -> None:
    camera = ceiling()
    xy = camera.unproject(np.array([640.0, 360.0]))
    loop = LegLoop(World(camera, xy, 2.0, 5, readings=EXACT), calibrates=False)
    for heading, length in ((0.4, 0.3), (2.5, 0.9)):
        ended = loop.leg(DriveLeg(heading, length))
        assert ended is not None
        assert ended.whole
        assert ended.length_m == pytest.approx(length, abs=0.03)
        assert abs(degrees(ended.heading_error_rad)) < 3
    # Fed again, the same ticks come out: nothing depends on anything else.
    again = LegDriver(loop.world.limits)
    legs = iter(leg.wanted for leg in loop.ended)
    for before, (told, tick, _) in zip([None, *loop.log], loop.log, strict=False):
        if tick.phase == "turn" and (before is None or before[1].wants_leg):
            again.give(next(legs))
        assert again.tick(told) == tick


def test_a_parked_robot_is_not_touched(rng: np.random.Generator) -> None:
    camera = ceiling()
    xy = camera.unproject(np.array([500.0, 360.0]))
    parked = (760.0, 360.0, 90.0)
    for heading in (-0.87, -0.75):  # along u
        loop = LegLoop(World(camera, xy, heading, 1, others=(parked,)), calibrates=False)
        ended = loop.leg(DriveLeg(heading, 3.0))
        assert ended is not None
        assert loop.nearest_px > -5
        assert loop.closest_px > 20

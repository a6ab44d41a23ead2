"""Which leg comes next without a calibration, and how a person is told."""

from __future__ import annotations

from math import cos, hypot, nan, pi, radians, remainder, sin

import pytest

from airground.control.legs import (
    DriveLeg,
    DrivenLeg,
    LocalMap,
    ScriptOptions,
    advise,
    scripted_leg,
)
from airground.errors import InputError

SIZE = (1280, 720)


def learned(*headings: float, scale: float = 200.0, clockwise: bool = False) -> LocalMap:
    """An image from straight above."""
    found = LocalMap()
    sign = 1 if clockwise else -1
    for heading in headings:
        for k in range(60):
            a, b = 0.2 * scale * cos(heading), sign * 0.2 * scale * sin(heading)
            found.take((640.0 + k, 360.0), (a, b), heading, 0.2)
    return found


def test_the_first_leg_goes_straight_on_short_and_slow() -> None:
    leg = scripted_leg(LocalMap(), (640.0, 360.0), SIZE, heading_rad=1.1)
    assert (leg.heading_rad, leg.length_m, leg.speed_mps) == pytest.approx((1.1, 0.3, 0.12))
    # Where nothing came of it, another way is tried.
    tried = (DrivenLeg(1.1, 0.02, whole=False),)
    leg = scripted_leg(LocalMap(), (640.0, 360.0), SIZE, tried, heading_rad=1.1)
    assert abs(remainder(leg.heading_rad - 1.1, pi)) > 0.5


def test_headings_are_well_apart() -> None:
    found = learned(0.0, 1.0)
    driven: tuple[DrivenLeg, ...] = ()
    at, heading = (640.0, 360.0), 0.0
    for _ in range(6):
        leg = scripted_leg(found, at, SIZE, driven, heading_rad=heading)
        driven += (DrivenLeg(leg.heading_rad, leg.length_m, whole=True),)
        heading = leg.heading_rad
        c, s = cos(heading), sin(heading)
        at = (at[0] + 200 * leg.length_m * c, at[1] - 200 * leg.length_m * s)
    first = [leg.heading_rad for leg in driven[:3]]
    apart = [abs(remainder(a - b, pi)) for a in first for b in first if a is not b]
    assert min(apart) > radians(45)
    assert {leg.length_m for leg in driven} == {0.6}


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("headings", [(0.5,), (0.5, 1.8)])
def test_legs_end_inside_the_margin(clockwise: bool, headings: tuple[float, ...]) -> None:
    found = learned(*headings, clockwise=clockwise)
    sign = 1 if clockwise else -1
    for at in ((70.0, 70.0), (1200.0, 90.0), (640.0, 650.0), (600.0, 300.0)):
        driven: tuple[DrivenLeg, ...] = ()
        for _ in range(5):
            leg = scripted_leg(found, at, SIZE, driven, heading_rad=0.5, margin_px=50.0)
            driven += (DrivenLeg(leg.heading_rad, leg.length_m, whole=True),)
            u = at[0] + 200 * leg.length_m * cos(leg.heading_rad)
            v = at[1] + sign * 200 * leg.length_m * sin(leg.heading_rad)
            assert 50 <= u <= 1230
            assert 50 <= v <= 670


def test_legs_keep_away_from_others() -> None:
    found = learned(0.0, 1.0)
    others = tuple(
        (640 + 150 * cos(a), 360 - 150 * sin(a), 70.0)
        for a in (radians(k) for k in range(0, 300, 30))
    )
    leg = scripted_leg(found, (640.0, 360.0), SIZE, heading_rad=0.0, others=others)
    end = (
        640 + 200 * leg.length_m * cos(leg.heading_rad),
        360 - 200 * leg.length_m * sin(leg.heading_rad),
    )
    assert min(hypot(end[0] - u, end[1] - v) for u, v, _ in others) > 69


def test_with_no_room_at_all_it_goes_inwards() -> None:
    found = learned(0.0, 1.0, scale=4000.0)  # so near that the image is 30 cm wide
    leg = scripted_leg(found, (900.0, 360.0), SIZE, heading_rad=0.0)
    assert abs(remainder(leg.heading_rad - pi, 2 * pi)) < 0.1


def test_wrong_input_is_refused() -> None:
    with pytest.raises(InputError, match="finite"):
        scripted_leg(LocalMap(), (nan, 0.0), SIZE, heading_rad=0.0)
    with pytest.raises(InputError, match="length_m"):
        ScriptOptions(length_m=0.0)
    with pytest.raises(InputError, match="known_share"):
        ScriptOptions(known_share=1.5)


def said(leg: DriveLeg | None, heading: float | None = 0.0, found: LocalMap | None = None) -> str:
    return advise(
        leg,
        heading_rad=heading,
        local_map=found or learned(0.0, 1.0),
        uv=(640.0, 360.0),
    )


def test_a_person_is_told_the_side_and_the_direction_in_the_image() -> None:
    leg = DriveLeg(radians(58), 1.0)
    assert said(leg) == "turn left by about 60 deg and drive 1.0 m towards the upper right"
    clockwise = learned(0.0, 1.0, clockwise=True)
    line = said(leg, found=clockwise)
    assert line == "turn right by about 60 deg and drive 1.0 m towards the lower right"
    assert (
        said(leg, radians(-60))
        == "turn left by about 120 deg and drive 1.0 m towards the upper right"
    )
    assert said(leg, radians(52)) == "drive 1.0 m towards the upper right, straight on"
    assert said(leg, radians(-125)) == "turn round and drive 1.0 m towards the upper right"
    assert said(leg, None) == "drive 1.0 m towards the upper right"
    assert (
        said(DriveLeg(radians(-90), 0.5), radians(-100))
        == "drive 0.5 m towards the bottom, straight on"
    )


def test_what_is_not_known_is_not_said() -> None:
    line = said(DriveLeg(radians(60), 1.0), found=LocalMap())
    assert line == "turn by about 60 deg, until the compass says 60 deg, and drive 1.0 m"


def test_without_a_leg_it_says_what_is_missing() -> None:
    def after(*headings: float) -> str:
        driven = tuple(DrivenLeg(h, 0.5, whole=True) for h in headings)
        return advise(None, heading_rad=0.0, local_map=LocalMap(), uv=None, driven=driven)

    assert after() == "drive straight on for about half a metre"
    assert "2 more directions" in after(0.0)
    assert "2 more directions" in after(0.0, pi)  # there and back is one
    assert "one more direction" in after(0.0, 1.0)
    assert "other places" in after(0.0, 1.0, 2.0)

"""A robot that is told to go must get on."""

from __future__ import annotations

from math import nan, pi

import pytest

from airground.control import VelocityCommand
from airground.control.safety.types import Place
from airground.session.headway import Headway

DT = 0.02


def steps(one: Headway, command: VelocityCommand, *places: Place | None) -> int | None:
    """After how many steps it is taken to be stuck."""
    for k, place in enumerate(places):
        if one.stuck(place, command, DT):
            return k
    return None


@pytest.mark.parametrize(
    "command", [VelocityCommand(0.1, 0.0), VelocityCommand(-0.1, 0.0), VelocityCommand(0.0, -0.4)]
)
def test_one_that_stands_though_it_is_told_to_move_is_noticed(command: VelocityCommand) -> None:
    k = steps(Headway(), command, *[Place(1.0, 2.0, 0.3)] * 200)
    told = abs(command.v) + 0.3 * abs(command.omega)
    assert k == pytest.approx(0.25 / (told * DT), abs=2)


def test_one_that_moves_or_turns_at_a_third_of_it_is_not() -> None:
    command = VelocityCommand(0.1, 0.0)
    ahead = [Place(0.033 * k * DT, 0.0, 0.0) for k in range(1000)]
    assert steps(Headway(), command, *ahead) is None
    turning = [Place(0.0, 0.0, 0.13 * k * DT - pi) for k in range(1000)]
    assert steps(Headway(), VelocityCommand(0.0, 0.4), *turning) is None


def test_to_and_fro_on_the_spot_is_no_way_to_go() -> None:
    one, stands = Headway(), Place(0.0, 0.0, 0.0)
    for k in range(500):
        side = 1 if k // 10 % 2 else -1
        assert not one.stuck(stands, VelocityCommand(0.0, side * 0.5), DT)


def test_what_is_not_known_or_not_asked_does_not_count() -> None:
    one, stands, go = Headway(), Place(0.0, 0.0, 0.0), VelocityCommand(0.3, 0.0)
    for _ in range(20):
        assert steps(one, go, *[stands] * 30) is None
        assert not one.stuck(None, go, DT)
        assert steps(one, go, *[stands] * 30) is None
        one.rest()
        assert steps(one, go, *[Place(nan, 0.0, 0.0)] * 30) is None
        assert steps(one, VelocityCommand(0.0, 0.0), *[stands] * 30) is None
        one.rest()

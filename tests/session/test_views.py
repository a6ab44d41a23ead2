"""What a person is shown of robots and of what else moves."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from airground.session.orders import DriveTo
from session_runs import RED_GOAL, session, view


def test_a_robot_is_shown_where_it_is_with_an_arrow_ahead_and_an_ellipse() -> None:
    one = session()
    one.run(0.3)
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(1.4)
    red, truth = view(one), one.world.truth("red", one.t)
    assert red.uv is not None
    assert hypot(*(truth.uv - red.uv)) < 12  # where it will be when the command takes effect
    assert red.heading_rad == pytest.approx(truth.theta, abs=0.1)
    assert red.speed_mps == pytest.approx(truth.v, abs=0.05)
    assert red.ahead_uv is not None
    ahead = one.world.camera.unproject(np.array(red.ahead_uv)) - truth.xy
    assert np.arctan2(ahead[1], ahead[0]) == pytest.approx(truth.theta, abs=0.15)
    assert red.covariance is not None
    uu, uv, vv = red.covariance
    assert uu > 0
    assert uu * vv > uv * uv
    assert 0 < (red.seen_s or 0) < 0.2
    assert 0 <= (red.heard_s or 0) < 0.1
    assert (red.task, red.done, red.stop, red.stop_reason) == ("goal", False, "", "")
    assert red.error_m == pytest.approx(
        float(np.hypot(*(truth.xy - one.world.camera.unproject(np.array(RED_GOAL))))), abs=0.15
    )


def test_before_a_calibration_a_robot_is_shown_by_its_track_and_its_own_sensors() -> None:
    one = session(known=False)
    one.run(0.4)
    red, truth = view(one), one.world.truth("red", one.t)
    assert red.uv is not None
    assert hypot(*(truth.uv - red.uv)) < 2
    assert red.heading_rad == pytest.approx(truth.theta, abs=0.2)
    assert (red.ahead_uv, red.error_m, red.goals_px) == (None, None, ())
    assert red.command.at_rest


@pytest.mark.parametrize("known", [True, False])
def test_something_else_is_shown_with_its_speed_where_the_ground_is_known(known: bool) -> None:
    one = session(known=known, cart=True)
    one.run(1.0)
    assert one.tick is not None
    (cart,) = one.tick.others
    truth = one.world.truth("cart", one.t - 0.05)
    assert hypot(*(truth.uv - cart.uv)) < 10
    if not known:
        assert (cart.speed_mps, cart.xy_dot, cart.speed_sigma_mps) == (None, None, None)
        return
    assert cart.speed_mps is not None
    assert cart.speed_sigma_mps is not None
    assert abs(cart.speed_mps - truth.v) < 4 * cart.speed_sigma_mps
    assert 0 < cart.speed_sigma_mps < 0.2


def test_what_is_not_seen_or_heard_is_shown_as_not_known() -> None:
    one = session(known=False)
    one.world.faults.robot("red", covered=True, link_gone=True)
    one.run(0.3)
    red = view(one)
    assert (red.uv, red.heading_rad, red.seen_s, red.heard_s) == (None, None, None, None)
    one = session()
    one.world.faults.robot("red", covered=True)
    one.run(0.3)
    red = view(one)
    assert (red.uv, red.ahead_uv, red.covariance, red.speed_mps) == (None, None, None, None)
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(0.2)
    assert view(one).command.at_rest
    assert "has not been found" in view(one).stop

"""A site put together: what it does when one of its processes dies."""

from __future__ import annotations

import os
import signal
from typing import TYPE_CHECKING, cast

from airground.session.compose import LiveSite, plan_without_site
from airground.session.orders import Alive, DriveTo
from airground.sim import EmbeddedOptions, EmbeddedWorld
from airground.vision.eyes_apart import EyesApart
from session_runs import known_calibration
from waiting import until

if TYPE_CHECKING:
    from airground.session.tick import SessionTick

PATIENT_S = 60.0  # the machine may be busy
AWAY = ((420.0, 560.0), (860.0, 330.0))


def test_when_the_eyes_die_robots_stand_and_fresh_eyes_go_on() -> None:
    calibration = known_calibration(EmbeddedWorld(EmbeddedOptions(robots=1)))
    ticks: list[SessionTick] = []
    with LiveSite(plan_without_site(robots=1), calibration) as site:
        site.live.listen(ticks.append)
        until(lambda: bool(ticks) and ticks[-1].camera.state == "live", PATIENT_S)
        turn = 0

        def driving() -> bool:
            nonlocal turn
            site.live.submit("me", Alive())
            if ticks[-1].robots[0].task == "none" or ticks[-1].robots[0].done:
                site.live.submit("me", DriveTo("red", (AWAY[turn % 2],)))
                turn += 1
            return abs(ticks[-1].commands["red"].v) > 0.1

        until(driving, PATIENT_S)
        eyes = cast("EyesApart", site.live._stage._eyes)
        child = eyes._child
        assert child is not None
        assert child._process.pid is not None
        os.kill(child._process.pid, signal.SIGKILL)
        since = len(ticks)

        def seen(state: str) -> bool:
            site.live.submit("me", Alive())
            return any(tick.camera.state == state for tick in ticks[since:])

        until(lambda: seen("lost"), PATIENT_S)
        lines = [event.line for tick in ticks[since:] for event in tick.events]
        assert any("its process has died" in line for line in lines), lines
        until(lambda: any(tick.commands["red"].at_rest for tick in ticks[since:]), PATIENT_S)
        lost = next(k for k, tick in enumerate(ticks) if k >= since and tick.camera.state == "lost")
        until(lambda: any(tick.camera.state == "live" for tick in ticks[lost:]), PATIENT_S)
        assert eyes._child is not child
        assert not site.live.failed

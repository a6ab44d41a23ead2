"""The operator's console in a real browser: what a person does, and what the robots really do then."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from math import hypot
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from airground.session.stepped import embedded_robots
from airground.sim.live_world import EmbeddedWorld
from peers.browser import (
    LAPTOP,
    PATIENCE_S,
    PHONE,
    Console,
    TrueSite,
    curve,
    off_line,
)
from peers.relay import Relay
from session_runs import STANDS_MPS, known_calibration

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Open = Callable[..., Console]
    Start = Callable[..., subprocess.Popen[str]]

GOALS = (330.0, 450.0), (600.0, 470.0)
NEAR_PX, NEAR_M = 3.0, 0.02
FOLLOWS_PX = 6.0  # of a robot under way
SERVE = (sys.executable, "-m", "airground", "serve", "--port")


def drive(page: Console, site: TrueSite) -> tuple[float, float]:
    """Send red far away; it is under way when this returns."""
    goal = site.far(*GOALS)
    page.click_at(goal)
    page.wait(lambda: site.speed() > 0.1)
    return goal


def arrives(page: Console, site: TrueSite, goal: tuple[float, float]) -> None:
    page.until("state.robots[0].done")
    page.wait(lambda: site.speed() < STANDS_MPS)
    px, m = site.off(goal)
    assert px < NEAR_PX
    assert m < NEAR_M


def serve(start: Start, *options: str, port: int = 0) -> tuple[subprocess.Popen[str], str]:
    server = start(*SERVE, str(port), "--json", *options)
    assert server.stdout is not None
    return server, json.loads(server.stdout.readline())["url"]


# From nothing


def test_calibrate_and_drive_from_nothing(console: Open) -> None:
    with TrueSite(calibrated=False) as site:
        page = console(site.server.url).take()
        assert "does not know the ground" in page.by("invite").inner_text()
        page.click("tab-calibrate")
        page.click("calibrate-guided")
        page.until("calibration.phase === 'running'", 5 * PATIENCE_S)
        assert page.by("calibration-advice").inner_text()
        page.until("calibration.phase === 'good'", 5 * PATIENCE_S)
        page.click("calibration-keep")
        page.until("calibration.status === 'calibrated' && airground.calibration.rectify")
        assert "Calibrated: speeds are true to" in page.by("calibration-status").inner_text()
        for uv in GOALS:  # a metre at the right, and ahead, is a metre for the page
            there = site.camera.unproject(np.array(uv))
            for step in ((1.0, 0.0), (0.0, 1.0)):
                u, v = site.camera.project(there + step)
                ends = [page.get(f"groundFromImage({at[0]}, {at[1]})") for at in (uv, (u, v))]
                sigma = page.get("calibration.relative_sigma")
                assert hypot(*np.subtract(*ends)) == pytest.approx(1.0, abs=4 * sigma)

        page.click("tool-goal")
        goal = drive(page, site)
        arrives(page, site, goal)


# Driving


def test_a_click_sends_the_robot_there(site: TrueSite, console: Open) -> None:
    page = console(site.server.url).take()
    goal = drive(page, site)
    arrives(page, site, goal)
    assert page.get("state.mode") == "idle"
    assert "arrived" in page.by("robot-red").inner_text()


def test_a_sketch_is_smoothed_shown_and_driven(site: TrueSite, console: Open) -> None:
    page = console(site.server.url).take()
    goal = site.far(*GOALS)
    page.click("tool-sketch")
    u, v = page.get("state.robots[0].uv")
    page.draw(curve((u, v), goal))
    page.by("path-info").wait_for()
    assert re.search(r"m in .* s · .* m/s on average", page.by("path-info").inner_text())
    end = page.get("paths.red.points.at(-1)")
    assert site.speed() < STANDS_MPS  # shown first: nothing moves
    page.click("drive-path")
    page.until("state.robots[0].task === 'path'")
    way = page.get("paths.red.points")
    off_px = []
    while not page.get("state.robots[0].done"):
        off_px.append(off_line(way, site.truth().uv))
    arrives(page, site, (end[0], end[1]))
    assert len(off_px) > 10
    assert max(off_px) < FOLLOWS_PX


def test_what_cannot_be_driven_is_red_and_not_released(site: TrueSite, console: Open) -> None:
    page = console(site.server.url).take()
    u, v = page.get("state.robots[0].uv")
    page.click("tool-keepout")
    for du, dv in ((-90, 60), (90, 60), (90, 120), (-90, 120)):
        page.click_at((u + du, v + dv))
    page.click("polygon-close")
    page.until("fences.keep_out.length === 1")
    page.click("tool-sketch")
    page.draw([(u, v + 3 * k) for k in range(60)])
    page.until("paths.red?.undrivable.length > 0")
    assert "Cannot be driven" in page.by("path-info").inner_text()
    assert page.by("drive-path").is_disabled()


def test_driven_by_hand_it_stands_when_the_key_is_let_go(site: TrueSite, console: Open) -> None:
    page = console(site.server.url).take()
    page.click("tool-hand")
    before = site.truth().theta
    page.page.keyboard.down("ArrowLeft")
    page.wait(lambda: site.truth().theta > before + 0.1)
    page.page.keyboard.up("ArrowLeft")
    page.wait(lambda: abs(site.truth().omega) < 0.01)
    assert page.get("state.mode") != "stopped"


# STOP


@pytest.mark.parametrize("by", ["button", "space"])
def test_stop_is_heard_and_all_stands_until_released(
    site: TrueSite, console: Open, by: str
) -> None:
    page = console(site.server.url).take()
    drive(page, site)
    if by == "button":
        page.click("stop")
    else:
        page.by("speed-red").focus()  # whatever has the focus
        page.page.keyboard.press("Space")
    page.until("events.some((one) => one.line.startsWith('STOP was heard after'))")
    assert re.search("STOP heard|Stopped", page.by("stop-status").inner_text())
    assert page.get("state.mode") == "stopped"
    page.wait(lambda: site.speed() < STANDS_MPS)

    page.click_at(site.far(*GOALS))  # refused: it is stopped
    page.by("toast").first.wait_for()
    page.release()
    page.until("state.mode === 'idle'")
    assert page.get("state.robots[0].task") == "none"  # what was under way is forgotten
    assert site.speed() < STANDS_MPS


# The connection


@pytest.mark.parametrize("how", ["cut", "silent"])
def test_a_lost_connection_stops_the_robots_and_comes_back(
    site: TrueSite, console: Open, how: str
) -> None:
    with Relay(site.server.port) as relay:
        page = console(f"http://127.0.0.1:{relay.port}/", allow="WebSocket").take()
        drive(page, site)
        if how == "cut":
            relay.cut()
        else:
            relay.fall_silent()
        page.until("connection.state === 'lost'")
        assert "lost" in page.by("connection").inner_text()
        assert page.by("stop-status").get_attribute("data-state") == "lost"
        page.wait(lambda: site.speed() < STANDS_MPS)

        relay.mend()
        page.until("connection.state === 'live' && airground.controls !== null")
        page.until("controls.holder === null")
        assert page.by("take-controls").is_visible()
        assert site.speed() < STANDS_MPS  # nobody drives
        drive(page.take(), site)


def test_the_page_finds_a_server_that_was_started_again(
    console: Open, start: Start, tmp_path: Path
) -> None:
    world = EmbeddedWorld()
    known_calibration(world).save(tmp_path / "calibration.json")
    known = ("--calibration", str(tmp_path / "calibration.json"))
    server, url = serve(start, *known)
    page = console(url, allow="WebSocket").take()
    server.send_signal(signal.SIGKILL)
    page.until("connection.state === 'lost'")
    serve(start, *known, port=int(url.rsplit(":", 1)[1].strip("/")))
    page.until("connection.state === 'live' && airground.controls?.holder === null")
    page.take()
    assert page.get("calibration.status") == "calibrated"
    assert len(page.get("hello.site.robots")) == len(embedded_robots(world))


# More than one person


def test_a_second_person_watches_stops_and_takes_over(site: TrueSite, console: Open) -> None:
    first = console(f"{site.server.url}#name=Ada").take()
    second = console(f"{site.server.url}#name=Ben")
    second.until("controls.clients === 2")
    assert "Ada has the controls" in second.by("controls").inner_text()

    goal = site.far(*GOALS)
    second.click_at(goal)
    assert "You are watching" in second.by("toast").first.inner_text()
    assert refused(second, {"kind": "drive_to", "robot": "red", "goals_px": [goal]})
    assert first.get("state.robots[0].task") == "none"

    drive(first, site)
    second.click("stop")
    first.until("state.mode === 'stopped'")
    first.wait(lambda: site.speed() < STANDS_MPS)
    first.release()

    drive(first, site)
    second.click("take-controls")
    assert "Ada" in second.by("take-force").locator("xpath=../..").inner_text()
    second.click("take-cancel")
    assert first.get("controls.you")
    second.click("take-controls")
    second.click("take-force")
    second.until("controls.you")
    first.until("controls.you === false")
    second.wait(lambda: site.speed() < STANDS_MPS)  # what the first one drove
    assert "Ben has the controls" in first.by("controls").inner_text()
    assert any("Ben" in line for line in first.by("toast").all_inner_texts())
    drive(second, site)


def refused(page: Console, order: dict[str, Any]) -> bool:
    """Send an order past the page's own check; whether the server refuses it."""
    line = page.page.evaluate(
        """(order) => new Promise((done) => {
             const socket = new WebSocket(`ws://${location.host}/ws`);
             socket.onopen = () => {
               socket.send(JSON.stringify({ kind: "hello", version: 1, name: "sly" }));
               socket.send(JSON.stringify({ kind: "order", seq: 1, order }));
             };
             socket.onmessage = ({ data }) => {
               const said = typeof data === "string" ? JSON.parse(data) : {};
               if (said.reply === 1) { done(said.ok ? "" : said.line); socket.close(); }
             };
           })""",
        order,
    )
    return "take the controls" in line


# The page itself


@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.parametrize("size", [LAPTOP, PHONE], ids=["laptop", "phone"])
def test_no_text_is_covered_or_cut(
    site: TrueSite, console: Open, size: tuple[int, int], scheme: str
) -> None:
    page = console(site.server.url, size, color_scheme=scheme, has_touch=size == PHONE)
    assert page.layout() == []
    page.take()
    for tab in ("calibrate", "events", "robots"):
        page.click(f"tab-{tab}")
        assert page.layout() == [], tab
    for tool in ("fence", "keepout", "hand", "goal", "sketch"):
        page.click(f"tool-{tool}")
        assert page.layout() == [], tool
    u, v = page.get("state.robots[0].uv")
    page.draw(curve((u, v), site.far(*GOALS)))
    page.by("path-info").wait_for()
    assert page.layout() == [], "path"
    page.click("drive-path")
    page.until("state.mode === 'driving'")
    assert page.layout() == [], "driving"
    for button in ("layers", "connection"):
        page.click(button)
        assert page.layout() == [], button
        page.page.keyboard.press("Escape")
    page.click("stop")
    page.until("state.mode === 'stopped'")
    page.by("release").wait_for()
    assert page.layout() == [], "stopped"
    page.release()


def test_everything_is_in_reach_of_the_keyboard(site: TrueSite, console: Open) -> None:
    page = console(site.server.url)
    reached: dict[str, bool] = {}
    for _ in range(80):
        page.page.keyboard.press("Tab")
        name, seen = page.page.evaluate(
            """() => {
                 const node = document.activeElement, { outlineStyle, outlineWidth } = getComputedStyle(node);
                 return [node.dataset.testid ?? node.id, outlineStyle !== "none" && parseFloat(outlineWidth) >= 2];
               }"""
        )
        if name in reached:
            break
        reached[name] = seen
        if name == "take-controls":
            page.page.keyboard.press("Enter")
            page.until("controls?.you")
    tools = {f"tool-{name}" for name in ("goal", "sketch", "fence", "keepout", "hand")}
    others = {"take-controls", "view", "stop", "robot-red", "robot-blue", "speed-red", "layers"}
    assert tools | others <= set(reached)
    assert [name for name, seen in reached.items() if name and not seen] == []

    # And a goal without any pointer: the cross begins in the middle.
    page.by("view").focus()
    for key in ("ArrowLeft", "ArrowLeft", "ArrowDown", "Enter"):
        page.page.keyboard.press(key)
    page.until("state.robots[0].task === 'goal'")
    page.page.keyboard.press("Escape")
    page.until("state.robots[0].task === 'none'")


def test_a_finger_sketches_on_a_phone(site: TrueSite, console: Open) -> None:
    page = console(site.server.url, PHONE, has_touch=True, is_mobile=True)
    page.by("take-controls").tap()
    page.until("controls?.you")
    page.by("tool-sketch").tap()
    u, v = page.get("state.robots[0].uv")
    page.touch(curve((u, v), site.far(*GOALS)))
    page.by("path-info").wait_for()
    page.by("drive-path").tap()
    page.wait(lambda: site.speed() > 0.05)
    page.by("stop").tap()
    page.until("state.mode === 'stopped'")
    page.wait(lambda: site.speed() < STANDS_MPS)

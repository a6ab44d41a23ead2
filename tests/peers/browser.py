"""The console in a real browser, and a site behind it whose truth can be asked for."""

from __future__ import annotations

import shutil
from contextlib import ExitStack
from math import hypot, inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import pytest

from airground.console.limits import ConsoleLimits
from airground.console.server import ConsoleServer
from airground.control.safety.bounds import SafetyBounds
from airground.session.live import LiveSession
from airground.session.options import SessionOptions
from airground.session.orders import Gone, Release, SetFences
from airground.session.session import Session
from airground.session.stepped import embedded_robots
from airground.sim.live import LiveWorld
from airground.sim.live_options import FAMILY, EmbeddedOptions
from airground.sim.live_world import EmbeddedWorld
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.eyes_apart import EyesApart
from airground.vision.tracker import Tracker
from peers.waiting_clock import WaitingClock
from session_runs import GOOD_WHEELS, known_calibration
from waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Browser, ConsoleMessage, Locator, Page

    from airground.geometry.arrays import FloatArray
    from airground.session.tick import SessionTick
    from airground.sim.live_truth import RobotTruth

LAPTOP, PHONE = (1280, 720), (390, 844)
PATIENCE_S = 60.0  # for a drive of ten seconds, on a computer that does much else
POLL_MS = 40
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = (
    "--no-sandbox",  # tests may run as root
    "--use-angle=swiftshader",  # WebGL without a graphics card
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
)
OVERLAPS = Path(__file__).with_name("overlaps.js").read_text()

# The page's own processes have to share the computer too.
BOUNDS = SafetyBounds(operator_s=4.0)
SILENCE_S = 2.0
LOOKS_S = 0.25  # how far the world runs on before it is looked at
STEPS_S = 0.04  # and before the loop steps: who is told late drives too far, which is not the page's doing
CAMERA_HZ = 10.0


def eyes() -> Eyes:
    """Make what looks at the embedded world's pictures."""
    return Eyes(make_detector(f"tag:family={FAMILY}"), Tracker())


def open_chromium() -> Iterator[Browser]:
    """Start Chromium, or skip."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed; pip install playwright"
    )
    with playwright.sync_playwright() as driver:
        own = driver.chromium.executable_path
        program = next(filter(None, map(shutil.which, NAMES)), own if Path(own).exists() else None)
        if program is None:
            pytest.skip(
                "Chromium is not installed; on Debian: apt install chromium, elsewhere: playwright install chromium"
            )
        browser = driver.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        yield browser
        browser.close()


class TrueSite:
    """The embedded world with its console, in this process. A context manager."""

    def __init__(self, *, calibrated: bool = True) -> None:
        options = EmbeddedOptions(robots=2, camera_hz=CAMERA_HZ, odometry=GOOD_WHEELS)
        world = EmbeddedWorld(options, seed=0)
        clock = WaitingClock(self._limit)
        self.tick: SessionTick | None = None
        self.image_t = -inf
        self.camera = world.camera
        self.world = LiveWorld(world, clock)
        self._eyes = EyesApart(eyes)
        robots = embedded_robots(world, speed_mps=0.4)
        session = SessionOptions(robots, name="embedded world", bounds=BOUNDS)
        self.live = LiveSession(
            Session(session, known_calibration(world) if calibrated else None),
            self.world.camera,
            self._eyes,
            self.world.robots,
            clock=clock,
        )
        self.server = ConsoleServer(self.live, port=0, limits=ConsoleLimits(silence_s=SILENCE_S))
        self._life = ExitStack()

    def _limit(self) -> float:
        """Until when the world may run on without being looked at."""
        if self.tick is None:
            return inf
        return min(self.image_t + LOOKS_S, self.tick.t + STEPS_S)

    def _hear(self, tick: SessionTick) -> None:
        shown = self.live.image()
        if shown is not None:
            self.tick, self.image_t = tick, shown.t

    def truth(self, name: str = "red") -> RobotTruth:
        """Where a robot really is."""
        return self.world.truth(name)

    def speed(self, name: str = "red") -> float:
        """How fast it really is, either way [m/s]."""
        return abs(self.truth(name).v)

    def off(self, goal: tuple[float, float], name: str = "red") -> tuple[float, float]:
        """How far it really is from a pixel [px], and on the ground [m]."""
        truth, there = self.truth(name), self.camera.unproject(np.array(goal))
        return hypot(*(truth.uv - goal)), hypot(*(truth.xy - there))

    def far(self, *goals: tuple[float, float]) -> tuple[float, float]:
        """Of some pixels the one that red has farthest to go to."""
        return max(goals, key=lambda goal: self.off(goal)[1])

    def settle(self) -> None:
        """Let go of everything; wait until all stand."""
        for order in (Release(), SetFences(), Gone()):
            self.live.submit("tests", order)
        until(lambda: self.tick is not None and self.tick.mode == "idle", PATIENCE_S)
        until(lambda: max(self.speed("red"), self.speed("blue")) < 0.01, PATIENCE_S)

    def __enter__(self) -> Self:
        with self._life as life:
            life.enter_context(self._eyes)
            life.enter_context(self.world)
            life.callback(self.live.close)
            self.live.listen(self._hear)
            self.live.start()
            life.enter_context(self.server)
            until(lambda: self.tick is not None, PATIENCE_S)
            self._life = life.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._life.close()


class Console:
    """A page of the console, and what a person does there."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.faults: list[str] = []
        """What the browser complained of: errors, and what the page's policy forbids."""
        page.on("console", self._hear)
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.set_default_timeout(PATIENCE_S * 1000)

    def _hear(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning") and "GL Driver Message" not in message.text:
            self.faults.append(message.text)

    def open(self, url: str) -> Console:
        """Load it; wait for the first image."""
        self.page.goto(url)
        return self.until(
            "image !== null && airground.state !== null && airground.calibration !== null"
        )

    def get(self, what: str) -> Any:
        """Something that the page knows, as `state.mode`."""
        return self.page.evaluate(f"window.airground.{what}")

    def until(self, what: str, patience_s: float = PATIENCE_S) -> Console:
        """Wait until something that the page knows is true."""
        return self.wait(lambda: self._true(what), patience_s, what)

    def wait(
        self, condition: Callable[[], bool], patience_s: float = PATIENCE_S, what: str = "it"
    ) -> Console:
        """Wait for anything; where it does not come, tell what the page knows."""
        try:
            until(condition, patience_s)
        except AssertionError:
            told = self.page.evaluate("airground.events.slice(-12).map((one) => one.line)")
            known = ("state", "calibration", "controls", "connection", "stopPending")
            told += [f"{one}: {self.get(one)}" for one in known]
            pytest.fail("\n".join([f"never came: {what}", *told]))
        return self

    def _true(self, what: str) -> bool:
        # Not by Playwright's own wait: it evaluates inside of the page, which the page's policy forbids.
        self.page.wait_for_timeout(POLL_MS)
        return bool(self.page.evaluate(f"Boolean(window.airground?.{what})"))

    def by(self, name: str) -> Locator:
        """A part of the page."""
        return self.page.get_by_test_id(name)

    def click(self, name: str) -> None:
        """Press a button."""
        self.by(name).click()

    def take(self) -> Console:
        """Take the controls."""
        self.click("take-controls")
        return self.until("controls?.you")

    def at(self, uv: tuple[float, float]) -> tuple[float, float]:
        """Where a pixel of the image is in the window."""
        x, y = self.get(f"viewFromImage({uv[0]}, {uv[1]})")
        return x, y

    def click_at(self, uv: tuple[float, float]) -> None:
        """Click a pixel of the image."""
        self.page.mouse.click(*self.at(uv))

    def draw(self, points: list[tuple[float, float]]) -> None:
        """Draw a line with the mouse, through pixels of the image."""
        seen = [self.at(uv) for uv in points]
        self.page.mouse.move(*seen[0])
        self.page.mouse.down()
        for xy in seen[1:]:
            self.page.mouse.move(*xy)
        self.page.mouse.up()

    def touch(self, points: list[tuple[float, float]]) -> None:
        """Draw a line with a finger."""
        finger = self.page.context.new_cdp_session(self.page)
        seen = [self.at(uv) for uv in points]
        for kind, one in [("touchStart", seen[0]), *(("touchMove", xy) for xy in seen[1:])]:
            place = {"x": one[0], "y": one[1]}
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [place]})
        finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        finger.detach()

    def release(self) -> None:
        """Hold the button that lets go of STOP."""
        self.by("release").hover()
        self.page.mouse.down()
        self.until("state.mode !== 'stopped'")
        self.page.mouse.up()

    def layout(self) -> list[str]:
        """What is wrong with it: texts over each other, cut, outside."""
        faults: list[str] = self.page.evaluate(OVERLAPS)
        return faults


def curve(start: tuple[float, float], end: tuple[float, float]) -> list[tuple[float, float]]:
    """A line as a hand draws it, with a bend."""
    a, b = np.array(start), np.array(end)
    across = np.array([-(b - a)[1], (b - a)[0]]) * 0.12
    share = np.linspace(0, 1, 30)[:, None]
    points = a + share * (b - a) + np.sin(2 * np.pi * share) * across
    return [(float(u), float(v)) for u, v in points]


def off_line(points: list[list[float]], uv: FloatArray) -> float:
    """How far a place is from a line through points [px]."""
    line = np.array(points)[:, :2]
    begin, way = line[:-1], np.diff(line, axis=0)
    along = ((uv - begin) * way).sum(axis=1) / np.maximum((way**2).sum(axis=1), 1e-9)
    nearest = begin + np.clip(along, 0, 1)[:, None] * way
    return float(np.linalg.norm(nearest - uv, axis=1).min())

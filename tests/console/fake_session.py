"""A session that only pretends, for the console's server: robots go in circles, and orders are written down.

`python -m console.fake_session --port 8000` in the folder of the tests serves the console with it.
"""

from __future__ import annotations

import argparse
import math
import threading
import time
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import Calibration, Fit, Observability
from airground.control import Limits, VelocityCommand
from airground.geometry import LimitedHomography
from airground.session.handle import RobotInfo, ShownImage, SiteView
from airground.session.orders import SetFences, SetSpeed, Sketch, Stop
from airground.session.tick import (
    CalibrationView,
    CameraView,
    OtherView,
    PathView,
    RobotView,
    SessionEvent,
    SessionTick,
)
from scenes import scene

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.session.orders import Order
    from airground.vision.frame import ImageArray

SIZE = (1280, 720)
FPS = 30.0


def calibration_for(tilt_deg: float = 50.0) -> Calibration:
    """The calibration of a camera that looks down at an angle, taken as exact."""
    here = scene(tilt_deg=tilt_deg, height=6.0)
    return Calibration(
        model=LimitedHomography(here.g),
        covariance=np.zeros((6, 6)),
        origin_px=np.array([640.0, 400.0]),
        fit=Fit("linear", 0.5, 1000, 1.0, 0.4),
        observability=Observability("ok", 0.01, (1.0,) * 6, ""),
        image_size_px=SIZE,
    )


def robot_view(name: str = "one", **changes: Any) -> RobotView:
    """A robot at rest."""
    at_rest = RobotView(
        name=name,
        uv=(600.123456, 400.0),
        covariance=(0.25, 0.01, 0.3),
        ahead_uv=(650.0, 410.0),
        heading_rad=0.5,
        speed_mps=0.0,
        turn_radps=0.0,
        seen_s=0.02,
        heard_s=0.01,
        task="none",
        done=False,
        progress=0.0,
        goals_px=(),
        error_m=None,
        error_px=None,
        command=VelocityCommand(0.0, 0.0),
        stop="",
        stop_reason="",
        speed_limit_mps=0.4,
    )
    return replace(at_rest, **changes)


def make_tick(t: float = 0.0, **changes: Any) -> SessionTick:
    """A tick in which four robots and ten others move."""
    robots = []
    for k in range(4):
        angle = 0.3 * t + k * math.pi / 2
        u, v = 640 + 250 * math.cos(angle), 400 + 130 * math.sin(angle)
        ahead = (u - 40 * math.sin(angle), v + 25 * math.cos(angle))
        robots.append(
            robot_view(f"robot-{k}", uv=(u, v), ahead_uv=ahead, speed_mps=0.3, turn_radps=0.3)
        )
    others = tuple(
        OtherView(
            f"other-{k}",
            (100.0 * k + 5 * math.sin(t), 600.0),
            (0.5, 0.0, 0.5),
            (0.1, 0.2),
            0.2236,
            0.01,
            (100.0 * k, 620.0),
        )
        for k in range(10)
    )
    tick = SessionTick(
        t=t,
        number=round(t * 50),
        mode="idle",
        why="",
        stop_heard=0,
        commands={},
        robots=tuple(robots),
        others=others,
        camera=CameraView("live", "", 0.02, FPS, round(t * FPS), SIZE),
        calibration=CalibrationView("calibrated", 0.012, 1),
        paths=(),
        stages_ms={"detect": 4.25, "track": 1.5, "control": 0.8},
    )
    return replace(tick, **changes)


@cache
def picture() -> ImageArray:
    """Waves, with the noise of a camera."""
    v, u = np.ogrid[0 : SIZE[1], 0 : SIZE[0]]
    ground = 120 + 25 * np.sin(u / 31.0) * np.sin(v / 23.0)
    noise = np.random.default_rng(0).integers(-5, 6, (*ground.shape, 3))
    image = (ground[..., None] + noise).astype(np.uint8)
    image.flags.writeable = False
    return image


class FakeSession:
    """Plays a session; `step` by hand, or `run` in a thread."""

    def __init__(self) -> None:
        limits = Limits()
        robots = tuple(RobotInfo(f"robot-{k}", "unicycle", 0.15, limits) for k in range(4))
        self.site = SiteView("pretended", robots, 50.0, 0.03)
        self.calibration: Calibration | None = calibration_for()
        self.recording = ""
        self.orders: list[tuple[str, Order]] = []
        self.changes: dict[str, Any] = {}
        self.listeners: list[Callable[[SessionTick], None]] = []
        self.listener_s: list[float] = []
        self._began = time.monotonic()
        self._end = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="fake-session", daemon=True)
        self._picture = picture()
        self._shown: ShownImage | None = None

    def now(self) -> float:
        return time.monotonic() - self._began

    def submit(self, client: str, order: Order) -> None:
        with self._lock:
            self.orders.append((client, order))
            self._pretend(order)

    def _pretend(self, order: Order) -> None:
        if isinstance(order, Stop):
            heard = self.changes.get("stop_heard", 0) + 1
            self.changes |= {"stop_heard": heard, "mode": "stopped", "why": "STOP was pressed"}
        elif isinstance(order, SetFences):
            revision = self.changes.get("fences_revision", 0) + 1
            fences = (order.stay_inside, order.keep_out)
            self.changes |= {"fences": fences, "fences_revision": revision}
        elif isinstance(order, Sketch):
            points = np.array([(*uv, 0.3) for uv in order.points_px])
            path = PathView(order.robot, order.sketch, points, (), 3.2, 11.0, 2.5)
            self.changes["paths"] = (path,)
        elif isinstance(order, SetSpeed):
            line = f"{order.robot} now drives at {order.speed_mps} m/s"
            self.changes["events"] = (SessionEvent(self.now(), "info", line, order.robot),)

    def listen(self, listener: Callable[[SessionTick], None]) -> Callable[[], None]:
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener)

    def image(self) -> ShownImage | None:
        t = self.now()
        index = int(t * FPS)
        shown = self._shown
        if shown is None or shown.index != index:
            shown = self._shown = ShownImage(self._picture, index, index / FPS, t)
        return shown

    def step(self, **changes: Any) -> SessionTick:
        """Say one tick to who listens."""
        with self._lock:
            tick = make_tick(self.now(), **(self.changes | changes))
            self.changes.pop("events", None)
        for listener in list(self.listeners):
            begun = time.perf_counter()
            listener(tick)
            self.listener_s.append(time.perf_counter() - begun)
        return tick

    def _run(self) -> None:
        while not self._end.wait(0.02):
            self.step()

    def run(self) -> FakeSession:
        self._thread.start()
        return self

    def end(self) -> None:
        self._end.set()
        self._thread.join(5.0)

    def asked(self, kind: str) -> list[str]:
        """Clients that gave orders of a kind, in order."""
        with self._lock:
            return [client for client, order in self.orders if order.kind == kind]


def main() -> None:
    from airground.console.server import ConsoleServer

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8000)
    parser.add_argument("--token")
    options = parser.parse_args()
    session = FakeSession().run()
    with ConsoleServer(session, options.host, options.port, options.token) as server:
        print(server.url, flush=True)
        try:
            server.wait()
        except KeyboardInterrupt:
            print("ending", flush=True)
    session.end()


if __name__ == "__main__":
    main()

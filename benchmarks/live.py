"""The live system under load: from a frame to a command, from a click on STOP to rest, and memory over time.

    python benchmarks/live.py latency            1280x720 rendered, four robots under way, console with one watcher
    python benchmarks/live.py stop               a click in a real browser, while both cores are kept busy
    python benchmarks/live.py memory --minutes 30

The session runs here as in `airground serve`; detector and tracker, and the embedded world that draws the pictures
and drives the robots, have processes of their own on the same computer. frame_to_command: from the frame in memory
to the last robot's command handed over; vision: detector and tracker, there and back; decide: from the inputs to the
commands; step: with what people are told. No peer is known that a user would run instead.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import statistics
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import Calibration, Fit, Observability
from airground.geometry import LimitedHomography
from airground.session.compose import LiveSite, plan_without_site
from airground.session.orders import Alive, DriveTo, Release, Stop
from airground.sim.live_options import EmbeddedOptions
from airground.sim.live_world import EmbeddedWorld

if TYPE_CHECKING:
    from airground.session.live import LiveSession
    from airground.session.tick import SessionTick

ME = "benchmark"
GOALS = ((420.0, 430.0), (860.0, 400.0), (560.0, 300.0), (760.0, 560.0), (480.0, 560.0))
SETTLE_S = 20.0


def true_calibration() -> Calibration:
    world = EmbeddedWorld(EmbeddedOptions(robots=1))
    model = LimitedHomography(world.camera.g)
    uv = np.array([640.0, 430.0])
    scale = np.abs(model.g).mean(axis=1)
    return Calibration(
        model=model,
        covariance=np.diag(np.repeat((1e-3 * scale) ** 2, 2)),
        origin_px=uv,
        fit=Fit("trajectory", 0.3, 1000, 1.0),
        observability=Observability("ok", 0.01, (1.0,), ""),
        time_offset_s=world.time_offset_s,
        image_size_px=(1280, 720),
    )


class Operator:
    """Sends robots from goal to goal, for ever."""

    def __init__(self, live: LiveSession) -> None:
        self._live = live
        self._turn: dict[str, int] = {}
        self._sent_t: dict[str, float] = {}
        self._newest: SessionTick | None = None
        self._ended = threading.Event()
        self.busy = True
        live.listen(self._take)
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def end(self) -> None:
        """Send nothing more."""
        self._ended.set()
        self._thread.join(2.0)

    def _take(self, tick: SessionTick) -> None:
        self._newest = tick

    def _run(self) -> None:
        while not self._ended.wait(0.2):
            self._live.submit(ME, Alive())
            tick = self._newest
            if tick is None or not self.busy or tick.mode == "stopped":
                continue
            for k, view in enumerate(tick.robots):
                late = tick.t - self._sent_t.get(view.name, -1e9) > 25.0
                if view.task == "none" or view.done or late:
                    turn = self._turn.get(view.name, k) + 1
                    self._turn[view.name] = turn
                    self._sent_t[view.name] = tick.t
                    self._live.submit(ME, DriveTo(view.name, (GOALS[turn % len(GOALS)],)))


def watcher(url: str, ended: Any) -> None:
    """Take images and states, as a page does."""
    import json

    from websockets.sync.client import connect
    from websockets.typing import Origin

    where = url.replace("http", "ws") + "ws"
    with connect(where, origin=Origin(url.rstrip("/")), max_size=None) as socket:
        socket.send(json.dumps({"kind": "hello", "version": 1, "name": "watcher"}))
        view = {"kind": "view", "image": True, "rate_hz": 15, "width_px": 1280}
        socket.send(json.dumps(view))
        while not ended.is_set():
            try:
                message = socket.recv(timeout=1.0)
            except TimeoutError:
                continue
            if isinstance(message, bytes):
                length = int.from_bytes(message[:4], "big")
                index = json.loads(message[4 : 4 + length])["index"]
                socket.send(json.dumps({"kind": "shown", "index": index}))


def spin(ended: Any) -> None:
    while not ended.is_set():
        np.linalg.svd(np.random.default_rng(0).normal(size=(60, 60)))


def open_live(stack: ExitStack, robots: int, record: Path | None = None) -> tuple[LiveSite, str]:
    from airground.console.server import ConsoleServer

    plan = plan_without_site(robots=robots)
    site = stack.enter_context(LiveSite(plan, true_calibration(), record=record, note=print))
    server = stack.enter_context(ConsoleServer(site.live, "127.0.0.1", 0))
    return site, server.url


def process(stack: ExitStack, target: Any, *arguments: Any) -> None:
    context = multiprocessing.get_context("spawn")
    ended = context.Event()
    child = context.Process(target=target, args=(*arguments, ended), daemon=True)
    child.start()
    stack.callback(child.join, 5.0)
    stack.callback(ended.set)


def latency(robots: int, seconds: float) -> None:
    with ExitStack() as stack:
        site, url = open_live(stack, robots)
        process(stack, watcher, url)
        operator = Operator(site.live)
        operator.start()
        stack.callback(operator.end)
        time.sleep(SETTLE_S)
        late, cpu, began = site.live.late_steps, time.process_time(), time.monotonic()
        kept: dict[str, list[float]] = {}
        site.live.stages.keep(kept)
        time.sleep(seconds)
        took = time.monotonic() - began
        load = os.getloadavg()[0]
        print(
            f"{robots} robots, 1280x720 at {len(kept['vision']) / took:.1f} Hz, {len(kept['step']) / took:.0f} "
            f"steps/s, {100 * (time.process_time() - cpu) / took:.0f} % of a core, {site.live.late_steps - late} steps "
            f"late by a period; load {load:.1f}"
        )
        print(f"{'ms':>18} {'median':>8} {'90 %':>8} {'99 %':>8} {'worst':>8}")
        for name in ("vision", "decide", "step", "frame_to_command"):
            row = np.percentile(1e3 * np.array(kept[name]), [50, 90, 99, 100])
            print(f"{name:>18} " + " ".join(f"{value:8.1f}" for value in row))


def stop(robots: int, rounds: int) -> None:
    """Click STOP in Chromium; the browser's clock and ours are one, as both run here."""
    from playwright.sync_api import sync_playwright

    with ExitStack() as stack:
        site, url = open_live(stack, robots)
        operator = Operator(site.live)
        operator.start()
        stack.callback(operator.end)
        told: dict[str, list[tuple[float, bool]]] = {name: [] for name in site.robots}

        def watch(name: str, robot: Any) -> None:
            send, halt = robot.send, robot.stop

            def sends(command: Any) -> Any:
                sent = send(command)
                told[name].append((time.time(), sent.at_rest))
                return sent

            def halts() -> None:
                halt()
                told[name].append((time.time(), True))

            robot.send, robot.stop = sends, halts

        for one in site.robots.items():
            watch(*one)
        heard: list[float] = []
        submit = site.live.submit

        def hear(client: str, order: Any) -> None:
            if isinstance(order, Stop):
                heard.append(time.time())
            submit(client, order)

        site.live.submit = hear  # type: ignore[method-assign]
        for _ in range(os.cpu_count() or 1):
            process(stack, spin)
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(url)
        page.get_by_test_id("stop").wait_for()
        page.evaluate(
            "document.querySelector('[data-testid=stop]').addEventListener('pointerdown', "
            "() => { window.pressedAt = Date.now(); }, true)"
        )
        time.sleep(SETTLE_S)
        took, came = [], []
        for _ in range(rounds):
            time.sleep(4.0)
            heard.clear()
            page.get_by_test_id("stop").click()
            time.sleep(1.0)
            pressed = page.evaluate("window.pressedAt") / 1e3
            rest = [stands(commands, pressed) for commands in told.values()]
            took.append(1e3 * (max(rest) - pressed))
            came.append(1e3 * ((heard[0] if heard else float("nan")) - pressed))
            for commands in told.values():
                commands.clear()
            site.live.submit(ME, Release())
        browser.close()
        print(
            f"STOP, from the press in the browser to rest commanded to all {robots} robots, {rounds} times, load "
            f"{os.getloadavg()[0]:.1f}: median {statistics.median(took):.0f} ms, worst {max(took):.0f} ms; of these "
            f"in the browser and on its way {statistics.median(came):.0f} and {max(came):.0f} ms"
        )


def stands(commands: list[tuple[float, bool]], after: float) -> float:
    """When a robot was told to stand, and from then on nothing else."""
    since = None
    for when, at_rest in commands:
        if when >= after:
            since = (since or when) if at_rest else None
    return since or float("inf")


def memory(robots: int, minutes: float) -> None:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        site, url = open_live(stack, robots, folder / "session.mcap")
        process(stack, watcher, url)
        operator = Operator(site.live)
        operator.start()
        stack.callback(operator.end)
        page = os.sysconf("SC_PAGE_SIZE")
        began = time.monotonic()
        print(f"{'min':>6} {'RSS MB':>8} {'file MB':>8} {'threads':>8}")
        while (gone := time.monotonic() - began) < 60 * minutes:
            held = int(Path("/proc/self/statm").read_text("ascii").split()[1]) * page / 1e6
            size = (folder / "session.mcap").stat().st_size / 1e6
            print(
                f"{gone / 60:6.1f} {held:8.1f} {size:8.1f} {threading.active_count():8d}",
                flush=True,
            )
            time.sleep(min(60.0, 60 * minutes / 10))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("what", choices=("latency", "stop", "memory"), nargs="?", default="latency")
    parser.add_argument("--robots", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--rounds", type=int, default=20)
    arguments = parser.parse_args()
    if arguments.what == "latency":
        latency(arguments.robots, arguments.seconds)
    elif arguments.what == "stop":
        stop(arguments.robots, arguments.rounds)
    else:
        memory(arguments.robots, arguments.minutes)


if __name__ == "__main__":
    main()

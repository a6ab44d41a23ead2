"""Make the pictures of the operator's console in docs/images: a browser, the embedded world, and a person's hand.

Run: python docs/console_pictures.py; needs Chromium and a computer that does nothing else. Five minutes. With --again
it begins with the calibration of the last time, and leaves out the pictures of making one.
"""

from __future__ import annotations

import shutil
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from playwright.sync_api import TimeoutError as LateError
from playwright.sync_api import sync_playwright

from airground.console.limits import ConsoleLimits
from airground.console.server import ConsoleServer
from airground.control.safety.bounds import SafetyBounds
from airground.records.calibration_file import load_calibration, save_calibration
from airground.session.compose import LiveSite, plan_without_site

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Browser, Page

IMAGES = Path(__file__).parent / "images"
KNOWN = Path("out") / "console-calibration.json"
LAPTOP, PHONE = (1280, 720), (390, 844)
PATIENCE_S = 600.0
FAR = (460.0, 580.0), (420.0, 330.0)  # where to go from above, and from below
FRESH_S = 8.0
COLOURS, GREY = 120, 100  # of each half of a palette; saturation between them
LONG_LEG = (
    "((c) => c.phase === 'running' && /driving|turning/.test(c.advice) && c.leg_to_px && "
    "Math.hypot(c.leg_to_px[0] - c.leg_from_px[0], c.leg_to_px[1] - c.leg_from_px[1]) > 70)"
    "(airground.calibration)"
)
ARGUMENTS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENT = SafetyBounds(tick_s=2.0, track_s=4.0, camera_s=4.0, operator_s=4.0, robot_s=4.0)


def until(page: Page, what: str) -> None:
    """Wait until something that the page knows is true."""
    end = time.monotonic() + PATIENCE_S
    while not page.evaluate(f"Boolean(window.airground?.{what})"):
        if time.monotonic() > end:
            sys.exit(f"never came: {what}")
        page.wait_for_timeout(50)


def at(page: Page, u: float, v: float) -> tuple[float, float]:
    """Where a pixel of the image is in the window."""
    x, y = page.evaluate(f"window.airground.viewFromImage({u}, {v})")
    return x, y


def draw(page: Page, points: list[tuple[float, float]]) -> None:
    """Draw a line."""
    page.mouse.move(*at(page, *points[0]))
    page.mouse.down()
    for uv in points[1:]:
        page.mouse.move(*at(page, *uv))
    page.mouse.up()


def waves(
    start: tuple[float, float], end: tuple[float, float], high: float
) -> list[tuple[float, float]]:
    """A sketch with two bends."""
    share = np.linspace(0, 1, 50)[:, None]
    a, b = np.array(start), np.array(end)
    across = np.array([-(b - a)[1], (b - a)[0]]) / np.hypot(*(b - a))
    line = a + share * (b - a) + high * np.sin(2 * np.pi * share) * across
    return [(float(u), float(v)) for u, v in line]


def uv_of(page: Page, robot: int) -> tuple[float, float]:
    """Where a robot is."""
    u, v = page.evaluate(f"window.airground.state.robots[{robot}].uv")
    return u, v


def keep(page: Page, name: str) -> None:
    """Write a picture, small."""
    for toast in page.get_by_test_id("toast").all():
        with suppress(LateError):  # it has gone by itself
            toast.click(timeout=500)
    page.mouse.move(2, 2)
    end = time.monotonic() + FRESH_S
    while page.get_by_test_id("connection").get_attribute("data-state") != "live":
        if time.monotonic() > end:  # a busy computer; the picture says so
            break
        page.wait_for_timeout(50)
    page.wait_for_timeout(100)
    pixels = np.frombuffer(page.screenshot(), np.uint8)
    image = cv2.imdecode(pixels, cv2.IMREAD_COLOR)
    path = IMAGES / f"console-{name}.png"
    path.write_bytes(small(image))
    print(path.name, f"{path.stat().st_size / 1000:.0f} kB")


def small(image: Any) -> bytes:
    """PNG with a palette: half of it for the page's few bright colours, which a common one would lose."""
    from io import BytesIO

    from PIL import Image

    saturation = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)[..., 1]
    colours = []
    for part in (image[saturation < GREY], image[saturation >= GREY]):
        strip = Image.fromarray(np.ascontiguousarray(part[None, :, ::-1]))
        colours += (strip.quantize(COLOURS).getpalette() or [])[: 3 * COLOURS]
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours)
    buffer = BytesIO()
    paletted = Image.fromarray(np.ascontiguousarray(image[..., ::-1]))
    paletted.quantize(palette=palette, dither=Image.Dither.NONE).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def take(page: Page) -> None:
    """Take the controls."""
    page.get_by_test_id("take-controls").click()
    until(page, "controls?.you")


def sketch(page: Page, robot: str, points: list[tuple[float, float]]) -> None:
    """Draw a path for a robot; it is there when this returns."""
    before = page.evaluate(f"window.airground.paths.{robot}?.sketch ?? 0")
    page.get_by_test_id(f"robot-{robot}").click()
    page.get_by_test_id("tool-sketch").click()
    page.wait_for_timeout(500)  # what belongs to the tool is shown
    discard = page.get_by_test_id("discard-path")
    if discard.is_visible():  # a line that is there would be pulled
        discard.click()
    draw(page, points)
    until(page, f"paths.{robot}?.sketch > {before}")


def main() -> None:
    """Make them, one after the other in one session."""
    plan = plan_without_site()
    plan = replace(plan, options=replace(plan.options, bounds=PATIENT))
    limits = ConsoleLimits(silence_s=4.0)
    again = "--again" in sys.argv
    with (
        LiveSite(plan, load_calibration(KNOWN) if again else None) as site,
        ConsoleServer(site.live, port=0, limits=limits) as server,
        sync_playwright() as driver,
    ):
        program = shutil.which("chromium") or shutil.which("google-chrome")
        browser = driver.chromium.launch(executable_path=program, args=ARGUMENTS)

        def open_(size: tuple[int, int] = LAPTOP, name: str = "Ada", **options: Any) -> Page:
            page = page_of(browser, size, **options)
            page.goto(f"{server.url}#name={name}")
            until(page, "image && airground.calibration")
            return page

        page = open_()
        take(page)
        if not again:
            calibrate(page)
            KNOWN.parent.mkdir(exist_ok=True)
            assert site.live.calibration is not None
            save_calibration(KNOWN, site.live.calibration)
        driving(page)
        undrivable(page)
        birdseye(page)
        page.get_by_test_id("give-controls").click()
        page.context.close()
        light(open_(color_scheme="light"))
        second(open_)
        phone(open_)
        browser.close()


def page_of(browser: Browser, size: tuple[int, int], **options: Any) -> Page:
    """A fresh page."""
    given: dict[str, Any] = {"color_scheme": "dark"} | options
    given["viewport"] = {"width": size[0], "height": size[1]}
    return browser.new_context(**given).new_page()


def calibrate(page: Page) -> None:
    """From nothing to good enough."""
    page.get_by_test_id("tab-calibrate").click()
    keep(page, "start")
    page.get_by_test_id("calibrate-guided").click()
    until(page, f"calibration?.phase === 'good' || {LONG_LEG}")
    keep(page, "calibrating")
    until(page, "calibration.phase === 'good'")
    keep(page, "calibrated")
    page.get_by_test_id("calibration-keep").click()
    until(page, "calibration.rectify")
    page.get_by_test_id("tab-robots").click()


def driving(page: Page) -> None:
    """On a sketch, halfway."""
    page.get_by_test_id("robot-blue").click()
    page.get_by_test_id("tool-goal").click()
    page.mouse.click(*at(page, 960, 420))
    until(page, "state.mode === 'driving'")
    until(page, "state.mode === 'idle'")  # red has made way
    end = (620, 600) if uv_of(page, 0)[1] < 450 else (480, 300)
    sketch(page, "red", waves(uv_of(page, 0), end, 60))
    keep(page, "sketch")
    page.get_by_test_id("drive-path").click()
    until(page, "state.robots[0].progress > 0.5")
    keep(page, "driving")
    until(page, "state.robots[0].done")


def undrivable(page: Page) -> None:
    """A sketch through where nobody may be."""
    u, v = uv_of(page, 0)
    down = 1 if v < 450 else -1
    page.get_by_test_id("tool-keepout").click()
    for du, dv in ((-90, 90), (60, 75), (90, 130), (-70, 150)):
        page.mouse.click(*at(page, u + du, v + down * dv))
    page.get_by_test_id("polygon-close").click()
    until(page, "fences.keep_out.length === 1")
    sketch(page, "red", waves((u, v), (u - 30, v + down * 230), 40))
    keep(page, "undrivable")
    page.get_by_test_id("tool-keepout").click()
    page.mouse.click(*at(page, u, v + down * 110))
    page.get_by_test_id("polygon-delete").click()
    until(page, "fences.keep_out.length === 0")
    sketch(page, "red", waves((u, v), (u - 30, v + down * 230), 40))


def birdseye(page: Page) -> None:
    """The ground from above, large."""
    page.get_by_test_id("tool-goal").click()
    page.get_by_test_id("swap").click()
    page.wait_for_timeout(500)
    keep(page, "birdseye")
    page.get_by_test_id("swap").click()


def light(page: Page) -> None:
    """By day, and stopped."""
    take(page)
    page.get_by_test_id("robot-red").click()
    page.mouse.click(*at(page, *FAR[uv_of(page, 0)[1] > 450]))
    until(page, "state.robots[0].speed_mps > 0.2")
    page.keyboard.press("Space")
    until(page, "state.mode === 'stopped'")
    page.wait_for_timeout(500)
    keep(page, "stopped-light")
    page.get_by_test_id("release").hover()
    page.mouse.down()
    until(page, "state.mode !== 'stopped'")
    page.mouse.up()
    page.get_by_test_id("give-controls").click()
    page.context.close()


def second(open_: Callable[..., Page]) -> None:
    """Somebody else has the controls."""
    ada, ben = open_(name="Ada"), open_(name="Ben")
    take(ada)
    until(ben, "controls?.holder")
    ben.get_by_test_id("take-controls").click()
    keep(ben, "second")
    ada.context.close()
    ben.context.close()


def phone(open_: Callable[..., Page]) -> None:
    """In a hand."""
    page = open_(PHONE, has_touch=True, is_mobile=True, device_scale_factor=1)
    take(page)
    sketch(page, "red", waves(uv_of(page, 0), FAR[uv_of(page, 0)[1] > 450], 40))
    keep(page, "phone-sketch")
    page.get_by_test_id("drive-path").click()
    until(page, "state.robots[0].progress > 0.3")
    keep(page, "phone")
    page.context.close()


if __name__ == "__main__":
    main()

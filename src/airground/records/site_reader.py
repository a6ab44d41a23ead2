"""Read ``site.toml``, and say all that is wrong with it at once."""

from __future__ import annotations

import os
import re
import tomllib
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

from airground.control.limits import Limits
from airground.control.safety.bounds import SafetyBounds
from airground.errors import FileError
from airground.records.access import StrPath, file_error
from airground.records.site import (
    EMBEDDED,
    CalibrationSite,
    CameraSite,
    ConsoleSite,
    ControlSite,
    FenceSite,
    RecordSite,
    RobotSite,
    SeparationSite,
    Site,
    TimingSite,
)
from airground.records.site_lines import TomlLines
from airground.records.site_plain import choice, flag, shown, text, whole
from airground.records.site_robots import read_robot, refuse_pairs
from airground.records.site_table import Mistakes, Table
from airground.records.site_values import corners, crossing, existing, source_beside, within

__all__ = ["FORMAT", "SITE_KEYS", "read_site"]

FORMAT = "airground.site/1"
MAX_BYTES = 1_000_000
MOST_FENCES = 40

# What a site may say of when robots stop; the rest hangs together with the program.
SAFETY = (
    "camera_s",
    "track_s",
    "robot_s",
    "operator_s",
    "position_sigma_m",
    "heading_sigma_rad",
    "calibration_sigma",
    "image_margin_px",
    "fence_sigmas",
    "reaction_s",
    "speed_error_mps",
    "speed_error_share",
    "turn_error_radps",
    "turn_error_share",
    "response_s",
    "persist_s",
    "search_mps",
    "search_m",
    "good_ticks",
    "gentle",
)


def _keys(cls: type) -> tuple[str, ...]:
    return tuple(one.name for one in fields(cls))


SITE_KEYS: dict[str, tuple[str, ...]] = {
    "": ("format", *_keys(Site)),
    "cameras": _keys(CameraSite),
    "calibration": _keys(CalibrationSite),
    "robots": _keys(RobotSite),
    "robots.limits": _keys(Limits),
    "robots.timing": _keys(TimingSite),
    "control": _keys(ControlSite),
    "safety": SAFETY,
    "fences": _keys(FenceSite),
    "separation": _keys(SeparationSite),
    "record": _keys(RecordSite),
    "console": _keys(ConsoleSite),
}
"""Keys of each table, by its name."""


def read_site(path: StrPath) -> Site:
    """Read a site file.

    Parameters
    ----------
    path : path-like
        The file. Paths in it are relative to its folder.

    Returns
    -------
    site : Site
        Checked as far as that goes without opening anything.

    Raises
    ------
    FileError
        If it cannot be read or is not TOML.
    SiteError
        If something in it is wrong; its `lines` have one line for each mistake.
    """
    name = os.fspath(path)
    content = _content(name)
    try:
        document = tomllib.loads(content)
    except tomllib.TOMLDecodeError as error:
        raise _not_toml(name, str(error), content) from error
    except RecursionError as error:
        raise FileError(name, "is nested too deeply") from error
    mistakes = Mistakes(name, TomlLines(content))
    _check_format(mistakes, document)
    site = _site(Table(mistakes, "", document, SITE_KEYS[""]), Path(name).absolute().parent)
    mistakes.raise_any()
    return site


def _content(name: str) -> str:
    try:
        with Path(name).open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise file_error(name, error, "read") from error
    if len(data) > MAX_BYTES:
        raise FileError(name, f"is longer than {MAX_BYTES} bytes; expected a site in TOML")
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        problem = f"byte 0x{data[error.start]:02x} is not UTF-8; save the file as UTF-8"
        raise FileError(name, problem, line=line) from error


def _not_toml(name: str, message: str, content: str) -> FileError:
    at = re.search(r" \(at line (\d+), column \d+\)", message)
    line = int(at[1]) if at else content.count("\n") + 1 if "end of document" in message else None
    said = re.sub(r" \(at .*\)", "", message)
    return FileError(name, f"is not TOML: {said[:1].lower()}{said[1:]}", line=line)


def _check_format(mistakes: Mistakes, document: dict[str, Any]) -> None:
    """A file of another version is not looked at any further: all in it may be right there."""
    found = document.get("format")
    if found == FORMAT:
        return
    if found is None:
        problem = f'is missing; the file must begin with: format = "{FORMAT}"'
    else:
        problem = f'found {shown(found)}, expected "{FORMAT}"'
        if isinstance(found, str) and found.startswith("airground.site/"):
            problem += "; update airground"
    mistakes.add("format", problem)
    if found is not None:
        mistakes.raise_any()


def _site(top: Table, folder: Path) -> Site:
    cameras = [_camera(one, folder) for one in top.tables("cameras", SITE_KEYS["cameras"])]
    if len(cameras) > 1:
        top.mistakes.add("cameras[1]", "a second camera; this version takes exactly one")
    robots = top.tables("robots", SITE_KEYS["robots"])
    for key, found in (("cameras", cameras), ("robots", robots)):
        if not found and isinstance(top.value.get(key, []), list):
            top.wrong(key, f"is missing; a site has one [[{key}]] at least")
    members = tuple(
        read_robot(one, SITE_KEYS["robots.limits"], SITE_KEYS["robots.timing"]) for one in robots
    )
    refuse_pairs(robots, members)
    links = [robot.link for robot in members if robot.link]
    source = cameras[0].source if cameras else ""
    if source and any((link == EMBEDDED) != (source == EMBEDDED) for link in links):
        problem = f'either the source and the links of all robots are "{EMBEDDED}", or none of them'
        top.mistakes.add("cameras[0].source", problem)
    bounds: SafetyBounds = top.table("safety", SITE_KEYS["safety"]).build(SafetyBounds)
    return Site(
        name=top.need("name", text, "site"),
        cameras=tuple(cameras),
        robots=members,
        calibration=_calibration(top.table("calibration", SITE_KEYS["calibration"]), folder),
        control=_control(top.table("control", SITE_KEYS["control"])),
        safety=bounds,
        fences=_fences(top),
        separation=_separation(top.table("separation", SITE_KEYS["separation"])),
        record=_record(top, folder),
        console=_console(top.table("console", SITE_KEYS["console"]), folder),
    )


def _camera(table: Table, folder: Path) -> CameraSite:
    return CameraSite(
        source=table.need("source", partial(source_beside, folder=folder), ""),
        name=table.get("name", text, "camera"),
        detector=table.get("detector", text, "auto"),
        rate_hz=table.get("rate_hz", within(0.1, 1000.0), None),
        stabilize=table.get("stabilize", flag, False),
    )


def _calibration(table: Table, folder: Path) -> CalibrationSite:
    base = CalibrationSite()
    return CalibrationSite(
        file=table.get("file", partial(existing, folder=folder), None),
        wanted_sigma=table.get("wanted_sigma", within(0.001, 0.5), base.wanted_sigma),
        lens=table.get("lens", choice("auto", "none", "division"), base.lens),
    )


def _control(table: Table) -> ControlSite:
    return ControlSite(rate_hz=table.get("rate_hz", within(5.0, 1000.0), ControlSite().rate_hz))


def _fences(top: Table) -> tuple[FenceSite, ...]:
    tables = top.tables("fences", SITE_KEYS["fences"])
    if len(tables) > MOST_FENCES:
        top.wrong("fences", f"found {len(tables)}, expected {MOST_FENCES} at most")
    fences = []
    for table in tables:
        side: Any = table.need("kind", choice("stay_inside", "keep_out"), "keep_out")
        polygon = table.need("corners_px", corners, ())
        if polygon and (problem := crossing(polygon)):
            table.wrong("corners_px", problem)
        fences.append(FenceSite(side, polygon))
    return tuple(fences)


def _separation(table: Table) -> SeparationSite:
    base = SeparationSite()
    return SeparationSite(
        margin_m=table.get("margin_m", within(0.0, 10.0), base.margin_m),
        others_radius_m=table.get("others_radius_m", within(0.01, 50.0), base.others_radius_m),
    )


def _record(top: Table, folder: Path) -> RecordSite | None:
    if "record" not in top.value:
        return None
    table = top.table("record", SITE_KEYS["record"])
    where = table.need("folder", text, ".")
    images: Any = table.get("images", choice("none", "some", "all"), "some")
    return RecordSite(folder / where, images, table.get("image_hz", within(0.01, 1000.0), 2.0))


def _console(table: Table, folder: Path) -> ConsoleSite:
    base = ConsoleSite()
    port = table.get("port", whole, base.port)
    if not 0 < port < 65536:
        table.wrong("port", f"found {port}, expected a port from 1 to 65535")
    return ConsoleSite(
        host=table.get("host", text, base.host),
        port=port,
        token_file=table.get("token_file", partial(existing, folder=folder), None),
    )

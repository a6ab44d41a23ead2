"""site.toml: what it says, and each mistake as one line with its place."""

from __future__ import annotations

import re
from dataclasses import MISSING, fields
from pathlib import Path

import pytest

from airground.control.estimation.options import StateOptions
from airground.control.limits import Limits
from airground.control.safety.bounds import SafetyBounds
from airground.errors import FileError
from airground.records.site import (
    CalibrationSite,
    CameraSite,
    ConsoleSite,
    ControlSite,
    RecordSite,
    RobotSite,
    SeparationSite,
    Site,
    TimingSite,
)
from airground.records.site_reader import SITE_KEYS, read_site
from airground.records.site_table import SiteError

SMALL = """\
format = "airground.site/1"
name = "yard"
[[cameras]]
source = "0"
[[robots]]
name = "red"
track = 7
link = "udp://10.0.0.5:9000"
"""


def read(folder: Path, text: str) -> Site:
    path = folder / "site.toml"
    path.write_bytes(text.encode())
    return read_site(path)


def mistakes(folder: Path, text: str) -> list[str]:
    """Lines of the mistakes, without the file's name."""
    with pytest.raises(SiteError) as caught:
        read(folder, text)
    error = caught.value
    start = f"{folder / 'site.toml'}:"
    assert all(line.startswith(start) and "\n" not in line for line in error.lines)
    assert str(error).count("\n") == 0
    assert str(error) == error.lines[0] + "".join(f"; {line}" for line in error.lines[1:])
    return [line.removeprefix(start).strip() for line in error.lines]


def test_the_example_has_every_key(root: Path) -> None:
    path = root / "examples" / "site.toml"
    site = read_site(path)
    assert (site.name, len(site.robots), len(site.fences)) == ("hall 3", 2, 2)
    red, blue = site.robots
    assert red.link == "udp://192.168.0.31:7001?timeout_s=0.3"
    assert (red.track, red.timing.actuation_delay_s, red.lever_arm_m) == ("0", 0.08, (0.05, 0.0))
    assert blue.limits == Limits(speed_mps=0.8, turn_radius_m=0.9)
    assert site.record is not None
    assert site.record.folder == path.parent / "recordings"
    text = path.read_text("utf-8")
    for table, keys in SITE_KEYS.items():
        left_out = {"cameras": {"rate_hz"}, "safety": set(keys)}.get(table, set())
        for key in set(keys) - left_out:
            assert re.search(rf"^[# \[]*(\w+\.)?{key}\b", text, re.MULTILINE), f"{table} {key}"


def test_a_small_site_has_the_defaults_of_the_program(tmp_path: Path) -> None:
    site = read(tmp_path, SMALL)
    assert site.cameras == (CameraSite("0"),)
    assert site.robots == (RobotSite("red", "7", "udp://10.0.0.5:9000"),)
    assert (site.calibration, site.control) == (CalibrationSite(), ControlSite())
    assert (site.safety, site.separation) == (SafetyBounds(), SeparationSite())
    assert (site.record, site.console, site.fences) == (None, ConsoleSite(), ())
    base = StateOptions()
    assert TimingSite() == TimingSite(base.actuation_delay_s, base.speed_lag_s, base.turn_lag_s)


def test_paths_are_relative_to_the_site_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = tmp_path / "there"
    there.mkdir()
    (there / "c.json").write_text("{}")
    monkeypatch.chdir(tmp_path)
    text = SMALL.replace('"0"', '"film.mp4"') + (
        '[calibration]\nfile = "c.json"\n[record]\nfolder = "out"\n[console]\ntoken_file = "c.json"\n'
    )
    (there / "site.toml").write_text(text)
    for site in (read_site(there / "site.toml"), read_site("there/site.toml")):
        assert site.calibration.file == site.console.token_file == there / "c.json"
        assert site.record == RecordSite(there / "out")
        assert site.cameras[0].source == str(there / "film.mp4")
    absolute = read(tmp_path, SMALL.replace('"0"', '"/dev/video0"'))
    assert absolute.cameras[0].source == "/dev/video0"


@pytest.mark.parametrize("source", ["0", "usb:1", "rtsp://u:p@cam/1", "embedded"])
def test_sources_that_are_no_files_stay(tmp_path: Path, source: str) -> None:
    text = SMALL.replace('"0"', f'"{source}"')
    if source == "embedded":
        text = text.replace("udp://10.0.0.5:9000", "embedded")
    assert read(tmp_path, text).cameras[0].source == source


def test_all_mistakes_are_told_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = """\
format = "airground.site/1"
nmae = "yard"
[[cameras]]
source = "0"
[[cameras]]
source = "1"
[[robots]]
name = "red"
track = 7
link = "udp://10.0.0.5:9000"
limits = { speed_mps = "fast", reverse_mps = -1 }
lever_arm_m = [1,
  2, 3]
[robots.timing]
turn_lag_s = nan
[[robots]]
name = "red"
track = "7"
link = "udp://10.0.0.5:9000"
limits.speed_mps = true
[safety]
good_ticks = 1.5
camera_s = inf
operator_s = -1
"""
    assert mistakes(tmp_path, text) == [
        "name: is missing",
        "2: nmae: unknown key; did you mean name?",
        "5: cameras[1]: a second camera; this version takes exactly one",
        '11: robots[0].limits.speed_mps: found "fast", expected a number',
        "11: robots[0].limits.reverse_mps: must be 0 or more and finite, not -1.0",
        "12: robots[0].lever_arm_m: found [1, 2, 3], expected two numbers: [1.0, 2.0]",
        "15: robots[0].timing.turn_lag_s: found nan, expected a finite number",
        "17: robots[1].name: the same name as robots[0].name; each robot needs its own",
        "18: robots[1].track: the same track as robots[0].track; each robot needs its own",
        "19: robots[1].link: the same address as robots[0].link; each robot needs its own",
        "20: robots[1].limits.speed_mps: found true, expected a number",
        "22: safety.good_ticks: found 1.5, expected a whole number",
        "23: safety.camera_s: found inf, expected a finite number",
        "24: safety.operator_s: must be 0 or more, not -1.0",
    ]


ROBOT = '[[robots]]\nname = "b"\ntrack = 8\nlink = "udp://10.0.0.6:9000{}"\n'
OTHER = ROBOT.replace("8", "9").replace('"b"', '"c"')


@pytest.mark.parametrize(
    ("added", "want"),
    [
        ("[safety]\ntick_s = 1", "10: safety.tick_s: unknown key; did you mean track_s?"),
        ("[contrl]\nrate_hz = 50", "9: contrl: unknown key; did you mean control?"),
        ("[zzz]", "9: zzz: unknown key; known are format, name,"),
        ("[control]\nrate_hz = 2", "10: control.rate_hz: found 2, expected a number from 5 to 1000"),
        ("control = 3", "9: robots[0].control: unknown key; known are name, track,"),
        ('[record]\nfolder = "r"\nimages = "key"', '11: record.images: found "key", expected "none" or "some"'),
        ("[record]", "9: record.folder: is missing"),
        ("[console]\nport = 70000", "10: console.port: found 70000, expected a port from 1"),
        ("[console]\nport = 80.0", "10: console.port: found 80.0, expected a whole number"),
        ('[calibration]\nfile = "no.json"', '10: calibration.file: found "no.json", expected a file'),
        ('[calibration]\nlens = "fish"', '10: calibration.lens: found "fish", expected "auto" or'),
        ("[[fences]]\ncorners_px = [[0, 0], [9, 0], [9, 9]]", "9: fences[0].kind: is missing"),
        (
            '[[fences]]\nkind = "keep_out"\ncorners_px = [[0, 0], [9, 9], [9, 0], [0, 9]]',
            "11: fences[0].corners_px: the sides cross",
        ),
        (
            '[[fences]]\nkind = "keep_out"\ncorners_px = [[0, 0], [9, 9], [5, 5]]',
            "11: fences[0].corners_px: the corners enclose nothing",
        ),
        (
            '[[fences]]\nkind = "keep_out"\ncorners_px = [[0, 0], [9, "9"], [5, 5]]',
            "11: fences[0].corners_px: found [[0, 0], [9, '9'], [5, 5]], expected corners of two",
        ),
        (
            '[[fences]]\nkind = "keep_out"\ncorners_px = [[0, 0], [9, 9]]',
            "11: fences[0].corners_px: found [[0, 0], [9, 9]], expected 3 to 100 corners",
        ),
        ("[fences]\n", "9: fences: found a table, expected a list of tables: [[fences]]"),
        ('kind = "ackermann"', "robots[0].limits.turn_radius_m: an ackermann robot needs one"),
        ('kind = "tank"', '9: robots[0].kind: found "tank", expected "unicycle" or'),
        ("speed_mps = 0.7", "9: robots[0].speed_mps: found 0.7, above limits.speed_mps = 0.5"),
        ('color = "red"', '9: robots[0].color: found "red", expected a colour as "#rrggbb"'),
        ("radius_m = 0", "9: robots[0].radius_m: found 0, expected a number from 0.01 to 50"),
        ("limits = 3", "9: robots[0].limits: found a number, expected a table"),
        (ROBOT.format("?rate_hz=0"), '12: robots[1].link: found "udp://10.0.0.6:9000?rate_hz=0"'),
        (ROBOT.format("?rate=9"), "12: robots[1].link: "),
        (ROBOT.format("/path"), "12: robots[1].link: "),
        (ROBOT.format("0"), "12: robots[1].link: "),
        (ROBOT.replace("udp", "tcp").format(""), "12: robots[1].link: "),
        (
            ROBOT.replace("udp://10.0.0.6:9000{}", "embedded"),
            '4: cameras[0].source: either the source and the links of all robots are "embedded"',
        ),
        (
            ROBOT.format("?rate_hz=9") + OTHER.format("?lost_s=2"),
            "16: robots[2].link: the same address as robots[1].link",
        ),
    ],
)  # fmt: skip
def test_one_mistake_is_one_line(tmp_path: Path, added: str, want: str) -> None:
    text = SMALL + added + "\n"
    found = mistakes(tmp_path, text.replace("\n", "\r\n") if "port" in added else text)
    assert len(found) == 1, found
    assert want in found[0]


@pytest.mark.parametrize(
    ("text", "line", "match"),
    [
        ("", None, "format: is missing; the file must begin with"),
        ('format = "airground.site/2"\nx = 1', 1, 'found "airground.site/2".*update airground'),
        ("format = 1", 1, 'format: found 1, expected "airground.site/1"'),
        ('format = "airground.site/1"\nname = ', 2, "is not TOML: invalid value"),
        ("a = 1\na = 2", 2, "is not TOML: cannot overwrite a value"),
        ('a = "', 1, "is not TOML"),
        ("a = " + "[" * 5000, None, "not TOML|nested"),
    ],
)
def test_what_is_no_site_is_refused(
    tmp_path: Path, text: str, line: int | None, match: str
) -> None:
    with pytest.raises(FileError, match=match) as caught:
        read(tmp_path, text)
    assert caught.value.line == line
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="there is no such file"):
        read_site(tmp_path / "none.toml")
    (tmp_path / "site.toml").write_bytes(b'format = "x"\nname = "\xff"')
    with pytest.raises(FileError, match="0xff is not UTF-8") as caught:
        read_site(tmp_path / "site.toml")
    assert caught.value.line == 2
    (tmp_path / "site.toml").write_bytes(b"#" * 1_000_001)
    with pytest.raises(FileError, match="longer than"):
        read_site(tmp_path / "site.toml")


def test_every_key_stands_in_the_docs_and_nothing_else(root: Path) -> None:
    page = (root / "docs" / "site.md").read_text("utf-8")
    sections = re.split(r"^## ", page, flags=re.MULTILINE)[1:]
    documented = {}
    for section in sections:
        title = re.match(r"`\[+([\w.]+)\]+`|The file itself", section)
        assert title is not None, section[:40]
        documented[title[1] or ""] = tuple(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE))
    assert {key: set(value) for key, value in documented.items()} == {
        key: set(value) for key, value in SITE_KEYS.items()
    }
    assert all(len(set(value)) == len(value) for value in documented.values())


DEFAULTS = {
    "cameras": CameraSite,
    "calibration": CalibrationSite,
    "robots": RobotSite,
    "robots.limits": Limits,
    "robots.timing": TimingSite,
    "control": ControlSite,
    "safety": SafetyBounds,
    "separation": SeparationSite,
    "record": RecordSite,
    "console": ConsoleSite,
}


@pytest.mark.parametrize("table", DEFAULTS)
def test_the_docs_have_the_defaults(root: Path, table: str) -> None:
    page = (root / "docs" / "site.md").read_text("utf-8")
    title = re.search(rf"^## `\[+{re.escape(table)}\]+`$", page, re.MULTILINE)
    assert title is not None
    section = page[title.end() :].split("\n## ")[0]
    told = dict(re.findall(r"^\| `(\w+)` \| ([^|]*) \|", section, re.MULTILINE))
    for one in fields(DEFAULTS[table]):
        if one.name not in told or one.default is None or one.default_factory is not MISSING:
            continue
        said = told[one.name].strip("`")
        if one.default is MISSING:
            assert said == "needed", one.name
        elif one.default == "":
            assert said == "the console's"
        else:
            default = list(one.default) if isinstance(one.default, tuple) else one.default
            quoted = f'"{default}"' if isinstance(default, str) else str(default)
            assert said == (quoted.lower() if isinstance(default, bool) else quoted), one.name

"""Lines of keys in TOML, and site files with anything in them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.errors import FileError
from airground.records.site_lines import TomlLines
from airground.records.site_reader import read_site

if TYPE_CHECKING:
    from pathlib import Path

TEXT = '''\
# [[robots]] is not here: name = 1
name = "a # b" # and name
note = """
[[robots]]
name = "in a text" \\"""
"""

"quoted" . key = 1
[[robots]]
list = [
  1, # ]
  2, "]",
]
limits = { speed_mps = 1, more = { x = 2 } }
[ robots . timing ]
lag = '[[not]]'
deep.er = 2
[[robots]]
[robots.limits]
speed_mps = 3
[[robots.legs]]
a = 1
[[robots.legs]]
a = 2
[last]
x = 1
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("name", 2),
        ("note", 3),
        ("quoted", 8),
        ("quoted.key", 8),
        ("robots[0]", 9),
        ("robots[0].list", 10),
        ("robots[0].limits", 14),
        ("robots[0].limits.speed_mps", 14),
        ("robots[0].name", 9),
        ("robots[0].timing", 15),
        ("robots[0].timing.lag", 16),
        ("robots[0].timing.deep.er", 17),
        ("robots[1]", 18),
        ("robots[1].limits.speed_mps", 20),
        ("robots[1].legs[1].a", 24),
        ("robots[2]", None),
        ("last.x", 26),
        ("nowhere", None),
    ],
)
def test_where_a_key_stands(path: str, line: int | None) -> None:
    assert TomlLines(TEXT).line(path) == line
    assert TomlLines(TEXT.replace("\n", "\r\n")).line(path) == line


def test_a_site_with_anything_in_it_is_read_or_refused(
    root: Path, tmp_path: Path, rng: np.random.Generator
) -> None:
    """Pieces are dropped, doubled and swapped, bytes changed: one line a mistake, never another error."""
    whole = (root / "examples" / "site.toml").read_bytes()
    lines = whole.splitlines(keepends=True)
    path = tmp_path / "site.toml"
    values = [
        b"-1",
        b"true",
        b'""',
        b"[]",
        b"{}",
        b"nan",
        b"1e999",
        b"1979-05-27",
        b"[[1]]",
        b"9" * 400,
    ]
    refused, told = 0, []
    for _ in range(200):
        broken = list(lines)
        for _ in range(int(rng.integers(1, 4))):
            k = int(rng.integers(len(broken)))
            key = broken[k].partition(b"=")[0]
            value = values[int(rng.integers(len(values)))]
            changes = [
                b"",
                broken[k] * 2,
                broken[int(rng.integers(len(broken)))],
                key + b"= " + value + b"\n",
            ]
            broken[k] = changes[int(rng.integers(len(changes)))]
        data = bytearray(b"".join(broken))
        if rng.random() < 0.3:
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
        path.write_bytes(data)
        try:
            read_site(path)
        except FileError as error:
            refused += 1
            for line in getattr(error, "lines", (str(error),)):
                assert line.isprintable()
                assert line.startswith(str(path))
            told.append((error.line or 1, data.count(b"\n") + 2))
    assert refused > 100
    assert all(1 <= line <= last for line, last in told)

"""Blocks put together are the file, wherever the cuts fall."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from airground.records.text_blocks import BLOCK_BYTES, read_blocks

if TYPE_CHECKING:
    from pathlib import Path


def lines_with_numbers(path: Path) -> list[tuple[int, str]]:
    return [
        (block.first + i, line) for block in read_blocks(path) for i, line in enumerate(block.lines)
    ]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("shift", range(-3, 4))
def test_cut_near_a_line_end(tmp_path: Path, end: str, shift: int) -> None:
    # The first read ends before, within or after the end of the second line.
    lines = ["ä", "x" * (BLOCK_BYTES + shift - len(("ä" + end).encode())), "y", "z"]
    path = tmp_path / "a.txt"
    path.write_bytes("".join(line + end for line in lines).encode())
    assert lines_with_numbers(path) == list(enumerate(lines, start=1))


def test_character_across_a_cut(tmp_path: Path) -> None:
    lines = ["x" * 1000 + "🤖" * 7000 + "a" * i for i in range(40)]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(lines), encoding="utf-8", newline="\n")
    assert path.stat().st_size > 4 * BLOCK_BYTES
    assert lines_with_numbers(path) == list(enumerate(lines, start=1))


def test_only_the_last_block_is_last(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"0123456\n" * (BLOCK_BYTES // 4))
    blocks = list(read_blocks(path))
    assert [block.last for block in blocks] == [False, True]
    assert all(block.ended for block in blocks)

"""Smoothed tracks as a file."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from airground.errors import InputError
from airground.records import write_smoothed


@dataclass
class Smooth:
    t: np.ndarray
    uv: np.ndarray
    uv_dot: np.ndarray
    covariance: np.ndarray


def smooth(rng: np.random.Generator, count: int) -> Smooth:
    root = rng.normal(size=(count, 4, 4))
    return Smooth(
        np.sort(rng.uniform(0, 9, count)),
        rng.normal(size=(count, 2)),
        rng.normal(size=(count, 2)),
        root @ np.swapaxes(root, 1, 2),
    )


def test_every_number_reads_back(tmp_path: Path, rng: np.random.Generator) -> None:
    tracks = {"a": smooth(rng, 3), "b,c": smooth(rng, 2)}
    write_smoothed(tmp_path / "s.csv", tracks)
    with (tmp_path / "s.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["target"] for row in rows] == ["a", "a", "a", "b,c", "b,c"]
    k = 0
    for track in tracks.values():
        for t, uv, uv_dot, P in zip(track.t, track.uv, track.uv_dot, track.covariance, strict=True):
            row = rows[k]
            assert [float(row[c]) for c in ("t_s", "u_px", "v_px")] == [t, *uv]
            assert [float(row[c]) for c in ("u_dot_pxps", "v_dot_pxps")] == [*uv_dot]
            assert float(row["sigma_px"]) == pytest.approx(np.sqrt((P[0, 0] + P[1, 1]) / 2))
            assert float(row["sigma_dot_pxps"]) == pytest.approx(np.sqrt((P[2, 2] + P[3, 3]) / 2))
            k += 1


def test_what_is_not_a_number_is_refused(tmp_path: Path, rng: np.random.Generator) -> None:
    track = smooth(rng, 3)
    track.uv_dot[1, 0] = np.nan
    with pytest.raises(InputError, match="uv_dot"):
        write_smoothed(tmp_path / "s.csv", {"a": track})
    assert not (tmp_path / "s.csv").exists()

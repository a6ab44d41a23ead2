"""``calibration.json``: bit for bit, strict, whole or not at all."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.calibration import Calibration, Fit, Observability, Provenance, TargetFit
from airground.errors import FileError
from airground.geometry import LimitedHomography
from airground.records.calibration_file import FORMAT, calibration_document
from scenes import generators, random_scene


def some(rng: np.random.Generator) -> Calibration:
    here = random_scene(rng)
    root = rng.normal(size=(6, 6)) * 10 ** rng.uniform(-6, 0, (6, 1))
    covariance = root @ root.T
    return Calibration(
        model=LimitedHomography(here.g),
        covariance=(covariance + covariance.T) / 2,
        origin_px=here.pixels(rng),
        fit=Fit(
            "linear",
            float(rng.exponential()),
            int(rng.integers(1_000_000)),
            1.0,
            float(rng.random()),
            (0.1, 0.2, 3.0, 4.0),
        ),
        observability=Observability(
            "weak", float(rng.random()), tuple(rng.random(6)), "drive ünter den Linden"
        ),
        time_offset_s=float(rng.normal()),
        time_offset_sigma_s=float(rng.random()),
        image_size_px=here.image_size,
        targets={"robot, the 2nd": TargetFit(17), 'a"b': TargetFit(3)},
        provenance=Provenance(
            "0.1.0",
            "airground calibrate",
            (("tracks.csv", "ab" * 32),),
            "2026-11-21T00:00:00+00:00",
        ),
    )


@given(generators())
def test_it_reads_back_bit_for_bit(tmp_path_factory: Any, rng: np.random.Generator) -> None:
    path = tmp_path_factory.mktemp("c") / "calibration.json"
    before = some(rng)
    before.save(path)
    after = Calibration.load(path)
    assert (after.model.g == before.model.g).all()
    assert (after.covariance == before.covariance).all()
    assert (after.origin_px == before.origin_px).all()
    for name in (
        "fit",
        "observability",
        "time_offset_s",
        "time_offset_sigma_s",
        "image_size_px",
        "targets",
        "provenance",
    ):
        assert getattr(after, name) == getattr(before, name), name
    first = path.read_bytes()
    after.save(path)
    assert path.read_bytes() == first


@pytest.fixture
def document(rng: np.random.Generator) -> dict[str, Any]:
    return calibration_document(some(rng))


def test_the_contract_s_keys_are_there(document: dict[str, Any]) -> None:
    assert document["format"] == FORMAT == "airground.calibration/1"
    assert np.shape(document["g"]) == (3, 2)
    assert np.shape(document["covariance"]) == (6, 6)
    G = np.array(document["image_from_ground"])
    assert np.linalg.det(G) == pytest.approx(1.0)
    np.testing.assert_array_equal(G[:, :2], document["g"])
    np.testing.assert_allclose(G[:2, 2] / G[2, 2], document["origin_px"])
    assert document["distortion"] == {"model": "none"}
    assert {"rms_px", "sightings", "inlier_fraction", "method"} <= set(document["fit"])
    assert {"verdict", "relative_sigma", "singular_values", "advice"} <= set(
        document["observability"]
    )
    assert {"version", "command", "inputs", "created"} == set(document["provenance"])


def write(path: Path, document: object) -> Path:
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_unknown_keys_and_missing_additions_are_fine(
    document: dict[str, Any], tmp_path: Path
) -> None:
    document["new_in_1_1"] = {"x": 1}
    document["format"] = "airground.calibration/1.3"
    for key in ("window_s", "region_px"):
        del document["fit"][key]
    del document["provenance"]
    document["targets"] = {"robot": {}}
    loaded = Calibration.load(write(tmp_path / "c.json", document))
    assert loaded.fit.region_px is None
    assert loaded.targets == {"robot": TargetFit(None)}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "airground.calibration/2"}, "version 2 is not known here, expected 1"),
        ({"format": "something.else/1"}, 'expected "airground.calibration/1"'),
        ({"format": 3}, "expected a text, found 3"),
        ({"g": [[1, 2], [3, 4]]}, "g must have shape"),
        ({"g": [[1, 2], [3, "x"], [5, 6]]}, "g must be an array of numbers"),
        ({"g": [[1, 1], [1, 1], [1, 1]]}, "parallel"),
        ({"covariance": [[1.0]]}, "covariance must have shape"),
        ({"distortion": {"model": "fisheye"}}, '"none" only'),
        ({"time_offset_s": "soon"}, "expected a number"),
        ({"time_offset_s": True}, "key time_offset_s: expected a number, found true"),
        ({"time_offset_s": 10**400}, "expected a number"),
        ({"g": [[10**400, 2], [3, 4], [5, 6]]}, "g must be an array of numbers"),
        ({"g": [[1e200, 2], [3, 1e200], [5, 6]]}, "g: found 1e+200, expected at most 1e+15"),
        ({"g": [[1e-200, 0], [0, 1e-200], [0, 0]]}, "g has no entry above 1e-15"),
        ({"covariance": (-np.eye(6)).tolist()}, "covariance must have no negative eigenvalue"),
        ({"covariance": (1 - np.eye(6)).tolist()}, "covariance must have no negative eigenvalue"),
        ({"covariance": (1e300 * np.eye(6)).tolist()}, "covariance: found 1e+300"),
        ({"origin_px": [1e300, 1]}, "origin_px: found 1e+300"),
        ({"image_size_px": [1e300, 1]}, "image_size_px: found 1e+300"),
        ({"image_size_px": [640]}, "expected 2 numbers"),
        ({"image_size_px": [-1, 480]}, "image_size_px must be positive"),
        ({"targets": []}, "expected a JSON object"),
        ({"observability": {"verdict": "maybe"}}, "expected ok or weak"),
    ],
)
def test_what_is_wrong_is_named(
    document: dict[str, Any], tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    path = write(tmp_path / "c.json", {**document, **change})
    with pytest.raises(FileError, match=".*") as caught:
        Calibration.load(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "key", ["g", "covariance", "origin_px", "fit", "observability", "format", "time_offset_s"]
)
def test_a_missing_key_is_named(document: dict[str, Any], tmp_path: Path, key: str) -> None:
    del document[key]
    with pytest.raises(FileError, match=f"{key}.*missing"):
        Calibration.load(write(tmp_path / "c.json", document))


@pytest.mark.parametrize(
    "region", [[0, 0, 0, 9], [0, 9, 5, 9], [5, 0, 0, 9], [0, 0, 1e300, 9], [0, 0, 9]]
)
def test_a_region_has_an_area(
    document: dict[str, Any], tmp_path: Path, region: list[float]
) -> None:
    document["fit"]["region_px"] = region
    with pytest.raises(FileError, match="region_px"):
        Calibration.load(write(tmp_path / "c.json", document))


def test_a_number_that_only_reads_as_infinite(document: dict[str, Any], tmp_path: Path) -> None:
    document["fit"]["sightings"] = "SIGHTINGS"
    path = write(tmp_path / "c.json", document)
    path.write_text(path.read_text().replace('"SIGHTINGS"', "1e999"))
    with pytest.raises(FileError, match=r"key fit\.sightings: expected a number"):
        Calibration.load(path)


def test_a_file_without_end_is_not_read_to_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "c.json"
    path.write_bytes(b" " * 2000)
    monkeypatch.setattr("airground.records.calibration_file.MAX_BYTES", 1000)
    with pytest.raises(FileError, match="is longer than 1000 bytes"):
        Calibration.load(path)
    if not Path("/dev/zero").exists():
        pytest.skip("needs /dev/zero")
    with pytest.raises(FileError, match="is longer than 1000 bytes"):
        Calibration.load("/dev/zero")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not JSON"),
        (b'{"format": "airground.cal', "not JSON"),
        (b"\x00\xff\xfe\x80", "not a text file"),
        (b"[1, 2]", "expected a JSON object"),
        (b'{"format": "airground.calibration/1", "g": NaN}', "NaN is not a number"),
        (b"[" * 100_000, "not a calibration"),
        (b'{"x": 1' + b"0" * 5000 + b"}", ""),
    ],
)
def test_files_that_are_no_calibration(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "c.json"
    path.write_bytes(data)
    with pytest.raises(FileError) as caught:
        Calibration.load(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_brackets_in_brackets(tmp_path: Path) -> None:
    for depth in range(850, 1000):  # at one of them JSON can just be read, but not be written
        (tmp_path / "c.json").write_text('{"format": ' + "[" * depth + "]" * depth + "}")
        with pytest.raises(FileError, match="expected a text|not a calibration"):
            Calibration.load(tmp_path / "c.json")


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="there is no such file"):
        Calibration.load(tmp_path / "none.json")
    with pytest.raises(FileError, match="is a folder, expected a file"):
        Calibration.load(tmp_path)


def test_nothing_half_written_is_left(rng: np.random.Generator, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    good = some(rng)
    good.save(path)
    before = path.read_bytes()
    broken = dataclasses.replace(
        good, time_offset_s=float("nan")
    )  # JSON has no NaN, so writing fails
    with pytest.raises(ValueError, match="JSON"):
        broken.save(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["c.json"]


@given(st.text(max_size=40))
def test_any_target_name_survives(tmp_path_factory: Any, name: str) -> None:
    path = tmp_path_factory.mktemp("c") / "calibration.json"
    named = dataclasses.replace(some(np.random.default_rng(1)), targets={name: TargetFit(1)})
    if any(0xD800 <= ord(c) < 0xE000 for c in name):
        return
    named.save(path)
    assert list(Calibration.load(path).targets) == [name]

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
from airground.geometry import DivisionLens, LimitedHomography
from airground.records.calibration_file import FORMAT, calibration_document
from scenes import generators, random_scene


def maybe(rng: np.random.Generator, count: int | None = None, *, least: float = -np.inf) -> Any:
    """A number, or so many of them, or None."""
    if rng.random() < 0.3:
        return None
    values = np.maximum(rng.normal(size=count or 1) * 10 ** rng.uniform(-8, 3), least).tolist()
    return values[0] if count is None else tuple(values)


def some_target(rng: np.random.Generator) -> TargetFit:
    return TargetFit(
        int(rng.integers(100_000)),
        heading_bias_rad=maybe(rng),
        heading_bias_sigma_rad=maybe(rng, least=0.0),
        speed_scale=maybe(rng),
        speed_scale_sigma=maybe(rng, least=0.0),
        lever_arm_m=maybe(rng, 2),
        lever_arm_sigma_m=maybe(rng, 2, least=0.0),
        heading_drift_rad_per_sqrt_s=maybe(rng, least=0.0),
    )


def some(rng: np.random.Generator, *, lens: bool | None = None, sure: bool = False) -> Calibration:
    """A calibration with everything in it; with a lens or without, which may be sure of its k1."""
    here = random_scene(rng)
    lens = bool(rng.integers(2)) if lens is None else lens
    root = rng.normal(size=(6, 6)) * 10 ** rng.uniform(-6, 0, (6, 1))
    covariance = root @ root.T
    origin = here.pixels(rng)
    # Small enough for the origin to be seen through it.
    k1 = float(rng.uniform(-0.9, 0.2) / 5000**2)
    own = 1e-2 * k1 * rng.normal(size=2)
    k1_covariance = np.append(root[:, 0] * own[0], own @ own)  # k1 shares one of g's errors
    return Calibration(
        model=LimitedHomography(here.g),
        covariance=(covariance + covariance.T) / 2,
        origin_px=origin,
        fit=Fit(
            "linear",
            float(rng.exponential()),
            int(rng.integers(1_000_000)),
            1.0,
            float(rng.random()),
            (0.1, 0.2, 3.0, 4.0),
            nuisances=("time offset", "Länge"),
        ),
        observability=Observability(
            "weak", float(rng.random()), tuple(rng.random(6)), "drive ünter den Linden"
        ),
        time_offset_s=float(rng.normal()),
        time_offset_sigma_s=float(rng.random()),
        image_size_px=here.image_size,
        targets={"robot, the 2nd": some_target(rng), 'a"b': some_target(rng)},
        provenance=Provenance(
            "0.1.0",
            "airground calibrate",
            (("tracks.csv", "ab" * 32),),
            "2026-11-21T00:00:00+00:00",
        ),
        lens=DivisionLens(k1, origin + rng.normal(0, 300, 2)) if lens else None,
        k1_covariance=k1_covariance if lens and not sure else None,
    )


@given(generators())
def test_it_reads_back_bit_for_bit(tmp_path_factory: Any, rng: np.random.Generator) -> None:
    path = tmp_path_factory.mktemp("c") / "calibration.json"
    before = some(rng, sure=bool(rng.integers(2)))
    before.save(path)
    after = Calibration.load(path)
    if before.lens is None:
        assert after.lens is None
    else:
        assert after.lens is not None
        assert after.lens.k1 == before.lens.k1
        assert (after.lens.center == before.lens.center).all()
    if before.k1_covariance is None:
        assert after.k1_covariance is None
    else:
        assert after.k1_covariance is not None
        assert (after.k1_covariance == before.k1_covariance).all()
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
    return calibration_document(some(rng, lens=False))


@pytest.fixture
def bent(rng: np.random.Generator) -> dict[str, Any]:
    """A document with a lens, as plain JSON."""
    made: dict[str, Any] = json.loads(json.dumps(calibration_document(some(rng, lens=True))))
    return made


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
    assert document["fit"]["nuisances"] == ["time offset", "Länge"]
    assert {"version", "command", "inputs", "created"} == set(document["provenance"])


def test_the_contract_s_keys_of_a_lens_are_there(bent: dict[str, Any]) -> None:
    distortion = bent["distortion"]
    assert list(distortion) == ["model", "k1", "center_px", "k1_covariance"]
    assert distortion["model"] == "division"
    assert len(distortion["center_px"]) == 2
    assert len(distortion["k1_covariance"]) == 7
    # Matrix and origin go together: both are about the undistorted image.
    G = np.array(bent["image_from_ground"])
    np.testing.assert_allclose(G[:2, 2] / G[2, 2], bent["origin_px"])


def test_a_lens_whose_k1_is_exact_has_no_covariance(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    document = calibration_document(some(rng, lens=True, sure=True))
    assert list(document["distortion"]) == ["model", "k1", "center_px"]
    assert Calibration.load(write(tmp_path / "c.json", document)).k1_covariance is None
    document["distortion"]["k1_covariance"] = None
    assert Calibration.load(write(tmp_path / "d.json", document)).k1_covariance is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"model": "pinhole"}, 'key distortion.model: expected "none" or "division"'),
        ({"model": "two\nlines"}, 'found "two\\nlines"'),
        ({"model": None}, "key distortion.model: expected a text, found null"),
        ({"k1": None}, "key distortion.k1: expected a number, found null"),
        ({"k1": "small"}, "key distortion.k1: expected a number"),
        ({"k1": 1e300}, "key distortion: k1: found 1e+300"),
        ({"k1": -1e14}, "origin_px lies where the lens shows nothing"),
        ({"center_px": [1.0]}, "key distortion.center_px: expected 2 numbers"),
        ({"center_px": [1.0, True]}, "key distortion.center_px: expected 2 numbers"),
        ({"center_px": [1e300, 1.0]}, "key distortion: center: found 1e+300"),
        ({"k1_covariance": [0.0] * 6}, "key distortion.k1_covariance: expected 7 numbers"),
        ({"k1_covariance": [0.0] * 6 + [-1e-20]}, "k1_covariance does not go with covariance"),
        ({"k1_covariance": [1.0] * 6 + [1e-20]}, "k1_covariance does not go with covariance"),
        ({"k1_covariance": [0.0] * 6 + [1e300]}, "k1_covariance: found 1e+300"),
    ],
)
def test_what_is_wrong_with_a_lens_is_named(
    bent: dict[str, Any], tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    bent["distortion"].update(change)
    path = write(tmp_path / "c.json", bent)
    with pytest.raises(FileError) as caught:
        Calibration.load(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ["k1", "center_px"])
def test_a_missing_key_of_a_lens_is_named(bent: dict[str, Any], tmp_path: Path, key: str) -> None:
    del bent["distortion"][key]
    with pytest.raises(FileError, match=rf"key distortion\.{key} is missing"):
        Calibration.load(write(tmp_path / "c.json", bent))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"heading_bias_sigma_rad": -0.1}, "heading_bias_sigma_rad: expected a number from 0 on"),
        ({"speed_scale": "one"}, "speed_scale: expected a number"),
        ({"speed_scale_sigma": -1}, "speed_scale_sigma: expected a number from 0 on, found -1"),
        ({"lever_arm_m": 0.3}, "lever_arm_m: expected 2 numbers"),
        ({"lever_arm_m": [0.3, None]}, "lever_arm_m: expected 2 numbers"),
        ({"lever_arm_sigma_m": [0.1, -0.1]}, "lever_arm_sigma_m: expected 2 numbers from 0 on"),
        ({"heading_drift_rad_per_sqrt_s": -1e-9}, "heading_drift_rad_per_sqrt_s: expected"),
    ],
)
def test_what_is_wrong_with_a_target_is_named(
    document: dict[str, Any], tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    document["targets"] = {"robot": change}
    with pytest.raises(FileError) as caught:
        Calibration.load(write(tmp_path / "c.json", document))
    assert f"key targets.robot.{message}" in str(caught.value)


@pytest.mark.parametrize("names", ["k1", ["k1", 3], {"k1": 1}])
def test_nuisances_are_texts(document: dict[str, Any], tmp_path: Path, names: object) -> None:
    document["fit"]["nuisances"] = names
    with pytest.raises(FileError, match=r"key fit\.nuisances: expected a list of texts"):
        Calibration.load(write(tmp_path / "c.json", document))


def write(path: Path, document: object) -> Path:
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_unknown_keys_and_missing_additions_are_fine(
    document: dict[str, Any], tmp_path: Path
) -> None:
    document["new_in_1_1"] = {"x": 1}
    document["format"] = "airground.calibration/1.3"
    for key in ("window_s", "region_px", "nuisances"):
        del document["fit"][key]
    del document["provenance"]
    document["targets"] = {"robot": {}}
    loaded = Calibration.load(write(tmp_path / "c.json", document))
    assert loaded.fit.region_px is None
    assert loaded.fit.nuisances == ()
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
        ({"distortion": {"model": "fisheye"}}, 'expected "none" or "division"'),
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

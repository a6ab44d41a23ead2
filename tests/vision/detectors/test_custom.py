"""Detectors of the user's own: functions and models; and all detectors by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.errors import InputError
from airground.vision.detectors.auto import AutoDetector
from airground.vision.detectors.blobs import BlobDetector
from airground.vision.detectors.custom import FunctionDetector
from airground.vision.detectors.flow import PointDetector
from airground.vision.detectors.leds import LedDetector
from airground.vision.detectors.moving import MovingDetector
from airground.vision.detectors.onnx import OnnxDetector
from airground.vision.detectors.protocol import Detector
from airground.vision.detectors.registry import make_detector, names_of_detectors
from airground.vision.detectors.tags import TagDetector
from airground.vision.sightings import Sightings
from vision.synthetic import Tag, coverage, draw_tags, frame, texture, tilted, to_bytes

if TYPE_CHECKING:
    from pathlib import Path

PICTURE = frame(np.zeros((40, 60, 3), dtype=np.uint8), 2.5)


def two_points(image: np.ndarray) -> np.ndarray:
    assert image.shape == (40, 60, 3)
    return np.array([[1.0, 2.0], [3.0, 4.0]])


class Counter:
    def __call__(self, _image: np.ndarray, t: float) -> np.ndarray:
        return np.array([[t, 1.0, 0.5]])


def test_points_without_and_with_a_deviation() -> None:
    seen = FunctionDetector(two_points, sigma_px=2.0).detect(PICTURE)
    assert seen.t == 2.5
    assert_array_equal(seen.uv, [[1, 2], [3, 4]])
    assert_array_equal(seen.covariance[0], 4.0 * np.eye(2))
    seen = FunctionDetector(Counter()).detect(PICTURE)
    assert_array_equal(seen.uv, [[2.5, 1.0]])
    assert_array_equal(seen.covariance[0], 0.25 * np.eye(2))


def test_a_grey_frame_comes_in_three_channels() -> None:
    grey = frame(np.zeros((40, 60), dtype=np.uint8))
    assert len(FunctionDetector(two_points).detect(grey)) == 2


@pytest.mark.parametrize("nothing", [None, [], np.empty((0, 2)), np.empty((0, 3))])
def test_nothing(nothing: object) -> None:
    assert len(FunctionDetector(lambda _: nothing).detect(PICTURE)) == 0


def test_sightings_pass_with_the_time_of_the_frame() -> None:
    given = Sightings.round(0.0, [[1, 2]], 1.0, labels=("a",))
    seen = FunctionDetector(lambda _: given).detect(PICTURE)
    assert (seen.t, seen.labels) == (2.5, ("a",))


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (np.zeros((2, 4)), r"found shape \(2, 4\), expected \(N, 2\)"),
        (np.zeros(2), r"found shape \(2,\)"),
        ([[1.0, np.nan]], "row 0 has NaN"),
        ([[1.0, 2.0, 1.0], [1.0, 2.0, 0.0]], "row 1 has sigma 0"),
        ("ball", "no array of numbers"),
        ([[1, 2], [3]], "no array of numbers"),
    ],
)
def test_wrong_answers_are_refused(answer: object, message: str) -> None:
    def mine(image: np.ndarray) -> object:
        return answer

    with pytest.raises(InputError, match=message) as caught:
        FunctionDetector(mine).detect(PICTURE)
    assert "detector mine at t = 2.500 s" in str(caught.value)


def test_functions_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_finder.py").write_text(
        "import numpy as np\n"
        "def find(image, t):\n    return [[t, 7.0]]\n"
        "class Finder:\n    def __call__(self, image):\n        return [[5.0, 6.0]]\n"
        "class Needy:\n    def __init__(self, x):\n        pass\n"
        "number = 3\n"
    )
    (tmp_path / "broken_finder.py").write_text("import not_there_at_all\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert_array_equal(make_detector("my_finder:find").detect(PICTURE).uv, [[2.5, 7.0]])
    assert_array_equal(make_detector("my_finder:Finder").detect(PICTURE).uv, [[5.0, 6.0]])
    for text, message in {
        "my_finder:fnd": "has no 'fnd'; it has find",
        "my_finder:number": "is int, not a function",
        "my_finder:Needy": "cannot be made without arguments",
        "broken_finder:find": "No module named 'not_there_at_all'",
        "no_such_module:find": "cannot import 'no_such_module'",
    }.items():
        with pytest.raises(InputError, match=message):
            make_detector(text)


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("auto", AutoDetector),
        ("auto:family=36h11+4x4", AutoDetector),
        ("apriltag", AutoDetector),
        ("aruco", AutoDetector),
        ("tag:family=36h11+25h9,rescan_frames=5", TagDetector),
        ("led", LedDetector),
        ("LED:most=4", LedDetector),
        ("blob:color=red", BlobDetector),
        ("blob:color=200-260,single=yes", BlobDetector),
        ("moving:at=foot", MovingDetector),
        ("point:at=640,360+100,200", PointDetector),
    ],
)
def test_detectors_by_name(text: str, kind: type) -> None:
    detector = make_detector(text)
    assert isinstance(detector, kind)
    assert isinstance(detector, Detector)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no detector ''; there are auto, apriltag"),
        ("tags", "no detector 'tags'; there are auto, .*module:function, model.onnx"),
        ("tag:colour=red", "no key 'colour'; it has family"),
        ("tag:family", "no key 'family'"),
        ("tag:rescan_frames=often", "rescan_frames='often' is not understood"),
        ("tag:rescan_frames=2,rescan_frames=3", "rescan_frames is given twice"),
        ("led:most=0", "most must be 1 or more"),
        ("blob:single=maybe", "expected yes or no"),
        ("point", "needs the points"),
        ("point:at=3", "'3' is not u,v"),
        ("point:at=a,b", "could not convert"),
        ("nothing.onnx", "no such file"),
    ],
)
def test_wrong_names_say_what_there_is(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_detector(text)


def test_the_list_of_names_is_what_can_be_made() -> None:
    for name in names_of_detectors()[:-2]:
        if name != "point":
            make_detector(name)


def tagged(k: int, rng: np.random.Generator, family: str = "36h11") -> Any:
    tag = Tag(tilted([60 + 2 * k, 80], 50), number=3, family=family)
    return frame(draw_tags([tag], (200, 160), noise=2, rng=rng, supersample=4), k / 30)


def disc(k: int, rng: np.random.Generator) -> Any:
    cover = coverage((200, 160), [30 + 8 * k, 80], (9, 9))
    return frame(to_bytes(100 + 100 * cover, 2.0, rng), k / 30)


def test_auto_finds_tags_and_loses_no_frame(rng: np.random.Generator) -> None:
    frames = [tagged(k, rng, "4x4") for k in range(3)]
    live, file = AutoDetector(), AutoDetector()
    assert isinstance(file.choose(frames), TagDetector)
    for picture in frames:
        assert live.detect(picture).labels == file.detect(picture).labels == ("3",)


def test_auto_falls_back_to_what_moves(rng: np.random.Generator) -> None:
    frames = [disc(k, rng) for k in range(20)]
    file = AutoDetector(("36h11",), probe_frames=12)
    assert isinstance(file.choose(frames[::2]), MovingDetector)
    assert [len(file.detect(picture)) for picture in frames] == [1] * 20
    live = AutoDetector(("36h11",), probe_frames=3)
    for picture in frames[:4]:
        assert len(live.detect(picture)) == 0
    assert isinstance(live.chosen, MovingDetector)
    never = AutoDetector(("36h11",), otherwise_moving=False)
    assert isinstance(never.choose(frames[:3]), TagDetector)


def model(path: Path, output: np.ndarray, size: Any = 64, channels: int = 3) -> Path:
    """A network that finds the same boxes in every image."""
    onnx = pytest.importorskip("onnx")
    from onnx import TensorProto, helper, numpy_helper

    constant = numpy_helper.from_array(output.astype(np.float32), "boxes")
    zero = numpy_helper.from_array(np.zeros((), dtype=np.float32), "zero")
    nodes = [
        helper.make_node("ReduceMax", ["image"], ["most"], keepdims=0),
        helper.make_node("Mul", ["most", "zero"], ["nothing"]),
        helper.make_node("Add", ["boxes", "nothing"], ["out"]),
    ]
    graph = helper.make_graph(
        nodes,
        "boxes",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, channels, size, size])],
        [helper.make_tensor_value_info("out", TensorProto.FLOAT, list(output.shape))],
        [constant, zero],
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)])
    made.ir_version = 8
    onnx.save(made, str(path))
    return path


@pytest.fixture(autouse=True)
def _onnxruntime(request: pytest.FixtureRequest) -> None:
    if "onnx" in request.node.name:
        pytest.importorskip("onnxruntime")


# In a letterbox of 64 px a frame of 128x64 is halved, with 16 px of grey above: u = 2 (x - 0), v = 2 (y - 16),
# and half a pixel less, as (0, 0) is the centre of the first.
CORNERS = np.array([10.0, 20, 20, 30])
CENTRE = [2 * 15 - 0.5, 2 * (25 - 16) - 0.5]


def test_onnx_rows_of_corners(tmp_path: Path) -> None:
    rows = [[*CORNERS, 0.9, 0], [30, 20, 40, 30, 0.1, 0], [40, 20, 50, 30, 0.8, 2], [0] * 6]
    path = model(tmp_path / "rows.onnx", np.array([rows]))
    picture = frame(np.full((64, 128, 3), 99, dtype=np.uint8), 1.5)
    seen = OnnxDetector(path).detect(picture)
    assert_allclose(seen.uv, [CENTRE, [89.5, 17.5]])
    assert_allclose(seen.score, [0.9, 0.8], rtol=1e-6)
    assert_allclose(seen.outline[0, 0], [19.5, 7.5])
    assert seen.t == 1.5
    only = make_detector(f"{path}:classes=2,score=0.5").detect(picture)
    assert_allclose(only.uv, [[89.5, 17.5]])


@pytest.mark.parametrize("size", [64, "n"])
def test_onnx_columns_of_centres(tmp_path: Path, size: object) -> None:
    """Two boxes of one class overlap: the better one is kept; one of another class stays."""
    centres = [[15, 25, 10, 10], [16, 25, 10, 10], [15, 25, 10, 10]] + [[0, 0, 0, 0]] * 5
    scores = [[0.7, 0.1], [0.9, 0.0], [0.0, 0.8]] + [[0.0, 0.0]] * 5
    output = np.concatenate([np.array(centres), np.array(scores)], axis=1).T[None]
    detector = OnnxDetector(model(tmp_path / "columns.onnx", output, size))
    wide, tall = (128, 64) if size == 64 else (1280, 640)
    seen = detector.detect(frame(np.zeros((tall, wide, 3), dtype=np.uint8)))
    assert len(seen) == 2
    assert_allclose(seen.score, [0.9, 0.8], rtol=1e-6)
    if size == 64:
        assert_allclose(seen.uv, [[CENTRE[0] + 2, CENTRE[1]], CENTRE])


def test_onnx_nothing_sure_enough(tmp_path: Path) -> None:
    path = model(tmp_path / "none.onnx", np.array([[[10, 10, 20, 20, 0.05, 0]]]))
    assert len(OnnxDetector(path).detect(PICTURE)) == 0


def test_onnx_other_shapes_are_refused(tmp_path: Path) -> None:
    odd = OnnxDetector(model(tmp_path / "odd.onnx", np.zeros((2, 3))))
    with pytest.raises(InputError, match=r"of shape \(2, 3\), expected \(1, N, 6\)"):
        odd.detect(PICTURE)
    with pytest.raises(InputError, match=r"expected one of \(1, 3, H, W\)"):
        OnnxDetector(model(tmp_path / "grey.onnx", np.zeros((1, 1, 6)), channels=1))
    (tmp_path / "text.onnx").write_text("not a model")
    with pytest.raises(InputError, match="not a model that onnxruntime reads"):
        OnnxDetector(tmp_path / "text.onnx")


def test_a_texture_has_neither_tags_nor_a_choice(rng: np.random.Generator) -> None:
    detector = make_detector("apriltag")
    for k in range(2):
        assert len(detector.detect(frame(texture(rng, (200, 160)), k / 30))) == 0

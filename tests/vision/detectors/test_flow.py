"""Points of the operator's choice."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import map_coordinates  # type: ignore[import-untyped, unused-ignore]

from airground.errors import InputError
from airground.vision.detectors.flow import PointDetector
from vision.synthetic import frame, texture, to_bytes

POINTS = np.array([[100.3, 80.2], [200.0, 100.0], [150.7, 150.4]])
MIDDLE = np.array([160.0, 120.0])


class View:
    """A textured plane under an affine map, by cubic splines: nothing of OpenCV."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.plane = texture(rng, (520, 440), 4.0).astype(float)
        self.rng = rng

    def __call__(
        self, A: np.ndarray, shift: np.ndarray, noise: float = 2.0, gain: float = 1.0
    ) -> np.ndarray:
        v, u = np.mgrid[0:240, 0:320].astype(float)
        p = np.stack([u.ravel(), v.ravel()]) - (MIDDLE + shift)[:, None]
        q = np.linalg.inv(A) @ p + (MIDDLE + 100)[:, None]
        image = map_coordinates(self.plane, [q[1], q[0]], order=3, mode="mirror")
        return to_bytes(gain * image.reshape(240, 320), noise, self.rng)

    @staticmethod
    def truth(A: np.ndarray, shift: np.ndarray) -> np.ndarray:
        return np.asarray((POINTS - MIDDLE) @ A.T + MIDDLE + shift)


def turned(angle: float, scale: float = 1.0) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return scale * np.array([[c, -s], [s, c]])


def test_points_are_followed_without_drift(rng: np.random.Generator) -> None:
    view = View(rng)
    detector = PointDetector(POINTS)
    first = detector.detect(frame(view(np.eye(2), np.zeros(2)), 0.0))
    assert_array_equal(first.uv, POINTS)
    assert first.labels == ("1", "2", "3")
    squares = []
    for k in range(1, 14):
        A, shift = turned(0.02 * k, 1 + 0.006 * k), np.array([2.3 * k, 8 * np.sin(k / 3)])
        seen = detector.detect(frame(view(A, shift, gain=1 - 0.01 * k), k / 30))
        assert seen.labels == ("1", "2", "3")
        error = seen.uv - view.truth(A, shift)
        assert np.hypot(*error.T).max() < 0.08
        squares += [e @ np.linalg.solve(C, e) for e, C in zip(error, seen.covariance, strict=True)]
    assert 0.1 < np.mean(squares) < 5.0


def test_fast_motion(rng: np.random.Generator) -> None:
    view = View(rng)
    detector = PointDetector(POINTS)
    for k in range(4):
        shift = np.array([14.0, -9.0]) * k
        seen = detector.detect(frame(view(np.eye(2), shift), k / 30))
        assert_allclose(seen.uv, view.truth(np.eye(2), shift), atol=0.1)


def test_a_hidden_point_gives_nothing_and_is_found_again(rng: np.random.Generator) -> None:
    view = View(rng)
    detector = PointDetector(POINTS)
    for k in range(9):
        shift = np.array([2.0, 1.0]) * k
        image = view(np.eye(2), shift)
        truth = view.truth(np.eye(2), shift)
        if 3 <= k < 6:
            u, v = np.rint(truth[0]).astype(int)
            image[v - 22 : v + 23, u - 22 : u + 23] = 128
        seen = detector.detect(frame(image, k / 30))
        assert seen.labels == (("2", "3") if 3 <= k < 6 else ("1", "2", "3"))
        rows = [int(label) - 1 for label in seen.labels]
        assert_allclose(seen.uv, truth[rows], atol=0.1)


def test_a_point_that_leaves_the_image_is_lost(rng: np.random.Generator) -> None:
    view = View(rng)
    detector = PointDetector(POINTS)
    for k in range(14):
        shift = np.array([12.0, 0.0]) * k
        seen = detector.detect(frame(view(np.eye(2), shift), k / 30))
        truth = view.truth(np.eye(2), shift)
        rows = [int(label) - 1 for label in seen.labels]
        assert_allclose(seen.uv, truth[rows], atol=0.6)
    assert "2" not in seen.labels


def test_another_scene_holds_none_of_the_points(rng: np.random.Generator) -> None:
    detector = PointDetector(POINTS)
    detector.detect(frame(View(rng)(np.eye(2), np.zeros(2)), 0.0))
    other = View(rng)
    for k in range(1, 5):
        assert len(detector.detect(frame(other(np.eye(2), np.zeros(2)), k / 30))) == 0


def test_names_of_ones_own(rng: np.random.Generator) -> None:
    detector = PointDetector(POINTS, names=("a", "b", "c"))
    assert detector.detect(frame(View(rng)(np.eye(2), np.zeros(2)))).labels == ("a", "b", "c")


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        ([], {}, "points"),
        ([[1.0, 2.0, 3.0]], {}, "points must have shape"),
        ([[np.nan, 2.0]], {}, "points has NaN"),
        ([[50.0, 50.0]], {"window_px": 8}, "window_px must be odd"),
        ([[50.0, 50.0]], {"names": ("a", "b")}, "names must be 1"),
    ],
)
def test_wrong_options_are_refused(
    points: object, options: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        PointDetector(points, **options)  # type: ignore[arg-type]


def test_points_that_cannot_be_followed_are_refused(rng: np.random.Generator) -> None:
    image = View(rng)(np.eye(2), np.zeros(2))
    for point in ([5.0, 100.0], [318.0, 100.0], [1e6, 1e6]):
        with pytest.raises(InputError, match="inside the image of 320x240"):
            PointDetector([point]).detect(frame(image))
    with pytest.raises(InputError, match="shows nothing to follow"):
        PointDetector([[100, 100]]).detect(frame(np.full((240, 320), 90, dtype=np.uint8)))
    detector = PointDetector(POINTS)
    detector.detect(frame(image))
    with pytest.raises(InputError, match="expected that of the first frame"):
        detector.detect(frame(image[:200], 1.0))

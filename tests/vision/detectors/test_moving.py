"""Moving things before a still camera."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.errors import InputError
from airground.vision.detectors.background import median_of_nine
from airground.vision.detectors.moving import MovingDetector
from vision.synthetic import coverage, frame, texture, to_bytes

SIZE = (200, 140)
COLOURS = [np.array([200.0, 210, 220]), np.array([30.0, 30, 35]), np.array([40.0, 60, 190])]


class Scene:
    """Textured ground, and rectangles on it that may cast shadows."""

    def __init__(self, rng: np.random.Generator, noise: float = 3.0, colour: bool = True) -> None:
        grey = 110 + 0.3 * (texture(rng, SIZE, 2.0).astype(float) - 128)
        self.ground = np.dstack([grey, grey + 5, grey + 10]) if colour else grey[..., None]
        self.noise, self.rng = noise, rng

    def __call__(
        self, *things: tuple[float, float, float, int], gain: float = 1.0, shadow: float = 0.0
    ) -> np.ndarray:
        image = self.ground.copy()
        for u, v, half, colour in things:
            if shadow:
                dark = coverage(SIZE, [u + 0.8 * half, v + 0.5 * half], (half, half), n=3)
                image *= 1 - shadow * cv2.GaussianBlur(dark, (0, 0), 1.0)[..., None]
            cover = coverage(SIZE, [u, v], (1.3 * half, half), 0.3, n=5, round_=False)[..., None]
            image = image * (1 - cover) + COLOURS[colour][: image.shape[2]] * cover
        return to_bytes(gain * image, self.noise, self.rng).squeeze()


def warmed(scene: Scene, **options: object) -> MovingDetector:
    detector = MovingDetector(**options)  # type: ignore[arg-type]
    detector.learn([frame(scene(), float(k)) for k in range(9)])
    return detector


@pytest.mark.parametrize("colour", [True, False])
@pytest.mark.parametrize(("half", "noise", "limit_px"), [(4.0, 3.0, 0.35), (25.0, 5.0, 0.3)])
def test_places_and_their_covariance(
    rng: np.random.Generator, half: float, noise: float, limit_px: float, colour: bool
) -> None:
    scene = Scene(rng, noise, colour)
    detector = warmed(scene)
    errors, squares = [], []
    for k in range(12):
        truth = np.array([60 + 4.3 * k, 60 + 1.7 * k])
        seen = detector.detect(frame(scene((*truth, half, k % 2)), float(k)))
        assert len(seen) == 1
        error = seen.uv[0] - truth
        errors.append(np.hypot(*error))
        squares.append(error @ np.linalg.solve(seen.covariance[0], error))
    assert np.sqrt(np.mean(np.square(errors))) < limit_px
    assert np.mean(squares) < 4.0
    assert np.isnan(seen.angle).all()


def test_a_shadow_is_taken_off(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = warmed(scene)
    for k in range(6):
        truth = np.array([60 + 6.0 * k, 70.0])
        seen = detector.detect(frame(scene((*truth, 14.0, 2), shadow=0.4), float(k)))
        assert_allclose(seen.uv, [truth], atol=0.9)  # with its shadow it would be 4 px off


def test_a_grey_thing_is_not_taken_for_its_shadow(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = warmed(scene)
    cover = coverage(SIZE, [90, 70], (12, 9), 0.0)[..., None]
    image = to_bytes(scene.ground * (1 - 0.4 * cover), 3.0, rng)
    assert_allclose(detector.detect(frame(image)).uv, [[90, 70]], atol=0.8)


def test_nothing_is_given_during_the_warm_up(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = MovingDetector(warm_up_frames=12)
    counts = [
        len(detector.detect(frame(scene((20 + 8.0 * k, 70, 8.0, 1)), float(k)))) for k in range(16)
    ]
    assert counts == [0] * 12 + [1] * 4


def test_an_empty_scene_stays_empty(rng: np.random.Generator) -> None:
    scene = Scene(rng, noise=5.0)
    detector = warmed(scene)
    assert [len(detector.detect(frame(scene(), float(k)))) for k in range(8)] == [0] * 8


def test_light_that_changes_slowly_or_at_once(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = warmed(scene, warm_up_frames=9)
    for k in range(15):  # slowly
        seen = detector.detect(frame(scene((50 + 3.0 * k, 70, 10.0, 0), gain=1 + 0.01 * k), k / 9))
        assert_allclose(seen.uv, [[50 + 3.0 * k, 70]], atol=0.6)
    scene.ground = scene.ground[::-1].copy()  # all at once, and not by one factor
    counts = [len(detector.detect(frame(scene(), 10.0 + k))) for k in range(14)]
    assert counts == [0] * 14
    seen = detector.detect(frame(scene((90, 70, 10.0, 2)), 30.0))
    assert_allclose(seen.uv, [[90, 70]], atol=0.6)


def test_exposure_that_jumps_is_levelled(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = warmed(scene)
    seen = detector.detect(frame(scene((90, 70, 10.0, 2), gain=1.35)))
    assert_allclose(seen.uv, [[90, 70]], atol=0.6)


def test_a_thing_that_stood_leaves_no_ghost_for_long(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = MovingDetector()
    detector.learn([frame(scene((50, 70, 10.0, 0)), float(k)) for k in range(9)])
    for k in range(8):
        seen = detector.detect(frame(scene((100 + 4.0 * k, 70, 10.0, 0)), float(k)))
    assert_allclose(seen.uv, [[128, 70]], atol=0.6)


def test_what_stops_stays_in_view(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = warmed(scene)
    for k in range(40):
        seen = detector.detect(frame(scene((90, 70, 8.0, 1)), float(k)))
    assert_allclose(seen.uv, [[90, 70]], atol=0.6)


def test_what_the_border_cuts_is_left_out(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = warmed(scene)
    assert len(detector.detect(frame(scene((3, 70, 10.0, 0))))) == 0
    assert len(detector.detect(frame(scene((20, 70, 10.0, 0)), 1.0))) == 1


def test_pixels_that_show_nothing_are_ignored(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = warmed(scene)
    valid = np.ones((SIZE[1], SIZE[0]), dtype=bool)
    valid[:, 130:] = False
    image = scene((60, 70, 8.0, 2), (170, 70, 8.0, 2)).copy()
    image[:, 150:, :] = 0
    assert_allclose(detector.detect(frame(image), valid).uv, [[60, 70]], atol=0.6)
    with pytest.raises(InputError, match="valid must have the frame's shape"):
        detector.detect(frame(image, 1.0), valid[1:])


def test_the_foot_is_below_the_centre(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    picture = frame(scene((90, 70, 14.0, 2)))
    centroid = warmed(scene).detect(picture)
    foot = warmed(scene, at="foot").detect(picture)
    lowest = 70 + 14 * np.cos(0.3) + 1.3 * 14 * np.sin(0.3)
    assert_allclose(foot.uv, [[90, lowest]], atol=1.5)
    assert centroid.uv[0, 1] < foot.uv[0, 1] - 10


def test_the_median_network(rng: np.random.Generator) -> None:
    images = list(rng.integers(0, 256, (9, 20, 30), dtype=np.uint8))
    assert_array_equal(median_of_nine(images), np.median(images, axis=0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"least_size_px": 1}, "sizes"),
        ({"warm_up_frames": 3}, "warm_up_frames"),
        ({"at": "middle"}, "at must be one of centroid, foot"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        MovingDetector(**options)  # type: ignore[arg-type]


def test_a_frame_of_another_size_is_refused(rng: np.random.Generator) -> None:
    scene = Scene(rng)
    detector = warmed(scene)
    with pytest.raises(InputError, match="expected"):
        detector.detect(frame(scene()[10:]))

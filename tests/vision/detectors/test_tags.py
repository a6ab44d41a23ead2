"""Tags: place, covariance, heading, identity, and what is no tag."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.errors import InputError
from airground.vision.detectors.tag_families import APRILTAG, ARUCO, family
from airground.vision.detectors.tags import TagDetector, detect_family
from airground.vision.sightings import Sightings
from vision.synthetic import Tag, draw_tags, frame, texture, tilted

SIZE = (240, 200)


def random_tag(rng: np.random.Generator, side: float, tilt: float) -> Tag:
    place = tilted(
        rng.uniform([110, 90], [130, 110]),
        side,
        tilt_deg=tilt,
        turn_deg=rng.uniform(0, 360),
        lean_deg=rng.uniform(0, 360),
    )
    return Tag(place, number=int(rng.integers(587)))


def normalised(error: np.ndarray, covariance: np.ndarray) -> float:
    return float(error @ np.linalg.solve(covariance, error))


def wrapped(angle: float) -> float:
    return (angle + np.pi) % (2 * np.pi) - np.pi


@pytest.mark.parametrize(
    ("setting", "limit_px"),
    [
        ((20, 0, 0.5, 2.0), 0.02),
        ((30, 50, 0.7, 5.0), 0.04),
        ((60, 30, 0.0, 2.0), 0.02),
        ((60, 60, 1.0, 8.0), 0.06),
        ((100, 20, 0.7, 3.0), 0.02),
    ],
)
def test_place_heading_and_their_covariance(
    rng: np.random.Generator, setting: tuple[float, float, float, float], limit_px: float
) -> None:
    """Limits are a few times what the benchmark shows; the mean normalised square of N(0, I) is 2."""
    side, tilt, blur, noise = setting
    errors, squares, headings = [], [], []
    for _ in range(6):
        tag = random_tag(rng, side, tilt)
        image = draw_tags([tag], SIZE, blur_px=blur, noise=noise, rng=rng, supersample=8)
        seen = TagDetector().detect(frame(image))
        assert seen.labels == (str(tag.number),)
        error = seen.uv[0] - tag.centre
        errors.append(np.hypot(*error))
        squares.append(normalised(error, seen.covariance[0]))
        up = tag.points([0.0, -1.0]) - tag.centre
        off = wrapped(float(seen.angle[0]) - float(np.arctan2(up[1], up[0])))
        headings.append((off / float(seen.angle_sigma[0])) ** 2)
        assert_allclose(seen.outline[0], tag.corners, atol=8 * limit_px)
    assert np.sqrt(np.mean(np.square(errors))) < limit_px
    assert 0.2 < np.mean(squares) < 5.0
    assert np.mean(headings) < 4.0


def test_the_centre_is_where_the_diagonals_meet(rng: np.random.Generator) -> None:
    tag = Tag(tilted([120, 100], 90, tilt_deg=65, lean_deg=0))
    seen = TagDetector().detect(frame(draw_tags([tag], SIZE, blur_px=0.5)))
    mean_of_corners = tag.corners.mean(axis=0)
    assert np.hypot(*(mean_of_corners - tag.centre)) > 0.5
    assert_allclose(seen.uv[0], tag.centre, atol=0.1)


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
def test_heading_is_from_the_bottom_to_the_top_as_printed(turn: float) -> None:
    """v points down: a tag that stands upright heads towards -v, which is -90 degrees."""
    tag = Tag(tilted([120, 100], 60, turn_deg=turn))
    seen = TagDetector().detect(frame(draw_tags([tag], SIZE)))
    assert wrapped(float(seen.angle[0]) - np.radians(turn - 90)) == pytest.approx(0, abs=0.01)


def test_the_pattern_is_the_printed_one() -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    printed = cv2.aruco.generateImageMarker(dictionary, 7, 8) > 127
    assert_array_equal(family("36h11").pattern(7) > 0.5, printed)


@pytest.mark.parametrize("colour", [False, True])
def test_grey_and_colour_give_the_same(colour: bool, rng: np.random.Generator) -> None:
    image = draw_tags([Tag(tilted([120, 100], 50, tilt_deg=20))], SIZE, noise=2, rng=rng)
    grey = TagDetector().detect(frame(image))
    seen = TagDetector().detect(frame(np.dstack([image] * 3) if colour else image))
    assert_array_equal(seen.uv, grey.uv)


def moving_scene(k: int, rng: np.random.Generator) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    t = k / 30
    tags = [
        Tag(
            tilted(
                [60 + 90 * i + 90 * t, 60 + 40 * np.sin(3 * t + i)], 34 + 6 * i, turn_deg=90 * t
            ),
            number=i,
        )
        for i in range(2)
    ]
    image = draw_tags(tags, (320, 160), blur_px=0.6, noise=3, rng=rng, supersample=4)
    return image, {str(tag.number): tag.centre for tag in tags}


def test_tags_are_followed_and_the_search_gives_the_same(rng: np.random.Generator) -> None:
    followed, searched = TagDetector(), TagDetector(rescan_frames=1)
    for k in range(12):
        image, truth = moving_scene(k, rng)
        now = followed.detect(frame(image, k / 30))
        assert now.labels == ("0", "1")
        for uv, label in zip(now.uv, now.labels, strict=True):
            assert_allclose(uv, truth[label], atol=0.15)
        assert searched.detect(frame(image, k / 30)).labels == now.labels


def test_the_same_frames_give_the_same_bits(rng: np.random.Generator) -> None:
    images = [moving_scene(k, rng)[0] for k in range(4)]

    def run() -> list[Sightings]:
        detector = TagDetector()
        return [detector.detect(frame(image, k / 30)) for k, image in enumerate(images)]

    for a, b in zip(run(), run(), strict=True):
        assert_array_equal(a.uv, b.uv)
        assert_array_equal(a.covariance, b.covariance)
        assert_array_equal(a.angle, b.angle)


def test_a_tag_that_jumps_vanishes_and_comes_back(rng: np.random.Generator) -> None:
    detector = TagDetector()

    def look(k: int, *places: tuple[float, float]) -> Sightings:
        tags = [Tag(tilted(place, 40), number=3) for place in places]
        image = draw_tags(tags, SIZE, blur_px=0.5, noise=2, rng=rng, supersample=4)
        return detector.detect(frame(image, k / 30))

    assert len(look(0, (60, 60))) == 1
    assert_allclose(look(1, (90, 75)).uv, [[90, 75]], atol=0.1)  # 33 px: no fit reaches it
    assert_allclose(look(2, (180, 150)).uv, [[180, 150]], atol=0.1)
    assert len(look(3)) == 0
    assert len(look(4)) == 0
    assert_allclose(look(5, (60, 140)).uv, [[60, 140]], atol=0.1)


def test_a_new_tag_is_found_while_another_is_followed(rng: np.random.Generator) -> None:
    detector = TagDetector(rescan_frames=4)
    counts = []
    for k in range(8):
        tags = [Tag(tilted([60, 60], 40), number=1)]
        tags += [Tag(tilted([170, 120], 40), number=2)] if k >= 2 else []
        image = draw_tags(tags, SIZE, noise=2, rng=rng, supersample=4)
        counts.append(len(detector.detect(frame(image, k / 30))))
    assert counts[:2] == [1, 1]
    assert counts[6:] == [2, 2]


def test_both_of_two_tags_of_one_number_are_given(rng: np.random.Generator) -> None:
    tags = [Tag(tilted([60, 60], 40), number=5), Tag(tilted([170, 120], 40), number=5)]
    detector = TagDetector()
    for k in range(2):
        seen = detector.detect(frame(draw_tags(tags, SIZE, noise=2, rng=rng), k / 30))
        assert seen.labels == ("5", "5")


def test_a_half_covered_tag_is_left_out_or_right(rng: np.random.Generator) -> None:
    tag = Tag(tilted([120, 100], 60))
    image = draw_tags([tag], SIZE, noise=2, rng=rng)
    detector = TagDetector()
    detector.detect(frame(image, 0.0))
    for k, columns in enumerate((4, 12, 30, 45, 60), start=1):
        covered = image.copy()
        covered[60:140, 85 : 85 + columns] = 90
        seen = detector.detect(frame(covered, k / 30))
        for uv in seen.uv:
            assert_allclose(uv, tag.centre, atol=0.3)


def test_labels_name_the_family_where_there_are_several(rng: np.random.Generator) -> None:
    tags = [
        Tag(tilted([60, 60], 50), number=4, family="36h11"),
        Tag(tilted([170, 60], 50), number=9, family="5x5"),
        Tag(tilted([110, 150], 50), number=2, family="16h5"),
    ]
    image = draw_tags(tags, SIZE, blur_px=0.5, noise=2, rng=rng)
    seen = TagDetector(("36h11", "5x5", "16h5")).detect(frame(image))
    assert seen.labels == ("36h11:4", "5x5:9", "16h5:2")
    for uv, tag in zip(seen.uv, tags, strict=True):
        assert_allclose(uv, tag.centre, atol=0.05)


@pytest.mark.parametrize("grain", [1.5, 4.0])
def test_random_texture_holds_no_tags(rng: np.random.Generator, grain: float) -> None:
    detector = TagDetector((*APRILTAG, *ARUCO), rescan_frames=1)
    for k in range(2):
        image = texture(rng, (480, 360), grain)
        assert len(detector.detect(frame(image, k / 30))) == 0


def test_random_quadrilaterals_hold_no_tags(rng: np.random.Generator) -> None:
    """Black squares with spots in them: small dictionaries decode some of these by chance."""
    image = np.full((360, 480), 200, dtype=np.uint8)
    for row in range(4):
        for column in range(6):
            square = np.full((48, 48), 30, dtype=np.uint8)
            square[10:38, 10:38] = texture(rng, (28, 28), 4.0)
            image[20 + 85 * row : 68 + 85 * row, 16 + 78 * column : 64 + 78 * column] = square
    seen = TagDetector(("4x4", "16h5", "original")).detect(frame(image))
    assert len(seen) == 0


def test_which_families_are_there(rng: np.random.Generator) -> None:
    def frames(name: str) -> list[object]:
        tag = Tag(tilted([120, 100], 60, tilt_deg=20), number=3, family=name)
        return [
            frame(draw_tags([tag], SIZE, noise=2, rng=rng, supersample=4), k / 9) for k in range(3)
        ]

    for name in ("36h11", "4x4"):
        assert detect_family(frames(name)) == [name]  # type: ignore[arg-type]
    assert detect_family([]) == []
    assert detect_family([frame(texture(rng, SIZE), k / 9) for k in range(2)]) == []


@pytest.mark.parametrize("shape", [(1, 1), (5, 400), (12, 12)])
def test_images_too_small_for_a_tag(shape: tuple[int, int]) -> None:
    detector = TagDetector()
    assert len(detector.detect(frame(np.full(shape, 128, dtype=np.uint8)))) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"families": ()}, "name one tag family"),
        ({"families": ("37h2",)}, "no tag family '37h2'"),
        ({"rescan_frames": 0}, "rescan_frames"),
        ({"least_correlation": 1.5}, "least_correlation"),
        ({"least_side_px": np.nan}, "least_side_px"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        TagDetector(**options)  # type: ignore[arg-type]

"""The search for new tags: part by part, none left out, in half a second."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from airground.vision.detectors.tag_families import families_named
from airground.vision.detectors.tag_parts import OVERLAP_PX, parts_of
from airground.vision.detectors.tag_search import TagSearch, grey_part
from airground.vision.detectors.tags import TagDetector
from vision.synthetic import Tag, draw_tags, frame, texture, tilted

SIZE = (1280, 720)
FOLLOWED = Tag(tilted([200, 150], 40), number=1)


def scene(rng: np.random.Generator, *tags: Tag) -> np.ndarray:
    """A grained ground with noise."""
    coarse = texture(rng, (SIZE[0] // 2, SIZE[1] // 2), 3.0)
    ground = (70.0 + 0.3 * cv2.resize(coarse, SIZE)).astype(np.uint8)
    return draw_tags(
        list(tags), SIZE, background=ground, blur_px=0.6, noise=3, rng=rng, supersample=4
    )


@pytest.mark.parametrize("rate_hz", [10.0, 20.0, 30.0])
def test_a_tag_that_appears_anywhere_is_found_within_half_a_second(
    rate_hz: float, rng: np.random.Generator
) -> None:
    detector = TagDetector()
    empty = scene(rng, FOLLOWED)
    for k in range(3):
        assert detector.detect(frame(empty, k / rate_hz)).labels == ("1",)
    places = [
        (30.0, 30.0),
        (1245.0, 690.0),
        (640.0, 360.0),
        tuple(rng.uniform([320, 40], [1240, 680])),
    ]
    new = [
        Tag(tilted(place, side, turn_deg=float(rng.uniform(0, 360))), number=2 + k)
        for k, (place, side) in enumerate(zip(places, (20, 28, 120, 45), strict=True))
    ]
    image = scene(rng, FOLLOWED, *new)
    frames = int(0.5 * rate_hz) + 1  # the first of them may have come right after they appeared
    for k in range(3, 3 + frames):
        seen = detector.detect(frame(image, k / rate_hz))
        assert "1" in seen.labels
    assert seen.labels == ("1", "2", "3", "4", "5")


def test_no_frame_searches_more_than_a_part() -> None:
    """A whole search took as long as ten frames may: a robot's command waited for it."""
    detector, looked = TagDetector(), []
    find, find_part = TagSearch.find, TagSearch.find_part

    class Counting(TagSearch):
        def find(self, image, window=None):  # type: ignore[no-untyped-def]
            looked.append(image.size if window is None else 0)
            return find(self, image, window)

        def find_part(self, image, part, **options):  # type: ignore[no-untyped-def]
            looked.append(part.pixels)
            return find_part(self, image, part, **options)

    detector._search = Counting(families_named(["36h11"]), 8.0)
    both = draw_tags([FOLLOWED, Tag(tilted([900, 500], 40), number=2)], SIZE, supersample=2)
    one = draw_tags([FOLLOWED], SIZE, supersample=2)
    for k in range(30):
        looked.clear()
        seen = detector.detect(frame(both if k < 10 else one, k / 20))
        assert len(seen) == (2 if k < 10 else 1)
        if k > 0:
            assert sum(looked) < 0.25 * one.size


@pytest.mark.parametrize("before", [False, True])
@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080), (640, 480), (320, 240), (800, 1200)])
def test_every_tag_lies_within_a_part(
    size: tuple[int, int], before: bool, rng: np.random.Generator
) -> None:
    """Whatever its place: small ones at full size, large ones where the image is made smaller."""
    sets = parts_of(size[::-1], 10, before=before)
    parts = [part for together in sets for part in together]
    assert len(sets) <= 10
    assert max(sum(part.pixels for part in each) for each in sets) < 0.85 * size[0] * size[1]
    for scale, largest in ((1, OVERLAP_PX), (2, 2 * OVERLAP_PX), (4, min(size))):
        side = min(largest, *size) - 2
        for _ in range(50):
            low = np.floor(rng.uniform(0, np.array(size) - side))
            assert any(
                part.scale == scale
                and (low >= part.window[:2]).all()
                and (low + side <= part.window[2:]).all()
                for part in parts
            )


def test_small_images_are_not_divided() -> None:
    assert parts_of((200, 240), 10) == ()
    assert parts_of((720, 1280), 1) == ()


@pytest.mark.parametrize("side", [24.0, 70.0, 200.0])
def test_parts_place_tags_where_the_whole_search_does(
    side: float, rng: np.random.Generator
) -> None:
    tag = Tag(tilted([500, 300], side, turn_deg=20.0), number=4)
    image = draw_tags([tag], (960, 720), blur_px=0.5, noise=2, rng=rng, supersample=4)
    search = TagSearch(families_named(["36h11"]), 8.0)
    found = [
        candidate
        for together in parts_of(image.shape, 10)
        for part in together
        for candidate in search.find_part(image, part)
    ]
    assert found
    for candidate in found:
        assert candidate.number == 4
        assert np.abs(candidate.corners - tag.corners).max() < max(2.5, 0.05 * side)


def test_grey_of_a_part_is_the_part_of_the_grey(rng: np.random.Generator) -> None:
    image = rng.integers(0, 255, (90, 120, 3), dtype=np.uint8)
    whole = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    np.testing.assert_array_equal(grey_part(image, (13, 7, 101, 66)), whole[7:66, 13:101])
    np.testing.assert_array_equal(grey_part(whole, (13, 7, 101, 66)), whole[7:66, 13:101])

"""Tags that are known are given at once, and the search for others comes afterwards: no frame waits for it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.vision.detectors import tag_fit, tags
from airground.vision.detectors.auto import AutoDetector
from airground.vision.detectors.protocol import PromptDetector
from airground.vision.detectors.registry import make_detector
from airground.vision.detectors.tag_model import design_of
from airground.vision.detectors.tag_search import TagSearch
from airground.vision.detectors.tags import TagDetector
from airground.vision.frame import Frame
from airground.vision.sightings import Sightings
from vision.synthetic import Tag, draw_tags, frame, tilted

SIZE = (320, 200)
DT = 1 / 30


def shown(k: int, rng: np.random.Generator, places: dict[int, tuple[float, float]]) -> Frame:
    marks = [Tag(tilted(place, 40), number=number) for number, place in places.items()]
    return frame(draw_tags(marks, SIZE, blur_px=0.5, noise=2, rng=rng, supersample=4), k * DT)


def taken(detector: TagDetector, now: Frame) -> Sightings:
    seen = detector.follow(now)
    detector.look_around()
    return seen


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the searches that were made."""
    made: list[str] = []
    for name in ("find", "find_part", "glance"):
        before = getattr(TagSearch, name)

        def noted(*arguments: object, _name: str = name, _before: object = before, **more: object):  # type: ignore[no-untyped-def]
            made.append(_name)
            return _before(*arguments, **more)  # type: ignore[operator]

        monkeypatch.setattr(TagSearch, name, noted)
    return made


def test_what_moves_is_given_as_by_patient_detection(rng: np.random.Generator) -> None:
    prompt, patient = TagDetector(), TagDetector()
    for k in range(12):
        now = shown(k, rng, {1: (60 + 3 * k, 60), 2: (200 - 2 * k, 80 + 2 * k)})
        seen, other = taken(prompt, now), patient.detect(now)
        assert seen.labels == other.labels == ("1", "2")
        assert_allclose(seen.uv, [[60 + 3 * k, 60], [200 - 2 * k, 80 + 2 * k]], atol=0.1)
        assert_allclose(seen.uv, other.uv, atol=0.01)


def test_where_nothing_is_known_all_is_found_at_once(rng: np.random.Generator) -> None:
    detector = TagDetector()
    assert detector.follow(shown(0, rng, {})).labels == ()
    assert detector.follow(shown(1, rng, {1: (60, 60), 2: (200, 80)})).labels == ("1", "2")


def test_a_new_tag_is_found_afterwards_and_given_with_the_next_frame(
    rng: np.random.Generator, searches: list[str]
) -> None:
    detector = TagDetector(rescan_frames=1)
    taken(detector, shown(0, rng, {1: (60, 60)}))
    both = {1: (60.0, 60.0), 2: (200.0, 80.0)}
    searches.clear()
    assert detector.follow(shown(1, rng, both)).labels == ("1",)
    assert searches == []
    detector.look_around()
    assert searches
    searches.clear()
    assert detector.follow(shown(2, rng, both)).labels == ("1", "2")
    assert searches == []


def test_who_never_looks_around_sees_nothing_new(rng: np.random.Generator) -> None:
    detector = TagDetector(rescan_frames=1)
    detector.follow(shown(0, rng, {1: (60, 60)}))
    for k in range(1, 4):
        assert detector.follow(shown(k, rng, {1: (60, 60), 2: (200, 80)})).labels == ("1",)
    detector.look_around()
    detector.look_around()  # once is enough: there is nothing to do any more
    assert detector.follow(shown(4, rng, {1: (60, 60), 2: (200, 80)})).labels == ("1", "2")


def test_of_tags_that_jumped_one_is_looked_for_at_once(
    rng: np.random.Generator, searches: list[str]
) -> None:
    detector = TagDetector(rescan_frames=1000)
    at = {1: (60.0, 60.0), 2: (200.0, 60.0), 3: (60.0, 140.0)}
    taken(detector, shown(0, rng, at))
    taken(detector, shown(1, rng, at))
    jumped = {1: (60.0, 60.0), 2: (230.0, 75.0), 3: (90.0, 150.0)}  # no fit reaches them
    now = shown(2, rng, jumped)
    searches.clear()
    seen = detector.follow(now)
    assert seen.labels == ("1", "2")
    assert searches == ["glance"]
    assert_allclose(seen.uv[1], jumped[2], atol=0.1)
    detector.look_around()
    seen = detector.follow(shown(3, rng, jumped))
    assert seen.labels == ("1", "2", "3")
    assert_allclose(seen.uv, list(jumped.values()), atol=0.1)


def test_a_large_tag_that_jumped_is_looked_for_afterwards(
    rng: np.random.Generator, searches: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tags, "HASTY_PIXELS", 2000)
    detector = TagDetector(rescan_frames=1000)
    for k in range(2):
        taken(detector, shown(k, rng, {1: (60, 60), 2: (200, 60)}))
    searches.clear()
    assert detector.follow(shown(2, rng, {1: (60, 60), 2: (230, 75)})).labels == ("1",)
    assert searches == []
    detector.look_around()
    assert detector.follow(shown(3, rng, {1: (60, 60), 2: (230, 75)})).labels == ("1", "2")


def test_a_tag_that_went_away_is_found_where_it_comes_back(rng: np.random.Generator) -> None:
    detector = TagDetector(rescan_frames=1000)
    for k in range(3):
        taken(detector, shown(k, rng, {1: (60, 60), 2: (200, 60)}))
    for k in range(3, 6):
        assert taken(detector, shown(k, rng, {1: (60, 60)})).labels == ("1",)
    taken(detector, shown(6, rng, {1: (60, 60), 2: (210, 70)}))
    assert taken(detector, shown(7, rng, {1: (60, 60), 2: (210, 70)})).labels == ("1", "2")


def test_few_steps_are_taken_of_a_fit_before_the_answer(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[int] = []

    def counted(*arguments: object) -> np.ndarray:
        drawn.append(1)
        return design_of(*arguments)  # type: ignore[arg-type]

    detector, patient = TagDetector(), TagDetector()
    for k in range(2):
        now = shown(k, rng, {1: (60, 60), 2: (200, 60)})
        taken(detector, now)
        patient.detect(now)
    gone = shown(2, rng, {1: (60, 60)})
    monkeypatch.setattr(tag_fit, "design_of", counted)
    monkeypatch.setattr(tag_fit, "LONGEST", np.zeros(10))  # no fit is ever done
    detector.follow(gone)
    assert len(drawn) == tags.HASTY_STEPS
    drawn.clear()
    patient.detect(gone)
    assert len(drawn) == tag_fit.ITERATIONS


def test_a_camera_that_came_back_has_nothing_pending(rng: np.random.Generator) -> None:
    detector = TagDetector(rescan_frames=1)
    taken(detector, shown(0, rng, {1: (60, 60)}))
    detector.follow(shown(1, rng, {1: (60, 60)}))
    image = shown(0, rng, {2: (200, 60)}).image
    assert detector.follow(Frame(image, 0.0, segment=1)).labels == ("2",)
    detector.look_around()
    assert detector.detect(Frame(image, DT, segment=1)).labels == ("2",)


def test_the_automatic_choice_answers_at_once_too(rng: np.random.Generator) -> None:
    detector = AutoDetector()
    at = {1: (60.0, 60.0)}
    assert detector.follow(shown(0, rng, at)).labels == ("1",)
    assert isinstance(detector.chosen, PromptDetector)
    detector.look_around()
    both = {**at, 2: (200.0, 80.0)}
    counts = []
    for k in range(1, 20):
        counts.append(len(detector.follow(shown(k, rng, both))))
        detector.look_around()
    assert counts[0] == 1
    assert counts[-1] == 2
    assert isinstance(make_detector("tag"), PromptDetector)
    assert not isinstance(make_detector("moving"), PromptDetector)


def test_without_tags_the_automatic_choice_has_nothing_to_follow(rng: np.random.Generator) -> None:
    detector = AutoDetector(probe_frames=2)
    for k in range(4):
        assert len(detector.follow(shown(k, rng, {}))) == 0
        detector.look_around()
    assert not isinstance(detector.chosen, PromptDetector)

"""Eyes in another process see what eyes in this one see, and tell of their troubles."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import partial
from multiprocessing.shared_memory import SharedMemory

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from airground.errors import AirgroundError, InputError, UnreachableError
from airground.vision.eyes import Eyes, Look
from airground.vision.eyes_apart import EyesApart
from airground.vision.frame import Frame
from airground.vision.threads import use_threads
from vision import apart_work
from vision.synthetic import Tag, draw_tags, texture, tilted

GREY = np.full((90, 160), 120, dtype=np.uint8)
NAME = "detector and tracker"


def processes() -> list[int]:
    return [p.pid or 0 for p in multiprocessing.active_children() if p.name == NAME]


@pytest.fixture(autouse=True)
def _no_process_is_left() -> Iterator[None]:
    assert processes() == []
    yield
    assert processes() == []


def blank(index: int, t: float | None = None) -> Frame:
    return Frame(GREY, index / 20 if t is None else t, index=index)


def same(one: object, other: object) -> None:
    """Compare the fields of two values of one type."""
    assert type(one) is type(other)
    for field in fields(one):  # type: ignore[arg-type]
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, np.ndarray):
            assert_array_equal(a, b, err_msg=field.name)
        else:
            assert a == b, field.name


def same_look(one: Look, other: Look) -> None:
    assert one.frame is other.frame
    same(one.seen, other.seen)
    same(one.sightings, other.sightings)
    same(one.state, other.state)
    assert (one.stabilization is None) == (other.stabilization is None)
    if one.stabilization is not None and other.stabilization is not None:
        assert_array_equal(one.image_from_stable, other.image_from_stable)


def looked(eyes: Eyes, frame: Frame) -> Look:
    look = eyes.look(frame, at_once=True)
    eyes.look_around()
    return look


def test_a_look_is_that_of_eyes_in_this_process(rng: np.random.Generator) -> None:
    """Images of two sizes, grey and in colour, with a tag more from the third frame on."""
    use_threads(1)
    here = apart_work.real_eyes()
    counts = []
    with EyesApart(apart_work.real_eyes) as there:
        for k in range(9):
            tags = [Tag(tilted([60 + 2 * k, 60], 40), number=1)]
            tags += [Tag(tilted([150, 110 - k], 36, turn_deg=9 * k), number=2)] if k > 1 else []
            size = (200, 150) if k < 6 else (240, 180)
            image = draw_tags(tags, size, blur_px=0.5, noise=2, rng=rng, supersample=4)
            colour = k % 2 == 1
            frame = Frame(
                np.dstack([image] * 3) if colour else image,
                k / 20,
                "wall",
                index=k,
                late_s=0.01 * k,
            )
            look = there.look(frame)
            same_look(look, looked(here, frame))
            counts.append(len(look.seen))
    assert counts[0] == 1
    assert counts[-1] == 2


def test_a_moving_cameras_stable_view_comes_along(rng: np.random.Generator) -> None:
    use_threads(1)
    make = partial(apart_work.real_eyes, moving=True)
    here = make()
    ground = texture(rng, (400, 300))
    with EyesApart(make) as there:
        for k in range(3):
            frame = Frame(np.ascontiguousarray(ground[3 * k :][:240, 2 * k :][:, :320]), k / 20)
            look = there.look(frame)
            same_look(look, looked(here, frame))
    assert not look.lost
    assert look.image_from_stable is not None
    assert look.image_from_stable[0, 2] == pytest.approx(-4, abs=0.5)


@pytest.mark.parametrize(
    ("make", "kind", "line"),
    [
        (apart_work.no_such_eyes, InputError, "there are no such eyes"),
        (apart_work.undetermined_eyes, AirgroundError, "which eyes"),
        (apart_work.broken_eyes, RuntimeError, "a bug"),
        (apart_work.eyes_that_die, UnreachableError, "detector and tracker: its process has died"),
    ],
)
def test_trouble_with_making_them_is_told(
    make: Callable[[], Eyes], kind: type[Exception], line: str
) -> None:
    with pytest.raises(kind, match=line) as raised:
        EyesApart(make)
    assert raised.type is kind


def test_trouble_with_a_frame_is_told_and_the_next_is_looked_at() -> None:
    with EyesApart(apart_work.touchy_eyes) as eyes:
        (process,) = processes()
        eyes.look(blank(0))
        for index, kind, line in (
            (1, InputError, "^frame 1 is not well formed$"),
            (2, AirgroundError, "^nothing can be said of frame 2$"),
            (10, InputError, r"^[1-9][0-9]{4,} frozen$"),  # no garbage is looked for among modules
            (3, RuntimeError, r"(?s)^KeyError\('three'\).*in detect"),
        ):
            with pytest.raises(kind, match=line) as raised:
                eyes.look(blank(index))
            assert raised.type is kind
        assert len(eyes.look(blank(5)).seen) == 1
        with pytest.raises(InputError, match="do not follow"):
            eyes.look(blank(5))
        assert processes() == [process]


def test_trouble_with_looking_around_is_told_at_the_next_look() -> None:
    with EyesApart(apart_work.clumsy_eyes) as eyes:
        assert len(eyes.look(blank(7)).seen) == 1
        with pytest.raises(RuntimeError, match="seven"):
            eyes.look(blank(8))
        assert len(eyes.look(blank(9)).seen) == 1


def test_after_its_death_there_are_fresh_eyes() -> None:
    with EyesApart(apart_work.touchy_eyes) as eyes:
        for k in range(20, 30):
            look = eyes.look(blank(k))
        assert look.state.names == ("track-1",)
        with pytest.raises(UnreachableError, match="detector and tracker: its process has died"):
            eyes.look(blank(4, t=5.0))
        assert processes() == []
        look = eyes.look(blank(6, t=0.0))  # these remember no frame
        assert look.state.names == ("candidate-1",)
        (process,) = processes()
        os.kill(process, signal.SIGKILL)  # while nobody waits for it
        with pytest.raises(UnreachableError):
            eyes.look(blank(7, t=0.1))
        assert eyes.look(blank(7, t=0.1)).state.names == ("candidate-1",)


def test_eyes_that_hang_are_given_up() -> None:
    with EyesApart(apart_work.touchy_eyes, patience_s=3.0) as eyes:
        with pytest.raises(UnreachableError, match="detector and tracker: no answer for 3 s"):
            eyes.look(blank(11))
        assert processes() == []
        assert eyes.look(blank(12)).state.names == ("candidate-1",)


def test_close_leaves_neither_process_nor_memory() -> None:
    eyes = EyesApart(apart_work.touchy_eyes)
    eyes.look(blank(0))
    assert eyes._images is not None
    name = eyes._images.name
    assert len(processes()) == 1
    eyes.close()
    eyes.close()
    assert processes() == []
    with pytest.raises(FileNotFoundError):
        SharedMemory(name)

"""Pictures drawn in another process are those that this one would draw."""

from __future__ import annotations

import os
import signal
from contextlib import closing

import numpy as np
import pytest

from airground.control.command import VelocityCommand
from airground.errors import UnreachableError
from airground.sim.live_options import EmbeddedOptions
from airground.sim.live_studio import Studio
from airground.sim.live_world import EmbeddedWorld


def driven() -> EmbeddedWorld:
    world = EmbeddedWorld(EmbeddedOptions(robots=2), seed=3)
    for k in range(60):
        t = 0.02 * k
        world.advance(t)
        world.command("red", t, VelocityCommand(0.4, 0.8))
        world.command("blue", t, VelocityCommand(0.0, 1.5))
        world.pictures(t)
    return world


def test_the_same_picture_and_an_end_in_order() -> None:
    world, same = driven(), driven()
    world.advance(1.4)
    same.advance(1.4)
    pictures, again = world.pictures(1.4), same.pictures(1.4)
    assert pictures
    with closing(Studio(world)) as studio:
        studio.open()
        for picture, other in zip(pictures, again, strict=True):
            frame, expected = studio.draw(picture), same.draw(other)
            assert (frame.t, frame.index, frame.clock) == (expected.t, expected.index, "world")
            # Poses are interpolated over some milliseconds: a grey level at an edge may differ.
            off = np.abs(frame.image.astype(int) - expected.image.astype(int))
            assert off.max() <= 8
            assert np.mean(off > 1) < 1e-4
            assert not np.array_equal(frame.image, np.zeros_like(frame.image))
        process = studio._process
    assert not process.is_alive()


def test_a_studio_that_dies_is_said() -> None:
    world = driven()
    world.advance(1.4)
    (picture, *_) = world.pictures(1.4)
    with closing(Studio(world)) as studio:
        studio.open()
        assert studio._process.pid is not None
        os.kill(studio._process.pid, signal.SIGKILL)
        studio._process.join(10)
        with pytest.raises(UnreachableError, match="has died"):
            studio.draw(picture)

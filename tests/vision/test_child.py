"""A process that works for this one."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time

import pytest

from airground.errors import UnreachableError
from airground.vision import child as module
from airground.vision.child import Child
from vision import apart_work


def process(child: Child) -> int:
    (mine,) = (p.pid for p in multiprocessing.active_children() if p.name == child._what)
    assert mine is not None
    return mine


def alive(child: Child) -> bool:
    return child.alive


def test_it_answers_whatever_is_asked_until_it_is_closed() -> None:
    child = Child("the doubler", apart_work.double, 1)
    assert alive(child)
    assert [child.ask(k) for k in (1, 20)] == [3, 41]
    os.kill(process(child), signal.SIGINT)  # Ctrl-C goes to all processes of a terminal
    time.sleep(0.2)
    assert child.ask(5) == 11
    child.close()
    child.close()
    assert not alive(child)
    assert child._process.exitcode == 0  # by itself, as nobody asks any more


def test_one_that_was_killed_is_unreachable() -> None:
    child = Child("the doubler", apart_work.double, 0)
    assert child.ask(2) == 4
    os.kill(process(child), signal.SIGKILL)
    child._process.join(10)
    assert not alive(child)
    for _ in range(2):
        with pytest.raises(UnreachableError, match="the doubler: its process has died"):
            child.ask(1)
    child.close()


def test_one_that_dies_while_asked_is_unreachable() -> None:
    child = Child("the mayfly", apart_work.dies_when_asked)
    with pytest.raises(UnreachableError, match="the mayfly"):
        child.ask("anything")
    child.close()
    assert child._process.exitcode == 3


def test_one_that_does_not_listen_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CLOSING_S", 0.2)
    child = Child("the deaf one", apart_work.stubborn)
    assert child.pipe.recv() == "here"
    began = time.monotonic()
    child.close()
    assert time.monotonic() - began >= 0.2
    child._process.join(10)
    assert child._process.exitcode == -signal.SIGTERM

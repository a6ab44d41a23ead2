"""Work done here or by several processes: the same numbers, in order, and a clean end."""

from __future__ import annotations

import operator
import os
import time
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from airground.errors import UnreachableError
from airground.studies import workers as module
from airground.studies.simulation import BLOCK, PAPER, run_trials, trial_generators
from airground.studies.whole_drive import whole_drive_trials
from airground.studies.workers import HERE, Processes, cores, in_order

if TYPE_CHECKING:
    from collections.abc import Iterator

TRIALS = 2 * BLOCK + 7


def test_numbers_do_not_depend_on_who_works(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FEW", 1)
    here = run_trials(trials=TRIALS, seed=4)
    here_whole = whole_drive_trials(here, PAPER)
    told: list[tuple[int, int]] = []
    with Processes(2) as workers:
        there = run_trials(
            trials=TRIALS, seed=4, workers=workers, progress=lambda d, t: told.append((d, t))
        )
        there_whole = whole_drive_trials(there, PAPER, workers=workers)
        with pytest.raises(UnreachableError, match="was lost"):
            list(workers.map(os._exit, [(3,)], 1))
    assert told == [(25, 57), (50, 57), (57, 57)]
    for name in ("g", "g_hat", "ideal_uv_dot"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name))
    for mine, theirs in zip(here.samples, there.samples, strict=True):
        np.testing.assert_array_equal(theirs.uv, mine.uv)
        np.testing.assert_array_equal(theirs.xy_dot, mine.xy_dot)
    np.testing.assert_array_equal(there_whole.g_hat, here_whole.g_hat)
    np.testing.assert_array_equal(there_whole.uv_dot, here_whole.uv_dot)


def test_several_processes_work_and_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FEW", 1)
    with Processes(2) as workers:
        given = list(workers.map(operator.mul, ((k, k) for k in range(30)), 30))
        pids = set(workers.map(os.getpid, ((),) * 4, 4))
    assert given == [k * k for k in range(30)]
    assert os.getpid() not in pids
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_little_work_and_one_job_stay_here() -> None:
    with Processes(8) as workers:
        assert set(workers.map(os.getpid, ((),) * 15, 15)) == {os.getpid()}
    with Processes(1) as workers:
        assert set(workers.map(os.getpid, ((),) * 50, 50)) == {os.getpid()}
    assert cores() >= 1


def test_tasks_are_taken_as_they_are_needed_and_results_keep_their_order() -> None:
    waiting: list[Future[int]] = []

    def submit(task: tuple[Any, ...]) -> Future[int]:
        future: Future[int] = Future()
        future.set_result(task[0])
        waiting.append(future)
        return future

    def tasks() -> Iterator[tuple[int]]:
        yield from ((k,) for k in range(1_000_000_000))

    results = in_order(submit, tasks(), 5)
    assert [next(results) for _ in range(20)] == list(range(20))
    assert len(waiting) == 24


def test_an_error_drops_what_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FEW", 1)
    begun = time.monotonic()
    with pytest.raises(ZeroDivisionError), Processes(1 + 1) as workers:
        for _ in workers.map(divmod, ((1, k) for k in range(10**9)), 10**9):
            pass
    assert time.monotonic() - begun < 20


def test_trials_have_the_random_numbers_that_the_seed_spawns() -> None:
    spawned = [np.random.default_rng(s).random() for s in np.random.SeedSequence(9).spawn(7)]
    assert [rng.random() for rng in trial_generators(9, 7)] == spawned
    assert [rng.random() for rng in trial_generators(9, 3, first=4)] == spawned[4:]


def test_more_trials_add_to_the_same_ones() -> None:
    few, many = run_trials(trials=30, workers=HERE), run_trials(trials=60)
    np.testing.assert_array_equal(many.g_hat[:30], few.g_hat)
    a, b = whole_drive_trials(few, PAPER), whole_drive_trials(many, PAPER)
    np.testing.assert_allclose(b.g_hat[:30], a.g_hat, rtol=1e-9, atol=1e-9)

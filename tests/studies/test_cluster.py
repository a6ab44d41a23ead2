"""Trials on a Dask cluster: the same numbers; clear words where there is none."""

from __future__ import annotations

import socket
import sys
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from airground.cli import main
from airground.errors import InputError, UnreachableError
from airground.studies import cluster as module
from airground.studies.cluster import Cluster
from airground.studies.simulation import BLOCK, PAPER, run_trials
from airground.studies.whole_drive import whole_drive_trials

if TYPE_CHECKING:
    from collections.abc import Iterator

TRIALS = BLOCK + 5


@pytest.fixture(scope="module")
def local() -> Iterator[Any]:
    """A cluster on this computer, of threads of this process: what a process would add is tested there."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=2,
        processes=False,
        protocol="tcp",
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
    ) as cluster:
        yield cluster


@pytest.fixture
def address(local: Any) -> str:
    return str(local.scheduler_address)


def test_numbers_are_those_of_this_computer(address: str) -> None:
    here = run_trials(trials=TRIALS, seed=6)
    told: list[int] = []
    with Cluster(address) as workers:
        there = run_trials(
            trials=TRIALS, seed=6, workers=workers, progress=lambda done, _: told.append(done)
        )
        whole = whole_drive_trials(there, PAPER, workers=workers)
    assert told == [BLOCK, TRIALS]
    np.testing.assert_allclose(there.g_hat, here.g_hat, rtol=1e-12)
    np.testing.assert_allclose(whole.g_hat, whole_drive_trials(here, PAPER).g_hat, rtol=1e-9)


def test_the_command_sends_the_trials_there(
    address: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    sent: list[int] = []
    asked = Cluster.map

    def watch(self: Cluster, function: Any, tasks: Any, count: int) -> Any:
        sent.append(count)
        return asked(self, function, tasks, count)

    monkeypatch.setattr(Cluster, "map", watch)
    assert main(["reproduce", "table1", "--trials", "30", "--json"]) == 0
    assert sent == []
    here = capsys.readouterr().out
    assert main(["reproduce", "table1", "--trials", "30", "--dask", address, "--json"]) == 0
    assert sent == [2]
    assert capsys.readouterr().out == here


def test_the_cluster_stays_as_it_was(address: str, local: Any) -> None:
    with Cluster(address), Cluster(address):
        pass
    assert not local.scheduler.tasks
    with Cluster(address) as workers:
        assert list(workers.map(divmod, [(7, 2), (9, 4)], 2)) == [(3, 1), (2, 1)]


def test_an_error_of_a_task_comes_here(address: str) -> None:
    with Cluster(address) as workers, pytest.raises(InputError, match="trials must be 1 or more"):
        list(workers.map(run_trials_of, [(0,)], 1))


def run_trials_of(trials: int) -> object:
    return run_trials(trials=trials)


@pytest.mark.parametrize("wrong", ["tcp://127.0.0.1:{}", "nonsense://x:{}"])
def test_nobody_there_is_said_in_a_line(
    wrong: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(module, "PATIENCE_S", 2.0)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    begun = time.monotonic()
    wrong = wrong.format(port)
    assert main(["reproduce", "table1", "--trials", "1", "--dask", wrong]) == 4
    err = capsys.readouterr().err
    assert err.startswith(f"airground: no Dask scheduler answers at {wrong} within 2 s")
    assert err.count("\n") == 1
    assert time.monotonic() - begun < 15


def test_a_cluster_without_workers_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(module, "PATIENCE_S", 1.0)
    with (
        distributed.LocalCluster(
            n_workers=0,
            processes=False,
            protocol="tcp",
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
        ) as empty,
        pytest.raises(UnreachableError, match="has no workers"),
    ):
        Cluster(empty.scheduler_address).__enter__()


def test_another_version_there_is_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "version", str)
    with pytest.raises(UnreachableError, match="have airground ; install"):
        Cluster(address).__enter__()


def test_without_distributed_the_extra_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["reproduce", "table1", "--trials", "1", "--dask", "tcp://127.0.0.1:1"]) == 2
    assert "airground[dask]" in capsys.readouterr().err


def test_dask_and_jobs_do_not_go_together(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "--jobs", "2", "--dask", "tcp://127.0.0.1:1"]) == 2
    assert "not allowed with" in capsys.readouterr().err

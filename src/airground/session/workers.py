"""Who does the work that leaves the loop: threads for what is short, another process for what takes seconds."""

from __future__ import annotations

import multiprocessing
import signal
import traceback
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from airground.errors import AirgroundError
from airground.session.inputs import Finished

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Future

    from airground.session.tick import Job

__all__ = ["Workers", "done"]


class Workers:
    """Does jobs, and hands in what they give.

    Parameters
    ----------
    put : callable
        Is given each `Finished`, from any thread.
    """

    def __init__(self, put: Callable[[Finished], None]) -> None:
        self._put = put
        self._threads = ThreadPoolExecutor(max_workers=2, thread_name_prefix="session work")
        self._process: Executor | None = None
        self._closed = False

    def give(self, job: Job) -> None:
        """Have a job done.

        Parameters
        ----------
        job : Job
            Its result is handed in when it is there, or its error.
        """
        if self._closed:
            return
        if not job.heavy:
            self._threads.submit(lambda: self._put(Finished(job.number, done(job))))
            return
        # A fresh interpreter: one that was forked from a program with threads may hang.
        if self._process is None:
            context = multiprocessing.get_context("spawn")
            self._process = ProcessPoolExecutor(1, context, _ignore_interrupts)
        try:
            future = self._process.submit(job.work)
        except BrokenExecutor:
            self._process = None
            self._put(Finished(job.number, AirgroundError(f"{job.what}: the worker died")))
            return
        future.add_done_callback(lambda future: self._heavy_done(job, future))

    def close(self) -> None:
        """Do nothing more; what is under way is not waited for."""
        self._closed = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        if self._process is not None:
            self._process.shutdown(wait=False, cancel_futures=True)

    def _heavy_done(self, job: Job, future: Future[Any]) -> None:
        if not self._closed and not future.cancelled():
            self._put(Finished(job.number, _result(job, future.result)))


def _ignore_interrupts() -> None:
    """Ctrl-C is for who started us."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def done(job: Job) -> Any:
    """Do a job here and now.

    Parameters
    ----------
    job : Job
        Any.

    Returns
    -------
    result : object
        Its result, or its error: an `AirgroundError`.
    """
    return _result(job, job.work)


def _result(job: Job, work: Callable[[], Any]) -> Any:
    try:
        return work()
    except AirgroundError as error:
        return error
    except Exception as error:
        traceback.print_exception(error)
        return AirgroundError(f"{job.what}: a bug of ours, see the terminal ({error})")

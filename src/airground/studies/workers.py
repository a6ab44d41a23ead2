"""Who does the work: this process, or several on this computer. The results are the same, in the same order.

Work is cut into tasks in one way, whoever does it; each task is a function of a module and arguments that can be
pickled. A cluster is in `airground.studies.cluster`.
"""

from __future__ import annotations

import os
import signal
import threading
from collections import deque
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from airground.errors import UnreachableError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import TracebackType
    from typing import Self

__all__ = ["AHEAD", "HERE", "Here", "Pending", "Processes", "Workers", "cores", "in_order"]

T = TypeVar("T")
Done_co = TypeVar("Done_co", covariant=True)
FEW = 16  # tasks: starting a process costs as much as several of them
AHEAD = 4
"""Tasks under way for each process: while one is done, others wait for it."""


class Pending(Protocol[Done_co]):
    """A result to come, as a future of concurrent.futures or of Dask."""

    def result(self) -> Done_co:
        """Wait for it."""


class Workers(Protocol):
    """Whoever does tasks."""

    def map(
        self,
        function: Callable[..., T],
        tasks: Iterable[tuple[Any, ...]],
        count: int,
        *,
        long: bool = False,
    ) -> Iterator[T]:
        """Do the tasks; their results come in their order.

        Parameters
        ----------
        function : callable
            Of a module, so that others can find it.
        tasks : iterable of tuple
            Its arguments, task by task; taken as they are needed.
        count : int
            How many there are.
        long : bool
            Whether each takes so long that two of them are worth a process.

        Yields
        ------
        result : object
            Of the next task.
        """


class Here:
    """Whoever asks: nothing is started."""

    def map(
        self,
        function: Callable[..., T],
        tasks: Iterable[tuple[Any, ...]],
        count: int,
        *,
        long: bool = False,
    ) -> Iterator[T]:
        """Do the tasks one after the other.

        Parameters
        ----------
        function : callable
            What to do.
        tasks : iterable of tuple
            Its arguments.
        count : int
            How many there are.
        long : bool
            Whether each takes so long that two of them are worth a process.

        Yields
        ------
        result : object
            Of the next task.
        """
        del count, long
        for task in tasks:
            yield function(*task)


HERE = Here()
"""This process, which needs no opening and no closing."""


class Processes:
    """Processes of their own, started when there is enough to do for them; a context manager ends them.

    Parameters
    ----------
    jobs : int, optional
        How many; as many as there are cores for us where not given. With one, all is done in this process.
    """

    def __init__(self, jobs: int | None = None) -> None:
        wanted = jobs or cores()
        self._jobs = min(wanted, 61) if os.name == "nt" else wanted  # Windows waits for no more
        self._pool: ProcessPoolExecutor | None = None
        self._unstarted = 0

    def __enter__(self) -> Self:
        """Nothing is started yet."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the processes after the tasks they are at; those that wait are dropped."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
            self._pool = None

    def map(
        self,
        function: Callable[..., T],
        tasks: Iterable[tuple[Any, ...]],
        count: int,
        *,
        long: bool = False,
    ) -> Iterator[T]:
        """Do the tasks; few of them in this process.

        Parameters
        ----------
        function : callable
            Of a module.
        tasks : iterable of tuple
            Its arguments.
        count : int
            How many there are.
        long : bool
            Whether each takes so long that two of them are worth a process.

        Yields
        ------
        result : object
            Of the next task.

        Raises
        ------
        UnreachableError
            If a process is lost.
        """
        if self._jobs == 1 or count < (2 if long else FEW):
            yield from HERE.map(function, tasks, count)
            return
        try:
            yield from in_order(
                lambda task: self._submit(function, task), tasks, AHEAD * self._jobs
            )
        except BrokenProcessPool:
            raise UnreachableError(
                "a process that works for this one was lost: it was ended, or memory is full; try fewer --jobs"
            ) from None

    def _submit(self, function: Callable[..., T], task: tuple[Any, ...]) -> Future[T]:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self._jobs,
                mp_context=get_context("spawn"),  # a fork of a program with threads may hang
                initializer=_begin,
            )
            self._unstarted = self._jobs
        if not self._unstarted:
            return self._pool.submit(function, *task)
        self._unstarted -= 1
        with _no_interrupt():  # each of the first tasks starts a process, which inherits it
            return self._pool.submit(function, *task)


def in_order(
    submit: Callable[[tuple[Any, ...]], Pending[T]], tasks: Iterable[tuple[Any, ...]], most: int
) -> Iterator[T]:
    """Have tasks done, some at a time.

    Parameters
    ----------
    submit : callable
        Takes the arguments of a task and gives a future.
    tasks : iterable of tuple
        Arguments.
    most : int
        Tasks that are under way at a time.

    Yields
    ------
    result : object
        Of the next task.
    """
    under_way: deque[Pending[T]] = deque()
    for task in tasks:
        under_way.append(submit(task))
        if len(under_way) >= most:
            yield under_way.popleft().result()
    while under_way:
        yield under_way.popleft().result()


def cores() -> int:
    """Cores that this process may use.

    Returns
    -------
    count : int
        At least one.
    """
    affinity = getattr(os, "sched_getaffinity", None)  # Linux
    return (os.cpu_count() or 1) if affinity is None else len(affinity(0))


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Ignore Ctrl-C for some milliseconds: a process that is started meanwhile ignores it from its first moment on."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _begin() -> None:
    """In a process that works for another: that one hears Ctrl-C, and this one ends with it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)

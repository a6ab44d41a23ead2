"""A Dask cluster that does the work, instead of this computer. The only place that imports distributed."""

from __future__ import annotations

import logging
from concurrent.futures import CancelledError
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

from airground._version import __version__
from airground.errors import AirgroundError, InputError, UnreachableError
from airground.studies.workers import AHEAD, in_order

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import TracebackType
    from typing import Self

__all__ = ["Cluster", "version"]

T = TypeVar("T")
PATIENCE_S = 5.0


class Cluster:
    """Workers of a Dask cluster; a context manager connects and leaves it as it was.

    Parameters
    ----------
    address : str
        Of the scheduler, as ``tcp://host:8786``.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self._client: Any = None
        self._threads = 1

    def __enter__(self) -> Self:
        """Connect.

        Raises
        ------
        InputError
            If distributed is not installed.
        UnreachableError
            If nothing answers there, or nobody there can do our work.
        """
        try:
            distributed: Any = import_module("distributed")  # half of it has types
        except ImportError:
            raise InputError(
                "--dask needs the package distributed; install airground with the extra dask: airground[dask]"
            ) from None
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # we say it in one line
        try:
            self._client = distributed.Client(
                self.address, timeout=PATIENCE_S, set_as_default=False
            )
        except (OSError, ValueError, TypeError) as error:
            raise UnreachableError(
                f"no Dask scheduler answers at {self.address} within {PATIENCE_S:.0f} s ({_line(error)}); "
                "give its address, as tcp://host:8786"
            ) from None
        try:
            self._check()
        except BaseException:
            self._leave()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave; what is not done yet is dropped."""
        self._leave()

    def map(
        self,
        function: Callable[..., T],
        tasks: Iterable[tuple[Any, ...]],
        count: int,
        *,
        long: bool = False,
    ) -> Iterator[T]:
        """Do the tasks.

        Parameters
        ----------
        function : callable
            Of a module of airground.
        tasks : iterable of tuple
            Its arguments.
        count : int
            How many there are.
        long : bool
            Whether each takes long.

        Yields
        ------
        result : object
            Of the next task.

        Raises
        ------
        UnreachableError
            If the cluster is lost.
        """
        del count, long
        client = self._client

        def submit(task: tuple[Any, ...]) -> Any:
            return client.submit(function, *task, pure=False)

        try:
            yield from in_order(submit, tasks, AHEAD * self._threads)
        except (AirgroundError, GeneratorExit):
            raise
        except (OSError, CancelledError, RuntimeError) as error:  # KilledWorker is a RuntimeError
            raise UnreachableError(
                f"the Dask cluster at {self.address} was lost ({_line(error)})"
            ) from None

    def _check(self) -> None:
        try:
            self._client.wait_for_workers(1, timeout=PATIENCE_S)
        except OSError:  # a TimeoutError
            raise UnreachableError(f"the Dask cluster at {self.address} has no workers") from None
        self._threads = max(sum(self._client.nthreads().values()), 1)
        try:
            theirs = self._client.submit(version, pure=False).result(timeout=60)
        except Exception as error:
            raise UnreachableError(
                f"workers of the Dask cluster at {self.address} cannot run airground ({_line(error)}); "
                f"install airground {__version__} there"
            ) from None
        if theirs != __version__:
            raise UnreachableError(
                f"workers of the Dask cluster at {self.address} have airground {theirs}; install {__version__} there"
            )

    def _leave(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            client.close(timeout=PATIENCE_S)


def version() -> str:
    """Say which airground does the work.

    Returns
    -------
    version : str
        Of where this runs.
    """
    return __version__


def _line(error: BaseException) -> str:
    return " ".join((str(error) or type(error).__name__).split())[:160]

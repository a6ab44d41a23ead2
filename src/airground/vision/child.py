"""Another process that works for this one, and a pipe to it."""

from __future__ import annotations

import signal
from contextlib import suppress
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

from airground.errors import UnreachableError

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

__all__ = ["Child"]

CLOSING_S = 1.0


class Child:
    """A fresh interpreter: it shares no lock with this one. Ends with this one, or by `close`.

    Parameters
    ----------
    what : str
        What it is, for messages.
    work : callable
        What it does, given its end of the pipe and the arguments; a function of a module. It ends when the other
        side of the pipe is gone.
    *arguments : object
        Handed on; can be pickled.
    """

    def __init__(self, what: str, work: Callable[..., None], *arguments: Any) -> None:
        context = get_context("spawn")  # a fork of a program with threads may hang
        self._what = what
        self.pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_run, args=(work, theirs, *arguments), name=what, daemon=True
        )
        self._process.start()
        theirs.close()

    @property
    def alive(self) -> bool:
        """Whether it runs."""
        return self._process.is_alive()

    def ask(self, order: Any, patience_s: float | None = None) -> Any:
        """Send an order and wait for what comes back.

        Parameters
        ----------
        order : object
            Can be pickled.
        patience_s : float, optional [s]
            For how long; for ever where not given.

        Returns
        -------
        answer : object
            The next that it sends.

        Raises
        ------
        UnreachableError
            If it has died, or says nothing; then it is of no use any more, as its answer may still come.
        """
        try:
            self.pipe.send(order)
            if patience_s is not None and not self.pipe.poll(patience_s):
                raise UnreachableError(f"{self._what}: no answer for {patience_s:g} s")
            return self.pipe.recv()
        except (EOFError, OSError) as error:
            raise self.died() from error

    def died(self) -> UnreachableError:
        """What to raise where it has died.

        Returns
        -------
        error : UnreachableError
            Says so.
        """
        return UnreachableError(f"{self._what}: its process has died")

    def close(self) -> None:
        """End it; calling it again does nothing."""
        self.pipe.close()  # it ends by that
        self._process.join(CLOSING_S)
        if self._process.is_alive():
            self._process.terminate()
            self._process.join(CLOSING_S)


def _run(work: Callable[..., None], pipe: Connection, *arguments: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who started us
    with suppress(EOFError, OSError):  # nobody is there any more
        work(pipe, *arguments)

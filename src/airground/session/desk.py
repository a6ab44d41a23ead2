"""Work that leaves the loop, and what is done with its result when it comes back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from airground.session.tick import Job

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.session.inputs import Finished

__all__ = ["Desk"]


class Desk:
    """Numbers jobs and keeps what follows. A result that nobody waits for any more is dropped."""

    def __init__(self) -> None:
        self._next = 1
        self._waiting: dict[int, tuple[str, Callable[[Any], None]]] = {}
        self._handed_out: list[Job] = []

    def give(
        self,
        what: str,
        work: Callable[[], Any],
        then: Callable[[Any], None],
        *,
        heavy: bool = False,
    ) -> int:
        """Give work away.

        Parameters
        ----------
        what : str
            For people.
        work : callable
            Pure; raises `AirgroundError` only.
        then : callable
            Is given the result, or the error, in the loop.
        heavy : bool
            Whether it takes seconds; it must be picklable then, as another process does it.

        Returns
        -------
        number : int
            Of the job.
        """
        number = self._next
        self._next += 1
        self._waiting[number] = (what, then)
        self._handed_out.append(Job(number, what, work, heavy))
        return number

    def cancel(self, what: str) -> None:
        """Wait no longer for any work of a kind.

        Parameters
        ----------
        what : str
            Of `give`, or its first word.
        """
        self._waiting = {
            k: v for k, v in self._waiting.items() if what not in (v[0], v[0].split(" ")[0])
        }

    def waits_for(self, what: str) -> bool:
        """Tell whether work of a kind is under way.

        Parameters
        ----------
        what : str
            Of `give`.

        Returns
        -------
        waits : bool
            And its result is wanted.
        """
        return any(kind == what for kind, _ in self._waiting.values())

    def take(self, finished: Finished) -> None:
        """Do what follows.

        Parameters
        ----------
        finished : Finished
            The result.
        """
        _, then = self._waiting.pop(finished.job, ("", None))
        if then is not None:
            then(finished.result)

    def collect(self) -> tuple[Job, ...]:
        """Give the jobs that nobody has yet.

        Returns
        -------
        jobs : tuple of Job
            Once each.
        """
        jobs = tuple(self._handed_out)
        self._handed_out.clear()
        return jobs

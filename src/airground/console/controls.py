"""Who holds the controls: one at most, and everybody may watch."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Controls", "Handover"]


@dataclass(frozen=True, slots=True)
class Handover:
    """What came of asking for the controls, or of giving them back."""

    ok: bool
    """Whether it was granted."""

    line: str = ""
    """Why not, or what happened; empty where there is nothing to say."""

    gone: str | None = None
    """Client that held them and does not any more: what it drove stops."""

    changed: bool = False
    """Whether everybody is to be told."""


class Controls:
    """A state machine; it sends nothing and knows no clock."""

    def __init__(self) -> None:
        self._holder: str | None = None

    @property
    def holder(self) -> str | None:
        """Client that holds them."""
        return self._holder

    def take(self, client: str, *, force: bool = False) -> Handover:
        """Ask for the controls.

        Parameters
        ----------
        client : str
            Who asks.
        force : bool
            Whether to take them away from whom holds them.

        Returns
        -------
        handover : Handover
            Refused where somebody else holds them, unless by force.
        """
        before = self._holder
        if before == client:
            return Handover(ok=True)
        if before is not None and not force:
            return Handover(ok=False, line="somebody else holds the controls")
        self._holder = client
        return Handover(ok=True, gone=before, changed=True)

    def give_back(self, client: str) -> Handover:
        """Let go of the controls, or lose them: closed, silent.

        Parameters
        ----------
        client : str
            Who does.

        Returns
        -------
        handover : Handover
            Refused where it does not hold them.
        """
        if self._holder != client:
            return Handover(ok=False, line="you do not hold the controls")
        self._holder = None
        return Handover(ok=True, gone=client, changed=True)

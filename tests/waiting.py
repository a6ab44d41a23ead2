"""Waiting in tests for what another thread or process does: long enough for a loaded machine, no longer than needed."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

PATIENCE_S = 20.0


def until(condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> None:
    """Wait for something to become true.

    Parameters
    ----------
    condition : callable
        Is asked again and again.
    patience_s : float [s]
        Beyond it, the test fails.
    """
    end = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)

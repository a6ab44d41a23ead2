"""One to one, and the best of all."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from airground.vision.tracker.assignment import assign


def brute(table: np.ndarray) -> float:
    """Greatest total over all ways to pair, none included."""
    n, m = table.shape
    padded = np.concatenate([table, np.zeros((n, n))], axis=1)
    return max(float(padded[np.arange(n), list(p)].sum()) for p in permutations(range(n + m), n))


@given(st.integers(0, 2**32 - 1))
def test_assignment_is_the_best_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m = rng.integers(0, 5), rng.integers(0, 4)
    table = np.where(rng.random((n, m)) < 0.6, rng.normal(1, 3, (n, m)), -np.inf)
    i, j = np.nonzero(np.isfinite(table))
    order = rng.permutation(len(i))
    partner = assign(i[order], j[order], table[i, j][order], (int(n), int(m)))
    taken = partner[partner >= 0]
    assert len(set(taken.tolist())) == len(taken)
    total = sum(table[k, partner[k]] for k in range(n) if partner[k] >= 0)
    np.testing.assert_allclose(total, brute(table), atol=1e-9)

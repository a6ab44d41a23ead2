"""How often identities are really exchanged, beside what the tracker says of it: for tests and benchmarks.

Somebody who knows looks at each track, affirms it, and looks again some seconds later. Who owns a sighting is known
from the scene alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.vision.tracker import Tracker, TrackerOptions
from vision.tracker.points import Scene

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Looks:
    """N times that somebody looked again."""

    stated: FloatArray  # (N,) swap_probability before looking
    swapped: BoolArray  # (N,) whether the thing was another one than at the last look
    met: BoolArray  # (N,) whether it was hidden, missed for some frames or seen as one with another in between


def look(scene: Scene, options: TrackerOptions | None = None, *, every_s: float = 5.0) -> Looks:
    """Watch a scene and look again and again."""
    tracker = Tracker(options)
    known: dict[int, tuple[float, int]] = {}  # of each track: when somebody looked, what it was
    last = np.zeros(scene.uv.shape[1])  # when each thing was seen alone
    met = np.full(scene.uv.shape[1], -np.inf)
    rows = []
    for k, sightings in enumerate(scene.sightings):
        state, t = tracker.update(sightings), sightings.t
        alone = scene.owner[k][scene.owner[k] >= 0]
        last[alone] = t
        met[t - last > 0.1] = t
        for row in np.flatnonzero(state.confirmed & (state.sighting >= 0)):
            thing, serial = int(scene.owner[k][state.sighting[row]]), int(state.serial[row])
            if thing < 0 or state.merged_with[row]:
                continue
            when, before = known.get(serial, (-np.inf, -1))
            if t - when < every_s:
                continue
            if before >= 0:
                met_since = max(met[before], met[thing]) > when
                rows.append((state.swap_probability[row], thing != before, met_since))
            tracker.affirm(state.names[row])
            known[serial] = t, thing
    stated, swapped, between = (np.array(column) for column in zip(*rows, strict=True))
    return Looks(stated, swapped.astype(bool), between.astype(bool))


def unannounced(looks: list[Looks], limit: float) -> tuple[int, int]:
    """How many exchanges there were, and of how many the stated probability was not above a limit."""
    stated = np.concatenate([one.stated for one in looks])
    swapped = np.concatenate([one.swapped for one in looks])
    return int(swapped.sum()), int((swapped & (stated <= limit)).sum())

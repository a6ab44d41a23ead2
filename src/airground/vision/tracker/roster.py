"""What a tracker remembers of each track beside where it is: its name, and when it was seen."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.tracker.options import TrackerOptions

    BoolArray = NDArray[np.bool_]

__all__ = ["Roster", "birth_order"]

MOST_SCORE = 50.0  # beyond any doubt


def _column(dtype: Any) -> Any:
    return field(default_factory=lambda: np.empty(0, dtype=dtype))


# ruff: noqa: RUF009 (the helper makes a field, not a default)


@dataclass(slots=True, eq=False)
class Roster:
    """R tracks in the order of their serial numbers; columns are replaced, never written to from outside."""

    serial: IntArray = _column(np.intp)
    """(R,). Numbers of the tracks."""

    number: IntArray = _column(np.intp)
    """(R,). Number in the name of a confirmed track without a label; 0 for none."""

    born: FloatArray = _column(np.float64)
    """(R,) [s]. First sighting."""

    seen: FloatArray = _column(np.float64)
    """(R,) [s]. Last sighting of its own."""

    touched: FloatArray = _column(np.float64)
    """(R,) [s]. Last sighting of its own, or that it shared."""

    hits: IntArray = _column(np.intp)
    """(R,). Sightings of its own."""

    score: FloatArray = _column(np.float64)
    """(R,). Logarithm of the odds that it is a thing and not clutter."""

    confirmed: BoolArray = _column(np.bool_)
    """(R,). Whether it was taken for a thing."""

    visible: FloatArray = _column(np.float64)
    """(R,). How probable it is that it is in plain view."""

    quality: FloatArray = _column(np.float64)
    """(R,). Share of recent frames that it was seen in."""

    swap: FloatArray = _column(np.float64)
    """(R,). How probable it is that its identity was confused, from questions that are closed."""

    reads: IntArray = _column(np.intp)
    """(R,). How often its label was read."""

    labels: list[str] = field(default_factory=list)
    """(R). Labels; empty for none."""

    names: list[str] = field(default_factory=list)
    """(R). Names."""

    def __len__(self) -> int:
        return len(self.labels)

    def keep(self, rows: BoolArray) -> None:
        """Forget the others.

        Parameters
        ----------
        rows : (R,) array of bool
            Which to keep.
        """
        for column in fields(self):
            value = getattr(self, column.name)
            if isinstance(value, list):
                kept: Any = [item for item, stays in zip(value, rows, strict=True) if stays]
            else:
                kept = value[rows]
            setattr(self, column.name, kept)

    def add(self, serial: IntArray, t: float, score: FloatArray, labels: list[str]) -> None:
        """Append candidates.

        Parameters
        ----------
        serial : (K,) array of int
            Their numbers.
        t : float [s]
            When they were seen.
        score : (K,) array
            Odds that they are things.
        labels : list of str
            Theirs.
        """
        count = len(serial)
        new: dict[str, Any] = {
            "serial": serial,
            "born": np.full(count, t),
            "seen": np.full(count, t),
            "touched": np.full(count, t),
            "hits": np.ones(count, dtype=np.intp),
            "score": score,
            "visible": np.ones(count),
            "quality": np.ones(count),
            "reads": np.array([label != "" for label in labels], dtype=np.intp),
            "labels": labels,
            "names": [f"candidate-{k}" for k in serial],
        }
        for column in fields(self):
            value = getattr(self, column.name)
            if isinstance(value, list):
                value.extend(new[column.name])
            else:
                added = new.get(column.name, np.zeros(count, dtype=value.dtype))
                setattr(self, column.name, np.concatenate([value, added]))

    def note(
        self, t: float, partner: IntArray, host: IntArray, won: FloatArray, memory: float
    ) -> None:
        """Keep the books on who was seen.

        Parameters
        ----------
        t : float [s]
            Time of the frame.
        partner : (R,) array of int
            Sighting of each; -1 for none.
        host : (R,) array of int
            Row of the track whose sighting each shares; -1 for none.
        won : (R,) array
            What the frame adds to the score of a track that shares nothing.
        memory : float
            Weight of the past in the quality.
        """
        guests = np.flatnonzero(host >= 0)
        shares = np.zeros(len(self), dtype=np.bool_)
        shares[guests] = shares[host[guests]] = True
        own = (partner >= 0) & ~shares
        self.touched = np.where(own | shares, t, self.touched)
        self.seen = np.where(own, t, self.seen)
        self.hits = self.hits + own
        self.score = np.minimum(self.score + np.where(shares, 0.0, won), MOST_SCORE)
        self.quality = memory * self.quality + (1 - memory) * own

    def adopt(self, lost: IntArray, back: IntArray) -> None:
        """Give lost tracks what is known of the candidates that they came back as.

        Parameters
        ----------
        lost : (K,) array of int
            Rows of the tracks.
        back : (K,) array of int
            Rows of the candidates.
        """
        for name in ("seen", "touched", "quality"):
            column = getattr(self, name).copy()
            column[lost] = column[back]
            setattr(self, name, column)
        hits = np.bincount(lost, self.hits[back], len(self)).astype(np.intp)
        self.hits = self.hits + hits

    def lost(self, t: float, options: TrackerOptions) -> BoolArray:
        """Which tracks were not seen for too long.

        Parameters
        ----------
        t : float [s]
            Time.
        options : TrackerOptions
            Say how long is too long.

        Returns
        -------
        lost : (R,) array of bool
            Those.
        """
        untouched = t - self.touched > options.lost_s
        unseen = t - self.seen > max(options.merged_s, options.lost_s)
        return np.asarray(untouched | unseen)


def birth_order(uv: FloatArray, middle: FloatArray) -> IntArray:
    """Order that neither the order of the rows nor a turn of the image changes.

    Parameters
    ----------
    uv : (N, 2) array [px]
        Sightings that become candidates.
    middle : (2,) array [px]
        Of all sightings.

    Returns
    -------
    order : (N,) array of int
        By the distance from the middle.
    """
    aside = np.linalg.norm(uv - middle, axis=1)
    return np.lexsort((uv[:, 1], uv[:, 0], np.round(aside, 6)))

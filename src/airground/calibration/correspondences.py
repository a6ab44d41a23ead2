"""From tracks and motion readings to motion correspondences: clocks, gaps, windows, several targets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.ground_path import GroundPath, ground_path
from airground.calibration.local_polynomial import Windows, windows
from airground.calibration.recordings import IntArray
from airground.calibration.samples import MotionSamples
from airground.calibration.window_choice import choose_count, unbroken
from airground.errors import InputError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.recordings import Motion, Tracks

__all__ = ["Correspondences", "Pairing", "pair_recordings"]


@dataclass(frozen=True, slots=True, eq=False)
class Correspondences:
    """Motion correspondences of all targets at one clock offset."""

    samples: MotionSamples
    """W samples."""

    window: IntArray
    """(W,). Number of the window that each came from: the same at every clock offset."""

    target_index: IntArray
    """(W,). Which target."""

    span: FloatArray
    """(W,) [s]. Time over which the velocities were taken."""

    sightings: dict[str, int]
    """How many sightings of each target the samples rest on."""

    one_frame: bool
    """Whether all ground velocities are in one frame; headings may count from a zero of each robot's own."""

    @property
    def target_count(self) -> int:
        """How many targets `target_index` may name."""
        return len(self.sightings)

    def take(self, rows: object) -> Correspondences:
        """Some of the correspondences.

        Parameters
        ----------
        rows : index
            Slice, integer or boolean array, as NumPy takes it.

        Returns
        -------
        correspondences : Correspondences
            Those; `sightings` stays.
        """
        index = np.arange(len(self.samples))[rows]  # type: ignore[call-overload]
        return replace(
            self,
            samples=self.samples.take(index),
            window=self.window[index],
            target_index=self.target_index[index],
            span=self.span[index],
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """One target's sightings in windows, and its path on the ground."""

    index: int
    """Which of the pairing's targets."""

    t: FloatArray
    """(N,) [s]. Times of its sightings."""

    raw_uv: FloatArray
    """(N, 2) [px]. The sightings themselves."""

    windows: Windows
    """W windows over them."""

    uv: FloatArray
    """(W, 2) [px]. Position in each window."""

    uv_dot: FloatArray
    """(W, 2) [px/s]. Velocity in each window."""

    path: GroundPath
    """Its readings, integrated."""


@dataclass(frozen=True, slots=True, eq=False)
class Pairing:
    """Sightings and readings of the targets that are in both files, ready for any clock offset."""

    targets: tuple[str, ...]
    """Names of the targets that can be calibrated on."""

    pairs: tuple[_Pair, ...]
    """Windows over the sightings, and paths of the readings."""

    one_frame: bool
    """Whether all readings are in one ground frame."""

    def thinned(self, most: int) -> Pairing:
        """Keep every so many windows, for what need not see all of them.

        Parameters
        ----------
        most : int
            About so many windows to keep.

        Returns
        -------
        pairing : Pairing
            Itself where it has no more.
        """
        count = sum(len(pair.windows.first) for pair in self.pairs)
        if count <= most:
            return self
        every = slice(None, None, -(-count // most))
        return replace(
            self,
            pairs=tuple(
                replace(p, windows=p.windows.take(every), uv=p.uv[every], uv_dot=p.uv_dot[every])
                for p in self.pairs
            ),
        )

    def at_offset(self, offset: float) -> Correspondences:
        """Motion correspondences with the readings' clock ahead by `offset`.

        Parameters
        ----------
        offset : float [s]
            To be added to a sighting's time to get the readings' time.

        Returns
        -------
        correspondences : Correspondences
            Those windows that lie in unbroken stretches of readings.
        """
        uv, uv_dot, xy_dot, number, target, span = [], [], [], [], [], []
        sightings = dict.fromkeys(self.targets, 0)
        base = 0
        for pair in self.pairs:
            w = pair.windows
            xy, stretch = _path_at(pair, offset)
            first, last = stretch[w.first], stretch[w.first + w.count - 1]
            keep = (first >= 0) & (
                first == last
            )  # numbers only grow: no gap lies between equal ones
            kept = w.take(keep)
            _, velocity = kept.fit(pair.t, xy)
            uv.append(pair.uv[keep])
            uv_dot.append(pair.uv_dot[keep])
            xy_dot.append(velocity)
            number.append(base + np.flatnonzero(keep))
            target.append(np.full(int(keep.sum()), pair.index, dtype=np.intp))
            span.append(kept.span)
            sightings[self.targets[pair.index]] = kept.rows_covered(len(pair.t))
            base += len(w.first)
        return Correspondences(
            samples=MotionSamples(
                np.concatenate(uv), np.concatenate(uv_dot), np.concatenate(xy_dot)
            ),
            window=np.concatenate(number),
            target_index=np.concatenate(target),
            span=np.concatenate(span),
            sightings=sightings,
            one_frame=self.one_frame,
        )


def _path_at(pair: _Pair, offset: float) -> tuple[FloatArray, IntArray]:
    """The path at the sightings; where windows are few, only at theirs."""
    w, count = pair.windows, len(pair.t)
    if 2 * len(w.first) * w.count > count:
        return pair.path.at(pair.t + offset)
    rows = np.unique(w.first[:, None] + np.arange(w.count))
    xy, stretch = np.zeros((count, 2)), np.full(count, -1, dtype=np.intp)
    xy[rows], stretch[rows] = pair.path.at(pair.t[rows] + offset)
    return xy, stretch


def pair_recordings(tracks: Tracks, motion: Motion, *, most: int | None = None) -> Pairing:
    """Match the targets of tracks and motion, and lay windows over their sightings.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    most : int, optional
        Windows of a target to keep, evenly spread, where not all are wanted.

    Returns
    -------
    pairing : Pairing
        Targets that are in both.

    Raises
    ------
    InputError
        If no target is in both, or none has enough rows.
    """
    common = [name for name in tracks.targets if name in motion.targets]
    if not common:
        raise InputError(
            f"no target is in both tracks ({_names(tracks.targets)}) and motion ({_names(motion.targets)}); "
            "name the robot the same in both"
        )
    pairs = []
    for index, name in enumerate(common):
        rows = tracks.rows(name)
        path = ground_path(motion, name)
        t, uv = tracks.t[rows], tracks.uv[rows]
        if path is None or len(t) < 2:
            continue
        sigma = None if tracks.sigma is None else float(np.median(tracks.sigma[rows]))
        count = choose_count(t, uv, sigma=sigma, path=path)
        first = unbroken(t, count, step=max(1, count // 4))
        if most is not None:
            first = first[:: max(1, -(-len(first) // most))]
        laid = windows(t, first, count)
        position, velocity = laid.fit(t, uv)
        pairs.append(_Pair(index, t, uv, laid, position, velocity, path))
    if not pairs:
        raise InputError("no target has two sightings and two readings")
    return Pairing(tuple(common), tuple(pairs), one_frame=motion.xy_dot is not None)


def _names(targets: tuple[str, ...]) -> str:
    shown = ", ".join(targets[:5])
    return shown if len(targets) <= 5 else f"{shown} and {len(targets) - 5} more"

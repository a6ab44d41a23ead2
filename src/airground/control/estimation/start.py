"""Where a vehicle heads, found from how it moves in the image, before a filter can run.

The way that it drove is reckoned from commands and readings, from nowhere and with heading zero. The sightings of its
mark are that way, turned: with p reckoned and z seen, as complex numbers about their means, the best turn is the
argument of ``C = sum(conj(p) z)`` and its deviation ``sigma / (s sqrt(sum |p|^2))``, with the scale
``s = |C| / sum |p|^2``. A way backwards turns by itself, as p goes backwards; so does a turn on the spot if the mark is
off the axle. Where neither speed nor command is known, the vehicle is taken to drive straight on, forward.
"""

from __future__ import annotations

import cmath
from math import inf, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.control.estimation.model import BIAS, SIZE, Gaussian, moved

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.control.estimation.model import Piece
    from airground.control.estimation.options import StateOptions

__all__ = ["Mark", "Start", "begun"]

_MOST_MARKS = 60
_OLDEST_S = 5.0
_FRESH_S = 1.0
_FEWEST = 4


class Mark(NamedTuple):
    """A sighting, and where and how the vehicle was by reckoning."""

    t: float
    """When [s]."""

    seen: complex
    """On the ground, x + iy [m]."""

    covariance: tuple[float, float, float]
    """Of that: xx, xy, yy [m^2]."""

    reckoned: complex
    """Of the mark [m]."""

    turned: float
    """Reckoned heading [rad]."""


class Start(NamedTuple):
    """What is known before heading and position both are."""

    mean: tuple[float, ...]
    """Reckoned state, from nowhere; the scales and the bias are those known from before."""

    known: tuple[float, float, float]
    """Variances of the scales and the bias."""

    driven: bool
    """Whether commands or readings tell a speed; else it is taken to be 1 m/s."""

    steered: bool
    """Whether commands or readings tell a turn rate."""

    compass: tuple[float, float] | None
    """Time of the newest heading reading [s], and what it adds to the reckoned heading [rad]."""

    marks: tuple[Mark, ...]
    """Sightings of the last seconds, the oldest first."""

    @classmethod
    def anew(cls, options: StateOptions, before: Gaussian | None = None) -> Start:
        """Know nothing, except of what the vehicle is like where that was found before.

        Parameters
        ----------
        options : StateOptions
            Of the vehicle.
        before : Gaussian, optional
            Belief that was given up.

        Returns
        -------
        start : Start
            Without a sighting.
        """
        a = b = bias = 0.0
        scale = options.scale_sigma**2
        known = (scale, scale, options.heading_bias_sigma_rad**2)
        if before is not None:
            *_, a, b, bias, _ = before.mean
            variances = before.covariance.diagonal()[-3:].tolist()
            if np.isfinite([a, b, bias, *variances]).all():
                known = (variances[0], variances[1], variances[2])
            else:
                a = b = bias = 0.0
        mean = (0.0, 0.0, 0.0, 1.0, 0.0, a, b, bias, 0.0)
        return cls(mean, known, False, False, None, ())

    def moved(self, pieces: Sequence[Piece], options: StateOptions) -> Start:
        """Reckon on.

        Parameters
        ----------
        pieces : sequence of (float, VelocityCommand or None)
            Durations [s] and what was in effect; None in all of them where that is not known.
        options : StateOptions
            Of the vehicle.

        Returns
        -------
        start : Start
            Afterwards.
        """
        start = self
        if pieces[0][1] is not None:
            start = (self if self.driven else self._at_rest())._replace(steered=True)
        return start._replace(mean=moved(start.mean, pieces, options))

    def _at_rest(self) -> Start:
        """From now on a speed is told; sightings from before cannot be compared with it."""
        mean = (*self.mean[:3], 0.0, *self.mean[4:])
        return self._replace(mean=mean, driven=True, marks=())

    def read(self, t: float, read: tuple[float, ...]) -> Start:
        """Take readings over.

        Parameters
        ----------
        t : float [s]
            When.
        read : (3,) tuple of float
            Heading [rad], speed [m/s] and turn rate [rad/s]; infinite where there is none.

        Returns
        -------
        start : Start
            With them.
        """
        heading, speed, turn_rate = read
        start = self if self.driven or speed == inf else self._at_rest()
        x, y, theta, v, w, a, b, bias, side = start.mean
        if speed < inf:
            v = (1 + a) * speed
        if turn_rate < inf:
            w = (1 + b) * turn_rate
        return start._replace(
            mean=(x, y, theta, v, w, a, b, bias, side),
            steered=start.steered or turn_rate < inf,
            compass=(t, heading - bias - theta) if heading < inf else start.compass,
        )

    def seen(
        self,
        t: float,
        xy: tuple[float, float],
        R: tuple[float, float, float],
        options: StateOptions,
    ) -> Start:
        """Take a sighting over.

        Parameters
        ----------
        t : float [s]
            When.
        xy : (float, float) [m]
            Where on the ground.
        R : (float, float, float) [m^2]
            Covariance of that: xx, xy, yy.
        options : StateOptions
            Of the vehicle, for the lever arm.

        Returns
        -------
        start : Start
            With it; the oldest forgotten.
        """
        x, y, theta = self.mean[:3]
        reckoned = complex(x, y) + complex(*options.lever_arm_m) * cmath.rect(1.0, theta)
        kept = [mark for mark in self.marks if mark.t >= t - _OLDEST_S]
        if len(kept) >= _MOST_MARKS:
            kept = kept[::2]
        return self._replace(marks=(*kept, Mark(t, complex(*xy), R, reckoned, theta)))


def begun(start: Start, options: StateOptions) -> Gaussian | None:
    """First belief, at the newest sighting, if the heading can be told by then.

    Parameters
    ----------
    start : Start
        At the time of its newest sighting.
    options : StateOptions
        Of the vehicle.

    Returns
    -------
    belief : Gaussian or None
        None where the heading is not known yet.
    """
    if not start.marks:
        return None
    newest = start.marks[-1]
    turned, v, bias_sign = start.mean[2], start.mean[3], 0.0
    sigma_v = 0.05 + 0.3 * abs(v)
    if start.compass is not None and newest.t - start.compass[0] <= _FRESH_S:
        theta = start.compass[1] + turned
        variance = options.heading_sigma_rad**2 + start.known[2]
        bias_sign = -1.0
        if not start.driven:
            v, sigma_v = 0.0, 0.5
    else:
        found = _turn(start, options)
        if found is None:
            return None
        theta, variance, scale = found
        theta += turned
        if not start.driven:
            v *= scale
            sigma_v = 0.05 + 0.3 * abs(v)
    mean, w = start.mean, start.mean[4]
    arm = complex(*options.lever_arm_m) * cmath.rect(1.0, theta)
    axle = newest.seen - arm
    theta = (theta + pi) % (2 * pi) - pi
    xx, xy, yy = newest.covariance
    P = np.zeros((SIZE, SIZE))
    P[:2, :2] = ((xx, xy), (xy, yy))
    sigma_w = 0.1 + 0.3 * abs(w) if start.steered else 1.0
    for k, value in enumerate((variance, sigma_v**2, sigma_w**2, *start.known), 2):
        P[k, k] = value
    P[BIAS, 2] = P[2, BIAS] = bias_sign * start.known[2]
    T = np.eye(SIZE)  # the axle is where the mark is less the arm, which turns with the heading
    T[0, 2], T[1, 2] = arm.imag, -arm.real
    P = T @ P @ T.T
    return Gaussian((axle.real, axle.imag, theta, v, w, *mean[5:]), 0.5 * (P + P.T))


def _turn(start: Start, options: StateOptions) -> tuple[float, float, float] | None:
    """Turn from reckoned to seen, its variance, and the scale; None where the motion does not tell."""
    marks = start.marks
    count = len(marks)
    if count < _FEWEST:
        return None
    p_mean = sum(mark.reckoned for mark in marks) / count
    z_mean = sum(mark.seen for mark in marks) / count
    noise = sum(0.5 * (mark.covariance[0] + mark.covariance[2]) for mark in marks) / count
    C, reckoned, seen = 0j, 0.0, 0.0
    for mark in marks:
        p, z = mark.reckoned - p_mean, mark.seen - z_mean
        C += p.conjugate() * z
        reckoned += abs(p) ** 2
        seen += abs(z) ** 2
    if reckoned < 1e-8 or abs(C) < 1e-12:
        return None
    scale = abs(C) / reckoned
    rest = seen - abs(C) * scale
    variance = noise / (reckoned * scale**2)
    if variance > options.start_sigma_rad**2 or rest > 4 * noise * 2 * count + 0.02 * seen:
        return None
    if start.driven and not 0.4 < scale < 2.5:  # it does not do what it is told
        return None
    turned = max(abs(mark.turned - marks[-1].turned) for mark in marks)
    unsure = (0.1 * turned) ** 2 if start.steered else 0.15**2
    return cmath.phase(C), 2 * variance + unsure + options.heading_walk_rad**2, scale

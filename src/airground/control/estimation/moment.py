"""What is believed at one moment, brought on to the next datum, and the datum weighed, taken or refused."""

from __future__ import annotations

from math import hypot, inf, isfinite
from typing import TYPE_CHECKING, NamedTuple

from airground.control.estimation.model import OMEGA, Gaussian, V, place, propagate
from airground.control.estimation.readings import correct
from airground.control.estimation.start import Start, begun

if TYPE_CHECKING:
    from airground.control.estimation.history import CommandLine
    from airground.control.estimation.options import StateOptions

__all__ = [
    "READING",
    "SIGHTING",
    "Datum",
    "Moment",
    "Stray",
    "Tally",
    "absorb",
    "advance",
]

READING, SIGHTING = range(2)
_STEP_S = 0.08
_MOST_STEPS = 100
_SHAKEN_MPS = 0.1  # deviations that a refused sighting adds to speed and turn rate
_SHAKEN_RADPS = 0.3


class Datum(NamedTuple):
    """One thing measured; sorts by time, then by what it is."""

    t: float
    """When, by the camera's clock [s]."""

    kind: int
    """READING or SIGHTING."""

    values: tuple[float, ...]
    """Heading, speed, turn rate, infinite where not read; of a sighting x, y and their covariance xx, xy, yy."""


class Stray(NamedTuple):
    """A refused sighting."""

    t: float
    """When [s]."""

    x: float
    """Where [m]."""

    y: float
    """Where [m]."""

    sigma: float
    """How certain that is [m]."""


class Tally(NamedTuple):
    """What was refused, and how often a filter began anew."""

    sightings: int = 0
    """Sightings that lay too far from where the robot was expected."""

    readings: int = 0
    """Readings so far from what was expected that they hardly count."""

    jumps: int = 0
    """New beginnings since refused sightings agreed with each other: the robot was carried."""

    losses: int = 0
    """New beginnings since nothing was known any more: a long dropout."""


class Moment(NamedTuple):
    """All that is believed at one time."""

    t: float
    """When [s]."""

    belief: Gaussian | None
    """State; None while position or heading is unknown."""

    start: Start | None
    """What there is until then; None afterwards."""

    seen_t: float
    """Time of the newest sighting in it [s]."""

    strays: tuple[Stray, ...]
    """Sightings refused one after the other that agree."""

    tally: Tally
    """Counts since the filter was made."""

    @classmethod
    def first(cls, t: float, options: StateOptions) -> Moment:
        """Know nothing.

        Parameters
        ----------
        t : float [s]
            When.
        options : StateOptions
            Of the vehicle.

        Returns
        -------
        moment : Moment
            At that time.
        """
        return cls(t, None, Start.anew(options), -inf, (), Tally())


def advance(moment: Moment, t: float, commands: CommandLine, options: StateOptions) -> Moment:
    """Bring a belief on to a later time.

    Parameters
    ----------
    moment : Moment
        Earlier, or at that time.
    t : float [s]
        When.
    commands : CommandLine
        What was in effect until then.
    options : StateOptions
        Of the vehicle.

    Returns
    -------
    moment : Moment
        At `t`; begun anew where too much time went by, or too little is known by then.
    """
    total = t - moment.t
    if not total > 0:
        return moment
    if total > options.longest_gap_s:
        return _anew(moment, t, options, lost=moment.belief is not None)
    belief, start = moment.belief, moment.start
    for pieces in commands.steps(moment.t, t, max(_STEP_S, total / _MOST_STEPS)):
        if belief is not None:
            belief = propagate(belief, pieces, options)
        elif start is not None:
            start = start.moved(pieces, options)
    if belief is not None and not _sane(belief, options):
        return _anew(moment, t, options, lost=True)
    return Moment(t, belief, start, moment.seen_t, moment.strays, moment.tally)


def _sane(belief: Gaussian, options: StateOptions) -> bool:
    xx, yy, tt, a, b, c, d, e = belief.covariance.diagonal().tolist()
    farthest = options.lost_m**2
    return (
        0 <= xx < farthest
        and 0 <= yy < farthest
        and 0 <= tt < options.lost_rad**2
        and min(a, b, c, d, e) >= 0
        and isfinite(a + b + c + d + e + sum(belief.mean))
    )


def _anew(moment: Moment, t: float, options: StateOptions, *, lost: bool) -> Moment:
    start = Start.anew(options, moment.belief)
    tally = moment.tally
    tally = tally._replace(losses=tally.losses + lost)
    return Moment(t, None, start, moment.seen_t, (), tally)


def absorb(moment: Moment, datum: Datum, commands: CommandLine, options: StateOptions) -> Moment:
    """Belief after a datum.

    Parameters
    ----------
    moment : Moment
        Before it.
    datum : Datum
        What was measured.
    commands : CommandLine
        What was in effect until then.
    options : StateOptions
        Of the vehicle.

    Returns
    -------
    moment : Moment
        At the time of the datum.
    """
    moment = advance(moment, datum.t, commands, options)
    if datum.kind == SIGHTING:
        x, y, xx, xy, yy = datum.values
        moment = _sighted(moment, (x, y), (xx, xy, yy), options)
    elif moment.belief is not None:
        belief, doubted = correct(moment.belief, datum.values, options)
        tally = moment.tally
        if doubted:
            tally = tally._replace(readings=tally.readings + doubted)
        moment = Moment(moment.t, belief, None, moment.seen_t, moment.strays, tally)
    elif moment.start is not None:
        moment = moment._replace(start=moment.start.read(datum.t, datum.values))
    return moment


def _sighted(
    moment: Moment,
    xy: tuple[float, float],
    R: tuple[float, float, float],
    options: StateOptions,
) -> Moment:
    if moment.belief is None:
        assert moment.start is not None
        start = moment.start.seen(moment.t, xy, R, options)
        belief = begun(start, options)
        return moment._replace(
            belief=belief, start=None if belief is not None else start, seen_t=moment.t
        )
    distance, belief = place(moment.belief, xy, R, options)
    if distance <= options.gate_sigma:
        return moment._replace(belief=belief, seen_t=moment.t, strays=())
    tally = moment.tally._replace(sightings=moment.tally.sightings + 1)
    stray = Stray(moment.t, *xy, (R[0] + R[2]) ** 0.5)
    strays: tuple[Stray, ...] = (stray,)
    if moment.strays and _agree(moment.strays[-1], stray, options):
        strays = (*moment.strays, stray)
    P = moment.belief.covariance.copy()
    P[V, V] += _SHAKEN_MPS**2  # it may have been stopped or pushed; then the next ones will agree
    P[OMEGA, OMEGA] += _SHAKEN_RADPS**2
    moment = moment._replace(belief=Gaussian(moment.belief.mean, P), strays=strays, tally=tally)
    if len(strays) < options.jump_after:
        return moment
    moment = _anew(moment, moment.t, options, lost=False)
    moment = moment._replace(tally=tally._replace(jumps=tally.jumps + 1))
    return _sighted(moment, xy, R, options)


def _agree(one: Stray, other: Stray, options: StateOptions) -> bool:
    way = hypot(other.x - one.x, other.y - one.y)
    sigma = hypot(one.sigma, other.sigma)
    return way <= options.gate_sigma * sigma + options.fastest_mps * (other.t - one.t)

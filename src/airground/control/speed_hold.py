"""A ground speed held in metres per second, whatever a vehicle's own unit of speed is (paper, section 4).

The camera measures the true speed of anything that drives on the ground; pixels per second say nothing, as their scale
changes over the image. A vehicle whose wheels, throttle or gearing make it drive ``1 / scale`` of what it is told is
told ``scale`` times as much. The scale comes from integrating the relative error, so it holds at other speeds as well::

    scale' / scale = (expected - measured) / expected / time * weight

Expected is the wanted speed as the vehicle follows it and as it is measured: late. The weight falls with the
measurement's deviation, and while the vehicle still speeds up or slows down, as its lag may be another. Nothing is
learnt while little speed is expected, and none beyond the bound (no winding up).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, isfinite, isnan

from airground.errors import InputError

__all__ = ["SpeedHold", "SpeedMemory"]


@dataclass(frozen=True, slots=True)
class SpeedMemory:
    """What a `SpeedHold` must be told at the next step."""

    scale: float = 1.0
    """What commands are multiplied by: for a vehicle that takes a scale of throttle, the answer itself."""

    following_mps: float = 0.0
    """Wanted speed as the vehicle follows it [m/s]."""

    expected_mps: float = 0.0
    """That, as it is measured [m/s]."""

    at_bound: bool = False
    """Whether the vehicle would need more than the bound: it is blocked, or not the vehicle that was meant."""


@dataclass(frozen=True, slots=True)
class SpeedHold:
    """Regulator of one vehicle's speed; it does not steer. A speed measured as a length wants the sign of the command.

    Measured speeds come from a `StateFilter` or from image velocities through J; of one that heeds commands late, the
    filter's answer is as fresh as its prediction, and `lateness_s` is small.
    """

    time_s: float = 1.5
    """The error of the scale falls to a third in this time [s]; several times the lag."""

    lag_s: float = 0.2
    """Time constant with which the vehicle follows a command, with its dead time [s]."""

    lateness_s: float = 0.1
    """How old the measured speed is, with the smoothing in it [s]."""

    most: float = 1.6
    """Largest scale, and one over the smallest: 1.6 serves units that are wrong by 37 %."""

    least_mps: float = 0.03
    """Nothing is learnt where less speed than this is expected [m/s]."""

    sigma_share: float = 0.2
    """A measurement counts half where its deviation is this share of the expected speed."""

    def __post_init__(self) -> None:
        for name in ("time_s", "least_mps", "sigma_share"):
            value = getattr(self, name)
            if not (value > 0 and isfinite(value)):
                raise InputError(f"{name} must be positive and finite, not {value}")
        for name in ("lag_s", "lateness_s"):
            value = getattr(self, name)
            if not (value >= 0 and isfinite(value)):
                raise InputError(f"{name} must be 0 or more and finite, not {value}")
        if not (self.most > 1 and isfinite(self.most)):
            raise InputError(f"most must be above 1 and finite, not {self.most}")

    def step(
        self,
        memory: SpeedMemory,
        wanted_mps: float,
        measured_mps: float,
        dt: float,
        *,
        sigma_mps: float = 0.0,
    ) -> tuple[float, SpeedMemory]:
        """Say what to tell the vehicle now.

        Parameters
        ----------
        memory : SpeedMemory
            `SpeedMemory()` at first, then what the last step gave.
        wanted_mps : float [m/s]
            Ground speed wanted from now on, negative in reverse. Rest where it is no finite number.
        measured_mps : float [m/s]
            True ground speed, signed alike; NaN where it is not known, and then the scale stays.
        dt : float [s]
            Until the next step.
        sigma_mps : float [m/s]
            Standard deviation of the measured speed; NaN: unknown, and then nothing is learnt.

        Returns
        -------
        command_mps : float [m/s]
            Wanted speed times the scale; rest is rest.
        memory : SpeedMemory
            For the next step.

        Raises
        ------
        InputError
            If `dt` is not positive and finite, or `sigma_mps` is negative.
        """
        if not (dt > 0 and isfinite(dt)):
            raise InputError(f"dt must be positive and finite, not {dt}")
        if sigma_mps < 0:
            raise InputError(f"sigma_mps must be 0 or more, not {sigma_mps}")
        wanted = wanted_mps if isfinite(wanted_mps) else 0.0
        expected = memory.expected_mps
        scale, at_bound = memory.scale, memory.at_bound
        if (
            abs(expected) >= self.least_mps
            and isfinite(measured_mps)
            and not isnan(sigma_mps)
            and wanted * expected > 0  # not while it stops or turns back
        ):
            ratio = sigma_mps / (self.sigma_share * expected)
            under_way = abs(wanted - expected) / max(abs(wanted), abs(expected))
            weight = max(0.0, 1 - 3 * under_way) / (1 + ratio * ratio)
            off = (expected - measured_mps) / expected
            off = max(-1.0, min(1.0, off))  # one wild measurement moves little
            grown = scale * exp(off * weight * min(1.0, dt / self.time_s))
            scale = max(1 / self.most, min(self.most, grown))
            at_bound = scale != grown
        following = memory.following_mps
        following += (wanted - following) * _reached(dt, self.lag_s)
        expected += (following - expected) * _reached(dt, self.lateness_s)
        return wanted * scale, SpeedMemory(scale, following, expected, at_bound)


def _reached(dt: float, lag: float) -> float:
    return 1.0 if lag == 0 else 1 - exp(-dt / lag)

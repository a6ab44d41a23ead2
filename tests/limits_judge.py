"""Is a sequence of commands within limits? Written from the words in `Limits`, for tests."""

from __future__ import annotations

from math import hypot, isfinite

from airground.control import Limits, VelocityCommand

SLACK = 1e-9


def breaches(now: VelocityCommand, limits: Limits) -> list[str]:
    """What a command breaks by itself."""
    speed = hypot(now.v, now.lateral)
    found = {
        "not finite": not all(map(isfinite, (now.v, now.omega, now.lateral))),
        "speed": speed > limits.speed_mps + SLACK,
        "reverse": now.v < -limits.reverse_mps - SLACK,
        "turn rate": abs(now.omega) > limits.turn_rate_radps + SLACK,
        "lateral acceleration": speed * abs(now.omega) > limits.lateral_acceleration_mps2 + SLACK,
        "turn radius": abs(now.omega) * limits.turn_radius_m > speed + SLACK,
    }
    return [name for name, broken in found.items() if broken]


def jumps(before: VelocityCommand, now: VelocityCommand, dt: float, limits: Limits) -> list[str]:
    """What a change breaks; time is what it would take at the limits."""

    def needed(old: float, new: float) -> float:
        if old * new < 0:  # through zero
            return abs(old) / limits.deceleration_mps2 + abs(new) / limits.acceleration_mps2
        change = abs(new) - abs(old)
        return max(change / limits.acceleration_mps2, -change / limits.deceleration_mps2)

    gain = hypot(now.v, now.lateral) - hypot(before.v, before.lateral)
    vector = hypot(now.v - before.v, now.lateral - before.lateral)
    most = max(limits.acceleration_mps2, limits.deceleration_mps2) * dt
    found = {
        "speed": max(needed(before.v, now.v), needed(before.lateral, now.lateral)) > dt + SLACK,
        "gain": gain > limits.acceleration_mps2 * dt + SLACK,
        "vector": vector > most + SLACK,
        "turn": abs(now.omega - before.omega) > limits.turn_acceleration_radps2 * dt + SLACK,
    }
    return [name for name, broken in found.items() if broken]

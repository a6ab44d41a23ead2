"""Where a robot is when a command takes effect: late sightings, readings, commands in flight."""

from airground.control.estimation.counts import StateCounts
from airground.control.estimation.options import StateOptions
from airground.control.estimation.state_filter import StateFilter

__all__ = [
    "StateCounts",
    "StateFilter",
    "StateOptions",
]

"""All that a session is ever told. Whatever it does follows from these, in their order: that is what a replay feeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airground.robots import RobotReading
    from airground.session.orders import Order
    from airground.vision.sightings import Sightings
    from airground.vision.tracker import TrackerState

__all__ = ["CameraNews", "Finished", "Heard", "Input", "Ordered", "Seen"]


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A frame of the camera, after detector and tracker."""

    t: float
    """When it was taken, as the camera stamps it, on the session's clock [s]: late by what calibration finds."""

    arrived_s: float
    """When it was in memory [s]."""

    index: int
    """Number of the frame as the camera counts."""

    size_px: tuple[int, int]
    """Width and height [px]."""

    sightings: Sightings
    """What the detector saw."""

    tracks: TrackerState
    """What the tracker believes after it."""

    segment: int = 0
    """Grows when the camera went away and came back: the tracker began anew."""


@dataclass(frozen=True, slots=True)
class CameraNews:
    """The camera's health has changed."""

    state: str
    """As `SourceState`: opening, live, lost, ended."""

    line: str = ""
    """What a user should know; empty where all is well."""

    frozen_s: float = 0.0
    """For how long it has been sending one and the same picture [s]."""


@dataclass(frozen=True, slots=True)
class Heard:
    """A robot has told something."""

    robot: str
    """Name of it."""

    readings: tuple[RobotReading, ...]
    """One or more, oldest first."""


@dataclass(frozen=True, slots=True)
class Ordered:
    """Somebody who may has asked for something."""

    client: str
    """Who."""

    order: Order
    """What."""


@dataclass(frozen=True, slots=True, eq=False)
class Finished:
    """Work that was given away is done."""

    job: int
    """Its number."""

    result: Any
    """What it gave; an `AirgroundError` where it failed."""


Input = Seen | CameraNews | Heard | Ordered | Finished

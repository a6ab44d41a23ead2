"""What an operator can ask for, and its form on the wire. Pixels are those of the image, as they are clicked."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields
from typing import Any, ClassVar, Literal, get_args

from airground.errors import InputError
from airground.session.order_fields import FIELDS, SPECIAL, shown

__all__ = [
    "KINDS",
    "Alive",
    "Calibrate",
    "DriveTo",
    "EndCalibration",
    "FollowPath",
    "Gone",
    "Hand",
    "Order",
    "Release",
    "Rest",
    "SetFences",
    "SetSpeed",
    "Sketch",
    "Stop",
    "order_document",
    "parse_order",
]

Pixels = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Stop:
    """All robots stand at once, and stay so until `Release`. Anybody may ask for it."""

    kind: ClassVar[str] = "stop"


@dataclass(frozen=True, slots=True)
class Release:
    """Let go of stops that wait for a person. Nothing moves by it: what was under way is forgotten."""

    kind: ClassVar[str] = "release"


@dataclass(frozen=True, slots=True)
class Alive:
    """The operator is there. Without it for a while, all robots stop."""

    kind: ClassVar[str] = "alive"


@dataclass(frozen=True, slots=True)
class Gone:
    """The operator's connection was lost, or the controls were given away: what was driven stops."""

    kind: ClassVar[str] = "gone"


@dataclass(frozen=True, slots=True)
class DriveTo:
    """Drive through pixels, and stop on the last."""

    kind: ClassVar[str] = "drive_to"

    robot: str
    """Which."""

    goals_px: Pixels
    """Where its mark shall be, in order."""

    heading_rad: float | None = None
    """Direction in the image at the end, from u towards v; any where None."""


@dataclass(frozen=True, slots=True)
class Sketch:
    """Make a path of a line drawn by hand, and show it; nothing moves."""

    kind: ClassVar[str] = "sketch"

    robot: str
    """Which is to drive it."""

    sketch: int
    """Number that the page gives it; the newest per robot wins."""

    points_px: Pixels
    """As drawn."""

    speed_mps: float | None = None
    """Wished for along it; the robot's own where None."""


@dataclass(frozen=True, slots=True)
class FollowPath:
    """Release the path that was shown: the robot drives to its start and along it."""

    kind: ClassVar[str] = "follow_path"

    robot: str
    """Which."""

    sketch: int
    """Number of the sketch that was shown."""


@dataclass(frozen=True, slots=True)
class Rest:
    """Forget what a robot was to do; it brakes and stands."""

    kind: ClassVar[str] = "rest"

    robot: str | None = None
    """Which; all where None."""


@dataclass(frozen=True, slots=True)
class SetFences:
    """Where robots may be, from now on; replaces what was."""

    kind: ClassVar[str] = "set_fences"

    stay_inside: tuple[Pixels, ...] = ()
    """Polygons; none leaves all of the visible ground."""

    keep_out: tuple[Pixels, ...] = ()
    """Polygons."""


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """How fast a robot drives from now on."""

    kind: ClassVar[str] = "set_speed"

    robot: str
    """Which."""

    speed_mps: float
    """Within its limits."""


@dataclass(frozen=True, slots=True)
class Calibrate:
    """Begin a calibration drive; what is known of the camera is forgotten when the new calibration is taken over."""

    kind: ClassVar[str] = "calibrate"

    by: Literal["guided", "hand"] = "guided"
    """Whether robots drive legs by themselves, or a person drives them."""

    robots: tuple[str, ...] = ()
    """Which take part; all where empty."""


@dataclass(frozen=True, slots=True)
class EndCalibration:
    """End the calibration drive."""

    kind: ClassVar[str] = "end_calibration"

    keep: bool = True
    """Whether its result is taken over; otherwise the one before stays."""


@dataclass(frozen=True, slots=True)
class Hand:
    """A robot is driven by hand; holds for a fraction of a second, so it has to be repeated."""

    kind: ClassVar[str] = "hand"

    robot: str
    """Which."""

    forward: float
    """Share of the speed that is set, -1 to 1."""

    turn: float
    """Share of the largest turn rate, -1 to 1; positive to the left as seen from above."""


Order = (
    Stop
    | Release
    | Alive
    | Gone
    | DriveTo
    | Sketch
    | FollowPath
    | Rest
    | SetFences
    | SetSpeed
    | Calibrate
    | EndCalibration
    | Hand
)

KINDS: dict[str, type[Order]] = {order.kind: order for order in get_args(Order)}
"""Orders by their name on the wire."""


def order_document(order: Order) -> dict[str, Any]:
    """Give an order as what JSON can hold.

    Parameters
    ----------
    order : Order
        Any.

    Returns
    -------
    document : dict
        For `parse_order`.
    """
    return {"kind": order.kind} | {one.name: getattr(order, one.name) for one in fields(order)}


def parse_order(document: object) -> Order:
    """Read an order from what somebody sent. Nothing is taken on trust.

    Parameters
    ----------
    document : object
        As JSON gave it.

    Returns
    -------
    order : Order
        With finite numbers of sensible size only.

    Raises
    ------
    InputError
        If it is not an order: which field, and what was expected.
    """
    if not isinstance(document, dict):
        raise InputError(f"an order must be an object, not {type(document).__name__}")
    name = document.get("kind")
    kind = KINDS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise InputError(f"kind must be one of {', '.join(KINDS)}, not {shown(name)}")
    declared = {one.name: one for one in fields(kind)}
    unknown = sorted(str(key) for key in document if key != "kind" and key not in declared)
    if unknown:
        known = ", ".join(declared) or "none"
        raise InputError(f"{name}: unknown field {shown(unknown[0])}; it has {known}")
    values: dict[str, Any] = {}
    for key, one in declared.items():
        if key in document:
            read = SPECIAL.get((kind.kind, key), FIELDS[key])
            values[key] = read(f"{name}: {key}", document[key])
        elif one.default is MISSING:
            raise InputError(f"{name}: field {key} is missing")
    return kind(**values)

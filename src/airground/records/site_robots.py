"""Robots of a site file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from airground.control.estimation.options import StateOptions
from airground.control.limits import Limits
from airground.records.site import RobotSite, TimingSite
from airground.records.site_plain import choice, pair
from airground.records.site_values import address, color, link, name, track, within

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.records.site_table import Table

__all__ = ["read_robot", "refuse_pairs"]


def read_robot(table: Table, limits: tuple[str, ...], timing: tuple[str, ...]) -> RobotSite:
    """Read one robot.

    Parameters
    ----------
    table : Table
        Its own.
    limits : tuple of str
        Keys of its limits.
    timing : tuple of str
        Keys of its timing.

    Returns
    -------
    robot : RobotSite
        With stand-ins for what is wrong.
    """
    asked = table.table("limits", limits)
    bounds: Limits = asked.build(Limits)
    state: StateOptions = table.table("timing", timing).build(StateOptions)
    kind: Any = table.get(
        "kind", choice("unicycle", "differential", "ackermann", "omni"), "differential"
    )
    if kind == "ackermann" and not bounds.turn_radius_m > 0:
        table.mistakes.add(
            table.at("limits.turn_radius_m"), "an ackermann robot needs one above 0 [m]"
        )
    speed = table.get("speed_mps", within(0.001, 100.0), None)
    limit_is_right = asked.value.get("speed_mps", bounds.speed_mps) == bounds.speed_mps
    if speed is not None and speed > bounds.speed_mps and limit_is_right:
        table.wrong("speed_mps", f"found {speed:g}, above limits.speed_mps = {bounds.speed_mps:g}")
    compass: Any = table.get("compass", choice("absolute", "relative"), "absolute")
    return RobotSite(
        name=table.need("name", name, ""),
        track=table.need("track", track, ""),
        link=table.need("link", link, ""),
        kind=kind,
        radius_m=table.get("radius_m", within(0.01, 50.0), 0.35),
        color=table.get("color", color, ""),
        speed_mps=speed,
        compass=compass,
        lever_arm_m=table.get("lever_arm_m", pair, (0.0, 0.0)),
        limits=bounds,
        timing=TimingSite(**{key: getattr(state, key) for key in timing}),
    )


def refuse_pairs(tables: Sequence[Table], robots: Sequence[RobotSite]) -> None:
    """Say where two robots have one name, track or address.

    Parameters
    ----------
    tables : sequence of Table
        Theirs.
    robots : sequence of RobotSite
        As read.
    """
    seen: dict[tuple[str, object], str] = {}
    for table, robot in zip(tables, robots, strict=True):
        listed = (
            ("name", "name", robot.name),
            ("track", "track", robot.track),
            ("link", "address", address(robot.link)),
        )
        for key, what, value in listed:
            if not value:
                continue  # wrong and told already, or embedded
            other = seen.setdefault((what, value), table.at(key))
            if other != table.at(key):
                table.wrong(key, f"the same {what} as {other}; each robot needs its own")

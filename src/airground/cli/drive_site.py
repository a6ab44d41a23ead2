"""``airground drive --site``: the same drive on a live site."""

from __future__ import annotations

import json
from math import atan2, cos, radians, sin
from typing import TYPE_CHECKING

from airground.cli.output import note, print_json
from airground.cli.terminal import status
from airground.errors import InputError

if TYPE_CHECKING:
    from argparse import Namespace

    from airground.calibration import Calibration
    from airground.records import DrawnPath

__all__ = ["drive_site"]

PATIENCE_S = 300.0


def drive_site(args: Namespace, calibration: Calibration, drawn: DrawnPath | None) -> None:
    """Drive a robot of a site, and say how it went.

    Parameters
    ----------
    args : Namespace
        As parsed.
    calibration : Calibration
        To drive with.
    drawn : DrawnPath or None
        A sketch to follow; goals where None.

    Raises
    ------
    InputError
        If the site, the robot or what is asked for is wrong.
    UnreachableError
        If camera or robot cannot be reached.
    """
    import numpy as np

    from airground.records import make_folder, write_text
    from airground.records.site_reader import read_site
    from airground.session.compose import LiveSite, plan_of_site
    from airground.session.site_drive import SiteOrder, drive_on_site

    plan = plan_of_site(read_site(args.site))
    names = [robot.name for robot in plan.options.robots]
    robot = args.robot or names[0]
    if robot not in names:
        raise InputError(f"--robot: the site has no robot {robot!r}; it has {', '.join(names)}")
    heading = None
    if args.heading_deg is not None:
        # A heading on the ground is a direction in the image, at the goal.
        ground = np.array([cos(radians(args.heading_deg)), sin(radians(args.heading_deg))])
        du, dv = (calibration.jacobian(np.array(args.goal[-1])) @ ground).tolist()
        heading = atan2(dv, du)
    order = SiteOrder(
        robot,
        goals_px=tuple(args.goal or ()),
        points_px=() if drawn is None else tuple((float(u), float(v)) for u, v in drawn.uv),
        heading_rad=heading,
        speed_mps=args.speed_mps,
    )
    if args.out is not None:
        make_folder(args.out)
    with status() as say, LiveSite(plan, calibration, note=note) as site:
        driven = drive_on_site(site.live, order, patience_s=PATIENCE_S, say=say)
    document = driven.document()
    if args.out is not None:
        text = json.dumps(document, indent=2, allow_nan=False) + "\n"
        write_text(args.out / "drive.json", text)
    if args.json:
        print_json(document)
        return
    off = ""
    if driven.goal_error_px is not None and driven.goal_error_m is not None:
        off = f"; {driven.goal_error_px:.1f} px, {100 * driven.goal_error_m:.1f} cm from the goal"
    print(f"site: {plan.options.name}; {robot} seen by its camera")
    print(
        f"arrived after {driven.time_s:.1f} s{off}"
        if driven.reached
        else f"not arrived: {driven.trouble}{off}"
    )
    print(f"fastest {driven.max_speed_mps:.3f} m/s, {len(driven.stops)} stops for safety")
    for line in driven.stops:
        print(f"  stop at {line}")

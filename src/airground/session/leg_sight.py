"""What a leg's driver is told of one robot: mark, compass, odometer, and what else is in view."""

from __future__ import annotations

from math import hypot, pi
from typing import TYPE_CHECKING

from airground.control.legs import LegInput

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.control.legs import LocalMap
    from airground.session.member import Member
    from airground.session.options import SessionOptions
    from airground.vision.tracker import Track

__all__ = ["leg_input"]

FAR_SHARE = 0.12
"""Of the image's smaller side: what is kept from other things while no metre is known there."""


def leg_input(
    t: float,
    member: Member,
    local: LocalMap,
    *,
    tracks: Sequence[Track | None],
    options: SessionOptions,
    size_px: tuple[int, int],
    held: bool,
) -> LegInput:
    """Put together what is known of a robot.

    Parameters
    ----------
    t : float [s]
        Now.
    member : Member
        The robot.
    local : LocalMap
        What its own motion told of the image.
    tracks : sequence of Track or None
        Everything else in view.
    options : SessionOptions
        Of the session.
    size_px : (int, int) [px]
        Of the image.
    held : bool
        Whether something else holds it at rest.

    Returns
    -------
    now : LegInput
        For its driver.
    """
    reading, track = member.reading, member.track
    uv = uv_dot = None
    if track is not None and track.sighting is not None:
        uv = (float(track.uv[0]), float(track.uv[1]))
        uv_dot = (float(track.uv_dot[0]), float(track.uv_dot[1]))
    elif member.seen_uv is not None:
        uv = (float(member.seen_uv[0]), float(member.seen_uv[1]))
    far = FAR_SHARE * min(size_px)
    if uv is not None:
        steps = [local.px_per_m(uv, heading) for heading in (0.0, pi / 2)]
        known = [hypot(*step) for step in steps if step is not None]
        if len(known) == 2:
            far = max(0.3 * far, max(known) * (member.options.radius_m + options.others_radius_m))
    return LegInput(
        t=t,
        dt=options.period_s,
        image_size_px=size_px,
        heading_rad=None if reading is None else reading.heading,
        speed_mps=None if reading is None else reading.speed,
        reading_t=None if reading is None else reading.t,
        turn_radps=None if reading is None else reading.turn_rate,
        uv=uv,
        uv_dot=uv_dot,
        seen_t=member.seen_t,
        margin_px=options.border_px,
        others=tuple((float(k.uv[0]), float(k.uv[1]), far) for k in tracks if k is not None),
        held=held,
    )

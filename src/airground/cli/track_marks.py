"""``airground track --mark-height``: marks above the ground under a camera that moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from airground.errors import InputError
from airground.records import read_motion

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable

    from airground.geometry.arrays import FloatArray
    from airground.vision.eyes import Look
    from airground.vision.video_tracks import VideoTracks

__all__ = ["MarksAbove", "add_mark_arguments", "refuse_marks"]


def add_mark_arguments(parser: ArgumentParser, length: Callable[[str], float]) -> None:
    """Declare the arguments.

    Parameters
    ----------
    parser : ArgumentParser
        Of the command.
    length : callable
        Reads a positive number.
    """
    parser.add_argument(
        "--mark-height",
        type=length,
        metavar="M",
        help="with --stabilize: marks are so high above the ground [m], and move in another way than the ground "
        "when the camera does; refer them to the first frame as what they are. Needs --focal-length and --motion",
    )
    parser.add_argument(
        "--focal-length", type=length, metavar="PX", help="of the camera [px], for --mark-height"
    )
    parser.add_argument(
        "--motion",
        type=Path,
        metavar="MOTION",
        help="how a robot moved on the ground (CSV), for --mark-height: its drive tells how high the camera is",
    )


def refuse_marks(args: Namespace) -> None:
    """Raise for options that do not go together.

    Parameters
    ----------
    args : Namespace
        As parsed.

    Raises
    ------
    InputError
        If some of them are missing.
    """
    given = {
        "--mark-height": args.mark_height,
        "--focal-length": args.focal_length,
        "--motion": args.motion,
    }
    missing = [option for option, value in given.items() if value is None]
    if len(missing) == len(given):
        return
    if missing:
        raise InputError(f"{', '.join(given)} belong together; give {' and '.join(missing)} too")
    if not args.stabilize:
        raise InputError("--mark-height is for a camera that moves; give --stabilize too")


class MarksAbove:
    """Marks at a height.

    Parameters
    ----------
    args : Namespace
        As parsed, and with all options that this needs.

    Raises
    ------
    FileError
        If the motion cannot be read.
    """

    def __init__(self, args: Namespace) -> None:
        self.camera_height_m = float("nan")
        """Of the camera above the ground at its first picture, once that is known [m]."""
        self._height_m, self._focal_px = args.mark_height, args.focal_length
        self._motion = read_motion(args.motion)
        self._ground: dict[float, FloatArray] = {}

    def note(self, look: Look) -> None:
        """Keep how the ground lies in a frame.

        Parameters
        ----------
        look : Look
            Of it.
        """
        if look.stabilization is not None and look.stabilization.stable_from_image is not None:
            self._ground[look.frame.t] = look.stabilization.stable_from_image

    def refer(self, found: VideoTracks) -> VideoTracks:
        """Refer all sightings to the first frame as what they are.

        Parameters
        ----------
        found : VideoTracks
            As if they were on the ground.

        Returns
        -------
        found : VideoTracks
            With the marks' plane held still in place of the ground.

        Raises
        ------
        UndeterminedError
            If flight and drive do not tell where the camera is.
        """
        from airground.vision.moving import MarksView, calibrate_marks

        view = MarksView(self._height_m, self._focal_px, found.image_size_px)
        plane = calibrate_marks(found.tracks, self._ground, self._motion, view)
        self.camera_height_m = plane.camera_height_m
        return replace(found, tracks=plane.tracks)

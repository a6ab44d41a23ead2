"""``airground inspect``."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from airground.calibration import Calibration
from airground.calibration.inspection import Inspection, LensBend, inspect_calibration
from airground.cli.output import image_size, print_json, refuse_overwriting, two_numbers
from airground.errors import InputError
from airground.records import replacing
from airground.records.cells import shown

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "inspection_document", "run"]

NAME = "inspect"
SUMMARY = "say what a calibration means: horizon, scale over the image, focal length, tilt, height"
EXAMPLE = """\
  airground inspect calibration.json --picture view.png
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument("calibration", type=Path, metavar="C", help="calibration (JSON)")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE.png", help="draw horizon, ground grid and scale"
    )
    parser.add_argument(
        "--image-size", type=image_size, metavar="WxH", help="if the calibration does not hold it"
    )
    parser.add_argument(
        "--principal-point",
        type=two_numbers,
        metavar="U,V",
        help="in pixels (default: the lens's centre, or else the image's middle)",
    )
    parser.add_argument(
        "--focal-length-px",
        type=_positive,
        metavar="F",
        help="if known; needed when the camera looks straight down",
    )


def run(args: Namespace) -> None:
    """Inspect, draw, print.

    Parameters
    ----------
    args : Namespace
        As parsed.
    """
    if args.picture is not None and args.picture.suffix.lower() != ".png":
        raise InputError(f"--picture {args.picture}: expected a name that ends in .png")
    if args.picture is not None:
        refuse_overwriting("--picture", args.picture, (args.calibration,))
    calibration = Calibration.load(args.calibration)
    inspection = inspect_calibration(
        calibration,
        image_size_px=args.image_size,
        principal_point_px=args.principal_point,
        focal_length_px=args.focal_length_px,
    )
    if args.picture is not None:
        from airground.pictures.inspection import draw_inspection

        with replacing(args.picture) as temporary:
            draw_inspection(temporary, calibration, inspection)
    if args.json:
        print_json(inspection_document(calibration, inspection))
    else:
        print("\n".join(_summary(calibration, inspection)))


def inspection_document(calibration: Calibration, inspection: Inspection) -> dict[str, Any]:
    """Give the JSON object of an inspection.

    Parameters
    ----------
    calibration : Calibration
        What was inspected.
    inspection : Inspection
        What was found.

    Returns
    -------
    document : dict
        Without NaN; what is not determined is null.
    """
    estimate = inspection.camera
    camera: dict[str, float | str | None] = dict.fromkeys(
        (
            "focal_length_px",
            "focal_length_sigma_px",
            "tilt_deg",
            "tilt_sigma_deg",
            "roll_deg",
            "roll_sigma_deg",
            "height_m",
            "height_sigma_m",
            "square_pixel_residual",
        )
    )
    if estimate is not None:
        camera.update(
            focal_length_px=_finite(estimate.camera.focal_length_px),
            focal_length_sigma_px=_finite(estimate.focal_length_sigma_px),
            tilt_deg=_finite(estimate.camera.tilt_deg),
            tilt_sigma_deg=_finite(math.degrees(estimate.tilt_sigma_rad)),
            roll_deg=_finite(estimate.camera.roll_deg),
            roll_sigma_deg=_finite(math.degrees(estimate.roll_sigma_rad)),
            height_m=_finite(estimate.camera.height_m),
            height_sigma_m=_finite(estimate.height_sigma_m),
            square_pixel_residual=_finite(estimate.camera.square_pixel_residual),
        )
    return {
        "verdict": calibration.observability.verdict,
        "relative_sigma": calibration.observability.relative_sigma,
        "frame_px": list(inspection.frame_px),
        "lens": _lens_document(inspection.lens),
        "horizon": inspection.horizon.tolist(),
        "horizon_in_frame": inspection.horizon_in_frame,
        "ground_frame": _handedness(calibration),
        "scale": {
            "uv_px": inspection.uv.tolist(),
            "min_px_per_m": inspection.pixels_per_metre[:, 0].tolist(),
            "max_px_per_m": inspection.pixels_per_metre[:, 1].tolist(),
            "relative_sigma": inspection.relative_sigma.tolist(),
        },
        **camera,
        "camera_problem": inspection.camera_problem or None,
    }


def _summary(calibration: Calibration, inspection: Inspection) -> list[str]:
    scale, sigma = inspection.pixels_per_metre, inspection.relative_sigma
    a, b, c = inspection.horizon
    undistorted = "" if inspection.lens is None else " in the undistorted image"
    lines = [
        f"verdict {calibration.observability.verdict}; ground velocities good to "
        f"{calibration.observability.relative_sigma:.1%} where the robot drove",
        f"scale {scale[:, 0].min():.4g} to {scale[:, 1].max():.4g} px/m over the ground in the frame, "
        f"known to {sigma.min():.1%} at best and {sigma.max():.1%} at worst",
        *_lens_lines(inspection.lens),
        f"horizon {a:+.5f} u {b:+.5f} v {c:+.2f} = 0{undistorted}, "
        + ("crosses the frame" if inspection.horizon_in_frame else "outside the frame"),
        f"ground frame {_handedness(calibration)}-handed",
    ]
    estimate = inspection.camera
    if estimate is None:
        return [*lines, f"camera not determined: {inspection.camera_problem}"]
    k = estimate.camera
    return [
        *lines,
        f"for square pixels{',' if undistorted else ''}{undistorted}:",
        f"  focal length {k.focal_length_px:.1f} px (deviation {estimate.focal_length_sigma_px:.1f})",
        f"  tilt {k.tilt_deg:.2f} degrees from straight down ({math.degrees(estimate.tilt_sigma_rad):.2f})",
        f"  roll {k.roll_deg:.2f} degrees ({math.degrees(estimate.roll_sigma_rad):.2f})",
        f"  height {k.height_m:.3f} m ({estimate.height_sigma_m:.3f})",
    ]


def _lens_document(lens: LensBend | None) -> dict[str, Any] | None:
    if lens is None:
        return None
    return {
        "model": "division",
        "k1": lens.k1,
        "k1_sigma": lens.k1_sigma,
        "center_px": lens.center_px.tolist(),
        "bend_frame_px": _finite(lens.frame_px),
        "bend_frame_sigma_px": _finite(lens.frame_sigma_px),
        "bend_region_px": None if lens.region_px is None else _finite(lens.region_px),
    }


def _lens_lines(lens: LensBend | None) -> list[str]:
    if lens is None:
        return []
    kind = "barrel" if lens.k1 < 0 else "pincushion" if lens.k1 > 0 else "no distortion"
    sigma = "taken as exact" if lens.k1_sigma is None else f"deviation {lens.k1_sigma:.2g}"
    what = f"lens k1 {lens.k1:.4g} per px^2 ({sigma}), {kind} round {lens.center_px[0]:.1f}, {lens.center_px[1]:.1f}"
    if math.isfinite(lens.frame_px):
        error = "" if lens.k1_sigma is None else f" ({lens.frame_sigma_px:.1f})"
        corner = f"by {abs(lens.frame_px):.1f} px{error} in the frame's farthest corner"
    else:
        corner = "the frame's farthest corner beyond what the lens's model reaches"
    region = ""
    if lens.region_px is not None and math.isfinite(lens.region_px):
        region = f", by {abs(lens.region_px):.1f} px at most where targets were seen"
    return [what, f"  it moves points {corner}{region}"]


def _handedness(calibration: Calibration) -> str:
    return "right" if float(calibration.model.nearness(calibration.origin_px)) < 0 else "left"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 1e-9 < value < 1e9:
        raise argparse.ArgumentTypeError(f"expected a positive number of pixels, not {shown(text)}")
    return value

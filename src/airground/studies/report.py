"""The demo's report: one HTML file with its pictures in it."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from airground._version import __version__
from airground.pictures.demo import draw_ground, draw_overview, draw_speeds
from airground.pictures.driving import draw_demo_drive
from airground.pictures.inspection import draw_inspection
from airground.records import replacing, write_text
from airground.studies.film import mark_positions
from airground.studies.html_page import html_page, inline_png

if TYPE_CHECKING:
    from pathlib import Path

    from airground.geometry import FloatArray
    from airground.studies.demo import Demo

__all__ = ["figure_rows", "write_report"]

BODY = """\
<h1>One drive, no checkerboard: a camera calibrated</h1>
<p class="soft">airground {version}, simulated world. Everything below was computed from the camera's images and from
<code>motion.csv</code> (the robot's compass and odometer).</p>
<img alt="A frame of the video with tracks, speeds and metric grid drawn in" src="{frame}">
<p class="soft">One frame of <a href="demo.mp4">demo.mp4</a>. Tags were found in the images (<code>tracks.csv</code>);
grid and speeds are those of the calibration.</p>
<div class="wide"><table>
<tr><th>what</th><th>found</th><th>truth</th><th></th></tr>
{rows}
</table></div>
<h2>What the camera saw, and what the calibration knows</h2>
<p>The robot's figure eight and a passing cart, in pixels. The white lines are a metric grid on the floor that nobody
ever measured.</p>
<img alt="Camera view with tracks, metric grid and scale" src="{view}">
<h2>The same drive on the floor</h2>
<p>Sightings taken to metres by the calibration, over the true path. The origin of the ground frame is free, so it was
moved onto the truth's; nothing was turned or stretched.</p>
<img alt="Rectified path over the true path" src="{ground}">
<h2>Everybody's speed, with an error bar</h2>
<p>The cart carries nothing and says nothing: its speed comes from its image and the calibration. Bands hold 95 %.</p>
<img alt="Measured speeds of robot and cart with 95 per cent bands" src="{speeds}">
<h2>And now it is a joystick</h2>
<p>A line sketched by hand in the image became a path with a speed in m/s, orange where the robot has to be slow, and
the robot followed it; then it was sent to three pixels. It is steered by what the camera sees, 100 ms late, its compass
and its odometer: nothing else. The film is <a href="drive.mp4">drive.mp4</a>.</p>
<img alt="A frame of the drive: the sketched path, coloured by its speed, goals, and the robot" src="{driveframe}">
<img alt="Sketch, released path and where the robot drove, and its speed" src="{drive}">"""


def write_report(out: Path, demo: Demo) -> None:
    """Write ``report.html`` and its pictures.

    Parameters
    ----------
    out : Path
        Folder, which exists.
    demo : Demo
        What to report.
    """
    truth = {
        demo.world.robot: demo.world.path.speed_mps,
        demo.drive.cart: float(np.linalg.norm(demo.drive.cart_xy_dot)),
    }
    with replacing(out / "view.png") as temporary:
        draw_inspection(temporary, demo.calibration, demo.inspection, tracks=demo.tracks)
    with replacing(out / "ground.png") as temporary:
        draw_ground(
            temporary, demo.calibration, demo.tracks, demo.world.robot, _true_positions(demo)
        )
    with replacing(out / "speeds.png") as temporary:
        draw_speeds(temporary, demo.speeds, truth)
    with replacing(out / "overview.png") as temporary:
        draw_overview(
            temporary, demo.calibration, demo.inspection, demo.tracks, demo.speeds, truth=truth
        )
    driven = demo.driven
    with replacing(out / "drive.png") as temporary:
        draw_demo_drive(
            temporary,
            size_px=demo.scene.image_size_px,
            sketch=driven.sketch_uv,
            path_uv=demo.calibration.distort(driven.path.uv),
            along=driven.along.uv,
            before=driven.to_start.uv,
            goals=np.stack([goal.uv for goal in driven.goals]),
            to_goals=np.concatenate([d.uv for d in driven.goal_drives]),
            planned=(driven.path.time, driven.path.speed),
            speed=(driven.along.t - driven.along.t[0], driven.along.v),
        )
    rows = "\n".join(
        f'<tr><td>{escape(what)}</td><td class="number">{escape(found)}</td>'
        f'<td class="number">{escape(true)}</td><td class="soft">{escape(remark)}</td></tr>'
        for what, found, true, remark in figure_rows(demo)
    )
    pictures = {
        name: inline_png(out / f"{name}.png")
        for name in ("frame", "view", "ground", "speeds", "drive")
    }
    pictures["driveframe"] = inline_png(out / "drive-frame.png")
    body = BODY.format(version=escape(__version__), rows=rows, **pictures)
    write_text(out / "report.html", html_page("airground demo", body))


def _true_positions(demo: Demo) -> FloatArray:
    """True positions of the robot's tag at its sightings."""
    t = demo.tracks.t[demo.tracks.rows(demo.world.robot)]
    return mark_positions(demo.scene, demo.world.robot, t)


def figure_rows(demo: Demo) -> list[tuple[str, str, str, str]]:
    """Figures of the demo, for people.

    Parameters
    ----------
    demo : Demo
        What to report.

    Returns
    -------
    rows : list of (str, str, str, str)
        What, found, truth, remark.
    """
    d, c = demo.document(), demo.calibration
    rows = [
        ("error of g, n (eq. 22)", f"{d['n']:.4f}", "0", "the paper's robot: 0.0563 on average"),
        (
            "error of ground velocities",
            f"{d['map_error']:.2%}",
            "0",
            f"stated deviation {d['relative_sigma']:.2%}",
        ),
        (
            "clock offset",
            f"{d['time_offset_s'] * 1e3:.0f} ms",
            f"{d['time_offset_true_s'] * 1e3:.0f} ms",
            f"stated deviation {d['time_offset_sigma_s'] * 1e3:.0f} ms",
        ),
        (
            "cart's speed, mean",
            f"{d['cart_speed_mps']:.3f} m/s",
            f"{d['cart_speed_true_mps']:.3f} m/s",
            f"rms error of each {d['cart_rms_mps']:.3f} m/s; {d['cart_covered']:.0%} inside the stated 95 %",
        ),
    ]
    estimate = demo.inspection.camera
    if estimate is not None:
        k = estimate.camera
        rows += [
            (
                "camera height above the tags",
                f"{k.height_m:.2f} m",
                f"{demo.world.height_m - demo.mark_height_m:.2f} m",
                f"stated deviation {estimate.height_sigma_m:.2f} m",
            ),
            (
                "camera tilt",
                f"{k.tilt_deg:.1f} degrees",
                f"{np.degrees(demo.world.tilt_rad):.1f} degrees",
                f"stated deviation {np.degrees(estimate.tilt_sigma_rad):.1f} degrees",
            ),
            (
                "focal length",
                f"{k.focal_length_px:.0f} px",
                f"{demo.world.focal_length_px:.0f} px",
                f"stated deviation {estimate.focal_length_sigma_px:.0f} px",
            ),
        ]
    goals, oracle = demo.driven.goals, demo.driven.oracle_path_rms_m
    rows += [
        (
            "distance from the sketched path",
            f"{1000 * demo.driven.path_rms_m:.1f} mm rms",
            "0",
            "" if oracle is None else f"{1000 * oracle:.1f} mm for who knows the true g",
        ),
        (
            "distance from the clicked goals",
            f"{1000 * max(goal.error_m for goal in goals):.1f} mm at most",
            "0",
            f"{max(goal.error_px for goal in goals):.1f} px at most; {sum(g.reached for g in goals)} of "
            f"{len(goals)} reached, {demo.driven.stops} stops for safety",
        ),
    ]
    rows.append(("sightings used", f"{c.fit.sightings}", "", f"residual {c.fit.rms_px:.2f} px"))
    return rows

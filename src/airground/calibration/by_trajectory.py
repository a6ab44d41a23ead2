"""A calibration by the whole-drive estimator, from recordings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.calibration import Calibration, Fit, TargetFit
from airground.calibration.headings import advise, distinct_headings_deg
from airground.calibration.lens_uncertainty import raw_relative_sigma
from airground.calibration.observability import verdict
from airground.calibration.trajectory.estimate import estimate_whole_drive
from airground.errors import UnobservableMotionError

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.calibration.recordings import Motion, Tracks
    from airground.calibration.trajectory.estimate import WholeDrive
    from airground.calibration.trajectory.selection import Distortion
    from airground.geometry.arrays import FloatArray

__all__ = ["calibrate_trajectory"]

ASKED = 500  # image points over which an uncertainty is averaged
FEWEST_INLIERS = 0.35  # share of the sightings that must follow the estimate
MOST = 0.5  # share of a track that must: the rest, were it more, could follow another g
NAMED = 3  # robots in a message
HEADINGS = 2  # whose vanishing points and speeds determine g
RANK = 6  # of eq. 15, both components


def calibrate_trajectory(
    tracks: Tracks,
    motion: Motion,
    *,
    time_offset_s: float | None,
    distortion: Distortion,
    image_size_px: tuple[int, int] | None,
    speed_scale_sigma: float,
    say: Callable[[str], None],
) -> Calibration:
    """Calibrate on the whole drive at once.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    time_offset_s : float or None [s]
        Clock offset; estimated where None.
    distortion : {"auto", "none", "division"}
        Whether to estimate a lens.
    image_size_px : (int, int) or None [px]
        Kept with the calibration; its middle is the lens's centre.
    speed_scale_sigma : float
        Relative standard deviation of a robot's speed scale.
    say : callable
        Is given one-line remarks.

    Returns
    -------
    calibration : Calibration
        With its covariance and a verdict.

    Raises
    ------
    UnobservableMotionError
        If the motion does not determine g.
    InputError
        If tracks and motion do not belong together.
    """
    center = None if image_size_px is None else (np.array(image_size_px, dtype=np.float64) - 1) / 2
    drive = estimate_whole_drive(
        tracks,
        motion,
        offset=time_offset_s,
        distortion=distortion,
        center=center,
        scale_sigma=speed_scale_sigma,
    )
    problem, state, view = drive.problem, drive.solution.state, drive.problem.view
    layout = problem.layout
    model, px = drive.model, view.px_from_normal
    covariance = px @ drive.cautious @ px.T
    # Robots of one make read wrong alike: what several of them agree on is no surer than what one says.
    row, others = model.g.ravel(), 1 - 1 / len(problem.chains)
    covariance = covariance + others * (speed_scale_sigma / 3) ** 2 * np.outer(row, row)
    lens, k1_covariance = view.lens(state.bend), None
    if lens is not None and (bend := layout.bend) is not None:
        own = drive.covariance[bend, [*range(6), bend]] * view.scale**2
        k1_covariance = np.append(px @ own[:6], own[6] * view.scale**2)
    seen = np.concatenate([chain.uv for chain in problem.chains])
    some = seen[:: 1 + len(seen) // ASKED]
    sigma = float(
        np.sqrt(np.mean(raw_relative_sigma(model.g, covariance, lens, k1_covariance, uv=some) ** 2))
    )
    headings = distinct_headings_deg(drive.start.data.samples.xy_dot)
    _require_following(drive, headings)
    observability = verdict(
        sigma,
        _singular(drive),
        headings,
        advise(headings, enough=HEADINGS),
        rank=RANK,
        doubtful=drive.rival,
    )
    _remark(drive, motion, say, offset_given=time_offset_s is not None)
    (u0, v0), (u1, v1) = seen.min(axis=0), seen.max(axis=0)
    offset = layout.offset
    return Calibration(
        model=model,
        covariance=(covariance + covariance.T) / 2,
        origin_px=view.middle,
        fit=Fit(
            method="trajectory",
            rms_px=_rms_px(drive),
            sightings=sum(len(chain) for chain in problem.chains),
            inlier_fraction=min(1.0, drive.inliers),
            region_px=(float(u0), float(v0), float(u1), float(v1)),
            nuisances=_nuisances(drive),
            sighting_sigma_px=problem.noise.pixel,
            speed_sigma_sqrt_s=problem.noise.along,
            heading_sigma_rad_sqrt_s=problem.noise.across,
            sighting_correlation=drive.hanging,
        ),
        observability=observability,
        time_offset_s=float(state.offset),
        time_offset_sigma_s=0.0
        if offset is None
        else float(np.sqrt(drive.covariance[offset, offset])),
        image_size_px=image_size_px,
        targets={
            chain.name: _target(drive, k, len(chain)) for k, chain in enumerate(problem.chains)
        },
        lens=lens,
        k1_covariance=k1_covariance,
    )


def _require_following(drive: WholeDrive, headings: tuple[float, ...]) -> None:
    """Refuse where the rest may follow another g: of tracks that move smoothly, more than half must follow this one."""
    if drive.followed >= MOST and drive.inliers >= FEWEST_INLIERS:
        return
    if drive.followed < MOST:
        reason = (
            f"only {drive.followed:.0%} of the sightings that form a track follow the drive that the readings tell, "
            f"more than half must{_worst(drive)}"
        )
        names = (
            "names may be mixed up (`airground identify` tells who is who), or "
            if len(drive.following) > 1
            else ""
        )
        advice = f"{names}the readings may be of another robot, drive or clock"
    else:
        reason = f"only {drive.inliers:.0%} of the sightings follow the estimate"
        advice = "look for wrong sightings, or for readings of another robot or clock"
    raise UnobservableMotionError(reason, rank=0, headings_deg=headings, advice=advice)


def _worst(drive: WholeDrive) -> str:
    """Robots most of whose track goes a way of its own, the worst first; nothing where there is one robot."""
    astray = sorted((share, name) for name, share in drive.following.items() if share < MOST)
    if len(drive.following) == 1 or not astray:
        return ""
    told = ", ".join(f"{name} {share:.0%}" for share, name in astray[:NAMED])
    return f" ({told}{', ...' if len(astray) > NAMED else ''})"


def _singular(drive: WholeDrive) -> FloatArray:
    """Singular values of the whitened problem in g_T, descending: what the drive says of each direction of g."""
    values = np.linalg.eigvalsh(drive.cautious)
    return np.asarray(1 / np.sqrt(np.maximum(values, 1e-300)))


def _rms_px(drive: WholeDrive) -> float:
    """Of the sightings that are not gross."""
    solution = drive.solution
    squares = [
        np.sum(w[:, None] * z**2)
        for z, (w, _) in zip(solution.sightings, solution.weights, strict=True)
    ]
    counted = sum(float(np.sum(w)) for w, _ in solution.weights)
    return float(np.sqrt(sum(squares) / (2 * counted))) * drive.problem.noise.pixel


def _nuisances(drive: WholeDrive) -> tuple[str, ...]:
    free = drive.problem.free
    several = len(drive.problem.chains) > 1
    named = (
        ("time_offset", free.offset),
        ("distortion", free.lens),
        ("heading_bias", bool(free.turn)),
        ("speed_scale", several),
        ("lever_arm", bool(free.lever)),
        ("heading_drift", free.drift),
        ("slip", free.slip),
    )
    return tuple(name for name, on in named if on)


def _target(drive: WholeDrive, k: int, sightings: int) -> TargetFit:
    problem, covariance = drive.problem, drive.covariance
    layout, noise = problem.layout, problem.noise
    robot, first = drive.solution.state.robots[k], drive.solution.state.robots[0]

    def sigma(place: int) -> float:
        return float(np.sqrt(covariance[place, place]))

    turn, lever = layout.turn(k), layout.lever(k)
    several = len(problem.chains) > 1
    mine, its = layout.own(k), layout.own(0)
    apart = covariance[mine, mine] + covariance[its, its] - 2 * covariance[mine, its]
    scale = float(np.exp(first.scale - robot.scale))
    return TargetFit(
        sightings=sightings,
        heading_bias_rad=None
        if not problem.free.turn
        else -float((robot.turn + np.pi) % (2 * np.pi) - np.pi),
        heading_bias_sigma_rad=None
        if not problem.free.turn
        else (0.0 if turn is None else sigma(turn)),
        speed_scale=scale if several else None,
        speed_scale_sigma=scale * float(np.sqrt(max(apart, 0.0))) if several else None,
        lever_arm_m=None if lever is None else (float(robot.lever[0]), float(robot.lever[1])),
        lever_arm_sigma_m=None if lever is None else (sigma(lever), sigma(lever + 1)),
        heading_drift_rad_per_sqrt_s=float(noise.drift * np.sqrt(2 / noise.drift_s))
        if problem.free.drift
        else None,
    )


def _remark(
    drive: WholeDrive, motion: Motion, say: Callable[[str], None], *, offset_given: bool
) -> None:
    """Say what was assumed."""
    problem = drive.problem
    offset = problem.layout.offset
    if not offset_given and offset is not None:
        sigma = float(np.sqrt(drive.covariance[offset, offset]))
        if sigma > problem.priors.offset_s / 2:
            say(
                f"the data hardly show the clocks' offset (deviation {sigma:.2f} s); "
                "give --time-offset-s if you know it"
            )
    if motion.heading is not None and len(problem.chains) > 1 and not problem.free.turn:
        say(
            "the headings of all targets are taken as counted from one zero: no drive alone can tell"
        )
    if worst := _worst(drive):
        say(f"less than half of a robot's track follows{worst}: names may be mixed up")
    if _mirrored(drive) and motion.heading is not None and len(problem.chains) > 1:
        say(
            "the ground frame comes out left-handed, as north-east is; if your headings count counter-clockwise, "
            "names are mixed up (`airground identify` tells who is who)"
        )
    if drive.hanging > 1.5:
        say(
            f"errors of sightings hang together (as if {drive.hanging:.0f} frames were one): "
            "the stated deviations allow for it"
        )
    if drive.rival:
        say("two different solutions fit alike, and the better one was taken; drive also elsewhere")


def _mirrored(drive: WholeDrive) -> bool:
    """Whether the ground frame is left-handed: v points down, and a camera sees from above."""
    return bool(np.linalg.det(drive.model.jacobian(drive.problem.view.middle)) > 0)

"""Recordings of any drive under any camera, with any of the faults that real ones have; seeded, and with the truth.

The camera projects by its own full homography and the lens distorts by its own closed form: nothing is shared with
what is estimated. Everything works on whole columns, so that an hour of driving takes a fraction of a second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.calibration.recordings import IntArray, Motion, Tracks
from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.camera import SimCamera
from airground.sim.recording_noise import RecordingNoise
from airground.sim.recording_plan import RecordingPlan
from airground.sim.route_drive import Pose, RouteDrive
from airground.sim.spoiled import spoil_readings, spoil_sightings

__all__ = ["Recording", "RecordingNoise", "RecordingPlan", "Truth", "distort", "record"]

STANDING_S = 1.0  # readings begin before the tracks and end after them, so that clocks may differ


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What really happened. Rows are those of the tracks or of the motion."""

    camera: SimCamera
    """Without its lens."""

    drive: RouteDrive
    """Of the first robot, on the clock of the tracks; robot k is `lead_s[k]` ahead."""

    lead_s: FloatArray
    """(K,) [s]. How far ahead of the first each robot is."""

    noise: RecordingNoise
    """All nuisances, as they were asked for."""

    heading_bias: FloatArray
    """(K,) [rad]. What each robot's headings read too much."""

    speed_scale: FloatArray
    """(K,). What each robot's speeds read, over the truth."""

    lens_k1_per_px2: float
    """The lens's coefficient, for radii in pixels [1/px^2]."""

    lens_centre_px: FloatArray
    """(2,) [px]. Where the lens does not distort."""

    robot: IntArray
    """(N,). Robot that a sighting really belongs to: in a swap not the one named."""

    xy: FloatArray
    """(N, 2) [m]. Ground position of the tracked point at each sighting's time."""

    axle: Pose
    """Of the robot really sighted, at each sighting's time; N entries."""

    wrong: NDArray[np.bool_]
    """(N,). Is the sighting an outlier, a repeated position, or of another robot than it says?"""

    read: Pose
    """Of the axle at each reading's time; M entries."""

    slip: FloatArray
    """(M,). Slow relative error of the speed."""

    drift: FloatArray
    """(M,) [rad]. Slow error of the heading, without the bias."""

    @property
    def g(self) -> FloatArray:
        """(3, 2). The limited homography (eq. 21)."""
        return self.camera.g


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """What is measured, and the truth behind it."""

    tracks: Tracks
    """Sightings of `robot-1`, `robot-2`, ... while they are in the image."""

    motion: Motion
    """Their readings."""

    truth: Truth
    """For judging a result, never an input."""

    plan: RecordingPlan
    """What was asked for."""


def distort(uv: FloatArray, k1_per_px2: float, centre_px: FloatArray) -> FloatArray:
    """Where a lens shows points, by the division model ``r_u = r_d / (1 + k1 r_d^2)`` solved for r_d.

    Parameters
    ----------
    uv : (..., 2) array [px]
        Points as a camera without distortion would show them.
    k1_per_px2 : float [1/px^2]
        Coefficient; negative for barrel distortion.
    centre_px : (2,) array [px]
        Centre of distortion.

    Returns
    -------
    uv : (..., 2) array [px]
        Distorted; NaN where the lens shows no such point.
    """
    off = uv - centre_px
    inside = 1 - 4 * k1_per_px2 * np.sum(off**2, axis=-1, keepdims=True)
    root = np.sqrt(np.where(inside >= 0, inside, np.nan))
    # The smaller root of k1 r_u r_d^2 - r_d + r_u = 0, in the form that keeps its digits for small k1.
    return np.asarray(centre_px + off * (2 / (1 + root)))


def record(
    plan: RecordingPlan | None = None,
    noise: RecordingNoise | None = None,
    *,
    seed: int | np.random.Generator = 0,
) -> Recording:
    """Drive, watch and write down.

    Parameters
    ----------
    plan : RecordingPlan, optional
        Camera and drive; the defaults where not given.
    noise : RecordingNoise, optional
        Faults; none where not given.
    seed : int or Generator
        Where all chance comes from: the same seed, the same recording.

    Returns
    -------
    recording : Recording
        Tracks, motion and truth.

    Raises
    ------
    InputError
        If the drive is not known or too short for its stops, or nothing is seen.
    """
    plan, noise = plan or RecordingPlan(), noise or RecordingNoise()
    rng = np.random.default_rng(seed)
    camera = plan.camera()
    drive, duration = plan.route_drive(camera, rng)
    count = plan.robots
    lead: FloatArray = duration / count * np.arange(count, dtype=np.float64)
    bias, scale = _each(noise.heading_bias_rad, count), _each(noise.speed_scale, count)

    frames = _ticks(0.0, duration, noise.tracks_hz)
    robot = np.repeat(np.arange(count), len(frames))
    t = np.tile(frames, count)
    axle = drive.at(t + lead[robot])
    forward = np.column_stack([np.cos(axle.theta), np.sin(axle.theta)])
    left = np.column_stack([-forward[:, 1], forward[:, 0]])
    xy = axle.xy + noise.lever_m[0] * forward + noise.lever_m[1] * left
    size = np.array(plan.image_size_px, dtype=np.float64)
    centre = np.array(noise.lens_centre_px or (size - 1) / 2, dtype=np.float64)
    k1 = noise.lens_k1 / float(np.sum(size**2) / 4)
    uv = distort(camera.project(xy), k1, centre)
    seen = spoil_sightings(uv, t, robot, size_px=size, noise=noise, rng=rng)
    if len(seen.rows) == 0:
        raise InputError("nothing comes into the camera's view")
    names = tuple(f"robot-{k + 1}" for k in range(count))
    rows = seen.rows
    tracks = Tracks(
        targets=names,
        target_index=seen.name,
        t=t[rows],
        uv=seen.uv,
        sigma=_stated(noise, noise.pixel_px, len(rows)),
    )

    ticks = _ticks(-STANDING_S, duration + STANDING_S, noise.motion_hz)
    reader = np.repeat(np.arange(count), len(ticks))
    when = np.tile(ticks, count)
    read = drive.at(when + lead[reader])
    readings = spoil_readings(read, when, reader, bias=bias, scale=scale, noise=noise, rng=rng)
    form = plan.reading
    along, heading = readings.speed, readings.heading
    polar = form != "xy_dot"
    motion = Motion(
        targets=names,
        target_index=reader,
        t=when + noise.time_offset_s,
        xy_dot=None
        if polar
        else along[:, None] * np.column_stack([np.cos(heading), np.sin(heading)]),
        heading=np.angle(np.exp(1j * heading)) if polar else None,  # a compass wraps
        speed=along if form == "speed" else None,
        distance=readings.distance if form == "distance" else None,
        sigma_speed=_stated(
            noise, np.hypot(noise.speed_mps, noise.speed_share * drive.speed_mps), len(when)
        ),
        sigma_heading=_stated(noise, noise.heading_rad, len(when)),
    )
    truth = Truth(
        camera=camera,
        drive=drive,
        lead_s=lead,
        noise=noise,
        heading_bias=bias,
        speed_scale=scale,
        lens_k1_per_px2=k1,
        lens_centre_px=centre,
        robot=robot[rows],
        xy=xy[rows],
        axle=Pose(axle.xy[rows], axle.theta[rows], axle.speed[rows], axle.way[rows]),
        wrong=seen.wrong,
        read=read,
        slip=readings.slip,
        drift=readings.drift,
    )
    return Recording(tracks, motion, truth, plan)


def _ticks(start: float, end: float, hz: float) -> FloatArray:
    count = int(np.floor((end - start) * hz + 1e-9)) + 1
    return np.asarray(start + np.arange(count) / hz)


def _each(value: float | tuple[float, ...], count: int) -> FloatArray:
    """One entry for each robot; a tuple that is too short begins again."""
    return np.resize(np.asarray(value, dtype=np.float64), count)


def _stated(noise: RecordingNoise, sigma: float, count: int) -> FloatArray | None:
    return np.full(count, sigma) if noise.states_sigma and sigma > 0 else None

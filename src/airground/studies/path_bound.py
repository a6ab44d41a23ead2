"""How well g can be known from a whole recording: the Cramer-Rao bound, for noise of known size.

Sightings have white noise in pixels. Readings have white noise, a slow slip and a slow drift; a reading counts between
its neighbours by linear interpolation, so that a displacement is a linear function of the readings' noise.
`airground.studies.path_information` says what is unknown and how it is eliminated; nothing here is shared with the
estimators that are judged by it. The noise is taken as normal: see `airground.studies.bound`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse  # type: ignore[import-untyped,unused-ignore]

from airground.errors import UndeterminedError
from airground.geometry.arrays import FloatArray
from airground.studies.path_information import RobotPart, shared_information, sighting_derivatives
from airground.studies.reading_noise import hat_weights, slow_precision

if TYPE_CHECKING:
    from collections.abc import Mapping

    from airground.sim.camera import SimCamera
    from airground.sim.recordings import Recording

__all__ = ["PathBound", "Unknowns", "displacement_bound", "recording_bound"]

LEAST_INFORMATION = 1e-12  # of the least known combination beside the best; below it is rounding


@dataclass(frozen=True, slots=True)
class Unknowns:
    """What an estimator does not know, besides g and the path. A prior of 0 is knowledge, of infinity is none."""

    clock: bool = False
    """Is the clocks' offset unknown?"""

    lens: bool = False
    """Is the lens's k1 unknown?"""

    lever: bool = False
    """Is the lever arm unknown?"""

    speed_scale_sigma: float = 0.0
    """Prior standard deviation of each robot's speed scale."""

    heading_bias_sigma: float = 0.0
    """Prior standard deviation of each robot's heading bias [rad], but the first's, which turns the ground's frame."""


@dataclass(frozen=True, slots=True, eq=False)
class PathBound:
    """The smallest covariance that an unbiased estimate of g can have."""

    g: FloatArray
    """(3, 2). Truth."""

    covariance: FloatArray
    """(6, 6). Of g, row by row."""

    nuisances: Mapping[str, float] = field(default_factory=dict)
    """Least standard deviations of what else is shared by all robots: clock_s, lens_k1_per_px2."""

    @property
    def n_rms(self) -> float:
        """Root mean square of n (eq. 22)."""
        return float(np.sqrt(np.trace(self.covariance)) / np.linalg.norm(self.g))

    def whitened(self, g: FloatArray) -> float:
        """Size of an estimate's error in units of the bound, ``sqrt(e^T C^-1 e / 6)``.

        Parameters
        ----------
        g : (3, 2) array
            Estimate, scaled as in eq. 21.

        Returns
        -------
        size : float
            Root mean square 1 for an efficient estimate.
        """
        e = (np.asarray(g, dtype=np.float64) - self.g).ravel()
        size = np.sqrt(np.diag(self.covariance))  # pixels and perspective differ by 1e5
        correlation = self.covariance / np.outer(size, size)
        return float(np.sqrt(e / size @ np.linalg.solve(correlation, e / size) / 6))


def displacement_bound(
    camera: SimCamera, xy: FloatArray, sigma_px: float, covariance: FloatArray
) -> PathBound:
    """Bound of g for one robot whose displacements are measured with a given covariance.

    Parameters
    ----------
    camera : SimCamera
        Truth.
    xy : (N, 2) array [m]
        True ground positions at the sightings.
    sigma_px : float [px]
        Standard deviation of each coordinate of a sighting.
    covariance : (2(N-1), 2(N-1)) array or sparse matrix [m^2]
        Of the displacements from one sighting to the next, x and y of each in turn; may be singular.

    Returns
    -------
    bound : PathBound
        With no other unknowns than g and the path.
    """
    on_path, on_shared, on_own = sighting_derivatives(camera, xy, np.zeros(len(xy)))
    steps = 2 * (len(xy) - 1)
    robot = RobotPart(
        on_path=on_path,
        on_shared=on_shared[:, :6],
        on_own=on_own[:, :2],
        sigma_px=sigma_px,
        white=sparse.csc_array(covariance),
        shared_steps=np.zeros((steps, 6)),
        own_steps=np.zeros((steps, 2)),
        own_precision=np.zeros(2),
    )
    return _bound(camera.g, [robot], ())


def recording_bound(recording: Recording, unknowns: Unknowns | None = None) -> PathBound:
    """Bound of g for a simulated recording, all whose noise levels are known, and all of whose wrong sightings.

    Heading noise moves a tracked point with a lever arm too; that is left out, as it is small beside a pixel.

    Parameters
    ----------
    recording : Recording
        With pixel noise and odometry noise.
    unknowns : Unknowns, optional
        What is not known; nothing but g and the path where not given.

    Returns
    -------
    bound : PathBound
        In the ground's frame in which the first robot's heading is right.

    Raises
    ------
    UndeterminedError
        If the motion leaves more than one g.
    """
    unknowns = unknowns or Unknowns()
    truth, noise = recording.truth, recording.truth.noise
    shared = ["g"] * 6 + ["clock_s"] * unknowns.clock + ["lens_k1_per_px2"] * unknowns.lens
    robots = []
    for k, name in enumerate(recording.motion.targets):
        mine = np.flatnonzero((truth.robot == k) & ~truth.wrong)
        mine = mine[np.argsort(recording.tracks.t[mine])]
        rows = recording.motion.rows(name)
        t, read_t = recording.tracks.t[mine], recording.motion.t[rows] - noise.time_offset_s
        theta, speed = truth.axle.theta[mine], truth.axle.speed[mine]
        on_path, sh, own = sighting_derivatives(
            truth.camera,
            truth.axle.xy[mine],
            theta,
            lever=np.array(noise.lever_m),
            k1=truth.lens_k1_per_px2,
            centre=truth.lens_centre_px,
        )
        step = np.diff(truth.axle.xy[mine], axis=0)
        velocity = speed[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])
        none = np.zeros((2 * len(step), 1))
        white, slow, precision = _reading_noise(recording, k, rows, t, read_t)
        # Readings s v, heading + b, at a clock that is ahead: what they say of a displacement, by s, b and the clock.
        scale = -step.reshape(-1, 1) / truth.speed_scale[k]
        bias = -np.column_stack([-step[:, 1], step[:, 0]]).reshape(-1, 1)
        clock = np.diff(velocity, axis=0).reshape(-1, 1)
        priors = [(scale, unknowns.speed_scale_sigma)]
        priors += [(bias, unknowns.heading_bias_sigma)] if k > 0 else []
        free = [(column, sigma) for column, sigma in priors if sigma > 0]
        pixels = [own[:, :4] if unknowns.lever else own[:, :2]]
        pixels += [np.zeros((2 * len(t), 1))] * len(free)
        robots.append(
            RobotPart(
                on_path=on_path,
                on_shared=np.hstack(
                    [sh[:, :6]]
                    + [np.zeros((2 * len(t), 1))] * unknowns.clock
                    + [sh[:, 6:]] * unknowns.lens
                ),
                on_own=np.hstack(pixels),
                sigma_px=float(np.hypot(noise.pixel_px, noise.whole_pixels / np.sqrt(12))),
                white=white,
                shared_steps=np.hstack(
                    [none] * 6 + [clock] * unknowns.clock + [none] * unknowns.lens
                ),
                own_steps=np.hstack([none] * pixels[0].shape[1] + [c for c, _ in free]),
                own_precision=np.array([0.0] * pixels[0].shape[1] + [s**-2 for _, s in free]),
                slow=slow,
                slow_precision=precision,
            )
        )
    return _bound(truth.g, robots, tuple(shared[6:]))


def _reading_noise(
    recording: Recording, k: int, rows: slice, t: FloatArray, read_t: FloatArray
) -> tuple[Any, Any, Any]:
    """Covariance of robot k's displacements by white noise, their dependence on slow noise, and its precision."""
    truth, noise = recording.truth, recording.truth.noise
    theta, speed = truth.read.theta[rows], truth.read.speed[rows]
    W = hat_weights(t, read_t)
    along = sparse.vstack([W * np.cos(theta), W * np.sin(theta)])
    across = sparse.vstack([W * (-speed * np.sin(theta)), W * (speed * np.cos(theta))])
    order = np.arange(2 * W.shape[0]).reshape(2, -1).T.ravel()  # x and y of each in turn
    along, across = along.tocsr()[order], across.tocsr()[order]
    variance = (noise.speed_mps / truth.speed_scale[k]) ** 2 + (noise.speed_share * speed) ** 2
    white = (along * variance) @ along.T + noise.heading_rad**2 * (across @ across.T)
    slow, precision = [], []
    if noise.slip > 0:
        slow.append(along * speed)
        precision.append(slow_precision(read_t, noise.slip, noise.slip_s))
    if noise.heading_drift > 0:
        slow.append(across[:, 1:])  # zero at the first reading
        precision.append(slow_precision(read_t, noise.heading_drift, np.inf))
    if not slow:
        return white.tocsc(), None, None
    return white.tocsc(), sparse.hstack(slow).tocsc(), sparse.block_diag(precision).tocsc()


def _bound(g: FloatArray, robots: list[RobotPart], names: tuple[str, ...]) -> PathBound:
    information = np.sum([shared_information(robot) for robot in robots], axis=0)
    size = np.sqrt(np.diag(information))
    correlation = information / np.outer(size, size)
    if np.linalg.eigvalsh(correlation)[0] < LEAST_INFORMATION:
        raise UndeterminedError("the recording does not determine g, however small the noise")
    covariance = np.linalg.inv(correlation) / np.outer(size, size)
    deviations = np.sqrt(np.diag(covariance))
    return PathBound(
        g, covariance[:6, :6], {name: float(deviations[6 + k]) for k, name in enumerate(names)}
    )

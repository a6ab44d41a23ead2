"""The bound of a whole recording, against dense algebra written another way, and against what reaches it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError, UndeterminedError
from airground.sim.recordings import Recording, RecordingNoise, RecordingPlan, distort, record
from airground.studies.bound import drive_bound
from airground.studies.path_bound import Unknowns, displacement_bound, recording_bound
from airground.studies.reading_noise import hat_weights, slow_precision
from airground.studies.simulation import PAPER
from airground.studies.tracked_bound import tracked_bound

SHORT = RecordingPlan(duration_s=12.0, drive="triangle", corner_radius=0.2, tilt_deg=50.0)
NOISE = RecordingNoise(
    tracks_hz=6.0, motion_hz=5.0, pixel_px=1.5, speed_mps=0.02, speed_share=0.05, heading_rad=0.04,
    slip=0.03, heading_drift=0.02, lens_k1=-0.05, lever_m=(0.15, 0.1), time_offset_s=0.2,
    speed_scale=(1.02, 1.0, 0.97),
)  # fmt: skip


def dense_bound(recording: Recording, unknowns: Unknowns) -> np.ndarray:
    """Covariance of g from one dense Gaussian over all readings: no multipliers, and another parametrization.

    Unknown: a full homography of 8 numbers per world, a start on the ground per robot but the first, all true
    readings. The path is integrated from them, and sightings and readings compared with what was measured.
    """
    truth, noise, motion = recording.truth, recording.truth.noise, recording.motion
    count = len(motion.targets)
    G = truth.camera.image_from_ground / truth.camera.image_from_ground[2, 2]
    parts = []
    for k in range(count):
        mine = np.flatnonzero((truth.robot == k) & ~truth.wrong)
        mine = mine[np.argsort(recording.tracks.t[mine])]
        rows = motion.rows(motion.targets[k])
        t, read_t = recording.tracks.t[mine], motion.t[rows] - noise.time_offset_s
        parts.append((mine, rows, t, read_t))
    sizes = [len(p[3]) for p in parts]
    # homography (8), k1, clock; then for each robot: start (2), lever (2), scale, bias, white, heading, slip, drift
    total = 10 + sum(6 + 4 * m for m in sizes)

    def model(x: np.ndarray) -> np.ndarray:
        H = np.append(x[:8], 0.0).reshape(3, 3) + G
        out, at = [], 10
        for k, (mine, rows, t, read_t) in enumerate(parts):
            m = len(read_t)
            start, lever, (scale, bias) = x[at : at + 2], x[at + 2 : at + 4], x[at + 4 : at + 6]
            noises = x[at + 6 : at + 6 + 4 * m].reshape(4, m)
            at += 6 + 4 * m
            speed, theta = truth.read.speed[rows], truth.read.theta[rows]
            # Linear in the noise, as the bound is: of speed and of heading, each along its own direction.
            dv = noises[0] + speed * noises[2]
            dh = speed * (noises[1] + noises[3])
            xy_dot = np.column_stack(
                [dv * np.cos(theta) - dh * np.sin(theta), dv * np.sin(theta) + dh * np.cos(theta)]
            )
            h = np.diff(read_t)[:, None]
            way = np.concatenate(
                [np.zeros((1, 2)), np.cumsum(h * (xy_dot[1:] + xy_dot[:-1]) / 2, 0)]
            )
            j = np.searchsorted(read_t, t) - 1
            u = ((t - read_t[j]) / np.diff(read_t)[j])[:, None]
            h = h[j]
            moved = way[j] + h * (u - u**2 / 2) * xy_dot[j] + h * u**2 / 2 * xy_dot[j + 1]
            axle = truth.axle
            way = axle.xy[mine] - axle.xy[mine[0]]
            moved = moved - way * scale / truth.speed_scale[k] - bias * (way[:, ::-1] * (-1.0, 1.0))
            a = axle.theta[mine]
            forward = np.column_stack([np.cos(a), np.sin(a)])
            left = np.column_stack([-forward[:, 1], forward[:, 0]])
            arm = np.array(noise.lever_m) + lever
            drifted = axle.xy[mine] + start + moved + x[9] * axle.speed[mine, None] * forward
            xy = drifted + arm[0] * forward + arm[1] * left
            w = np.column_stack([xy, np.ones(len(xy))]) @ H.T
            k1 = truth.lens_k1_per_px2 + x[8] * 1e-6
            out.append(distort(w[:, :2] / w[:, 2:], k1, truth.lens_centre_px).ravel())
        return np.concatenate(out)

    J = np.empty((2 * sum(len(p[0]) for p in parts), total))
    for c in range(total):
        step = np.zeros(total)
        step[c] = 1e-5 * (max(abs(G.ravel()[c]), 1e-4) if c < 8 else 1.0)
        J[:, c] = (model(step) - model(-step)) / (2 * step[c])
    precision = np.zeros(total)
    fixed = np.zeros(total, dtype=bool)
    fixed[8], fixed[9] = not unknowns.lens, not unknowns.clock
    blocks, at = [], 10
    for k, (_, rows, _, read_t) in enumerate(parts):
        m = len(read_t)
        fixed[at : at + 2] = k == 0  # the ground's origin
        fixed[at + 2 : at + 4] = not unknowns.lever
        for c, sigma in (
            (at + 4, unknowns.speed_scale_sigma),
            (at + 5, unknowns.heading_bias_sigma if k else 0.0),
        ):
            fixed[c] = sigma == 0
            precision[c] = 0.0 if sigma == 0 else sigma**-2
        at += 6
        variance = (noise.speed_mps / truth.speed_scale[k]) ** 2
        precision[at : at + m] = 1 / (variance + (noise.speed_share * truth.read.speed[rows]) ** 2)
        precision[at + m : at + 2 * m] = noise.heading_rad**-2
        lag = np.abs(read_t[:, None] - read_t)
        blocks.append((at + 2 * m, noise.slip**2 * np.exp(-lag / noise.slip_s)))
        early = np.minimum(read_t[:, None], read_t) - read_t[0]
        fixed[at + 3 * m] = True
        blocks.append((at + 3 * m + 1, noise.heading_drift**2 * early[1:, 1:]))
        at += 4 * m
    information = J.T @ J / noise.pixel_px**2 + np.diag(precision)
    for first, covariance in blocks:
        rows = slice(first, first + len(covariance))
        information[rows, rows] += np.linalg.inv(covariance)
    information = information[~fixed][:, ~fixed]
    size = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size)

    def columns(x: np.ndarray) -> np.ndarray:
        H = np.append(x, 0.0).reshape(3, 3) + G
        return np.asarray((H / np.cbrt(np.linalg.det(H)))[:, :2].ravel())

    steps = np.diag(1e-5 * np.maximum(np.abs(G.ravel()[:8]), 1e-4))
    to_g = np.column_stack([(columns(s) - columns(-s)) / (2 * s.sum()) for s in steps])
    return np.asarray(to_g @ covariance[:8, :8] @ to_g.T)


@pytest.mark.parametrize(
    "unknowns",
    [
        Unknowns(),
        Unknowns(clock=True),
        Unknowns(lens=True, speed_scale_sigma=0.02),
        Unknowns(True, True, True, 0.03, 0.5),
    ],
)
@pytest.mark.parametrize("robots", [1, 2])
def test_the_bound_is_that_of_dense_algebra(unknowns: Unknowns, robots: int) -> None:
    found = record(replace(SHORT, robots=robots), NOISE)
    bound = recording_bound(found, unknowns)
    dense = dense_bound(found, unknowns)
    size = np.sqrt(np.diag(dense))
    assert_allclose(
        bound.covariance / np.outer(size, size), dense / np.outer(size, size), atol=2e-5
    )


def test_the_papers_end_points_have_the_papers_bound() -> None:
    drive = PAPER.drive
    sigma_m = drive.duration_s * PAPER.speed_bound_mps / np.sqrt(3)
    bound = displacement_bound(
        PAPER.camera(), drive.corners, 5 / np.sqrt(3), np.eye(16) * sigma_m**2
    )
    assert_allclose(bound.covariance, drive_bound().covariance, rtol=1e-8, atol=1e-16)


@pytest.mark.parametrize(
    ("motion_hz", "n_rms"),
    [(30.0, 0.0053), (20.0, 0.0063), (10.0, 0.0087), (5.0, 0.0121), (None, 0.0461)],
)
def test_figures_of_the_tracked_drive(motion_hz: float | None, n_rms: float) -> None:
    assert tracked_bound(motion_hz=motion_hz).n_rms == pytest.approx(n_rms, abs=6e-5)


def test_a_whitened_error_is_one_on_average() -> None:
    bound = drive_bound()
    path = tracked_bound(motion_hz=1.0)
    rng = np.random.default_rng(0)
    root = np.linalg.cholesky(path.covariance)
    sizes = [path.whitened(path.g + (root @ rng.normal(size=6)).reshape(3, 2)) for _ in range(400)]
    assert np.sqrt(np.mean(np.square(sizes))) == pytest.approx(1.0, abs=0.05)
    assert_allclose(path.g, bound.g)


def test_more_unknowns_never_tell_more() -> None:
    found = record(SHORT, NOISE)
    last = recording_bound(found).covariance
    for unknowns in (
        Unknowns(clock=True),
        Unknowns(clock=True, lens=True),
        Unknowns(clock=True, lens=True, lever=True),
        Unknowns(clock=True, lens=True, lever=True, speed_scale_sigma=0.02),
    ):
        covariance = recording_bound(found, unknowns).covariance
        assert (np.diag(covariance) >= np.diag(last) * (1 - 1e-6)).all()
        last = covariance
    assert set(recording_bound(found, Unknowns(clock=True, lens=True)).nuisances) == {
        "clock_s",
        "lens_k1_per_px2",
    }


def test_a_straight_drive_has_no_bound() -> None:
    found = record(RecordingPlan(drive="straight"), RecordingNoise(pixel_px=1.0, speed_share=0.05))
    with pytest.raises(UndeterminedError, match="does not determine g"):
        recording_bound(found)


def test_weights_integrate_what_is_linear_between_readings(rng: np.random.Generator) -> None:
    read_t = np.sort(rng.uniform(0, 10, 30))
    read_t[[0, -1]] = -1.0, 11.0
    t = np.sort(rng.uniform(0, 10, 50))
    values = rng.normal(size=30)
    fine = np.linspace(-1.0, 11.0, 1_200_001)
    way = (
        np.concatenate([[0.0], np.cumsum(np.interp((fine[1:] + fine[:-1]) / 2, read_t, values))])
        * 1e-5
    )
    assert_allclose(hat_weights(t, read_t) @ values, np.diff(np.interp(t, fine, way)), atol=1e-8)


def test_precisions_are_the_inverse_of_the_covariances() -> None:
    t = np.array([0.0, 0.1, 0.5, 2.0])
    lag = np.abs(t[:, None] - t)
    assert_allclose(np.linalg.inv(slow_precision(t, 0.3, 2.0).toarray()), 0.09 * np.exp(-lag / 2))
    walk = np.minimum(t[1:, None], t[1:])
    assert_allclose(np.linalg.inv(slow_precision(t, 0.3, np.inf).toarray()), 0.09 * walk)


def test_rates_that_do_not_fit_are_refused() -> None:
    with pytest.raises(InputError, match="whole steps"):
        tracked_bound(motion_hz=0.33)

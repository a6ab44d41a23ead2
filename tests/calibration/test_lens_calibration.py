"""A calibration behind a distorting lens, against a simulation that bends its image by itself."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose

from airground.calibration import (
    Calibration,
    Fit,
    Observability,
    TargetFit,
    Tracks,
    measure_speeds,
)
from airground.calibration.inspection import inspect_calibration
from airground.calibration.lens_uncertainty import (
    ground_velocity_by_k1,
    joint_covariance,
    raw_relative_sigma,
)
from airground.calibration.observability import relative_sigma
from airground.errors import InputError
from airground.geometry import DivisionLens, LimitedHomography
from drives import fit_drive
from scenes import Array, Scene, generators, random_scene, scene
from warp import Warp

SCENE = scene(tilt_deg=50, roll_deg=4, heading_deg=20, height=6.0)  # no entry of g is zero
T = np.arange(0, 60, 1 / 30)


def warp_for(here: Scene, strength: float) -> Warp:
    """A lens with |k1| r^2 = `strength` in the corner farthest from its centre, the principal point."""
    size = np.array(here.image_size)
    far = np.maximum(here.principal_point, size - here.principal_point)
    return Warp(strength / float(far @ far), here.principal_point)


def truth(here: Scene, warp: Warp | None, **changes: Any) -> Calibration:
    """The calibration that an estimator should find, without uncertainty."""
    middle = np.array(here.image_size) / 2
    origin = np.array(here.principal_point if not here.sees_ground(middle) else middle)
    lens = None if warp is None else DivisionLens(warp.k1, np.array(warp.center))
    made = Calibration(
        model=LimitedHomography(here.g),
        covariance=np.zeros((6, 6)),
        origin_px=origin,
        fit=Fit("linear", 0.5, 1000, 1.0, 0.4, (300.0, 200.0, 1000.0, 600.0)),
        observability=Observability("ok", 0.01, (1.0,) * 6, ""),
        image_size_px=here.image_size,
        lens=lens,
    )
    return dataclasses.replace(made, **changes)


def seen(here: Scene, rng: np.random.Generator, count: int = 20) -> Array:
    """Ground points that are in the pinhole's image."""
    return here.ground(rng, (count,))


@given(generators())
def test_velocities_are_those_of_the_simulation(rng: np.random.Generator) -> None:
    here = random_scene(rng, tilt_deg=(0, 65), square=False)
    warp = warp_for(here, rng.uniform(-0.5, 0.2))
    xy, xy_dot = seen(here, rng), here.velocities(rng, (20,))
    uv, uv_dot = warp.bend(here.project(xy)), warp.push(here, xy, xy_dot)
    calibration = truth(here, warp)
    found, covariance = calibration.ground_velocity(uv, uv_dot)
    size = np.linalg.norm(xy_dot, axis=1)[:, None]
    assert_allclose(found / size, xy_dot / size, rtol=0, atol=1e-5)
    assert (covariance == 0).all()
    assert calibration.is_ground(uv).all()
    assert_allclose(np.einsum("nij,nj->ni", calibration.jacobian(uv), xy_dot), uv_dot, rtol=1e-4)
    without, _ = truth(here, None).ground_velocity(uv, uv_dot)
    # The lens does something; without it, a point may even lie beyond the horizon.
    assert not np.nanmax(np.abs(without - xy_dot)) < 1e-3 * size.max()


@given(generators())
def test_derivative_by_k1_against_finite_differences(rng: np.random.Generator) -> None:
    here = random_scene(rng, tilt_deg=(0, 65))
    warp = warp_for(here, rng.uniform(-0.4, 0.2))
    xy = seen(here, rng)
    uv, uv_dot = warp.bend(here.project(xy)), rng.normal(0, 50, (20, 2))
    h = 4e-4 / float(np.sum(np.square(here.image_size)))
    high, low = (
        truth(here, Warp(warp.k1 + s * h, warp.center)).ground_velocity(uv, uv_dot)[0]
        for s in (1, -1)
    )
    found = ground_velocity_by_k1(here.g, DivisionLens(warp.k1, np.array(warp.center)), uv, uv_dot)
    numeric = (high - low) / (2 * h)
    each = np.linalg.norm(numeric, axis=1, keepdims=True)
    assert_allclose(found / each, numeric / each, rtol=0, atol=1e-4)


def correlated(here: Scene, warp: Warp, rng: np.random.Generator, size: float) -> Calibration:
    """A calibration whose g and k1 err together, as they do when one makes up for the other."""
    unit = np.concatenate([np.abs(here.g.ravel()), [abs(warp.k1)]])
    root = size * unit[:, None] * (0.2 * rng.normal(size=(7, 7)) + np.outer(np.ones(7), [1] * 7))
    joint = root @ root.T
    joint = (joint + joint.T) / 2
    return truth(here, warp, covariance=joint[:6, :6], k1_covariance=joint[6])


def test_covariance_is_that_of_g_and_k1_drawn_together(rng: np.random.Generator) -> None:
    warp = warp_for(SCENE, -0.4)
    calibration = correlated(SCENE, warp, rng, 1e-5)
    assert calibration.k1_covariance is not None
    assert calibration.lens is not None
    uv, uv_dot = np.array([1000.0, 600.0]), np.array([50.0, -20.0])
    _, covariance = calibration.ground_velocity(uv, uv_dot)
    joint = joint_covariance(calibration.covariance, calibration.k1_covariance)
    unit = np.sqrt(np.diag(joint))
    root = np.linalg.cholesky(joint / unit / unit[:, None] + 1e-12 * np.eye(7)) * unit[:, None]
    drawn = np.concatenate([SCENE.g.ravel(), [warp.k1]]) + rng.normal(size=(20000, 7)) @ root.T
    sampled = np.array(
        [
            LimitedHomography(x[:6].reshape(3, 2)).ground_velocity(
                (lens := DivisionLens(x[6], calibration.lens.center)).undistort(uv),
                lens.undistort_velocity(uv, uv_dot),
            )
            for x in drawn
        ]
    )
    size = np.abs(covariance).max()
    assert_allclose(np.cov(sampled.T), covariance, rtol=0.05, atol=0.02 * size)
    # Without the correlation it would be another one.
    apart = np.append(np.zeros(6), calibration.k1_covariance[6])
    _, other = dataclasses.replace(calibration, k1_covariance=apart).ground_velocity(uv, uv_dot)
    assert np.abs(other - covariance).max() > 0.1 * size


def test_relative_sigma_is_that_of_the_covariances(rng: np.random.Generator) -> None:
    warp = warp_for(SCENE, -0.4)
    c = correlated(SCENE, warp, rng, 1e-4)
    uv = warp.bend(SCENE.project(seen(SCENE, rng, 7)))
    found = raw_relative_sigma(c.model.g, c.covariance, c.lens, c.k1_covariance, uv=uv)
    headings = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    xy_dot = np.column_stack([np.cos(headings), np.sin(headings)])
    for point, sigma in zip(uv, found, strict=True):
        uv_dot = warp.push(SCENE, SCENE.unproject(warp.straighten(point)), xy_dot)
        _, covariance = c.ground_velocity(point, uv_dot)
        each = np.trace(covariance, axis1=1, axis2=2)
        assert sigma == pytest.approx(np.sqrt(each.mean()), rel=1e-4)
    plain = raw_relative_sigma(c.model.g, c.covariance, None, None, uv=uv)
    whole = relative_sigma(c.model.g, c.covariance, uv)
    assert np.sqrt(np.mean(plain**2)) == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize("shape", [(), (1,), (3, 1, 2, 1)])
def test_leading_axes_broadcast(shape: tuple[int, ...], rng: np.random.Generator) -> None:
    c = correlated(SCENE, warp_for(SCENE, -0.3), rng, 1e-3)
    uv, uv_dot = rng.uniform(400, 700, (*shape, 2)), np.array([3.0, -2.0])
    xy_dot, covariance = c.ground_velocity(uv, uv_dot)
    assert (xy_dot.shape, covariance.shape) == ((*shape, 2), (*shape, 2, 2))
    one, one_covariance = c.ground_velocity(uv.reshape(-1, 2)[0], uv_dot)
    assert_allclose(xy_dot.reshape(-1, 2)[0], one, rtol=1e-12)
    assert_allclose(covariance.reshape(-1, 2, 2)[0], one_covariance, rtol=1e-9)
    many, wide = c.ground_velocity(uv.reshape(-1, 2)[0], np.tile(uv_dot, (4, 1)))
    assert (many.shape, wide.shape) == ((4, 2), (4, 2, 2))


def test_beyond_the_horizon_and_the_lens_nothing_is_said() -> None:
    here = scene(tilt_deg=80, height=6.0)
    warp = warp_for(here, -0.5)
    calibration = truth(here, warp, origin_px=np.array([640.0, 600.0]))
    reach = 0.99 / math.sqrt(-warp.k1)
    outside = np.array(warp.center) + [0.0, reach]  # below, but the lens ends before
    sky = warp.bend([640.0, 60.0])
    for uv in (outside, sky):
        assert not calibration.is_ground(uv)
        xy_dot, covariance = calibration.ground_velocity(uv, [1.0, 1.0])
        assert np.isnan(xy_dot).all()
        assert np.isnan(covariance).all()
    assert calibration.is_ground(warp.bend([640.0, 300.0]))


def recorded(warp: Warp, *, ratio: int = 2, noise: Array | float = 0.0) -> tuple[Tracks, Array]:
    """Raw sightings of a figure eight, and its true velocity."""
    drive = fit_drive(SCENE, period=30.0, ratio=ratio)
    uv = warp.bend(SCENE.project(drive.xy(T))) + noise
    return Tracks.from_rows(T, ["cart"] * len(T), uv), drive.xy_dot(T)


@pytest.mark.parametrize("strength", [-0.5, 0.2])
def test_speeds_of_a_third_party(strength: float) -> None:
    warp = warp_for(SCENE, strength)
    tracks, xy_dot = recorded(warp, ratio=3)
    speeds = measure_speeds(truth(SCENE, warp), tracks)
    assert len(speeds.t) == len(T)
    error = np.linalg.norm(speeds.xy_dot - xy_dot, axis=1)
    size = np.sqrt(np.mean(np.sum(xy_dot**2, axis=1)))
    assert np.sqrt(np.mean(error**2)) < 0.005 * size
    np.testing.assert_array_equal(speeds.uv, tracks.uv)
    blind = measure_speeds(truth(SCENE, None), tracks)
    assert np.sqrt(np.mean(np.sum((blind.xy_dot - xy_dot) ** 2, axis=1))) > 0.03 * size


def test_deviation_of_speeds_is_that_of_the_errors(rng: np.random.Generator) -> None:
    warp = warp_for(SCENE, -0.5)
    tracks, xy_dot = recorded(warp, noise=rng.normal(0, 1.0, (len(T), 2)))
    speeds = measure_speeds(truth(SCENE, warp), tracks)
    ratio = (speeds.speed - np.linalg.norm(xy_dot, axis=1)) / speeds.speed_sigma
    assert 0.8 < np.std(ratio) < 1.3


def test_pixel_noise_goes_through_the_lens() -> None:
    warp = warp_for(SCENE, -0.9)
    plain, xy_dot = recorded(warp)
    tracks = dataclasses.replace(plain, sigma=np.ones(len(T)))
    speeds = measure_speeds(truth(SCENE, warp), tracks)
    xy = fit_drive(SCENE, period=30.0).xy(T)
    J = np.stack([warp.push(SCENE, xy, np.tile(e, (len(T), 1))) for e in np.eye(2)], axis=-1)
    h = xy_dot / np.linalg.norm(xy_dot, axis=1, keepdims=True)
    along = np.linalg.norm(np.linalg.solve(np.swapaxes(J, 1, 2), h[..., None])[..., 0], axis=1)
    gain = (speeds.speed_sigma / along)[60:-60]  # one window for all but those at the ends
    # Windows smooth the points a little, too.
    assert_allclose(gain, np.median(gain), rtol=0.02)


def test_an_uncertain_lens_makes_speeds_uncertain() -> None:
    warp = warp_for(SCENE, -0.5)
    tracks, _ = recorded(warp)
    relative = 0.05
    variance = np.append(np.zeros(6), (relative * warp.k1) ** 2)
    unsure = truth(SCENE, warp, k1_covariance=variance)
    wide, narrow = measure_speeds(unsure, tracks), measure_speeds(truth(SCENE, warp), tracks)
    shifted = measure_speeds(
        truth(SCENE, Warp(warp.k1 * (1 + 0.01 * relative), warp.center)), tracks
    )
    moved = 100 * np.abs(shifted.speed - narrow.speed)
    fast = narrow.speed > 0.5 * narrow.speed.max()
    assert_allclose(
        np.sqrt(wide.speed_sigma**2 - narrow.speed_sigma**2)[fast],
        moved[fast],
        rtol=0.02,
        atol=1e-3 * moved.max(),
    )


# Inspection


def test_scale_is_that_of_small_steps_on_the_ground() -> None:
    warp = warp_for(SCENE, -0.4)
    inspection = inspect_calibration(truth(SCENE, warp))
    headings = np.linspace(0, np.pi, 361)
    steps = np.column_stack([np.cos(headings), np.sin(headings)])
    some = list(zip(inspection.uv, inspection.pixels_per_metre, strict=True))[::11]
    for uv, (least, most) in some:
        xy = SCENE.unproject(warp.straighten(uv))
        length = np.linalg.norm(warp.push(SCENE, np.tile(xy, (361, 1)), steps), axis=1)
        assert least == pytest.approx(length.min(), rel=1e-3)
        assert most == pytest.approx(length.max(), rel=1e-3)


@pytest.mark.parametrize("strength", [-0.6, 0.25])
def test_horizon_is_where_the_far_ground_is_shown(strength: float) -> None:
    here = scene(tilt_deg=72, roll_deg=6, height=6.0)
    warp = warp_for(here, strength)
    inspection = inspect_calibration(truth(here, warp))
    # Level rays of the scene, 1e9 m away, through the simulation.
    gaze = np.linspace(-0.4, 0.4, 9)
    world = 1e9 * np.column_stack([np.cos(gaze), np.sin(gaze)])
    far = warp.bend(here.project(world - here.world_from_ground[:2, 2]))
    curve = inspection.horizon_uv
    a, b = curve[:-1], curve[1:]
    for point in far:
        along = np.clip(
            np.sum((point - a) * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0.0, 1.0
        )
        distance = np.linalg.norm(a + along[:, None] * (b - a) - point, axis=1)
        assert distance.min() < 0.05
    straight = np.linalg.svd(far - far.mean(axis=0), compute_uv=False)[1]
    assert straight > 5  # px; it is not


def test_a_horizon_that_dips_into_the_frame_between_its_corners() -> None:
    """Of a pincushion the middle is nearest: all corners see ground, and the top's middle does not."""
    here = scene(tilt_deg=70, height=6.0)  # its straight horizon is at v = 32
    calibration = truth(here, Warp(3e-7, here.principal_point))
    corners = np.array([[-0.5, -0.5], [1279.5, -0.5], [-0.5, 719.5], [1279.5, 719.5]])
    assert calibration.is_ground(corners).all()
    assert not calibration.is_ground([639.5, -0.5])
    assert inspect_calibration(calibration).horizon_in_frame
    level = scene(tilt_deg=60, height=6.0)
    assert not inspect_calibration(truth(level, Warp(3e-7, level.principal_point))).horizon_in_frame


def test_bend_is_the_shift_of_the_corners() -> None:
    warp = warp_for(SCENE, -0.3)
    sigma = 0.02 * abs(warp.k1)
    calibration = truth(SCENE, warp, k1_covariance=np.append(np.zeros(6), sigma**2))
    lens = inspect_calibration(calibration).lens
    assert lens is not None
    assert lens.k1 == warp.k1
    assert lens.k1_sigma == pytest.approx(sigma)
    u, v = np.meshgrid([-0.5, 1279.5], [-0.5, 719.5])
    frame = np.column_stack([u.ravel(), v.ravel()])
    shift = np.linalg.norm(warp.straighten(frame) - frame, axis=1)
    assert lens.frame_px == pytest.approx(shift.max())
    more = Warp(warp.k1 - 0.01 * sigma, warp.center)
    moved = np.linalg.norm(more.straighten(frame) - warp.straighten(frame), axis=1).max()
    assert lens.frame_sigma_px == pytest.approx(100 * moved, rel=1e-2)
    u, v = np.meshgrid([300.0, 1000.0], [200.0, 600.0])
    region = np.column_stack([u.ravel(), v.ravel()])
    shift = np.linalg.norm(warp.straighten(region) - region, axis=1)
    assert lens.region_px == pytest.approx(shift.max())
    pincushion = inspect_calibration(truth(SCENE, warp_for(SCENE, 0.2))).lens
    assert pincushion is not None
    assert pincushion.frame_px < 0
    assert inspect_calibration(truth(SCENE, None)).lens is None


def test_camera_is_that_of_the_undistorted_image() -> None:
    here = scene(tilt_deg=50, height=6.0, focal_length=800.0, offset=(0.05, -0.03))
    warp = warp_for(here, -0.4)
    found = inspect_calibration(truth(here, warp, image_size_px=None)).camera
    assert found is not None  # the lens's centre stands for the image's middle
    assert found.camera.focal_length_px == pytest.approx(800, rel=1e-9)
    assert found.camera.height_m == pytest.approx(6, rel=1e-9)
    elsewhere = truth(here, Warp(warp.k1, (600.0, 400.0)))
    asked = inspect_calibration(elsewhere, principal_point_px=(650.0, 350.0)).camera
    assert asked is not None
    assert_allclose(
        asked.camera.principal_point_px,
        Warp(warp.k1, (600.0, 400.0)).straighten([650.0, 350.0]),
    )


def test_a_principal_point_beyond_the_lens_is_said() -> None:
    found = inspect_calibration(
        truth(SCENE, warp_for(SCENE, -0.9)), principal_point_px=(9000.0, 9000.0)
    )
    assert found.camera is None
    assert "beyond what the lens's model reaches" in found.camera_problem


# What a calibration refuses


def test_nonsense_is_refused(rng: np.random.Generator) -> None:
    warp = warp_for(SCENE, -0.4)
    good = correlated(SCENE, warp, rng, 1e-3)
    assert good.k1_covariance is not None
    refused: list[tuple[dict[str, Any], str]] = [
        ({"lens": None}, "there is none"),
        ({"k1_covariance": np.zeros(6)}, r"k1_covariance must have shape \(7\)"),
        ({"k1_covariance": np.full(7, np.nan)}, "NaN"),
        ({"k1_covariance": 3 * good.k1_covariance}, "does not go with covariance"),
        ({"k1_covariance": -good.k1_covariance}, "does not go with covariance"),
        ({"k1_covariance": np.full(7, 1e300)}, "found 1e"),
        ({"lens": DivisionLens(1e-5, np.zeros(2))}, "origin_px lies where the lens shows nothing"),
    ]
    for changes, message in refused:
        with pytest.raises(InputError, match=message):
            dataclasses.replace(good, **changes)
    given_array = np.array(good.k1_covariance)
    mine = dataclasses.replace(good, k1_covariance=given_array)
    given_array[:] = 0
    assert mine.k1_sigma == good.k1_sigma
    assert dataclasses.replace(good, k1_covariance=None).k1_sigma is None


@pytest.mark.parametrize(
    "field", ["heading_bias_sigma_rad", "speed_scale_sigma", "lever_arm_sigma_m"]
)
def test_deviations_of_a_target_are_not_negative(field: str) -> None:
    bad: Any = (0.1, -0.1) if field.startswith("lever") else -0.1
    with pytest.raises(InputError, match=field):
        TargetFit(3, **{field: bad})

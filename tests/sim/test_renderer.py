"""The renderer against rays, and its promises: every frame for itself, blur, shutter, shadows, lamps."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.body import Body, Disc, Lamp, Part, Tag
from airground.sim.body_kinds import box, pillar, round_outline
from airground.sim.body_poses import PoseOfTime, parked
from airground.sim.flights import Shake, hover
from airground.sim.ground_texture import Ground, ground
from airground.sim.lens import Lens
from airground.sim.renderer import Renderer
from airground.sim.scene import Scene, Sun
from airground.sim.scene_camera import Pinhole
from airground.vision.frame import ImageArray
from raytrace import shift_px, tag_picture

SIZE = (320, 240)
GREY = Ground(np.full((64, 64, 3), 120, dtype=np.uint8), 0.1)
NOWHERE = Sun(shadow=0.0)


def camera(tilt_deg: float, roll_rad: float = 0.0) -> Pinhole:
    return Pinhole.looking_down(
        focal_length_px=450.0,
        tilt_rad=np.radians(tilt_deg),
        height_m=3.0,
        image_size_px=SIZE,
        roll_rad=roll_rad,
    )


def ground_at(view: Pinhole, uv: tuple[float, float], height_m: float) -> FloatArray:
    w = np.linalg.inv(view.image_from_plane(height_m)) @ np.array([*uv, 1.0])
    return np.asarray(w[:2] / w[2])


def sliding(
    x: float, y: float, theta: float, velocity: tuple[float, float], turn: float = 0.0
) -> PoseOfTime:
    def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.array([x, y]) + t[:, None] * np.array(velocity), theta + turn * t

    return pose


@pytest.mark.parametrize("k1", [0.0, -0.1])
@pytest.mark.parametrize("tilt_deg", [0.0, 40.0, 60.0])
def test_a_tag_is_where_rays_see_it(tilt_deg: float, k1: float, rng: np.random.Generator) -> None:
    """0.02 px is what was asked for; rays of 12 x 12 to a pixel are good for 0.001 px."""
    view = camera(tilt_deg, float(rng.uniform(-0.2, 0.2)))
    lens = Lens.of_image(k1, SIZE)
    for number in (3, 77):
        u, v = rng.uniform([70, 70], [250, 170])
        x, y = ground_at(view, (u, v), 0.3)
        pose = (float(x), float(y), float(rng.uniform(-3, 3)))
        body = box(
            "b", parked(*pose), (0.6, 0.6, 0.3), (90.0,) * 3, Tag("36h11", number, 0.4), moves=True
        )
        scene = Scene(view, GREY, (body,), lens=lens, sun=NOWHERE, noise=0.0)
        seen = Renderer(scene).clean(0.0)[..., 1].astype(np.float64)
        corners = scene.truth(0.0)[0].corners[0]
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 2, 0)
        high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 3, SIZE)
        wanted = tag_picture(
            focal_px=450.0,
            size_px=SIZE,
            rotation=view.camera_from_world,
            eye=view.centre_m,
            k1_per_px2=4 * k1 / (SIZE[0] ** 2 + SIZE[1] ** 2),
            height_m=0.3,
            pose=pose,
            number=number,
            tag_m=0.4,
            window=(low[0], low[1], high[0] - low[0], high[1] - low[1]),
        )
        shift, rms = shift_px(seen[low[1] : high[1], low[0] : high[0]], wanted)
        assert np.abs(shift).max() < 0.01
        assert rms < 7.0  # of 214 grey levels between black and white


def test_a_frame_depends_on_its_time_and_number_only() -> None:
    scene = small_scene()
    first = Renderer(scene, seed=3)
    for k in range(4):
        first.image(k / 10, k)
    here = first.image(0.7, 7)
    assert np.array_equal(here, Renderer(scene, seed=3).image(0.7, 7))
    assert not np.array_equal(here, Renderer(scene, seed=4).image(0.7, 7))
    assert not np.array_equal(here, Renderer(scene, seed=3).image(0.7, 8))
    flying = replace(scene, camera=hover(camera(20.0), seed=1), readout_s=0.02)
    one = Renderer(flying, seed=3)
    one.image(0.1, 1)
    assert np.array_equal(one.image(0.7, 7), Renderer(flying, seed=3).image(0.7, 7))


def test_threads_do_not_change_a_frame() -> None:
    scene = small_scene()
    threads = cv2.getNumThreads()
    images = []
    try:
        for count in (1, 2):
            cv2.setNumThreads(count)
            images.append(Renderer(scene, seed=1).image(0.3, 3))
    finally:
        cv2.setNumThreads(threads)
    assert np.array_equal(images[0], images[1])


def small_scene() -> Scene:
    return Scene(
        camera(30.0),
        ground("warehouse", tile_m=4.0, texel_m=0.016),
        (
            box(
                "b",
                sliding(0.0, 1.7, 0.4, (0.5, 0.2), 0.3),
                (0.5, 0.4, 0.2),
                (90.0,) * 3,
                Tag("36h11", 1, 0.3),
                moves=True,
            ),
            pillar("p", parked(-0.5, 1.2)),
        ),
        exposure_s=0.01,
        readout_s=0.01,
        shot_noise=2.0,
    )


def centroid(image: ImageArray) -> FloatArray:
    """Middle of what is not ground."""
    weight = np.abs(image[..., 2].astype(np.float64) - 120.0)
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    return np.asarray(np.array([(u * weight).sum(), (v * weight).sum()]) / weight.sum())


def disc_scene(pose: PoseOfTime, exposure_s: float = 0.0) -> Scene:
    """A thin white disc on the ground, from straight above: its middle is its centroid."""
    part = Part(round_outline(0.2, 40), 0.0, 1e-4, (255.0,) * 3, (Disc(0.21, (255.0,) * 3),))
    body = Body("disc", pose, (part,))
    return Scene(camera(0.0), GREY, (body,), sun=NOWHERE, noise=0.0, exposure_s=exposure_s)


def test_blur_is_centred_and_as_long_as_the_way() -> None:
    pose = sliding(-0.3, 0.1, 0.0, (2.0, 0.0))
    scene = disc_scene(pose, exposure_s=0.04)  # 12 px
    image = Renderer(scene).clean(0.0)
    truth = scene.truth(0.0)[0]
    assert np.abs(centroid(image) - truth.uv).max() < 0.05
    sharp = Renderer(replace(scene, exposure_s=0.0)).clean(0.0)
    # The variance of a line of length L is L^2 / 12.
    spread = [second_moment(i) for i in (image, sharp)]
    way = 2.0 * 0.04 * 450 / 3
    assert spread[0] - spread[1] == pytest.approx(way**2 / 12, rel=0.1)


def second_moment(image: ImageArray) -> float:
    """Variance along v: the camera looks along x at the top of the image, so x is -v and y is -u."""
    weight = np.abs(image[..., 2].astype(np.float64) - 120.0).sum(axis=1)
    v = np.arange(len(weight), dtype=np.float64)
    middle = (v * weight).sum() / weight.sum()
    return float(((v - middle) ** 2 * weight).sum() / weight.sum())


@pytest.mark.parametrize("moving_camera", [False, True])
def test_a_rolling_shutter_takes_each_row_at_its_time(moving_camera: bool) -> None:
    """By how much the disc moves against a global shutter: its velocity times its row's delay."""
    spot = ground_at(camera(0.0), (100.0, 200.0), 0.0)
    pose = sliding(
        float(spot[0]), float(spot[1]), 0.0, (0.0, 1.5) if not moving_camera else (0.0, 0.0)
    )
    scene = disc_scene(pose)
    if moving_camera:
        base = camera(0.0)

        def drifts(t: float) -> Pinhole:
            return replace(base, centre_m=base.centre_m - np.array([0.0, 1.5 * t, 0.0]))

        scene = replace(scene, camera=drifts)
    rolling = replace(scene, readout_s=0.03)
    moved = centroid(Renderer(rolling).clean(0.0)) - centroid(Renderer(scene).clean(0.0))
    # y points to -u here: 1.5 m/s are 225 px/s.
    late = 0.03 * (200 - 119.5) / 240
    assert moved == pytest.approx([-225 * late, 0.0], abs=0.05)
    assert rolling.truth(0.0)[0].uv - scene.truth(0.0)[0].uv == pytest.approx(
        [-225 * late, 0.0], abs=1e-3
    )


def test_a_heading_that_jumps_by_a_turn_turns_on() -> None:
    """Headings by atan2 jump at pi; a body that turns through it while the shutter is open must not spin back."""

    def jumps(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        theta = np.pi + 2.0 * t
        return np.tile([1.0, 0.0], (len(t), 1)), np.arctan2(np.sin(theta), np.cos(theta))

    images = []
    for pose in (jumps, sliding(1.0, 0.0, np.pi, (0.0, 0.0), 2.0)):
        body = box("b", pose, (0.6, 0.2, 0.1), (250.0,) * 3, moves=True)
        scene = Scene(camera(20.0), GREY, (body,), noise=0.0, exposure_s=0.01, readout_s=0.01)
        images.append(Renderer(scene).clean(0.0).astype(int))
    assert np.abs(images[0] - images[1]).max() <= 1


def test_near_things_hide_far_ones_and_pillars_are_drawn_again() -> None:
    view = camera(50.0)
    behind = box(
        "b", sliding(4.5, 0.0, 0.0, (0.0, 0.0)), (0.4, 0.4, 0.2), (0.0, 0.0, 250.0), moves=True
    )
    hiding = pillar("p", parked(3.6, 0.0), radius_m=0.4, height_m=1.4, colour=(250.0, 0.0, 0.0))
    scene = Scene(view, GREY, (behind, hiding), sun=NOWHERE, noise=0.0)
    assert scene.truth(0.0)[0].hidden
    assert not scene.truth(0.0)[1].hidden
    image = Renderer(scene).clean(0.0)
    assert image[..., 2].max() < 130  # nothing red is left
    u, v = np.rint(scene.truth(0.0)[0].uv).astype(int)
    assert image[v, u, 2] < 30
    alone = Renderer(replace(scene, bodies=(behind,))).clean(0.0)
    assert alone[v, u, 2] > 200


def test_shadows_lie_where_the_sun_casts_them() -> None:
    sun = Sun(azimuth_rad=0.5, elevation_rad=0.8, shadow=0.5, softness=0.0)
    body = pillar("p", parked(1.5, 0.0), radius_m=0.1, height_m=0.6)
    scene = Scene(camera(30.0), GREY, (body,), sun=sun, noise=0.0)
    image = Renderer(scene).clean(0.0)
    reach = 0.6 / np.tan(0.8)
    for share, dark in ((0.9, True), (1.4, False), (-0.9, False)):
        tip = np.array([1.5, 0.0]) + share * reach * np.array([np.cos(0.5), np.sin(0.5)])
        u, v = np.rint(scene.camera_at(0.0).project([*tip, 0.0])).astype(int)
        assert (image[v, u, 0] < 70) == dark


def test_lamps_shine_at_their_place_and_saturate() -> None:
    body = Body("l", parked(1.0, -0.2, 0.3), (), (Lamp((0.05, 0.02, 0.1), (0.0, 0.0, 255.0), 3.0),))
    scene = Scene(camera(20.0), GREY, (body,), noise=0.0)
    image = Renderer(scene).clean(0.0)
    uv = scene.truth(0.0)[0].uv
    assert image[round(uv[1]), round(uv[0]), 2] == 255
    assert centroid(image) == pytest.approx(uv, abs=0.02)


def test_a_blinking_lamp_shows_the_share_of_the_exposure_it_is_on() -> None:
    lamp = Lamp((0, 0, 0), period_s=0.2, duty=0.25)
    assert lamp.light(0.0, 0.2) == pytest.approx(0.25)
    assert lamp.light(0.04, 0.06) == pytest.approx(0.5)
    assert lamp.light(0.3, 0.3) == 0.0
    assert lamp.light(0.21, 0.21) == 1.0
    body = Body("l", parked(0, 0), (), (lamp,))
    scene = Scene(camera(0.0), GREY, (body,), noise=0.0, exposure_s=0.01)
    assert Renderer(scene).clean(0.02)[..., 2].max() > 200
    assert Renderer(scene).clean(0.12)[..., 2].max() == 120


def test_noise_has_its_strength_and_is_new_in_each_frame() -> None:
    scene = Scene(camera(0.0), GREY, noise=3.0)
    renderer = Renderer(scene, seed=1)
    a, b = (renderer.image(0.0, k).astype(np.float64) - 120 for k in (1, 2))
    for noise in (a, b):
        assert noise.std() == pytest.approx(np.hypot(3.0, 1 / np.sqrt(12)), rel=0.03)
        assert abs(noise.mean()) < 0.05
    assert abs(np.mean(a * b)) < 0.1
    light = Scene(camera(0.0), GREY, noise=3.0, shot_noise=4.0, brightness=2.0)
    bright = Renderer(light, seed=1).image(0.0, 1).astype(np.float64)
    assert bright.std() == pytest.approx(5.0, rel=0.05)


def test_a_moving_camera_draws_what_a_still_one_does() -> None:
    """The fast way against the good one, on the same floor; the fast one may be a little less sharp."""
    floor = ground("asphalt", tile_m=4.0, texel_m=0.008)
    view = camera(35.0, 0.1)
    for lens in (None, Lens.of_image(-0.08, SIZE)):
        still = Scene(view, floor, lens=lens, noise=0.0)
        good = Renderer(still).clean(0.0).astype(np.float64)
        fast = Renderer(replace(still, camera=hover(view, shake=Shake.none()))).clean(0.0)
        wanted = good.mean(axis=2)
        shift, rms = shift_px(fast.mean(axis=2), wanted)
        assert np.abs(shift).max() < 0.02
        assert rms < 0.35 * wanted.std()


def test_above_the_horizon_is_sky_for_still_and_moving_cameras() -> None:
    view = camera(85.0)
    floor = ground("checked", tile_m=4.0, texel_m=0.03)
    for at in (view, hover(view, shake=Shake.none())):
        image = Renderer(Scene(at, floor, noise=0.0)).clean(0.0)
        assert (image[:40] > 180).all()
        assert image[-20:].std() > 5


def test_a_body_behind_or_beside_the_camera_is_left_out() -> None:
    bodies = (
        box("behind", parked(-8.0, 0.0), (1.0, 1.0, 0.5), moves=True),
        box("below", parked(0.0, 0.0), (1.0, 1.0, 0.5), moves=True),
    )
    scene = Scene(camera(70.0), GREY, bodies, noise=0.0)
    empty = Renderer(replace(scene, bodies=())).clean(0.0)
    assert np.array_equal(Renderer(scene).clean(0.0), empty)
    assert not any(truth.in_view for truth in scene.truth(0.0))


def test_a_time_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="seconds"):
        Renderer(Scene(camera(0.0), GREY)).image(np.nan)

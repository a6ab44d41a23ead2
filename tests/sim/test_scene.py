"""Scenes: the camera, its planes and its lens, the truth, the ready-made ones, and the world's camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.body import Body, Lamp, Part, Tag
from airground.sim.body_kinds import box, rectangle, round_outline
from airground.sim.body_poses import along_path, crossing, parked
from airground.sim.calibration_drive import drive_eight
from airground.sim.flights import hover
from airground.sim.ground_texture import FLOORS, Ground, ground
from airground.sim.lens import Lens
from airground.sim.scene import Scene, Sun
from airground.sim.scene_camera import Pinhole
from airground.sim.scene_kinds import (
    demo_scene,
    drone_scene,
    lamp_scene,
    soccer_scene,
    street_scene,
)
from airground.sim.world import Transit, demo_world
from airground.sim.world_camera import WorldCamera
from airground.vision.sources.protocol import FrameSource

GREY = Ground(np.full((64, 64, 3), 120, dtype=np.uint8), 0.1)
VIEW = Pinhole.looking_down(
    focal_length_px=300.0,
    tilt_rad=0.6,
    height_m=4.0,
    image_size_px=(160, 120),
    roll_rad=0.1,
    heading_rad=0.7,
    xy_m=(1.0, -2.0),
)


def test_the_pinhole_over_the_ground_is_the_world_s_camera() -> None:
    world = demo_world()
    assert_allclose(Pinhole.of_world(world).plane().g, world.camera.g, rtol=1e-12)


def test_a_plane_s_homography_is_the_projection_of_its_points(rng: np.random.Generator) -> None:
    xy = VIEW.centre_m[:2] + rng.uniform(-1, 1, (20, 2)) + [2.0, 2.0]
    for height in (0.0, 0.4):
        xyz = np.column_stack([xy, np.full(20, height)])
        assert_allclose(VIEW.plane(height).project(xy), VIEW.project(xyz), atol=1e-9)
    assert not np.allclose(VIEW.plane(0.0).g, VIEW.plane(0.4).g, rtol=1e-2)


def test_points_behind_the_camera_have_no_image() -> None:
    assert np.isnan(VIEW.project([1.0, -2.0, 9.0])).all()


@pytest.mark.parametrize("k1", [-0.15, 0.05, 0.0])
def test_the_lens_goes_both_ways(k1: float, rng: np.random.Generator) -> None:
    lens = Lens.of_image(k1, (640, 480))
    uv = rng.uniform([0, 0], [640, 480], (50, 2))
    assert_allclose(lens.distort(lens.undistort(uv)), uv, atol=1e-9)
    corner = np.array([0.0, 0.0])
    middle = np.array([319.5, 239.5])
    # By definition: r_u = r_d / (1 + k1) at half the diagonal.
    far = np.linalg.norm(lens.undistort(corner) - middle) / np.linalg.norm(corner - middle)
    assert far == pytest.approx(1 / (1 + k1), rel=0.002)


def test_the_truth_of_a_standing_body_is_its_projection() -> None:
    x, y, theta = 2.6, 0.3, 0.9
    body = box("b", parked(x, y, theta), (0.6, 0.4, 0.3), (9.0,) * 3, Tag("4x4_50", 2, 0.2, (0.1, 0.05)))  # fmt: skip
    truth = Scene(VIEW, GREY, (body,)).truth(3.0)[0]
    c, s = np.cos(theta), np.sin(theta)
    mark = [x + c * 0.1 - s * 0.05, y + s * 0.1 + c * 0.05, 0.3]
    assert_allclose(truth.mark_xyz, mark)
    assert_allclose(truth.uv, VIEW.project(mark))
    ahead = VIEW.project(np.array(mark) + 1e-6 * np.array([c, s, 0])) - truth.uv
    assert truth.angle == pytest.approx(np.arctan2(ahead[1], ahead[0]), abs=1e-3)
    upper_left = [mark[0] + 0.1 * c - 0.1 * s, mark[1] + 0.1 * s + 0.1 * c, 0.3]
    assert_allclose(truth.corners[0, 0], VIEW.project(upper_left))
    edges = np.roll(truth.corners[0], -1, axis=0) - truth.corners[0]
    assert edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0] > 0  # clockwise to the eye


def test_what_is_behind_a_wall_is_hidden_and_what_is_beside_it_is_not() -> None:
    eye = VIEW.centre_m[:2]
    ahead = np.array([np.cos(0.7), np.sin(0.7)])
    aside = np.array([-ahead[1], ahead[0]])
    wall = eye + 2.0 * ahead
    far = eye + 2.6 * ahead
    spots = {"behind": far, "beside": far + 0.6 * aside, "before": eye + 1.5 * ahead}
    bodies = [box("wall", parked(float(wall[0]), float(wall[1]), 0.7), (0.1, 0.8, 1.2))]
    bodies += [
        box(name, parked(float(at[0]), float(at[1])), (0.1, 0.1, 0.1)) for name, at in spots.items()
    ]
    truths = {truth.name: truth for truth in Scene(VIEW, GREY, tuple(bodies)).truth(0.0)}
    assert {name: truths[name].hidden for name in spots} == {
        "behind": True,
        "beside": False,
        "before": False,
    }


def test_under_a_rolling_shutter_a_mark_s_row_and_time_agree() -> None:
    def turning(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.column_stack([2.6 + 2 * t, 0.3 - t]), 3 * t

    body = box("b", turning, (0.5, 0.5, 0.2), (9.0,) * 3, Tag("36h11", 0, 0.3, (0.1, 0.0)))
    for camera in (VIEW, hover(VIEW, seed=2)):
        scene = Scene(camera, GREY, (body,), readout_s=0.03, lens=Lens.of_image(-0.1, (160, 120)))
        truth = scene.truth(0.05)[0]
        assert truth.t == pytest.approx(0.05 + 0.03 * (truth.uv[1] - 59.5) / 120, abs=1e-9)
        global_shutter = replace(scene, readout_s=0.0).truth(truth.t)[0]
        assert_allclose(truth.uv, global_shutter.uv, atol=1e-6)


@pytest.mark.parametrize("name", sorted(FLOORS))
def test_floors_are_seeded_periodic_and_full_of_corners(name: str) -> None:
    floor = ground(name, seed=1, tile_m=4.0, texel_m=0.016)
    assert np.array_equal(floor.picture, ground(name, seed=1, tile_m=4.0, texel_m=0.016).picture)
    assert not np.array_equal(
        floor.picture, ground(name, seed=2, tile_m=4.0, texel_m=0.016).picture
    )
    grey = floor.picture.mean(axis=2)
    inside = np.median(np.abs(np.diff(grey, axis=1)))
    seam = np.abs(grey[:, 0] - grey[:, -1])
    # The squares of a checked floor end at the seam too.
    assert np.median(seam) < 2 * inside + (60 if name == "checked" else 1)
    assert inside > 1.0  # grain for feature trackers


def test_paths_are_followed() -> None:
    path = drive_eight(demo_world().path, 10.0)
    xy, theta = along_path(path, 2.0)(np.array([2.0, 7.0]))
    assert_allclose(xy[0], path.xy[0])
    assert_allclose(xy[1], path.at(np.array([5.0]))[0][0])
    assert theta[0] == pytest.approx(path.theta[0])
    transit = Transit("t", (1.0, 2.0), np.pi / 2, 0.5, 4.0)
    assert_allclose(
        crossing(transit)(np.array([2.0, 6.0]))[0], [[1.0, 1.0], [1.0, 3.0]], atol=1e-12
    )
    assert_allclose(crossing(transit, stands=True)(np.array([2.0]))[0], [[1.0, 2.0]])


def test_the_demo_s_robot_stays_in_view_with_a_tag_large_enough() -> None:
    scene = demo_scene()
    found = [truth for t in np.arange(0, 60, 1.0) for truth in scene.truth(float(t))[:1]]
    assert all(truth.in_view for truth in found)
    cells = [np.sqrt(_area(truth.corners[0])) / 8 for truth in found]
    assert min(cells) > 3.0  # px; a detector of tags needs two or three


def _area(corners: FloatArray) -> float:
    u, v = corners.T
    return float(abs(np.sum(u * np.roll(v, -1) - v * np.roll(u, -1))) / 2)


def test_twenty_robots_weave_without_touching() -> None:
    scene = soccer_scene()
    assert len(scene.bodies) == 20
    t = np.arange(0, 24, 0.1)
    xy = np.stack([body.pose(t)[0] for body in scene.bodies])
    apart = np.hypot(*np.moveaxis(xy[:, None] - xy[None], -1, 0))
    apart[np.arange(20), np.arange(20)] = 9.0
    assert 0.3 < apart.min() < 0.5
    heading = np.stack([body.pose(t)[1] for body in scene.bodies])
    way = np.diff(xy, axis=1)
    middle = heading[:, :-1] + np.angle(np.exp(1j * np.diff(heading, axis=1))) / 2
    turned = np.angle(np.exp(1j * (np.arctan2(way[..., 1], way[..., 0]) - middle)))
    assert np.abs(turned).max() < 0.02
    assert all(truth.in_view for truth in scene.truth(3.0))


def test_ready_made_scenes_are_seeded() -> None:
    one, same, other = lamp_scene(1), lamp_scene(1), lamp_scene(2)
    assert np.array_equal(one.ground.picture, same.ground.picture)
    assert not np.array_equal(one.ground.picture, other.ground.picture)
    assert np.array_equal(one.truth(1.0)[0].uv, same.truth(1.0)[0].uv)
    assert len(street_scene(cars=3).bodies) == 5
    with pytest.raises(InputError, match="flight"):
        drone_scene(flight="loop")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="1 to 21"):
        soccer_scene(robots=22)


def test_the_world_s_camera_is_a_source_of_frames() -> None:
    scene = Scene(VIEW, GREY)
    with WorldCamera(
        scene, rate_hz=10, duration_s=5.0, seed=2, dropped=0.3, late=0.5, late_s=0.4
    ) as source:
        assert isinstance(source, FrameSource)
        before = source.health
        first = next(iter(source))
        rest = list(source)  # goes on
        again = source.frame(rest[3].index)
    frames = [first, *rest]
    assert np.array_equal(again.image, rest[3].image)
    assert len(frames) == source.frame_count < 51
    assert [frame.t for frame in frames] == list(source.times)
    assert [frame.index / 10 for frame in frames] == pytest.approx(source.times)
    assert (before.state, source.health.state) == ("opening", "ended")
    assert source.health.dropped == frames[-1].index + 1 - len(frames)
    late = np.array([frame.late_s for frame in frames], dtype=np.float64)
    assert 0.2 < np.mean(late > 0) < 0.8
    assert source.health.late == (late >= 0.25).sum()
    assert next(WorldCamera(scene).__iter__()).late_s is None


def test_wrong_input_is_refused() -> None:
    with pytest.raises(InputError, match="floor"):
        ground("lava")
    with pytest.raises(InputError, match="one name"):
        Scene(VIEW, GREY, (box("a", parked(0, 0), (1, 1, 1)), box("a", parked(0, 0), (1, 1, 1))))
    with pytest.raises(InputError, match="not negative"):
        Scene(VIEW, GREY, exposure_s=-1.0)
    with pytest.raises(InputError, match="vignetting"):
        Scene(VIEW, GREY, vignetting=1.0)
    with pytest.raises(InputError, match="elevation"):
        Sun(elevation_rad=0.0)
    with pytest.raises(InputError, match="counter-clockwise"):
        Part(rectangle(1, 1)[::-1], 0.0, 1.0, (0, 0, 0))
    with pytest.raises(InputError, match="a part or a lamp"):
        Body("nothing", parked(0, 0), ())
    with pytest.raises(InputError, match="lamp"):
        Lamp((0, 0, 0), duty=2.0)
    with pytest.raises(InputError, match="positive"):
        Pinhole.looking_down(focal_length_px=0, tilt_rad=0, height_m=1, image_size_px=(9, 9))
    with pytest.raises(InputError, match="no body"):
        Scene(VIEW, GREY).body("x")
    with pytest.raises(InputError, match="rate_hz"):
        WorldCamera(Scene(VIEW, GREY), rate_hz=0)
    with pytest.raises(InputError, match="shares"):
        WorldCamera(Scene(VIEW, GREY), dropped=1.0)
    with pytest.raises(InputError, match="0 to"):
        WorldCamera(Scene(VIEW, GREY), duration_s=1.0).frame(99)
    assert len(round_outline(1.0)) > 8

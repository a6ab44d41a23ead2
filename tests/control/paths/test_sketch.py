"""Drawings with all that hands do, against what was meant, the camera, and differences of the answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.control import Floor, Limits
from airground.control.paths.image_path import ImagePath
from airground.control.paths.sketch import smooth_sketch
from airground.control.paths.sketch_check import check_path
from airground.control.paths.sketch_fit import in_tube
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.geometry.arrays import FloatArray
from airground.sim import demo_world

CAMERA = demo_world().camera
FLOOR = Floor(LimitedHomography(CAMERA.g), np.array([640.0, 400.0]))
LIMITS = Limits()
CAR = Limits(turn_radius_m=0.3)
ZIGZAG = [(200, 600), (800, 500), (220, 450), (900, 330)]


def stroke(rng: np.random.Generator, corners: object, count: int = 400) -> FloatArray:
    """A line through corners, at uneven points, with the hand's noise of 1 px."""
    c = np.array(corners, dtype=np.float64)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(c, axis=0).T))])
    t = np.sort(np.concatenate([rng.uniform(0, along[-1], count - 2), along[[0, -1]]]))
    uv = np.column_stack([np.interp(t, along, c[:, k]) for k in (0, 1)])
    return uv + rng.normal(0, 1.0, uv.shape)


def away(points: FloatArray, line: FloatArray) -> FloatArray:
    """Distance of each point from a polyline, by all pairs."""
    a, d = line[:-1], np.diff(line, axis=0)
    square = np.maximum((d**2).sum(axis=1), 1e-12)
    f = ((points[:, None] - a) * d).sum(axis=2) / square
    foot = a + np.clip(f, 0, 1)[:, :, None] * d
    return np.asarray(np.hypot(*(points[:, None] - foot).transpose(2, 0, 1)).min(axis=1))


def keeps(path: ImagePath, limits: Limits) -> None:
    """All limits, by differences of what the path says, run by run."""
    edges = (0, *path.breaks, len(path))
    for a, b, way in zip(edges[:-1], edges[1:], path.directions, strict=True):
        xy, s, v, t = path.xy[a:b], path.s[a:b], path.speed[a:b], path.time[a:b]
        h, dt = np.diff(s), np.diff(t)
        assert np.isfinite(np.column_stack([xy, s[:, None], v[:, None], t[:, None]])).all()
        assert (h > 0).all()
        assert (dt > 0).all()
        chord = np.hypot(*np.diff(xy, axis=0).T)
        assert (chord <= h * (1 + 1e-6) + 1e-12).all()
        assert_allclose(chord, h, rtol=0.02, atol=1e-9)
        assert v.max() <= (limits.reverse_mps if way < 0 else limits.speed_mps) * (1 + 1e-9)
        assert_allclose(h, dt * (v[1:] + v[:-1]) / 2, rtol=1e-6)
        a_ = np.diff(v) / dt
        assert a_.max() <= limits.acceleration_mps2 * (1 + 1e-6)
        assert a_.min() >= -limits.deceleration_mps2 * (1 + 1e-6)
        omega = path.curvature[a:b] * v
        assert np.abs(omega).max() <= limits.turn_rate_radps * (1 + 1e-6)
        assert np.abs(omega * v).max() <= limits.lateral_acceleration_mps2 * (1 + 1e-6)
        turned = np.diff(omega) / dt
        assert np.abs(turned).max() <= limits.turn_acceleration_radps2 * 1.01
        # The headings are those of the points, and turn as the curvature says.
        theta = path.theta[a:b]
        chords = np.arctan2(*np.diff(xy, axis=0).T[::-1])
        middle = (theta[1:] + theta[:-1]) / 2
        assert (np.cos(chords - middle) > 0.99).all()


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_curve_is_kept_and_its_noise_is_not(rng: np.random.Generator, noise: float) -> None:
    angle = np.linspace(0.3, 5.5, 500)
    clean = np.column_stack([640 + 300 * np.cos(angle), 420 + 170 * np.sin(angle)])
    path = smooth_sketch(FLOOR, clean + rng.normal(0, noise, clean.shape), LIMITS)
    inner = path.uv[20:-20]
    assert np.sqrt(np.mean(away(inner, clean) ** 2)) < (0.5 if noise else 0.05)
    # Curvature of the curve that was meant, on the ground, by the camera.
    xy = CAMERA.unproject(clean)
    one, two = np.gradient(xy, axis=0), np.gradient(np.gradient(xy, axis=0), axis=0)
    meant = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / np.hypot(*one.T) ** 3
    assert np.abs(path.curvature).max() < 1.5 * np.abs(meant).max()
    keeps(path, LIMITS)
    assert path.rms_deviation_px == pytest.approx(noise, abs=0.12)


def test_stated_deviation_is_that_of_brute_force(rng: np.random.Generator) -> None:
    uv = stroke(rng, [(200, 600), (700, 560), (680, 250), (1100, 300)])
    path = smooth_sketch(FLOOR, uv, LIMITS)
    off = away(uv, path.uv)
    assert path.rms_deviation_px == pytest.approx(np.sqrt(np.mean(off**2)), abs=1e-3)
    assert path.max_deviation_px >= off.max() - 1e-3
    assert path.max_deviation_px < 3 + 4.5  # the tube and the hand's largest slips
    assert_allclose(path.uv[[0, -1]], uv[[0, -1]], atol=1e-6)


def test_a_wider_tube_gives_a_smoother_path(rng: np.random.Generator) -> None:
    uv = stroke(rng, [(200, 600), (700, 560), (680, 250), (1100, 300)])
    tight, wide = (smooth_sketch(FLOOR, uv, LIMITS, smoothing_px=px) for px in (2.0, 12.0))
    assert np.abs(wide.curvature).max() < 0.5 * np.abs(tight.curvature).max()
    assert wide.duration < tight.duration
    assert tight.max_deviation_px < wide.max_deviation_px < 25


@pytest.mark.parametrize("limits", [LIMITS, CAR])
def test_doubling_back_is_a_stop(rng: np.random.Generator, limits: Limits) -> None:
    uv = stroke(rng, ZIGZAG)
    path = smooth_sketch(FLOOR, uv, limits)
    keeps(path, limits)
    assert path.directions == ((1, 1, 1) if limits is LIMITS else (1, -1, 1))
    for tip, corner in zip(path.uv[list(path.breaks)], np.array(ZIGZAG[1:3]), strict=True):
        drawn = np.hypot(*(uv - corner).T).min()  # points are uneven: none need be at the corner
        assert np.hypot(*(tip - corner)) < drawn + 3.0 + 4.5 + 3.0  # tube, string, hand
    assert (path.speed[[0, *path.breaks, -1]] == 0).all()
    for k in path.breaks:
        assert_allclose(path.xy[k], path.xy[k - 1], atol=1e-9)
        mismatch = path.theta[k] - path.theta[k - 1] + (np.pi if limits is CAR else 0)
        off = abs((mismatch + np.pi) % (2 * np.pi) - np.pi)
        assert off < 0.05 if limits is CAR else off > 2
    assert check_path(path, limits) == ()
    if limits is CAR:
        assert {u.kind for u in check_path(path, replace(CAR, reverse_mps=0.0))} == {"cusp"}
        stuck = smooth_sketch(FLOOR, stroke(rng, ZIGZAG), replace(CAR, reverse_mps=0.0))
        cusps = [u for u in check_path(stuck, CAR) if u.kind == "cusp"]
        assert len(cusps) == 2
        assert "turn on the spot" in str(cusps[0])


def test_a_pause_of_the_hand_is_no_place_to_dance(rng: np.random.Generator) -> None:
    first = stroke(rng, [(200, 600), (600, 450)], 200)
    pause = [600, 450] + rng.normal(0, 1.5, (300, 2))
    then = stroke(rng, [(600, 450), (1000, 560)], 200)
    path = smooth_sketch(
        FLOOR, np.concatenate([first, pause, then, then[-1:].repeat(50, 0)]), LIMITS
    )
    assert path.breaks == ()
    assert path.length < 1.03 * np.hypot(
        *np.diff(CAMERA.unproject([[200, 600], [600, 450]]), axis=0)[0]
    ) + (1.03 * np.hypot(*np.diff(CAMERA.unproject([[600, 450], [1000, 560]]), axis=0)[0]))
    keeps(path, LIMITS)


def test_what_goes_round_is_closed(rng: np.random.Generator) -> None:
    angle = np.linspace(0, 2 * np.pi + 0.1, 500)  # the hand goes on a little past its start
    uv = np.column_stack([640 + 350 * np.sin(angle), 420 + 150 * np.sin(2 * angle)])
    path = smooth_sketch(FLOOR, uv + rng.normal(0, 1, uv.shape), LIMITS)
    assert path.closed
    assert_allclose(path.xy[-1], path.xy[0], atol=1e-12)
    keeps(path, LIMITS)
    # No seam: heading, curvature and speed are those of the start, and the curvature does not jump.
    assert np.cos(path.theta[-1] - path.theta[0]) == pytest.approx(1, abs=1e-9)
    assert path.speed[-1] == pytest.approx(path.speed[0])
    around = np.concatenate([path.curvature[-6:-1], path.curvature[:6]])
    assert np.abs(np.diff(around)).max() < 0.1
    assert not smooth_sketch(FLOOR, uv, LIMITS, closed=False).closed
    assert not smooth_sketch(FLOOR, uv[:350], LIMITS).closed
    assert smooth_sketch(FLOOR, uv[:350], LIMITS, closed=True).closed
    back = stroke(rng, [(300, 600), (900, 400), (305, 603)])
    path = smooth_sketch(FLOOR, back, LIMITS)
    assert not path.closed  # out and back
    assert len(path.breaks) == 1
    assert_allclose(path.uv[-1], back[-1], atol=1e-6)


def test_a_car_cuts_corners_and_says_so(rng: np.random.Generator) -> None:
    path = smooth_sketch(FLOOR, stroke(rng, [(200, 600), (700, 560), (680, 250)]), CAR)
    assert np.abs(path.curvature).max() <= 1.01 / CAR.turn_radius_m
    (told,) = check_path(path, CAR)
    assert told.kind == "departs"
    assert away(told.uv[None], np.array([(200.0, 600), (700, 560), (680, 250)]))[0] > 10
    narrow = stroke(rng, [(200, 600), (700, 600), (715, 585), (700, 570), (200, 560)])
    (tight,) = check_path(smooth_sketch(FLOOR, narrow, CAR, closed=False), CAR)
    assert tight.kind == "curvature"
    assert np.hypot(*(tight.uv - [710, 585])) < 30
    assert tight.s_m[0] < tight.s_m[1]


def test_what_is_no_ground_is_left_out_and_told() -> None:
    uv = np.column_stack([np.linspace(300, 900, 60), np.full(60, 500.0)])
    uv[10:13] = np.nan
    uv[20] = [640, -3000]  # beyond the horizon
    horizon_v = -(FLOOR.model.horizon[0] * 640 + FLOOR.model.horizon[2]) / FLOOR.model.horizon[1]
    uv[30] = [640, horizon_v + 2]  # just below it
    path = smooth_sketch(FLOOR, uv, LIMITS)
    told = [(u.kind, u.first, u.last, u.drawn) for u in check_path(path, LIMITS)]
    assert told == [
        ("not_finite", 10, 12, True),
        ("horizon", 20, 20, True),
        ("far", 30, 30, True),
    ]
    assert "\n" not in str(path.undrivable[0])
    assert np.abs(path.uv[:, 1] - 500).max() < 1


def test_where_a_path_may_not_go_is_told(rng: np.random.Generator) -> None:
    uv = np.column_stack([np.linspace(300, 1400, 100), np.linspace(600, 300, 100)])
    path = smooth_sketch(FLOOR, uv, LIMITS)
    assert check_path(path, LIMITS, coarsest_m_per_px=1.0) == ()
    (out,) = check_path(path, LIMITS, image_size_px=(1280, 720))
    assert out.kind == "outside"
    assert path.uv[out.first, 0] > 1279.5 >= path.uv[out.first - 1, 0]
    square = [(200, 200), (800, 200), (800, 700), (200, 700)]
    (fence,) = check_path(path, LIMITS, fence=square)
    assert path.uv[fence.first, 0] > 800 >= path.uv[fence.first - 1, 0]
    assert [fence.first] == [
        u.first for u in check_path(path, LIMITS, fence=lambda uv: uv[:, 0] <= 800)
    ]
    scale = 1 / np.linalg.svd(FLOOR.model.jacobian(path.uv), compute_uv=False)[:, 1]
    bound = float(np.median(scale))
    (far,) = check_path(path, LIMITS, coarsest_m_per_px=bound)
    assert (scale[far.first : far.last + 1] > bound).all()
    dot = smooth_sketch(FLOOR, [[640, 500], [641, 500]], LIMITS)
    assert [u.kind for u in check_path(dot, LIMITS)] == ["short"]
    with pytest.raises(InputError, match="fence"):
        check_path(path, LIMITS, fence=[(0, 0), (1, 1)])


def test_the_fit_is_the_least_of_its_sum(rng: np.random.Generator) -> None:
    """Without a tube, against a dense least-squares solution."""
    q, J = rng.normal(0, 1, (30, 2)), rng.normal(0, 50, (30, 2, 2))
    p = in_tube(q, J, np.full(30, np.inf), np.ones(30), 3.0)
    m = np.sqrt(np.abs(np.linalg.det(J)))
    third = (
        np.diff(np.eye(30), 3, axis=0)
        * (3.0**3 * (m[:-3] + m[1:-2] + m[2:-1] + m[3:]) / 4)[:, None]
    )
    data = np.zeros((60, 60))
    for k in range(30):
        data[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = J[k]
    A = np.concatenate([data, np.kron(third, np.eye(2))])
    b = np.concatenate([data @ q.ravel(), np.zeros(len(A) - 60)])
    assert_allclose(p.ravel(), np.linalg.lstsq(A, b)[0], atol=1e-6)


@pytest.mark.parametrize(
    "uv",
    [[], [[1, 2]], [[640, 500]] * 5, [[np.nan, 1]] * 3, [[640, -3000], [650, -3000]], [1, 2], "no"],
)
def test_where_no_path_exists_there_is_an_error(uv: object) -> None:
    with pytest.raises(InputError):
        smooth_sketch(FLOOR, uv, LIMITS)  # type: ignore[arg-type]


def test_arguments_are_checked() -> None:
    for name in ("smoothing_px", "coarsest_m_per_px"):
        with pytest.raises(InputError, match=name):
            smooth_sketch(FLOOR, [[300, 500], [600, 500]], LIMITS, **{name: 0.0})  # type: ignore[arg-type]


pixels = st.tuples(st.floats(-2000, 3000), st.floats(-500, 2000))
doodles = st.lists(pixels, min_size=0, max_size=12)


@settings(max_examples=15)
@given(doodles, st.sampled_from([LIMITS, CAR]), st.sampled_from([None, True, False]))
def test_any_polyline_is_refused_or_gives_a_path_within_limits(
    uv: list[tuple[float, float]], limits: Limits, closed: bool | None
) -> None:
    try:
        path = smooth_sketch(FLOOR, np.array(uv).reshape(-1, 2), limits, closed=closed)
    except InputError:
        seen = np.array(uv).reshape(-1, 2)
        seen = seen[np.isfinite(CAMERA.unproject(seen)).all(axis=1)]
        scale = np.linalg.svd(FLOOR.model.jacobian(seen), compute_uv=False)[:, 1]
        assert len(np.unique(np.round(seen[scale >= 1.0], 5), axis=0)) < 2
        return
    keeps(path, limits)
    check_path(path, limits, image_size_px=(1280, 720))

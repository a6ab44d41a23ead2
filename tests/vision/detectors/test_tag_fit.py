"""The model of a tag's pixels, and its fit: derivatives, pixels, and when a fit is done."""

from __future__ import annotations

import numpy as np
import pytest

from airground.vision.detectors import tag_fit
from airground.vision.detectors.tag_families import family
from airground.vision.detectors.tag_fit import fit_tags
from airground.vision.detectors.tag_model import (
    CORNERS,
    design_of,
    homographies,
    pixels_of,
    steps_of,
)
from vision.synthetic import Tag, draw_tags, tilted

CELLS = 8
SHAPE = (200, 240)


def places(rng: np.random.Generator, *sides: float) -> np.ndarray:
    H = np.array(
        [
            tilted(
                rng.uniform([100, 90], [140, 110]),
                side,
                tilt_deg=30,
                turn_deg=float(rng.uniform(0, 360)),
            )
            for side in sides
        ]
    )
    return np.asarray(H / H[:, 2:, 2:])


def steps(*numbers: int) -> np.ndarray:
    return np.stack([steps_of(family("36h11").pattern(k)) for k in numbers], axis=1)


def test_homographies_take_the_square_to_the_corners(rng: np.random.Generator) -> None:
    H = places(rng, 30, 60, 90)
    q = np.column_stack([CORNERS, np.ones(4)]) @ H.swapaxes(1, 2)
    np.testing.assert_allclose(homographies(q[..., :2] / q[..., 2:]), H, rtol=1e-9, atol=1e-9)
    assert np.isnan(homographies(np.zeros((1, 4, 2)))).all()


def test_derivatives_are_those_of_the_pattern(rng: np.random.Generator) -> None:
    H, blur, code = places(rng, 40, 70), np.array([[0.9, 1.1], [1.3, 0.8]]), steps(3, 11)
    pixels, _ = pixels_of(SHAPE, H, CELLS, 300)
    design = design_of(pixels, H, blur, code, CELLS)
    step = 2e-3

    def pattern(D: np.ndarray, wider: np.ndarray) -> np.ndarray:
        moved = H @ (np.eye(3) + D.reshape(3, 3))
        return design_of(pixels, moved, blur * np.exp(wider), code, CELLS)[:, 11]

    for k in range(10):
        D, wider = np.zeros(9), np.zeros(2)
        (D if k < 8 else wider)[k % 8] = step
        slope = (pattern(D, wider) - pattern(-D, -wider)) / (2 * step)
        off = np.abs(slope - design[:, k])
        # The blur's slant is not carried through the derivatives.
        assert np.sqrt((off**2).mean()) < 0.06 * np.sqrt((design[:, k] ** 2).mean())


@pytest.mark.parametrize("side", [12.0, 20.0, 35.0, 80.0, 160.0])
def test_pixels_are_on_the_tag_and_each_is_taken_once(
    side: float, rng: np.random.Generator
) -> None:
    H = places(rng, side, side)
    pixels, there = pixels_of(SHAPE, H, CELLS, 400)
    for k in range(2):
        uv = pixels[:, k, there[k]].T
        assert len(np.unique(uv, axis=0)) == len(uv) <= 440
        q = np.column_stack([uv, np.ones(len(uv))]) @ np.linalg.inv(H[k]).T
        reach = np.abs(q[:, :2] / q[:, 2:]).max()
        assert reach < 1 + 2 * 1.0 / CELLS  # within the white margin
        area = 0.87 * (side * (1 + 0.9 / CELLS)) ** 2
        assert len(uv) > min(0.85 * area, 340)


def test_pixels_outside_of_the_image_are_left_out(rng: np.random.Generator) -> None:
    H = places(rng, 60, 60, 60)
    H[1, :2] += np.array([[100.0], [0.0]]) * H[1, 2]
    H[2, :2] += np.array([[900.0], [0.0]]) * H[2, 2]
    pixels, there = pixels_of(SHAPE, H, CELLS, 400)
    assert there[0].sum() > there[1].sum() > 50
    assert not there[2].any()
    assert ((pixels >= 0) & (pixels < np.array(SHAPE[::-1])[:, None, None])).all()


def test_a_fit_that_stops_early_is_where_the_patient_one_is(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A followed tag is drawn once or twice; where the step was short, once is as good."""
    H = places(rng, 25, 40, 60, 100)
    code = steps(7, 7, 7, 7)
    off: list[np.ndarray] = []
    drawn: list[int] = []

    def counted(*arguments: object) -> np.ndarray:
        drawn[-1] += 1
        return design_of(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(tag_fit, "design_of", counted)
    for k in range(4):
        image = draw_tags([Tag(H[k])], SHAPE[::-1], blur_px=0.6, noise=3, rng=rng, supersample=6)
        near = H[k : k + 1].copy()
        near[:, :2] += np.array([[0.06], [-0.05]]) * near[:, 2:]
        drawn.append(0)
        fits = fit_tags(image, near, code[:, :1], CELLS, np.array([[0.65, 0.65]]))
        assert drawn[-1] <= 2
        drawn.append(0)
        with monkeypatch.context() as patient:
            patient.setattr(tag_fit, "ENOUGH", 0.0)
            other = fit_tags(image, near, code[:, :1], CELLS, np.array([[0.65, 0.65]]))
        assert drawn[-1] > 2
        assert fits.ok.all()
        assert other.ok.all()
        J = fits.points(np.zeros((1, 2)))[1][:, 0]
        sigma = np.sqrt(np.diagonal(J @ fits.covariance @ J.swapaxes(1, 2), axis1=1, axis2=2))
        moved = fits.points(np.zeros((1, 2)))[0] - other.points(np.zeros((1, 2)))[0]
        off.append(np.abs(moved[:, 0]) / sigma)
    assert np.max(off) < 0.4
    assert 1 in drawn


def test_tags_fitted_together_are_where_each_is_alone(rng: np.random.Generator) -> None:
    H = places(rng, 50, 50)
    H[1, :2] += np.array([[-70.0], [60.0]]) * H[1, 2]
    image = draw_tags(
        [Tag(H[0]), Tag(H[1], number=9)], SHAPE[::-1], blur_px=0.6, noise=3, rng=rng, supersample=4
    )
    code, none = steps(7, 9), np.full((2, 2), np.nan)
    lost = np.concatenate([H, H[:1] * np.nan])
    together = fit_tags(image, lost, steps(7, 9, 3), CELLS, np.full((3, 2), np.nan))
    assert together.ok.tolist() == [True, True, False]
    for k in range(2):
        alone = fit_tags(image, H[k : k + 1], code[:, k : k + 1], CELLS, none[:1])
        assert alone.ok.all()
        np.testing.assert_allclose(
            together.points(CORNERS)[0][k], alone.points(CORNERS)[0][0], atol=0.02
        )


def test_a_tag_outside_of_the_image_leaves_the_others_as_they_are(rng: np.random.Generator) -> None:
    H = places(rng, 50, 50)
    H[1, :2] += 1000 * H[1, 2]
    image = draw_tags([Tag(H[0])], SHAPE[::-1], blur_px=0.6, noise=3, rng=rng, supersample=4)
    both = fit_tags(image, H, steps(7, 9), CELLS, np.full((2, 2), np.nan))
    alone = fit_tags(image, H[:1], steps(7), CELLS, np.full((1, 2), np.nan))
    assert both.ok.tolist() == [True, False]
    for name in ("correlation", "code_correlation", "contrast"):
        assert getattr(both, name)[0] == pytest.approx(getattr(alone, name)[0], rel=1e-4)
    assert both.correlation[0] < 1 < both.contrast[0]


def test_a_tag_that_is_hard_to_fit_goes_on_without_the_others(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that need no more steps are not drawn again; a limit of steps leaves the hard one where it is by then."""
    H = places(rng, 50, 50)
    H[1, :2] += np.array([[-70.0], [60.0]]) * H[1, 2]
    image = draw_tags([Tag(H[0])], SHAPE[::-1], blur_px=0.6, noise=3, rng=rng, supersample=4)
    drawn: list[int] = []

    def counted(*arguments: object) -> np.ndarray:
        drawn.append(len(arguments[1]))  # type: ignore[arg-type]
        return design_of(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(tag_fit, "design_of", counted)
    code, blur = steps(7, 9), np.full((2, 2), 0.65)
    near = H.copy()
    near[0, :2] += 0.02 * near[0, 2]
    fits = fit_tags(image, near, code, CELLS, blur)
    assert drawn[0] == 2
    assert drawn[-1] == 1
    assert len(drawn) == tag_fit.ITERATIONS
    assert drawn.count(2) <= 3
    drawn.clear()
    alone = fit_tags(image, near[:1], code[:, :1], CELLS, blur[:1])
    assert fits.correlation[0] > 0.97 > fits.correlation[1]
    np.testing.assert_allclose(fits.points(CORNERS)[0][0], alone.points(CORNERS)[0][0], atol=1e-3)
    drawn.clear()
    short = fit_tags(image, near, code, CELLS, blur, most=3)
    assert len(drawn) == 3
    np.testing.assert_allclose(short.points(CORNERS)[0][0], alone.points(CORNERS)[0][0], atol=1e-3)

"""A homography from matches: exact without noise, honest with it, and refused where points leave it open."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.vision.moving import NoiseScale, fit_homography
from airground.vision.moving.small_motion import deviation, difference
from vision.moving.flight import Array, camera, project

TRUTH = camera((900, 900), turn=0.4, tilt=0.35) @ np.linalg.inv(camera((940, 880), tilt=0.2))
TRUTH = TRUTH / np.cbrt(np.linalg.det(TRUTH))


def matches(
    rng: np.random.Generator, count: int, *, sigma: float = 0.4, wrong: int = 0, share: float = 1.0
) -> tuple[Array, Array]:
    """Matches over a part of the image; noise in both; the first `wrong` of them anywhere."""
    source = rng.uniform(0, 1, (count, 2)) * np.array([640, 360]) * share
    target = project(TRUTH, source) + rng.normal(0, sigma, source.shape)
    target[:wrong] = rng.uniform(0, 600, (wrong, 2))
    return source + rng.normal(0, sigma, source.shape), target


@pytest.mark.parametrize("count", [4, 5, 9, 200])
def test_exact_without_noise(rng: np.random.Generator, count: int) -> None:
    corners = np.array([[5.0, 9.0], [620.0, 4.0], [600.0, 350.0], [20.0, 330.0]])
    source = np.concatenate([corners, rng.uniform(0, 350, (count - 4, 2))])
    fit = fit_homography(source, project(TRUTH, source))
    assert fit.status == "ok"
    assert fit.inliers.all()
    assert fit.matrix is not None
    assert_allclose(project(fit.matrix, source), project(TRUTH, source), atol=1e-7)
    assert np.linalg.det(fit.matrix) == pytest.approx(1.0)


@pytest.mark.parametrize(("count", "wrong"), [(12, 0), (30, 10), (150, 75)])
def test_stated_covariance_is_what_comes_out(
    rng: np.random.Generator, count: int, wrong: int
) -> None:
    nees = []
    for _ in range(60):
        source, target = matches(rng, count, wrong=wrong)
        fit = fit_homography(source, target, source_covariance=0.16, target_covariance=0.16)
        assert fit.matrix is not None
        assert fit.covariance is not None
        delta = difference(fit.matrix, TRUTH)
        nees.append(delta @ np.linalg.solve(fit.covariance, delta))
    # Sum of 60 chi-squares of 8: mean 8, deviation of the mean 0.5; few points leave the scale open.
    assert 6.0 < np.mean(nees) < 11.5


def test_noise_is_found_where_it_is_not_known(rng: np.random.Generator) -> None:
    source, target = matches(rng, 200, sigma=1.5)
    fit = fit_homography(source, target, source_covariance=0.25, target_covariance=0.25)
    assert fit.scale == pytest.approx(3.0, rel=0.15)
    told = fit_homography(
        source,
        target,
        source_covariance=2.25,
        target_covariance=2.25,
        prior=NoiseScale(1.0, np.inf),
    )
    assert told.scale == 1.0


def test_a_corner_of_the_image_says_little_about_the_rest(rng: np.random.Generator) -> None:
    source, target = matches(rng, 60, share=0.2)
    fit = fit_homography(source, target, source_covariance=0.16, target_covariance=0.16)
    assert fit.matrix is not None
    assert fit.covariance is not None
    here, far = np.trace(
        deviation(fit.matrix, fit.covariance, np.array([[60.0, 30.0], [600.0, 340.0]])),
        axis1=1,
        axis2=2,
    )
    assert far > 100 * here


@pytest.mark.parametrize("count", [0, 1, 3])
def test_too_few(rng: np.random.Generator, count: int) -> None:
    source, target = matches(rng, count)
    fit = fit_homography(source, target)
    assert (fit.status, fit.matrix) == ("too few points", None)
    assert fit.inliers.shape == (count,)


def test_points_in_line(rng: np.random.Generator) -> None:
    along = np.linspace(0, 1, 20)[:, None] * np.array([600.0, 300.0])
    near = along + rng.normal(0, 0.5, along.shape)  # in line but for the noise
    but_one = np.concatenate([along, [[50.0, 300.0]]])
    for source in (along, near, but_one):
        target = project(TRUTH, source) + rng.normal(0, 0.4, source.shape)
        fit = fit_homography(source, target, target_covariance=0.16)
        assert (fit.status, fit.matrix) == ("points in line", None)


def test_two_planes(rng: np.random.Generator) -> None:
    source, target = matches(rng, 60, sigma=0.2)
    target[:28] = project(TRUTH, source[:28] * 1.02 + 8.0)
    fit = fit_homography(source, target, target_covariance=0.08)
    assert fit.status == "parallax"
    fit = fit_homography(source, target, target_covariance=0.08, parallax=False)
    assert fit.status == "ok"
    one, other = fit.inliers[:28], fit.inliers[28:]
    assert min(one.sum(), other.sum()) == 0  # one of them, not a mixture
    assert max(one.mean(), other.mean()) > 0.9


def test_nothing_agrees(rng: np.random.Generator) -> None:
    source, target = rng.uniform(0, 600, (2, 40, 2))
    fit = fit_homography(source, target, target_covariance=0.1, least=8)
    assert fit.matrix is None
    assert fit.status in ("no agreement", "points in line")  # what agrees by chance lies in line


def test_wrong_input_is_an_error() -> None:
    good = np.zeros((5, 2))
    with pytest.raises(InputError, match="target must have shape"):
        fit_homography(good, good[:4])
    with pytest.raises(InputError, match="NaN"):
        fit_homography(good + np.nan, good)
    with pytest.raises(InputError, match="variance"):
        fit_homography(good, good, source_covariance=-1.0)

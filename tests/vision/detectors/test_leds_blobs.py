"""Lights and coloured patches."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.errors import InputError
from airground.vision.detectors.blobs import BlobDetector
from airground.vision.detectors.leds import LedDetector
from airground.vision.sightings import Sightings
from vision.synthetic import coverage, draw_spots, frame, texture, to_bytes

RED, GROUND = np.array([40.0, 50.0, 200.0]), np.array([90.0, 100.0, 95.0])


def squares(seen: Sightings, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors [px] and normalised squares of the nearest sighting of each true point."""
    errors: list[float] = []
    normalised: list[float] = []
    for point in truth:
        off = seen.uv - point
        k = int(np.argmin(np.hypot(*off.T)))
        errors.append(np.hypot(*off[k]))
        normalised.append(off[k] @ np.linalg.solve(seen.covariance[k], off[k]))
    return np.array(errors), np.array(normalised)


@pytest.mark.parametrize(
    ("sigma", "peak", "limit_px"), [(0.9, 120, 0.12), (1.5, 200, 0.05), (2.0, 900, 0.05)]
)
def test_lights_and_their_covariance(
    rng: np.random.Generator, sigma: float, peak: float, limit_px: float
) -> None:
    """The last are saturated: 900 over 255."""
    errors: list[float] = []
    normalised: list[float] = []
    for _ in range(8):
        truth = np.array([[30.0, 30.0], [70, 60], [120, 30], [90, 95]]) + rng.uniform(0, 1, (4, 2))
        image = draw_spots([(u, v, sigma, peak) for u, v in truth], (160, 120))
        seen = LedDetector().detect(frame(to_bytes(image, 2.0, rng)))
        assert len(seen) == 4
        assert set(seen.labels) == {""}
        e, n = squares(seen, truth)
        errors.extend(e)
        normalised.extend(n)
    assert np.sqrt(np.mean(np.square(errors))) < limit_px
    assert 0.2 < np.mean(normalised) < 5.0


def test_lights_before_texture_and_large_bright_areas(rng: np.random.Generator) -> None:
    ground = 0.5 * texture(rng, (200, 150), 8.0).astype(float)
    ground[:, 150:] = 190.0  # sunlit
    lights = draw_spots([(40.2, 60.7, 1.5, 160.0), (100.6, 90.1, 1.5, 160.0)], (200, 150), 0.0)
    seen = LedDetector(most_size_px=15).detect(frame(to_bytes(ground + lights, 2.0, rng)))
    assert len(seen) == 2
    errors, _ = squares(seen, np.array([[40.2, 60.7], [100.6, 90.1]]))
    assert errors.max() < 0.3


def test_a_red_light_is_bright(rng: np.random.Generator) -> None:
    red = draw_spots([(60.3, 50.4, 1.5, 200.0)], (120, 100), 30.0)
    image = np.stack([np.full_like(red, 30.0), np.full_like(red, 30.0), red], axis=-1)
    seen = LedDetector().detect(frame(to_bytes(image, 1.0, rng)))
    assert_allclose(seen.uv, [[60.3, 50.4]], atol=0.1)


def test_two_lights_close_together_do_not_pull_at_each_other(rng: np.random.Generator) -> None:
    truth = np.array([[50.0, 50.0], [59.0, 50.0]])
    image = draw_spots([(u, v, 1.4, 180.0) for u, v in truth], (110, 100))
    errors, _ = squares(LedDetector().detect(frame(to_bytes(image, 1.0, rng))), truth)
    assert errors.max() < 0.1


def test_only_the_strongest_lights(rng: np.random.Generator) -> None:
    spots = [(30.0 + 30 * k, 40.0, 1.5, 70.0 + 30 * k) for k in range(4)]
    seen = LedDetector(most=2).detect(frame(to_bytes(draw_spots(spots, (160, 80)), 1.0, rng)))
    assert_allclose(sorted(seen.uv[:, 0]), [90, 120], atol=0.2)


@pytest.mark.parametrize("value", [0, 128, 255])
def test_no_lights_in_an_even_image(value: int) -> None:
    assert len(LedDetector().detect(frame(np.full((60, 80), value, dtype=np.uint8)))) == 0
    assert len(LedDetector().detect(frame(np.full((1, 1), value, dtype=np.uint8)))) == 0


def patch(
    centre: object, half: tuple[float, float], angle: float, round_: bool = True
) -> np.ndarray:
    cover = coverage((160, 120), centre, half, angle, round_=round_)[..., None]
    return GROUND * (1 - cover) + RED * cover


@pytest.mark.parametrize(("half", "limit_px"), [(4.0, 0.1), (20.0, 0.05)])
def test_coloured_patches(rng: np.random.Generator, half: float, limit_px: float) -> None:
    errors: list[float] = []
    normalised: list[float] = []
    angles: list[float] = []
    for k in range(8):
        centre, angle = np.array([80, 60]) + rng.uniform(0, 1, 2), rng.uniform(-1.5, 1.5)
        image = patch(centre, (1.6 * half, half), angle, bool(k % 2))
        seen = BlobDetector("red").detect(frame(to_bytes(image, 3.0, rng)))
        assert seen.labels == ("",)
        e, n = squares(seen, centre[None])
        errors.extend(e)
        normalised.extend(n)
        off = (seen.angle[0] - angle + np.pi / 2) % np.pi - np.pi / 2  # up to half a turn
        angles.append(off / seen.angle_sigma[0])
    assert np.sqrt(np.mean(np.square(errors))) < limit_px
    assert 0.05 < np.mean(normalised) < 4.0
    assert np.mean(np.square(angles)) < 4.0


def test_a_round_patch_has_no_heading(rng: np.random.Generator) -> None:
    seen = BlobDetector("red").detect(frame(to_bytes(patch([80, 60], (15, 15), 0.0), 2.0, rng)))
    assert np.isnan(seen.angle).all()
    assert np.isnan(seen.angle_sigma).all()


def test_the_outline_covers_the_patch(rng: np.random.Generator) -> None:
    image = patch([80, 60], (30, 12), 0.3, round_=False)
    outline = BlobDetector("red").detect(frame(to_bytes(image, 1.0, rng))).outline[0]
    sides = np.hypot(*(outline - np.roll(outline, 1, axis=0)).T)
    assert_allclose(sorted(sides)[::2], [24, 60], rtol=0.05)


def test_hues_by_name_by_number_and_through_zero(rng: np.random.Generator) -> None:
    picture = frame(to_bytes(patch([80, 60], (12, 12), 0.0), 1.0, rng))  # about 3.75 degrees
    for color in ("red", "340-20", "0-10", " Red "):
        assert len(BlobDetector(color).detect(picture)) == 1
    for color in ("blue", "green", "20-340"):
        assert len(BlobDetector(color).detect(picture)) == 0


def test_one_thing_of_a_colour_is_labelled(rng: np.random.Generator) -> None:
    cover = coverage((160, 120), [40, 60], (6, 6)) + coverage((160, 120), [110, 60], (14, 14))
    image = to_bytes(GROUND * (1 - cover[..., None]) + RED * cover[..., None], 1.0, rng)
    assert BlobDetector("red").detect(frame(image)).labels == ("", "")
    single = BlobDetector("red", single=True).detect(frame(image))
    assert single.labels == ("red",)
    assert_allclose(single.uv, [[110, 60]], atol=0.1)


def test_grey_images_have_no_colours() -> None:
    assert len(BlobDetector("red").detect(frame(np.full((60, 80), 128, dtype=np.uint8)))) == 0
    image = np.full((60, 80, 3), 128, dtype=np.uint8)
    assert_array_equal(BlobDetector("red").detect(frame(image)).uv, np.empty((0, 2)))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BlobDetector("puce"), "color must be one of red, orange"),
        (lambda: BlobDetector("10-400"), "two hues"),
        (lambda: BlobDetector("red", least_size_px=50, most_size_px=10), "in order"),
        (lambda: BlobDetector("red", least_saturation=2), "least_saturation"),
        (lambda: LedDetector(least_contrast=0), "least_contrast"),
        (lambda: LedDetector(most_size_px=1), "most_size_px"),
        (lambda: LedDetector(most=0), "most must be"),
    ],
)
def test_wrong_options_are_refused(make: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()  # type: ignore[operator]

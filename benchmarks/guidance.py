"""Metres of a calibration drive: planned leg by leg, beside the paper's 8 segments and beside legs to random places.

All drives are tracked and read alike, with the paper's noise (section 3.1: +-5 px, +-10 % of the speed, 0.12 m/s), and
estimated by the same estimator. The paper's 8 segments of 0.6 m are put where only somebody who knows the camera could
put them: in the middle of the image, as large as fits with 100 px to spare. Errors are of ground velocities, over the
image and all headings; medians over the trials. `bound` is the best of many drives of straight legs, by their Fisher
information, over that of the 8 segments: no plan can do better than that.
"""

from __future__ import annotations

import sys

import numpy as np

from airground.calibration.guidance import next_leg
from airground.calibration.guidance_information import leg_information, velocity_weight
from airground.calibration.guidance_types import LegOptions
from airground.calibration.online import OnlineCalibrator
from airground.calibration.online_model import ImageFrame, sighting, unproject
from airground.calibration.online_state import OnlineOptions
from airground.errors import UndeterminedError
from airground.geometry.arrays import FloatArray
from airground.sim.camera import SimCamera
from airground.sim.unicycle import SegmentDrive

SIZE = (1024, 768)
SPEED, HZ, PIXEL, SHARE = 0.12, 10.0, 5.0, 0.1
NOISE = SHARE / np.sqrt(3) / np.sqrt(HZ)
MARGIN = 60.0
METRES = 4.8
OPTIONS = LegOptions(
    sigma_px=PIXEL / np.sqrt(3),
    speed_mps=SPEED,
    sightings_hz=HZ,
    odometry_noise=NOISE,
    speed_scale_sigma=0.0,
)


class Driver:
    """A robot under a camera, and its estimator."""

    def __init__(self, camera: SimCamera, at: FloatArray, rng: np.random.Generator) -> None:
        self.camera, self.at, self.rng = camera, at, rng
        self.t = self.metres = 0.0
        self.calibrator = OnlineCalibrator(
            OnlineOptions(
                sigma_px=PIXEL / np.sqrt(3),
                speed_noise=NOISE,
                heading_noise=NOISE,
                speed_scale_sigma=0.0,
            )
        )

    def drive(self, step: FloatArray) -> None:
        """Drive straight."""
        length = float(np.hypot(*step))
        count = max(2, int(np.ceil(length / SPEED * HZ)))
        for k in range(count + 1):
            t = self.t + length / SPEED * k / count + 1e-4 * (k == 0)
            noise = self.rng.uniform(-SHARE * SPEED, SHARE * SPEED, 2)
            self.calibrator.reading(t, "robot", xy_dot=step / length * SPEED + noise)
            xy = self.at + step * k / count
            if self.camera.visible(xy):
                uv = self.camera.project(xy) + self.rng.uniform(-PIXEL, PIXEL, 2)
                self.calibrator.sighting(t, "robot", uv)
        self.at, self.t, self.metres = self.at + step, self.t + length / SPEED, self.metres + length

    def error(self, places: FloatArray) -> float:
        """Relative error of ground velocities, root mean square over places and headings."""
        found = self.calibrator.calibration()
        if found is None:
            return np.inf
        back = np.linalg.inv(found.model.jacobian(places))
        off = back @ _jacobian(self.camera, places) - np.eye(2)
        return float(np.sqrt(np.mean(np.sum(off**2, axis=(1, 2))) / 2))


def _jacobian(camera: SimCamera, uv: FloatArray) -> FloatArray:
    xy = camera.unproject(uv)
    return np.stack(
        [camera.project_velocity(xy, np.broadcast_to(e, xy.shape)) for e in np.eye(2)], axis=-1
    )


def camera_for(tilt_deg: float, corners: FloatArray) -> tuple[SimCamera, FloatArray]:
    """Give the lowest camera that has the drive in its image, and the shift of the drive into the middle."""
    for height in np.geomspace(1.5, 12.0, 60):
        camera = SimCamera.looking_down(
            focal_length_px=1000.0,
            tilt_rad=np.radians(tilt_deg),
            height_m=float(height),
            image_size_px=SIZE,
            heading_rad=0.4,
        )
        middle = camera.unproject(np.array([511.5, 383.5]))
        shift = middle - (corners.min(axis=0) + corners.max(axis=0)) / 2
        if camera.visible(corners + shift, 100.0).all():
            return camera, shift
    raise RuntimeError("no camera holds the drive")


def places_of(camera: SimCamera) -> FloatArray:
    u, v = np.meshgrid(np.linspace(60, 963, 7), np.linspace(60, 707, 5))
    uv = np.stack([u, v], axis=-1).reshape(-1, 2)
    uv = uv[np.isfinite(camera.unproject(uv)).all(axis=1)]
    scale = np.linalg.svd(_jacobian(camera, uv), compute_uv=False)[:, 1]
    return np.asarray(uv[scale > 0.1 * scale.max()])


def planned(camera: SimCamera, at: FloatArray, rng: np.random.Generator, *, plan: bool) -> Driver:
    """Drive as planned, or, once there is a calibration, to random places in the image."""
    driver = Driver(camera, at, rng)
    script = 0
    while driver.metres < METRES:
        uv = camera.project(driver.at)
        known = driver.calibrator.calibration()
        leg = next_leg(
            driver.calibrator if plan else None,
            uv,
            SIZE,
            margin_px=MARGIN,
            driven=script,
            options=OPTIONS,
        )
        script += leg.end_px is None
        step = np.array(leg.step_m)
        if known is not None and not plan:
            angle, length = rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 1.2)
            step = length * np.array([np.cos(angle), np.sin(angle)])
            if not camera.visible(driver.at + step, MARGIN):
                continue
        left = METRES - driver.metres
        driver.drive(step * min(1.0, max(left, 0.05) / np.hypot(*step)))
    return driver


def bound(camera: SimCamera, corners: FloatArray, rng: np.random.Generator) -> float:
    """Deviation of the best of many drives of straight legs, over that of the 8 segments, by Fisher information."""
    places = places_of(camera)
    image = ImageFrame(np.array([511.5, 383.5]), 1 / 400.0)
    x, D = image.from_pixels(camera.g), image.jacobian()
    weight = (D.T @ velocity_weight(camera.g, places) @ D).mean(axis=0)

    def deviations(start: FloatArray, steps: FloatArray) -> FloatArray:
        told, position = np.zeros((len(steps), 6, 6)), None
        for k in range(steps.shape[1]):
            more, position = leg_information(
                x,
                start,
                steps[:, k],
                sigma=PIXEL / np.sqrt(3) * image.scale,
                spacing_m=SPEED / HZ,
                walk=NOISE * float(np.sqrt(SPEED)),
                position=position,
            )
            told, start = told + more, start + steps[:, k]
        determined = np.linalg.cond(told) < 1e13
        covariance = np.linalg.inv(np.where(determined[:, None, None], told, np.eye(6)))
        sigma = np.sqrt(np.trace(covariance @ weight, axis1=1, axis2=2))
        return np.where(determined, sigma, np.inf)

    base = unproject(x, image.normalised(camera.project(corners[:1])))
    paper = float(deviations(base, np.diff(corners, axis=0)[None])[0])
    best = np.inf
    for legs in (3, 4, 5, 6):
        length = rng.dirichlet(np.full(legs, 4.0), 15_000) * METRES
        angle = rng.uniform(-np.pi, np.pi, length.shape)
        steps = np.stack([length * np.cos(angle), length * np.sin(angle)], axis=-1)
        uv = rng.uniform([MARGIN, MARGIN], np.array(SIZE) - MARGIN, (len(steps), 2))
        start = unproject(x, image.normalised(uv))
        c = sighting(x, (start[:, None] + np.cumsum(steps, axis=1)).reshape(-1, 2))
        ends = (c / image.scale + image.centre).reshape(*steps.shape)
        inside = ((ends >= MARGIN) & (ends <= np.array(SIZE) - MARGIN)).all(axis=(1, 2))
        if inside.any():
            best = min(best, float(deviations(start[inside], steps[inside]).min()))
    return best / paper


def main(trials: int) -> None:
    corners = SegmentDrive().corners
    print(f"errors of ground velocities after {METRES} m, medians of {trials} trials")
    print(f"{'tilt':>5} {'8 segments':>11} {'planned':>9} {'random':>9} {'bound':>7} {'metres':>8}")
    for tilt in (0, 20, 40, 60, 70):
        camera, shift = camera_for(tilt, corners)
        places = places_of(camera)
        errors: dict[str, list[float]] = {"paper": [], "planned": [], "random": []}
        for k in range(trials):
            rng = np.random.default_rng([tilt, k])
            driver = Driver(camera, corners[0] + shift, rng)
            for step in np.diff(corners, axis=0):
                driver.drive(step)
            errors["paper"].append(driver.error(places))
            for name in ("planned", "random"):
                try:
                    driver = planned(camera, corners[0] + shift, rng, plan=name == "planned")
                    errors[name].append(driver.error(places))
                except UndeterminedError:
                    errors[name].append(np.inf)
        paper, plan, random = (float(np.median(errors[n])) for n in ("paper", "planned", "random"))
        best = bound(camera, corners + shift, np.random.default_rng(tilt))
        # By their information, errors fall with the way to the power 2.2; so do the metres for one error.
        print(
            f"{tilt:5} {paper:11.4f} {plan:9.4f} {random:9.4f} {best:7.2f} "
            f"{(plan / paper) ** (1 / 2.2):8.2f} of the 8 segments', {(plan / random) ** (1 / 2.2):.2f} of random legs'"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)

"""Driving by the image beside peers that are given the ground: the same scenes, plant and limits for all, in one run.

Plant: an exact unicycle whose speed and turn rate change no faster than its limits. Rates of 20 Hz, no noise, no
latency: what differs is the law and what it knows.

- ours, true g: image-plane laws (FlatTracker, PointToPoint) with g of the simulated camera.
- ours, drive's g: the same, with g from one calibration drive of 75 s in the same scene (1 px, noisy readings).
- flatsys + lqr: python-control. Paths: its flat system's inputs fed forward, and its lqr about the reference, scheduled
  on speed. Goals: its point_to_point plan with a straight line's end heading, tracked alike. True ground coordinates.
- pure pursuit: look-ahead 0.25 m at 0.3 m/s on the ground, the textbook's. True ground coordinates.

Path rms and worst: distance to the path on the true ground, once it has had 6 s to settle; starts 0.3 m off the path,
at rest, 1 rad off. Late: rms distance from where the trajectory's own clock (30 s a round) wants it; ours may slow it.
Goals: end error, time until it rests within 1 cm and 2 px, overshoot: how far it leaves the goal again after 5 cm.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from math import atan2, cos, hypot, pi, radians, sin, tan
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import calibrate
from airground.control import Floor, Limits, RobotState
from airground.control.drive_laws import steered, wrapped
from airground.control.goals.point_to_point import PointToPoint
from airground.control.trajectories.flat_tracker import FlatTracker
from airground.control.trajectories.trajectory import GroundTrajectory
from airground.geometry import LimitedHomography
from airground.sim import FigureEight, calibration_drive, demo_world
from airground.sim.unicycle import arc

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.control import Controller
    from airground.geometry import FloatArray
    from airground.sim import SimCamera

    Law = Callable[[float, FloatArray, float, float, float], tuple[float, float, bool]]

DT = 0.05
ROUND_S = 30.0
POSES = 200
PLANNED = 40  # of them for flatsys, which takes 0.1 s a plan
LIMITS = Limits()


@dataclass(frozen=True)
class Scene:
    """A camera, and g as one calibration drive under it gives it."""

    camera: SimCamera
    centre: FloatArray
    half: tuple[float, float]
    known: Floor
    driven: Floor


def main() -> None:
    control = _python_control()
    print(f"{'scene':>16} {'law':>16} {'rms cm':>8} {'worst cm':>9} {'late cm':>8}")
    for tilt in (0, 30, 55, 60):
        scene = _scene(tilt)
        for name, curve in (("ellipse", _ellipse), ("eight", _eight)):
            for law, row in _paths(scene, curve, control):
                label = f"{name} {tilt} deg"
                print(f"{label:>16} {law:>16} {row[0]:8.2f} {row[1]:9.2f} {row[2]:8.2f}")
    scene = _scene(55)
    print(
        f"\n{POSES} random poses to random goals, 55 deg ({PLANNED} for flatsys); times of those that arrive"
    )
    print(
        f"{'law':>16} {'lost':>5} {'end cm':>7} {'worst':>6} {'px':>5} "
        f"{'time 50%':>9} {'90%':>6} {'max':>6} {'over cm':>8} {'max':>6}"
    )
    for law, rows in _goals(scene, control):
        lost = int((~rows[:, 4].astype(bool)).sum())
        there = rows[rows[:, 4] > 0]
        end, px, times, over = there[:, 0], there[:, 1], there[:, 2], there[:, 3]
        print(
            f"{law:>16} {lost:5} {np.median(end):7.2f} {end.max():6.2f} {px.max():5.2f} "
            f"{np.median(times):9.1f} {np.quantile(times, 0.9):6.1f} {times.max():6.1f} "
            f"{np.median(over):8.2f} {over.max():6.2f}"
        )
    _ticks(scene)


def _python_control() -> Any:
    try:
        import control.flatsys  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        print("python-control is not installed, its rows are left out: pip install control")
        return None
    return control


def _scene(tilt_deg: float) -> Scene:
    centre = np.array([0.0, 3.0 * tan(radians(tilt_deg))])
    half = (1.4, 0.8)
    eight = FigureEight((float(centre[0]), float(centre[1])), half)
    world = replace(demo_world(), tilt_rad=radians(tilt_deg), path=eight)
    camera, origin = world.camera, world.camera.project(centre)
    drive = calibration_drive(world, np.random.default_rng(1))
    found = calibrate(drive.tracks, drive.motion, distortion="none")
    return Scene(
        camera, centre, half, Floor(LimitedHomography(camera.g), origin), Floor(found.model, origin)
    )


# Paths


def _ellipse(half: tuple[float, float], t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    (a, b), w = half, 2 * pi / ROUND_S
    c, s = cos(w * t), sin(w * t)
    xy = np.array([a * c, b * s])
    return xy, w * np.array([-a * s, b * c]), -w * w * xy


def _eight(half: tuple[float, float], t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    (a, b), w = half, 2 * pi / ROUND_S
    c, s, c2, s2 = cos(w * t), sin(w * t), cos(2 * w * t), sin(2 * w * t)
    return (
        np.array([a * s, b * s2]),
        w * np.array([a * c, 2 * b * c2]),
        w * w * np.array([-a * s, -4 * b * s2]),
    )


def _paths(scene: Scene, curve: Any, control: Any) -> list[tuple[str, list[float]]]:
    fine = np.linspace(0, ROUND_S, 6000)
    path = np.array([curve(scene.half, t)[0] for t in fine]) + scene.centre
    start, w, _ = curve(scene.half, 0.0)
    across = np.array([-w[1], w[0]]) / np.hypot(*w)
    pose = (start + scene.centre + 0.3 * across, atan2(w[1], w[0]) + 1.0)

    # What the operator drew; the floor's origin is the centre.
    wanted = GroundTrajectory(scene.known, lambda t: curve(scene.half, t), period=ROUND_S)
    laws: list[tuple[str, Law]] = [
        (
            "ours, true g",
            _Ours(FlatTracker(scene.known, wanted, LIMITS, response_s=0.0), scene.camera),
        ),
        (
            "ours, drive's g",
            _Ours(FlatTracker(scene.driven, wanted, LIMITS, response_s=0.0), scene.camera),
        ),
    ]
    if control is not None:
        gains = _gains(control)

        def reference(t: float) -> tuple[FloatArray, float, float, float]:
            xy, w, a = curve(scene.half, t)
            v = hypot(*w)
            return xy + scene.centre, atan2(w[1], w[0]), v, (w[0] * a[1] - w[1] * a[0]) / v**2

        laws.append(("flatsys + lqr", _tracked(reference, gains)))
    laws.append(("pure pursuit", _pursuit(path, closed=True)))
    rows = []
    for name, law in laws:
        times, xy = _drive(law, *pose, 66.0)
        settled = times >= 6.0
        gaps = np.array([np.hypot(*(path - p).T).min() for p in xy[settled]])
        want = np.array([curve(scene.half, t)[0] for t in times[settled]]) + scene.centre
        late = np.hypot(*(xy[settled] - want).T)
        rms = [100 * float(np.sqrt(np.mean(x**2))) for x in (gaps, late)]
        rows.append((name, [rms[0], 100 * float(gaps.max()), rms[1]]))
    return rows


# Goals


def _goals(scene: Scene, control: Any) -> list[tuple[str, FloatArray]]:
    rng = np.random.default_rng(1)
    low, high = [-2.0, 2.6], [2.0, 5.6]
    poses = [
        (rng.uniform(low, high), float(rng.uniform(-pi, pi)), rng.uniform(low, high))
        for _ in range(POSES)
    ]
    gains = _gains(control) if control is not None else None
    table: list[tuple[str, list[list[float]]]] = []
    for name in ("ours, true g", "ours, drive's g", "flatsys + lqr", "pure pursuit"):
        if name == "flatsys + lqr" and control is None:
            continue
        rows = []
        for xy, theta, goal in poses[: PLANNED if name == "flatsys + lqr" else POSES]:
            law: Law
            if name.startswith("ours"):
                floor = scene.known if name.endswith("true g") else scene.driven
                points = PointToPoint(
                    floor, scene.camera.project(goal)[None], LIMITS, response_s=0.0
                )
                law = _Ours(points, scene.camera)
            elif name == "pure pursuit":
                law = _pursuit(goal[None], closed=False)
            else:
                law = _tracked(_plan(control, xy, theta, goal), gains)
            times, way = _drive(law, xy, theta, 60.0)
            gap = np.hypot(*(way - goal).T)
            px = float(np.hypot(*(scene.camera.project(way[-1]) - scene.camera.project(goal))))
            near = int(np.argmax(gap < 0.05)) if (gap < 0.05).any() else len(gap) - 1
            over = 100 * max(float(gap[near:].max()) - 0.05, 0.0)
            there = float(gap[-1] <= 0.01 and px <= 2.0)
            rows.append([100 * gap[-1], px, float(times[-1]), over, there])
        table.append((name, rows))
    return [(name, np.array(rows)) for name, rows in table]


# Laws


class _Ours:
    """A controller of ours in the image of the true camera."""

    def __init__(self, controller: Controller, camera: SimCamera) -> None:
        self.controller, self.camera, self.progress = controller, camera, 0.0

    def __call__(
        self, t: float, xy: FloatArray, theta: float, v: float, omega: float
    ) -> tuple[float, float, bool]:
        state = RobotState(t, self.camera.project(xy), theta, v, omega)
        answer = self.controller.step(state, self.progress, DT)
        self.progress = answer.progress
        return answer.command.v, answer.command.omega, answer.done


def _gains(control: Any) -> tuple[FloatArray, FloatArray]:
    """Gains by lqr of the error in the reference's frame (ahead, left, heading), at speeds from 0.02 m/s."""
    speeds = np.linspace(0.02, 0.5, 25)
    table = []
    for v in speeds:
        A = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, v], [0.0, 0.0, 0.0]])
        B = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
        table.append(control.lqr(A, B, np.diag([10.0, 100.0, 1.0]), np.diag([1.0, 1.0]))[0])
    return speeds, np.array(table)


def _tracked(reference: Any, gains: Any) -> Law:
    speeds, table = gains

    def law(
        t: float, xy: FloatArray, theta: float, v: float, omega: float
    ) -> tuple[float, float, bool]:
        want, heading, v_d, omega_d = reference(t + DT / 2)
        middle = xy + v * DT / 2 * np.array([cos(theta), sin(theta)])
        dx, dy = middle - want
        c, s = cos(heading), sin(heading)
        error = [c * dx + s * dy, c * dy - s * dx, wrapped(theta + omega * DT / 2 - heading)]
        K = table[int(np.argmin(np.abs(speeds - abs(v_d))))]
        dv, dw = K @ error
        done = v_d == 0 and abs(v) < 0.01 and abs(omega) < 0.05 and t > 1
        return float(v_d - dv), float(omega_d - dw), done

    return law


def _plan(control: Any, xy: FloatArray, theta: float, goal: FloatArray) -> Any:
    """Flat plan from the pose to the goal at a straight line's heading; slow ends, as it is singular at rest."""
    flat = control.flatsys

    def forward(x: Any, u: Any, _: Any) -> Any:
        c, s = np.cos(x[2]), np.sin(x[2])
        return [np.array([x[0], u[0] * c, -u[0] * u[1] * s]), np.array([x[1], u[0] * s, u[0] * u[1] * c])]  # fmt: skip

    def backward(z: Any, _: Any) -> Any:
        v = np.hypot(z[0][1], z[1][1])
        turn = (z[0][1] * z[1][2] - z[1][1] * z[0][2]) / v**2
        return np.array([z[0][0], z[1][0], np.arctan2(z[1][1], z[0][1])]), np.array([v, turn])

    system = flat.FlatSystem(forward, backward, inputs=2, states=3)
    step = goal - xy
    end = [*goal, atan2(step[1], step[0])]
    span = max(np.hypot(*step) / 0.25, 3.0)
    slow = [0.05, 0.0]
    plan = flat.point_to_point(
        system, span, [*xy, theta], slow, end, slow, basis=flat.PolyFamily(6)
    )

    def reference(t: float) -> tuple[FloatArray, float, float, float]:
        if t >= span:
            return goal, end[2], 0.0, 0.0
        x, u = plan.eval([t])
        return x[:2, 0], float(x[2, 0]), float(u[0, 0]), float(u[1, 0])

    return reference


def _pursuit(path: FloatArray, *, closed: bool, ahead: float = 0.25, speed: float = 0.3) -> Law:
    def law(
        _t: float, xy: FloatArray, theta: float, _v: float, _omega: float
    ) -> tuple[float, float, bool]:
        gaps = np.hypot(*(path - xy).T)
        k = int(np.argmin(gaps))
        target, pace = path[-1], speed
        if closed:
            along = np.roll(gaps, -k)
            far = int(np.argmax(along[: len(path) // 4] >= ahead))
            target = path[(k + far) % len(path)]
        else:
            pace = min(speed, 1.5 * float(gaps[k]))
        dx, dy = target - xy
        left, d = cos(theta) * dy - sin(theta) * dx, hypot(dx, dy)
        done = not closed and d < 0.005
        return (0.0, 0.0, True) if done else (pace, pace * 2 * left / d**2, False)

    return law


def _drive(law: Law, xy: FloatArray, theta: float, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Times and places; all commands go through the same limits."""
    v = omega = 0.0
    times, places = [], []
    for k in range(int(seconds / DT)):
        times.append(k * DT)
        places.append(xy)
        wanted_v, wanted_omega, done = law(k * DT, xy, theta, v, omega)
        if done:
            break
        state = RobotState(k * DT, np.zeros(2), theta, v, omega)
        v, omega = steered(LIMITS, wanted_v, wanted_omega, state, DT)
        xy, theta = xy + arc(theta, v, omega, DT), theta + omega * DT
    return np.array(times), np.array(places)


def _ticks(scene: Scene) -> None:
    """Seconds of one step: the quickest of several hundred, as other work on the machine only adds."""
    goal = scene.camera.project(scene.centre)
    goals = scene.camera.project(scene.centre + np.array([[0.5, 0.0], [0.0, 0.5], [0.0, 0.0]]))
    wanted = GroundTrajectory(scene.known, lambda t: _ellipse(scene.half, t), period=ROUND_S)
    print("\nmicroseconds a step: quickest tenth, median")
    for name, controller in (
        ("goal", PointToPoint(scene.known, goal[None], LIMITS, response_s=0.0)),
        ("three goals", PointToPoint(scene.known, goals, LIMITS, response_s=0.0)),
        (
            "car, heading",
            PointToPoint(scene.known, goal[None], Limits(turn_radius_m=0.4), 1.0, response_s=0.0),
        ),
        ("trajectory", FlatTracker(scene.known, wanted, LIMITS, response_s=0.0)),
    ):
        state = RobotState(0.0, scene.camera.project(scene.centre + [-1.0, 0.3]), 0.4, 0.2, 0.1)
        spent = []
        for _ in range(2000):
            started = time.perf_counter()
            controller.step(state, 0.0, DT)
            spent.append(time.perf_counter() - started)
        print(f"{name:>16} {1e6 * np.quantile(spent, 0.1):7.1f} {1e6 * np.median(spent):7.1f}")


if __name__ == "__main__":
    main()

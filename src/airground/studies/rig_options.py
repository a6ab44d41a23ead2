"""How a simulated closed loop is set up: delays and noise, and the robot's options for a world of any size."""

from __future__ import annotations

from dataclasses import dataclass, field

from airground.control import Limits
from airground.control.estimation.options import StateOptions
from airground.control.safety.bounds import SafetyBounds
from airground.sim.vehicle_odometry import OdometryNoise
from airground.sim.vehicle_options import PlantOptions

__all__ = [
    "LAG_S",
    "USUAL_MPS",
    "RigOptions",
    "limits_for",
    "plant_options",
    "safety_bounds",
    "state_options",
]

LAG_S = 0.15
"""What controllers are told of how slowly the robot's speed follows its commands [s]; in truth 0.12."""

USUAL_MPS = 0.3  # the speed that the defaults of limits and noise are meant for


def limits_for(speed_mps: float) -> Limits:
    """Limits of a robot that drives at a speed: the defaults, for one that is larger or smaller.

    Parameters
    ----------
    speed_mps : float [m/s]
        To be held.

    Returns
    -------
    limits : Limits
        Accelerations grow with the speed: it is reached within the same time.
    """
    usual, scale = Limits(), speed_mps / USUAL_MPS
    return Limits(
        speed_mps=speed_mps,
        reverse_mps=0.5 * speed_mps,
        acceleration_mps2=usual.acceleration_mps2 * scale,
        deceleration_mps2=usual.deceleration_mps2 * scale,
        lateral_acceleration_mps2=usual.lateral_acceleration_mps2 * scale,
    )


@dataclass(frozen=True, slots=True)
class RigOptions:
    """How late, how often and how well."""

    latency_s: float = 0.1
    """From a picture's exposure to the arrival of what was seen in it [s]."""

    actuation_s: float = 0.05
    """From a command's sending to its effect [s]."""

    camera_hz: float = 20.0
    """Pictures per second."""

    control_hz: float = 40.0
    """Commands per second."""

    sigma_px: float = 0.3
    """Noise of sightings, where nothing is rendered [px]."""

    odometry: OdometryNoise = field(default_factory=OdometryNoise)
    """Noise of the robot's own readings."""

    images: bool = False
    """Whether pictures are rendered, and the robot's tag is found in them."""

    wheels: float = 1.0
    """Size of the robot's wheels over what it takes them for: it drives so much faster than it is told and than it
    reads."""

    hold_speed: bool = True
    """Whether the pilot finds that out and allows for it."""

    predict: bool = True
    """Whether the pilot allows for what is late; without, it takes what it saw last for now."""


def plant_options(options: RigOptions, scale: float) -> PlantOptions:
    """The simulated robot: late, lagging and slipping a little.

    Parameters
    ----------
    options : RigOptions
        How late it is.
    scale : float
        Its speed over the usual one.

    Returns
    -------
    options : PlantOptions
        Of a differential drive.
    """
    usual = PlantOptions()
    return PlantOptions(
        latency_s=options.actuation_s,
        speed_scale=options.wheels,
        speed_mps=usual.speed_mps * scale,
        reverse_mps=usual.reverse_mps * scale,
        acceleration_mps2=usual.acceleration_mps2 * scale,
        track_width_m=usual.track_width_m * scale,
        slip=0.02,
        turn_slip=0.02,
    )


def state_options(options: RigOptions, scale: float, time_offset_s: float) -> StateOptions:
    """What the pilot's filter takes the robot and its sensors for.

    Parameters
    ----------
    options : RigOptions
        How late things are.
    scale : float
        The robot's speed over the usual one.
    time_offset_s : float [s]
        What the robot's clock is taken to be ahead of the camera's.

    Returns
    -------
    options : StateOptions
        Lags are those of `plant_options`, a little off.
    """
    usual = StateOptions()
    return StateOptions(
        actuation_delay_s=options.actuation_s if options.predict else 0.0,
        speed_lag_s=0.12,
        turn_lag_s=0.1,
        time_offset_s=time_offset_s,
        sighting_sigma_px=max(options.sigma_px, 0.05),
        heading_sigma_rad=0.02,
        heading_bias_sigma_rad=0.03,
        speed_sigma_mps=usual.speed_sigma_mps * scale,
        speed_stray_mps=usual.speed_stray_mps * scale,
        free_speed_mps=usual.free_speed_mps * scale,
        path_walk_m=usual.path_walk_m * scale,
        fastest_mps=usual.fastest_mps * scale,
        lost_m=usual.lost_m * scale,
    )


def safety_bounds(scale: float) -> SafetyBounds:
    """When the robot stops: the defaults, for one that is larger or smaller.

    Parameters
    ----------
    scale : float
        Its speed over the usual one.

    Returns
    -------
    bounds : SafetyBounds
        Lengths and speeds grow with it.
    """
    usual = SafetyBounds()
    return SafetyBounds(
        jump_m=usual.jump_m * scale,
        position_sigma_m=usual.position_sigma_m * scale,
        speed_error_mps=usual.speed_error_mps * scale,
    )

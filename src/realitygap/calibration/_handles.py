"""The parameters of motion and of contact, taken from what is thought possible of a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from realitygap.world import RobotModel

from ._prior import Parameter, numbers_of, scribbler_prior
from ._simulate import Floats

MOTION = (
    "drive.gain", "drive.asymmetry", "drive.track", "drive.axle", "drive.lag", "drive.delay", "drive.slip",
    "drive.drift_per_m", "drive.battery_sag", "drive.soft_dead_band",
)  # fmt: skip
"""Numbers that determine the mean of a motion, smoothly."""

MOTION_NOISE = (
    "drive.delay_jitter", "drive.travel_noise_per_m", "drive.heading_noise_per_m", "drive.heading_noise_per_s",
)  # fmt: skip
"""Numbers that determine the scatter of motions."""

CONTACT = ("contact.friction", "contact.lat", "contact.ang", "contact.saturation")
"""Numbers that determine the contact with walls. `contact.long` is 1, because only ratios count."""

BELOW_ONE = 1.0 - 1e-12  # distributions are asked for places below 1
Known = Mapping[str, Parameter]


def parameters_of(robot: RobotModel, prior: Sequence[Parameter] | None = None) -> dict[str, Parameter]:
    """Return the prior of each parameter by name. Default: that of a Scribbler."""
    return {parameter.name: parameter for parameter in prior or scribbler_prior(robot)}


def values_at(parameters: Sequence[Parameter], places: Floats) -> dict[str, Floats]:
    """Return the values of each parameter, (m,), at places (m, p) between the ends of its prior, 0 to 1, uniformly."""
    return {
        parameter.name: parameter.prior.of(np.clip(place, 0.0, BELOW_ONE))
        for parameter, place in zip(parameters, places.T, strict=True)
    }


def place_of(parameter: Parameter, value: float) -> float:
    """Return the position of a value between the ends of the prior, 0..1, limited to the ends."""
    low, high = parameter.prior.lowest, parameter.prior.highest
    inside = min(max(value, low), high)
    return float((parameter.scale(inside) - parameter.scale(low)) / parameter.width)


def own_values(robot: RobotModel) -> dict[str, float]:
    """Return values of the parameters with the robot's own numbers."""
    now = robot.centers()
    left, right = now["drive.gain_left"], now["drive.gain_right"]
    return {**now, "drive.gain": (left + right) / 2, "drive.asymmetry": left - right}


def robot_numbers(known: Known, robot: RobotModel, values: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the robot's numbers, (m,) each, for parameters (m,)."""
    plain = {name: value for name, value in values.items() if name not in known}
    given = {name: value for name, value in values.items() if name in known}
    return plain | numbers_of([known[name] for name in given], given, robot)

"""What is fitted of a drive and of contact: handles, each of which may stand for several numbers of the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from realitygap.world import RobotModel

from ._simulate import Floats, plain_numbers


@dataclass(frozen=True)
class Handle:
    """A parameter of a fit, thought to lie evenly between two ends.

    Attributes:
        name: Of the parameter.
        low, high: The ends.
        unit: Such as m/s.
    """

    name: str
    low: float
    high: float
    unit: str = ""

    @property
    def width(self) -> float:
        """From one end to the other."""
        return self.high - self.low


MOTION = (
    "drive.gain", "drive.asymmetry", "drive.track", "drive.axle", "drive.lag", "drive.delay", "drive.slip",
    "drive.drift_per_m", "drive.battery_sag",
)  # fmt: skip
"""What decides the mean of a motion, smoothly."""

MOTION_NOISE = (
    "drive.delay_jitter", "drive.travel_noise_per_m", "drive.heading_noise_per_m", "drive.heading_noise_per_s",
)  # fmt: skip
"""What decides how motions scatter."""

CONTACT = ("contact.friction", "contact.lat", "contact.ang")
"""What decides how a robot gives way; `contact.long` is 1: only ratios count."""


def handles_of(
    robot: RobotModel, prior: Mapping[str, tuple[float, float]] | None = None
) -> dict[str, Handle]:
    """What is thought possible of each parameter of motion and contact before anything is observed.

    Args:
        robot: Whose numbers the ranges are laid around.
        prior: Other ends, by name of the parameter.
    """
    now = plain_numbers(robot)
    track, axle, ang = now["drive.track"], now["drive.axle"], now["contact.ang"]
    ranges: dict[str, tuple[float, float, str]] = {
        "drive.gain": (0.5, 1.5, ""),
        "drive.asymmetry": (-0.25, 0.25, ""),
        "drive.track": (0.75 * track, 1.35 * track, "m"),
        "drive.axle": (axle - 0.04, axle + 0.04, "m"),
        "drive.lag": (0.0, 0.5, "s"),
        "drive.delay": (0.0, 0.6, "s"),
        "drive.delay_jitter": (0.0, 0.25, "s"),
        "drive.dead_band": (0.0, 0.3, ""),
        "drive.slip": (0.0, 0.3, ""),
        "drive.drift_per_m": (-0.6, 0.6, "rad/m"),
        "drive.travel_noise_per_m": (0.0, 0.1, "m"),
        "drive.heading_noise_per_m": (0.0, 0.6, "rad"),
        "drive.heading_noise_per_s": (0.0, 0.2, "rad"),
        "drive.battery_sag": (0.0, 0.006, "1/s"),
        "contact.friction": (0.0, 1.0, ""),
        "contact.lat": (0.05, 3.0, ""),
        "contact.ang": (ang / 8, ang * 8, "1/m2"),
    }
    for name, (low, high) in (prior or {}).items():
        if name in ranges:
            ranges[name] = (low, high, ranges[name][2])
    return {name: Handle(name, low, high, unit) for name, (low, high, unit) in ranges.items()}


def numbers_of(robot: RobotModel, values: Mapping[str, Floats]) -> dict[str, Floats]:
    """The robot's numbers that parameters stand for.

    Args:
        robot: Whose.
        values: (m,) of each parameter by name.

    Returns:
        (m,) of each number by dotted name.
    """
    numbers = {name: np.asarray(value, np.float64) for name, value in values.items()}
    gain, asymmetry = numbers.pop("drive.gain", None), numbers.pop("drive.asymmetry", None)
    if gain is None and asymmetry is None:
        return numbers
    now = plain_numbers(robot)
    left, right = now["drive.gain_left"], now["drive.gain_right"]
    middle = np.full_like(asymmetry, (left + right) / 2) if gain is None else gain
    apart = np.full_like(middle, left - right) if asymmetry is None else asymmetry
    return numbers | {
        "drive.gain_left": np.asarray(middle + apart / 2),
        "drive.gain_right": np.asarray(middle - apart / 2),
    }


def values_at(handles: Sequence[Handle], places: Floats) -> dict[str, Floats]:
    """(m,) of each parameter at places (m, p) between its ends, 0..1."""
    return {handle.name: handle.low + places[:, k] * handle.width for k, handle in enumerate(handles)}


def place_of(handle: Handle, value: float) -> float:
    """Where a value lies between the ends, 0..1."""
    return float(np.clip((value - handle.low) / handle.width, 0.0, 1.0))

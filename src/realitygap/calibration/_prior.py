"""The prior of a robot: parameters, each of which may represent several numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from realitygap.world import Distribution, RobotModel

Floats = NDArray[np.float64]

N_CORNERS = 4096
"""Robots at ends of the prior by which ranges of numbers are found."""


@dataclass(frozen=True)
class Effect:
    """The effect of a parameter's value on a number of the robot: replace it, or change it.

    Attributes:
        number: Dotted name of the number.
        how: `is`: v * factor; `times`: the number is multiplied by v; `plus`: v * factor is added.
        factor: Factor in `is` and `plus`.
    """

    number: str
    how: Literal["is", "times", "plus"] = "is"
    factor: float = 1.0


@dataclass(frozen=True)
class Parameter:
    """A parameter of a robot with its prior.

    Attributes:
        name: Such as drive.gain.
        prior: Possible values; a distribution without an atom.
        unit: Such as m.
        expand: Effects on the robot's numbers.
        advice: Data to record if observations do not identify it.
    """

    name: str
    prior: Distribution
    unit: str = ""
    expand: tuple[Effect, ...] = ()
    advice: str = ""

    @property
    def width(self) -> float:
        """Width of the prior on its own scale: logarithmic if ratios are equally likely."""
        return float(self.scale(self.prior.highest) - self.scale(self.prior.lowest))

    def scale(self, values: NDArray[np.floating] | float) -> Floats:
        """Return values on the scale on which the prior is even."""
        log = self.prior.log_uniform is not None
        return np.log(values) if log else np.asarray(values, np.float64)


def standard_of(prior: Sequence[Parameter], values: Mapping[str, Floats]) -> Floats:
    """Return (m, p) values on the scale on which each prior is a standard normal distribution; within 4 of 0."""
    places = [
        (p.scale(np.asarray(values[p.name], np.float64)) - p.scale(p.prior.lowest)) / p.width for p in prior
    ]
    least = scipy.special.ndtr(-4.0)
    return np.asarray(scipy.special.ndtri(np.clip(np.stack(places, axis=1), least, 1 - least)))


def values_of(prior: Sequence[Parameter], standard: Floats) -> dict[str, Floats]:
    """Return (m,) values of each parameter from points (m, p) on that scale."""
    return {
        p.name: p.prior.of(np.minimum(scipy.special.ndtr(z), 1 - 1e-12))
        for p, z in zip(prior, standard.T, strict=True)
    }


def numbers_of(
    prior: Sequence[Parameter], values: Mapping[str, Floats], robot: RobotModel
) -> dict[str, Floats]:
    """Return (m,) each number of the robot that the parameters decide, by dotted name."""
    plain = robot.centers()
    numbers: dict[str, Floats] = {}
    for how in ("is", "times", "plus"):
        for parameter in prior:
            value = np.asarray(values[parameter.name], np.float64)
            for effect in parameter.expand:
                if effect.how == how:
                    before = numbers.get(effect.number, np.full(len(value), plain[effect.number]))
                    numbers[effect.number] = {
                        "is": value * effect.factor,
                        "times": before * value,
                        "plus": before + value * effect.factor,
                    }[how]
    return numbers


def ranges_of(prior: Sequence[Parameter], robot: RobotModel) -> dict[str, tuple[float, float]]:
    """Return least and most of the robot's numbers over the prior."""
    corners = np.random.default_rng(0).choice([-8.0, 8.0], (N_CORNERS, len(prior)))
    numbers = numbers_of(prior, values_of(prior, corners), robot)
    return {name: (float(value.min()), float(value.max())) for name, value in numbers.items()}


def _even(low: float, high: float) -> Distribution:
    return Distribution(uniform=(low, high))


def _ratio(low: float, high: float) -> Distribution:
    return Distribution(log_uniform=(low, high))


DRIVE: tuple[tuple[str, Distribution, str, str], ...] = (
    ("lag", _even(0.0, 0.4), "s", "sudden starts and stops, with --observe encoders or track"),
    ("rise", _even(0.0, 0.5), "s", "wheels that reverse, with --observe encoders or track"),
    ("delay", _even(0.0, 0.6), "s", "sudden starts and stops, with --observe encoders or track"),
    ("delay_jitter", _even(0.0, 0.25), "s", "many sudden turns, with --observe track"),
    ("dead_band", _even(0.0, 0.3), "", "slow straight lines of growing speed"),
    ("soft_dead_band", _even(0.0, 0.2), "", "slow straight lines of growing speed"),
    ("slip", _even(0.0, 0.25), "", "straight lines, with --observe track and encoders: without these it is drive.gain"),
    ("drift_per_m", _even(-0.6, 0.6), "rad/m", "straight lines ahead and back, with --observe track"),
    ("heading_noise_per_m", _ratio(0.004, 0.6), "rad", "straight lines, with --observe track"),
    ("heading_noise_per_s", _ratio(0.001, 0.2), "rad", "turns in place, with --observe track"),
    ("travel_noise_per_m", _ratio(0.001, 0.1), "m", "straight lines, with --observe track"),
    ("battery_sag", _even(0.0, 0.006), "1/s", "long trials of straight lines and turns"),
)  # fmt: skip
"""Numbers of the drive that are parameters themselves; ranges chosen for small robots with cheap motors."""

RANGE: tuple[tuple[str, Distribution, str, str], ...] = (
    ("amplitude", _ratio(0.4, 10.0), "", "readings very near a wall"),
    ("decay", _ratio(0.05, 0.5), "m", "readings at several distances"),
    (
        "drop_most",
        _even(0.0, 1.0),
        "",
        "readings far from a wall, at distances from which light still returns",
    ),
    ("drop_at", _even(0.0, 0.45), "m", "readings at several distances"),
    ("drop_width", _ratio(0.005, 0.1), "m", "readings at several distances"),
    ("incidence", _even(0.0, 4.0), "", "readings near walls that are not faced"),
)
"""Numbers that all range sensors share."""


def scribbler_prior(robot: RobotModel) -> tuple[Parameter, ...]:
    """Return the prior of a robot with two wheels.

    Ranges are wide, and chosen: ratios as likely for sizes, even for what may be nothing at all. A parameter of which
    the robot has no number is left out.

    Args:
        robot: The robot as its file has it.
    """
    plain = robot.centers()
    track, ang = plain["drive.track"], plain["contact.ang"]
    both = ("drive.gain_left", "drive.gain_right")
    prior = [
        Parameter("drive.gain", _ratio(0.5, 1.5), "", tuple(Effect(name) for name in both), "straight lines and turns"),
        Parameter(
            "drive.asymmetry", _even(-0.3, 0.3), "", (Effect(both[0], "plus", 0.5), Effect(both[1], "plus", -0.5)),
            "straight lines ahead and back",
        ),
        Parameter("drive.track", _ratio(0.75 * track, 1.35 * track), "m", (Effect("drive.track"),), "turns in place"),
        Parameter("drive.axle", _even(-0.03, 0.03), "m", (Effect("drive.axle"),), "turns, with --observe track"),
        *_plain("drive", DRIVE, plain),
        Parameter("contact.friction", _even(0.0, 1.0), "", (Effect("contact.friction"),), "walls met at slant angles"),
        Parameter("contact.lat", _ratio(0.05, 5.0), "", (Effect("contact.lat"),), "walls scraped along"),
        Parameter("contact.ang", _ratio(ang / 64, ang * 8), "1/m2", (Effect("contact.ang"),), "walls met head on"),
        Parameter(
            "contact.saturation", _ratio(2.0, 200.0), "s/m", (Effect("contact.saturation"),),
            "walls pressed against with wheels that turn unequally",
        ),
        Parameter("body.length", _even(0.8, 1.2), "", _corners(plain, "x"), "walls met head on"),
        Parameter("body.width", _even(0.8, 1.2), "", _corners(plain, "y"), "walls scraped along"),
    ]  # fmt: skip
    if robot.stall.kind == "idler":
        # Also what loads take from the wheels, which in `sim` turn as commanded.
        prior.append(
            Parameter("stall.share", _even(0.05, 0.8), "", (Effect("stall.share"),), "walls scraped along")
        )
    return tuple(prior) + _of_ranges(robot)


def _plain(
    group: str, rows: Sequence[tuple[str, Distribution, str, str]], numbers: Mapping[str, object]
) -> list[Parameter]:
    return [
        Parameter(f"{group}.{name}", prior, unit, (Effect(f"{group}.{name}"),), advice)
        for name, prior, unit, advice in rows
        if f"{group}.{name}" in numbers
    ]


def _corners(numbers: Mapping[str, float], axis: str) -> tuple[Effect, ...]:
    return tuple(
        Effect(name, "times") for name in numbers if name.startswith("body.") and name.endswith(f".{axis}")
    )


def _of_ranges(robot: RobotModel) -> tuple[Parameter, ...]:
    """Return the parameters of range sensors whose light falls off with the distance."""
    seen = [k for k, sensor in enumerate(robot.range) if sensor.response in ("ir", "pulses")]
    rows = list(RANGE) if seen else []
    counted = [k for k in seen if robot.range[k].response == "pulses"]
    if counted:
        rows.append(("burst", _even(0.0, 1.0), "", "many readings in one place"))
    if len(counted) < len(seen):
        rows.append(("noise_gain", _ratio(0.002, 0.5), "", "many readings in one place"))
        rows.append(("outlier_most", _even(0.0, 1.0), "", "readings far from a wall"))
    return tuple(
        Parameter(f"range.{name}", prior, unit, tuple(Effect(f"range.{k}.{name}") for k in seen), advice)
        for name, prior, unit, advice in rows
    )


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

PRIOR_PRECISION = 12.0
"""Precision of a place that is even in 0..1."""
IDENTIFIED = 0.5
"""A parameter is identified if its interval is narrower than this share of its prior's."""
MAD = 1.4826
"""Factor of a median absolute deviation, to the standard deviation of a normal distribution."""
BELOW_ONE = 1.0 - 1e-12  # distributions are asked for places below 1
Known = Mapping[str, Parameter]


def parameters_of(robot: RobotModel, prior: Sequence[Parameter] | None = None) -> dict[str, Parameter]:
    """Return the prior of each parameter by name. Default: that of a robot with two wheels."""
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

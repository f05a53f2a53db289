"""The prior of a robot: parameters, each of which may represent several numbers."""

from __future__ import annotations

import math
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


def even(low: float, high: float) -> Distribution:
    """Return a prior in which each value is equally likely."""
    return Distribution(uniform=(low, high))


def ratio(low: float, high: float) -> Distribution:
    """Return a prior in which each ratio is equally likely."""
    return Distribution(log_uniform=(low, high))


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

    @property
    def is_ratio(self) -> bool:
        """True if ratios are equally likely, False if differences are."""
        return self.prior.log_uniform is not None

    def scale(self, values: NDArray[np.floating] | float) -> Floats:
        """Return values on the scale on which the prior is even."""
        return np.log(values) if self.is_ratio else np.asarray(values, np.float64)


@dataclass(frozen=True)
class Deviation:
    """A parameter of a robot with a prior around the number in the robot's file.

    A `Parameter` has one prior for all robots: it asks what small robots are like. This one asks how far a robot file
    may be off.

    Attributes:
        name: Name, the same as in a calibration or in a robot's file.
        kind: plus: the prior is around the robot's own number; ratio: that of its logarithm is.
        spread: Scale of the prior: the standard deviation of a normal one, or the scale of a Cauchy one.
        unit: Unit of its values.
        advice: Data to record if it is not identified.
        has_long_tails: True for a Cauchy prior, whose tails release a robot file that is wrong (Gelman et al. 2008).
        floor: Smallest noise; 0 for what is no noise.
        limits: Least and largest value.
        least: The middle of a prior of ratios is at least this.
        usual: A usual value, as a share of the farthest distance if it is in meters; 0 if there is none.
    """

    name: str
    kind: Literal["plus", "ratio"]
    spread: float
    unit: str
    advice: str = ""
    has_long_tails: bool = False
    floor: float = 0.0
    limits: tuple[float, float] = (-np.inf, np.inf)
    least: float = 0.0
    usual: float = 0.0

    @property
    def is_noise(self) -> bool:
        """True for noise, which is never below its floor."""
        return self.floor > 0.0

    @property
    def is_size(self) -> bool:
        """True for a number that is added to and never below 0."""
        return self.kind == "plus" and self.limits[0] == 0.0

    def at(self, own: float, standard: Floats) -> Floats:
        """Return values at points of the standard scale, without regard to limits."""
        if self.kind == "ratio":
            return np.asarray(np.hypot(self.floor, own * np.exp(self.spread * standard)))
        return np.asarray(own + self.spread * standard)

    def limited(self, own: float, standard: float) -> float:
        """Return the value at a point of the standard scale, within limits."""
        is_ratio = self.kind == "ratio"
        value = own * math.exp(self.spread * standard) if is_ratio else own + self.spread * standard
        return min(max(value, self.limits[0]), self.limits[1])

    def log_prior(self, standard: Floats) -> Floats:
        """Return log densities at points of the standard scale, less a constant."""
        return np.asarray(-np.log1p(standard**2) if self.has_long_tails else -0.5 * standard**2)

    @property
    def search(self) -> tuple[float, float]:
        """Ends of a search on the standard scale, which keep numbers finite."""
        far = 50.0 if self.has_long_tails else 4.0
        return -far, far

    @property
    def most(self) -> float:
        """The 95 % quantile of the prior on the standard scale."""
        return 6.314 if self.has_long_tails else 1.645


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


DRIVE: tuple[tuple[str, Distribution, str, str], ...] = (
    ("lag", even(0.0, 0.4), "s", "sudden starts and stops, with --observe encoders or track"),
    ("rise", even(0.0, 0.5), "s", "wheels that reverse, with --observe encoders or track"),
    ("delay", even(0.0, 0.6), "s", "sudden starts and stops, with --observe encoders or track"),
    ("delay_jitter", even(0.0, 0.25), "s", "many sudden turns, with --observe track"),
    ("dead_band", even(0.0, 0.3), "", "slow straight lines of growing speed"),
    ("soft_dead_band", even(0.0, 0.2), "", "slow straight lines of growing speed"),
    ("slip", even(0.0, 0.25), "", "straight lines, with --observe track and encoders: without these it is drive.gain"),
    ("drift_per_m", even(-0.6, 0.6), "rad/m", "straight lines ahead and back, with --observe track"),
    ("heading_noise_per_m", ratio(0.004, 0.6), "rad", "straight lines, with --observe track"),
    ("heading_noise_per_s", ratio(0.001, 0.2), "rad", "turns in place, with --observe track"),
    ("travel_noise_per_m", ratio(0.001, 0.1), "m", "straight lines, with --observe track"),
    ("battery_sag", even(0.0, 0.006), "1/s", "long trials of straight lines and turns"),
)  # fmt: skip
"""Numbers of the drive that are parameters themselves; ranges chosen for small robots with cheap motors."""

RANGE: tuple[tuple[str, Distribution, str, str], ...] = (
    ("amplitude", ratio(0.4, 10.0), "", "readings very near a wall"),
    ("decay", ratio(0.05, 0.5), "m", "readings at several distances"),
    (
        "drop_most",
        even(0.0, 1.0),
        "",
        "readings far from a wall, at distances from which light still returns",
    ),
    ("drop_at", even(0.0, 0.45), "m", "readings at several distances"),
    ("drop_width", ratio(0.005, 0.1), "m", "readings at several distances"),
    ("incidence", even(0.0, 4.0), "", "readings near walls that are not faced"),
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
        Parameter("drive.gain", ratio(0.5, 1.5), "", tuple(Effect(name) for name in both), "straight lines and turns"),
        Parameter(
            "drive.asymmetry", even(-0.3, 0.3), "", (Effect(both[0], "plus", 0.5), Effect(both[1], "plus", -0.5)),
            "straight lines ahead and back",
        ),
        Parameter("drive.track", ratio(0.75 * track, 1.35 * track), "m", (Effect("drive.track"),), "turns in place"),
        Parameter("drive.axle", even(-0.03, 0.03), "m", (Effect("drive.axle"),), "turns, with --observe track"),
        *_plain("drive", DRIVE, plain),
        Parameter("contact.friction", even(0.0, 1.0), "", (Effect("contact.friction"),), "walls met at slant angles"),
        Parameter("contact.lat", ratio(0.05, 5.0), "", (Effect("contact.lat"),), "walls scraped along"),
        Parameter("contact.ang", ratio(ang / 64, ang * 8), "1/m2", (Effect("contact.ang"),), "walls met head on"),
        Parameter(
            "contact.saturation", ratio(2.0, 200.0), "s/m", (Effect("contact.saturation"),),
            "walls pressed against with wheels that turn unequally",
        ),
        Parameter("body.length", even(0.8, 1.2), "", _corners(plain, "x"), "walls met head on"),
        Parameter("body.width", even(0.8, 1.2), "", _corners(plain, "y"), "walls scraped along"),
    ]  # fmt: skip
    if robot.stall.kind == "idler":
        # Also what loads take from the wheels, which in `sim` turn as commanded.
        prior.append(
            Parameter("stall.share", even(0.05, 0.8), "", (Effect("stall.share"),), "walls scraped along")
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
        rows.append(("burst", even(0.0, 1.0), "", "many readings in one place"))
    if len(counted) < len(seen):
        rows.append(("noise_gain", ratio(0.002, 0.5), "", "many readings in one place"))
        rows.append(("outlier_most", even(0.0, 1.0), "", "readings far from a wall"))
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
ENDS = (0.05, 0.95)
"""Quantiles at the ends of a 90 % interval."""
MAD = 1.4826
"""Factor of a median absolute deviation, to the standard deviation of a normal distribution."""
OFF_ENDS = (0.002, 0.998)
"""Places from which a fit begins are at least this far from the ends."""
BELOW_ONE = 1.0 - 1e-12  # distributions are asked for places below 1
Known = Mapping[str, Parameter]


def is_identified(width: float, prior_width: float, most: float = IDENTIFIED) -> bool:
    """Return whether observations identify a parameter: whether they leave less than half of its prior's width.

    Args:
        width: Width of its 90 % interval, or standard deviation of its draws, on the scale of its prior.
        prior_width: The same of its prior.
        most: Another share than half. Only the fit of infrared sensors has one, a third: the published shares of
            identified parameters that are near the truth were measured with it.
    """
    return bool(width < most * prior_width)


def parameters_of(robot: RobotModel, prior: Sequence[Parameter] | None = None) -> dict[str, Parameter]:
    """Return the prior of each parameter by name. Default: that of a robot with two wheels."""
    return {parameter.name: parameter for parameter in prior or scribbler_prior(robot)}


def values_at(parameters: Sequence[Parameter], places: Floats) -> dict[str, Floats]:
    """Return the values of each parameter, (m,), at places (m, p) between the ends of its prior, 0 to 1, uniformly."""
    return {
        parameter.name: parameter.prior.of(np.clip(place, 0.0, BELOW_ONE))
        for parameter, place in zip(parameters, places.T, strict=True)
    }


def place_of(parameter: Parameter, values: Floats | float) -> Floats:
    """Return the positions of values between the ends of the prior, 0..1, limited to the ends."""
    low, high = parameter.prior.lowest, parameter.prior.highest
    inside = np.clip(values, low, high)
    return np.asarray((parameter.scale(inside) - parameter.scale(low)) / parameter.width)


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

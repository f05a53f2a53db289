"""The parameters of a fit to a log, with their priors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from realitygap.world import RobotModel

from ._log_model import MotionLog
from ._simulate import Floats


@dataclass(frozen=True)
class LogParameter:
    """A parameter of a log with its prior.

    Attributes:
        name: Name, the same as in a calibration.
        kind: plus: the prior is around the robot's own number; ratio: that of its logarithm is; size: as plus, for a
            number of at least 0; noise: as ratio, but never below a floor.
        spread: Scale of the prior: a Cauchy distribution, whose tails release a robot file that is wrong (Gelman et
            al. 2008); of noise the standard deviation of a normal one.
        unit: Unit of its values.
        advice: Data to record if it is not identified.
        floor: Smallest noise.
    """

    name: str
    kind: Literal["plus", "ratio", "size", "noise"]
    spread: float
    unit: str
    advice: str = ""
    floor: float = 0.0

    def log_prior(self, standard: Floats) -> Floats:
        """Return log densities at points of the standard scale, less a constant."""
        return np.asarray(-0.5 * standard**2 if self.kind == "noise" else -np.log1p(standard**2))

    @property
    def search(self) -> tuple[float, float]:
        """Ends of a search on the standard scale, which keep numbers finite."""
        far = MOST_NOISE if self.kind == "noise" else FAR
        return -far, far

    @property
    def most(self) -> float:
        """The 95 % quantile of the prior on the standard scale."""
        return 1.645 if self.kind == "noise" else 6.314

    def of(self, own: float, standard: Floats) -> Floats:
        """Return values at points of the standard scale."""
        if self.kind in ("ratio", "noise"):
            return np.asarray(np.hypot(self.floor, own * np.exp(self.spread * standard)))
        return np.asarray(own + self.spread * standard)


DRIVE = (
    LogParameter("drive.gain", "ratio", 0.02, "", "Drive straight, at several speeds."),
    LogParameter("drive.asymmetry", "plus", 0.01, "", "Drive straight, ahead and back."),
    LogParameter("drive.track", "ratio", 0.02, "m", "Turn in place, in both directions, with poses."),
    LogParameter("drive.axle", "plus", 0.004, "m", "Turn in place, in both directions, with poses."),
    LogParameter("drive.soft_dead_band", "size", 0.02, "", "Drive at slow and at fast commands."),
    LogParameter("drive.lag", "size", 0.02, "s", "Start and stop suddenly, and often."),
)
"""Numbers of the drive. The spreads are chosen so that nine of ten small robots whose file has a wrong number are
within the prior's 90 % interval."""

ENCODER = (
    LogParameter("encoder.gain", "ratio", 0.01, "", "Drive straight, with poses."),
    LogParameter("encoder.asymmetry", "plus", 0.005, "", "Drive straight, ahead and back, with poses."),
)
"""Distance that encoders report for each meter of a wheel, and its difference between left and right."""

CAMERA = (
    LogParameter("camera.delay", "plus", 0.05, "s", "Start and stop suddenly, and often."),
    LogParameter("camera.left", "plus", 0.005, "m", "Turn in place, in both directions, with poses."),
    LogParameter("camera.heading", "plus", 0.02, "rad", "Drive straight, with headings."),
)
"""Time by which the poses' clock is behind that of the commands, or of the encoders if there are none; position of the
observed point to the left of the axle's middle; heading that is seen if the robot's is 0."""

OWN_NOISE = (
    LogParameter("drive.travel_noise_per_m", "noise", 1.0, "m", "Record poses for longer.", floor=5e-4),
    LogParameter("drive.heading_noise_per_m", "noise", 1.0, "rad", "Record poses for longer.", floor=1e-3),
)
SEEN_NOISE = (
    LogParameter("place", "noise", 1.0, "m", floor=1e-4),
    LogParameter("angle", "noise", 1.0, "rad", floor=5e-4),
    LogParameter("wheel", "noise", 1.0, "m", floor=1e-5),
    LogParameter("wheel_per_m", "noise", 1.0, "m", floor=1e-4),
)
TYPICAL = {"place": 0.003, "angle": 0.01, "wheel": 0.0005, "wheel_per_m": 0.003}
"""Typical errors of a camera and of encoders [m, rad, m, m]."""

FAR, MOST_NOISE = 50.0, 4.0
"""Ends of a search on the standard scale, which keep numbers finite."""

LEAST_NOISE = 0.002
"""Noise of the drive that a fit begins from, if the robot's file has less."""


@dataclass(frozen=True)
class LogNumbers:
    """The parameters of a fit, and all numbers that its model needs.

    Attributes:
        own: Values that the fit starts from, by name.
        free: Parameters of the robot that are fitted, those of noise last.
        camera: Parameters of each camera, the delay first.
    """

    own: Mapping[str, float]
    free: tuple[LogParameter, ...]
    camera: tuple[LogParameter, ...]

    @classmethod
    def of(cls, robot: RobotModel, logs: tuple[MotionLog, ...]) -> LogNumbers:
        """Return the parameters that logs of a robot can show."""
        now = robot.centers()
        own = {name: value for name, value in now.items() if name.startswith(("drive.", "encoder."))}
        for part in ("drive", "encoder"):
            left, right = (own.setdefault(f"{part}.gain_{side}", 1.0) for side in ("left", "right"))
            own |= {f"{part}.gain": (left + right) / 2, f"{part}.asymmetry": left - right}
        own |= dict.fromkeys(("camera.left", "camera.heading", "camera.delay"), 0.0) | TYPICAL
        own |= {noise.name: max(own[noise.name], LEAST_NOISE) for noise in OWN_NOISE}
        poses, commands, wheels, heading = (
            any(log.sees_poses for log in logs),
            any(log.has_commands for log in logs),
            any(log.sees_wheels for log in logs),
            any(log.sees_heading for log in logs),
        )
        by_poses = ("drive.track", "drive.axle")
        free = [parameter for parameter in DRIVE if (poses if parameter.name in by_poses else commands)]
        if poses:
            free += ENCODER if wheels or not commands else ()
            free += [*OWN_NOISE, *SEEN_NOISE[: 2 if heading else 1]]
        if wheels:
            free += SEEN_NOISE[2:]
        return cls(own, tuple(free), CAMERA[: 0 if not poses else 3 if heading else 2])

    def least(self, parameter: LogParameter) -> float:
        """Return the end below which a parameter has no meaning, on the standard scale."""
        return -self.own[parameter.name] / parameter.spread if parameter.kind == "size" else -np.inf

    @property
    def n_steady(self) -> int:
        """Number of the parameters that are no noise."""
        return sum(parameter.kind != "noise" for parameter in self.free)

    def values(self, standard: Floats) -> dict[str, Floats]:
        """Return (m,) of everything at (m, p + c) points on the standard scales: the robot's, then one camera's."""
        values = {name: np.full(len(standard), value) for name, value in self.own.items()}
        for k, parameter in enumerate((*self.free, *self.camera)):
            values[parameter.name] = parameter.of(self.own[parameter.name], standard[:, k])
        for part in ("drive", "encoder"):
            gain, apart = values[f"{part}.gain"], values[f"{part}.asymmetry"]
            values[f"{part}.gain_left"], values[f"{part}.gain_right"] = gain + apart / 2, gain - apart / 2
        return values

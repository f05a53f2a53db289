"""The parameters of a fit to a log, with their priors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from realitygap.world import RobotModel

from ._log_model import MotionLog
from ._prior import Deviation
from ._simulate import Floats

SIZE = (0.0, np.inf)
"""Limits of a number that has no sign."""

_near = partial(Deviation, has_long_tails=True)

DRIVE = (
    _near("drive.gain", "ratio", 0.02, "", "Drive straight, at several speeds."),
    _near("drive.asymmetry", "plus", 0.01, "", "Drive straight, ahead and back."),
    _near("drive.track", "ratio", 0.02, "m", "Turn in place, in both directions, with poses."),
    _near("drive.axle", "plus", 0.004, "m", "Turn in place, in both directions, with poses."),
    _near("drive.soft_dead_band", "plus", 0.02, "", "Drive at slow and at fast commands.", limits=SIZE),
    _near("drive.lag", "plus", 0.02, "s", "Start and stop suddenly, and often.", limits=SIZE),
)
"""Numbers of the drive. The spreads are chosen so that nine of ten small robots whose file has a wrong number are
within the prior's 90 % interval."""

ENCODER = (
    _near("encoder.gain", "ratio", 0.01, "", "Drive straight, with poses."),
    _near("encoder.asymmetry", "plus", 0.005, "", "Drive straight, ahead and back, with poses."),
)
"""Distance that encoders report for each meter of a wheel, and its difference between left and right."""

CAMERA = (
    _near("camera.delay", "plus", 0.05, "s", "Start and stop suddenly, and often."),
    _near("camera.left", "plus", 0.005, "m", "Turn in place, in both directions, with poses."),
    _near("camera.heading", "plus", 0.02, "rad", "Drive straight, with headings."),
)
"""Time by which the poses' clock is behind that of the commands, or of the encoders if there are none; position of the
observed point to the left of the axle's middle; heading that is seen if the robot's is 0."""

OWN_NOISE = (
    Deviation("drive.travel_noise_per_m", "ratio", 1.0, "m", "Record poses for longer.", floor=5e-4),
    Deviation("drive.heading_noise_per_m", "ratio", 1.0, "rad", "Record poses for longer.", floor=1e-3),
)
SEEN_NOISE = (
    Deviation("place", "ratio", 1.0, "m", floor=1e-4),
    Deviation("angle", "ratio", 1.0, "rad", floor=5e-4),
    Deviation("wheel", "ratio", 1.0, "m", floor=1e-5),
    Deviation("wheel_per_m", "ratio", 1.0, "m", floor=1e-4),
)
TYPICAL = {"place": 0.003, "angle": 0.01, "wheel": 0.0005, "wheel_per_m": 0.003}
"""Typical errors of a camera and of encoders [m, rad, m, m]."""

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
    free: tuple[Deviation, ...]
    camera: tuple[Deviation, ...]

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

    def least(self, parameter: Deviation) -> float:
        """Return the end below which a parameter has no meaning, on the standard scale."""
        return -self.own[parameter.name] / parameter.spread if parameter.is_size else -np.inf

    @property
    def n_steady(self) -> int:
        """Number of the parameters that are no noise."""
        return sum(not parameter.is_noise for parameter in self.free)

    def values(self, standard: Floats) -> dict[str, Floats]:
        """Return (m,) of everything at (m, p + c) points on the standard scales: the robot's, then one camera's."""
        values = {name: np.full(len(standard), value) for name, value in self.own.items()}
        for k, parameter in enumerate((*self.free, *self.camera)):
            values[parameter.name] = parameter.at(self.own[parameter.name], standard[:, k])
        for part in ("drive", "encoder"):
            gain, apart = values[f"{part}.gain"], values[f"{part}.asymmetry"]
            values[f"{part}.gain_left"], values[f"{part}.gain_right"] = gain + apart / 2, gain - apart / 2
        return values

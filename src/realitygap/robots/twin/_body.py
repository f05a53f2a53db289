"""A twin as the body of an emulated robot: the emulator's firmware tells its wheels, and reads its sensors."""

from __future__ import annotations

import hashlib
import math
from collections import deque

import numpy as np

from realitygap.world import Arena, Pose

from ._ir import IrSensors
from ._model import DELAYS, TwinModel, numbers_for
from ._motors import NOMINAL, Servo
from ._physics import Floats, Physics
from ._robot import FULL_SCALE
from ._senses import Encoders, Idler
from ._shape import STEP_S

EMITTERS = ("left", "center", "right")
JITTER_STEPS = 100  # time until the next delay is drawn: half a second
AT_REST = 1e-4  # speed of a wheel that has come to rest [m/s]


class TwinBody:
    """A twin that the emulator moves, in a frame of the robot: the end without the caster is ahead.

    It has the interface of a simulated robot behind an emulator, and the optional parts of a body: infrared, battery,
    noise. The firmware sets the steps of speed, so `motors.stepped` and `step_s` have no effect.

    Args:
        model: The twin.
        arena: Arena of the robot.

    Attributes:
        identity: Identity, equal for the same twin.
        pose: Pose of the pen; the heading is that of the end without the caster.
        stalled: True if the caster rolls too little for the turns of the wheels.
        rolls: True if it still moves, or will, without a command of the firmware.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        ValueError: The twin's engine is sim, which has no separate body.
    """

    def __init__(self, model: TwinModel, arena: Arena) -> None:
        if model.engine != "mujoco":
            raise ValueError(
                f"twin {model.name!r} has engine {model.engine!r}, expected 'mujoco': `sim` moves a command at a time, "
                "and cannot stand behind the emulator"
            )
        self.model = model
        self.identity = f"twin {model.name} {hashlib.sha256(model.to_toml().encode()).hexdigest()[:16]}"
        self._physics = Physics(model, arena)
        self._number = 0
        self.place(arena.start)

    def restart(self, seed: int) -> None:
        """Take other random numbers from the next `place` on."""
        self._number = seed

    def place(self, pose: Pose) -> None:
        """Place the twin at a pose, at rest; its battery is as at the start, and its noise restarts."""
        model, number = self.model, self._number
        ours = Pose(pose.x, pose.y, pose.heading + math.pi)
        self._physics.place(ours)
        self._here = ours
        self.pose = Pose(*map(float, pose))
        self._servo = Servo(model, number)
        self._ir = IrSensors(model, number)
        self._idler = Idler(model, ours)
        self._encoders = Encoders(model, number)
        self._delays = numbers_for(model.seed, number, DELAYS)
        self._late: deque[tuple[float, float]] = deque()
        self._late_steps = 0
        self._heard = (0.0, 0.0)
        self._steps = 0
        self._turned = (0.0, 0.0)
        self._looks, self._asked = 0, set(EMITTERS)
        self._counts = np.zeros(1)
        self.rolls = self.stalled = False

    def advance(self, left: float, right: float, seconds: float) -> tuple[float, float]:
        """Move on for a short time with the firmware asking for wheels at `left` and `right` [m/s].

        Returns:
            The distance of each wheel as measured by its encoder [m].
        """
        for _ in range(max(1, round(seconds / STEP_S))):
            turned = self._step(-right / NOMINAL, -left / NOMINAL)
        return -turned[1], -turned[0]

    def _step(self, left: float, right: float) -> tuple[float, float]:
        heard = self._after_delay(left, right)
        physics = self._physics
        physics.move(*self._servo.follow(*heard, self._here, STEP_S), 1)
        here, ways, before = physics.pose, physics.wheels, self._turned
        turned = ways[0] - before[0], ways[1] - before[1]
        self._here, self._turned = here, ways
        self._idler.watch(here, *turned, STEP_S)
        self.stalled = self._idler.stalled
        self._follow_heading(here)
        speeds = physics.wheel_speeds
        self.rolls = any(heard) or max(map(abs, speeds)) > AT_REST or any(map(any, self._late))
        return self._encoders.turn(*turned)

    def _follow_heading(self, here: Pose) -> None:
        """Update the robot's pose; its heading continues without a jump."""
        was = self.pose.heading
        turned = (here.heading - math.pi - was + math.pi) % math.tau - math.pi
        self.pose = Pose(here.x, here.y, was + turned)

    def _after_delay(self, left: float, right: float) -> tuple[float, float]:
        """Return the speeds that reach the wheels now, after the delay."""
        motors = self.model.motors
        if self._steps % JITTER_STEPS == 0:
            late = motors.delay + motors.delay_jitter * float(self._delays.uniform(-1.0, 1.0))
            self._late_steps = max(0, round(late / STEP_S))
        self._steps += 1
        self._late.append((left, right))
        while len(self._late) > self._late_steps + 1:
            self._late.popleft()
        if len(self._late) > self._late_steps:  # else the delay has just grown, and wheels go on as they do
            self._heard = self._late[0]
        return self._heard

    def obstacle(self, emitter: str, stronger: float) -> int:
        """Return the reading of the Fluke's infrared sensor, 0 (free) to 6400 (near).

        Args:
            emitter: "left", "center" or "right".
            stronger: Ratio of the light's reach to its reach at the usual power.
        """
        which = min(EMITTERS.index(emitter), len(self.model.ir.mount) - 1)
        if emitter in self._asked:
            self._asked = set()
            self._looks += 1
            self._counts = self._ir.readings(self._physics, self._servo.volts, self._looks - 1, stronger)
        self._asked.add(emitter)
        return round(FULL_SCALE * float(self._counts[which]))

    def volts(self, load: float) -> float:
        """Return the battery's voltage [V] with the motors at a load of 0 to 1."""
        return self._servo.volts_at(load)

    def ranges(self, mounts: Floats, reach: float) -> Floats:
        """Return distances to walls and obstacles [m], from mounts in the robot's frame."""
        return np.array(
            [
                self._physics.look(-x, -y, np.array([direction + math.pi]), reach)[0][0]
                for x, y, direction in mounts
            ]
        )

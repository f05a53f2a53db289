"""The readings of the Scribbler's and the Fluke's sensors at the robot's pose, with noise.

Mounts are forward, left [m] and direction [rad] in the Scribbler's frame; the Fluke looks to the other end. A comment
marks each number without a source.
"""

from __future__ import annotations

import math
import random

import numpy as np

from realitygap.world import BARE_FLOOR

from ._scene import Scene
from ._simulated import RobotOfItsOwn, SimulatedRobot

IR_REACH = 0.15  # of the robot's own IR at the usual threshold of 20 [m]: sources say 4 to 6 in, and 10 in
IR_THRESHOLD = 20
IR_TESTS = 18  # of one GET_DISTANCE
IR_CONE = math.radians(5)
IR_MOUNTS = ((0.070, 0.047), (0.070, -0.047))
LIGHT_MOUNTS = ((0.053, 0.018, 0.35), (0.053, 0.0, 0.0), (0.053, -0.018, -0.35))
LINE_MOUNTS = ((0.05, 0.005), (0.05, -0.005))

OBSTACLE_TOP = 6400  # the largest value of an obstacle
OBSTACLE_HALF = 0.12  # distance at which a Fluke with the usual IR power gives half of it [m]; chosen
OBSTACLE_REACH = 1.0
OBSTACLE_NOISE = 0.02  # of a Fluke 1's reading; chosen
IR_POWER = 135
POWER_DOUBLES = (
    10.0  # so much more IR power sees twice as far with a Fluke 1, whose useful band is narrow; chosen
)
FLUKE_PULSES = 10  # of the Fluke 2
FLUKE_EMITTERS = {"left": math.radians(30), "center": 0.0, "right": math.radians(-30)}  # directions chosen
FLUKE_CONE = math.radians(10)
FLUKE_FRONT = 0.089  # the board stands at the end with the caster [m]

LIGHT_NOISE = 0.004
S1_DARKEST, S2_DARKEST = 5000, 65535


def _cone(forward: float, left: float, direction: float, half: float) -> list[tuple[float, float, float]]:
    return [(forward, left, direction + part * half) for part in (-1, 0, 1)]


_IR_RAYS = np.array([ray for mount in IR_MOUNTS for ray in _cone(*mount, 0.0, IR_CONE)])
_FLUKE_RAYS = np.array(
    [
        ray
        for direction in FLUKE_EMITTERS.values()
        for ray in _cone(-FLUKE_FRONT, 0.0, math.pi + direction, FLUKE_CONE)
    ]
)


class Senses:
    """The sensors of one robot.

    Args:
        robot: Table with the robot.
        scene: Scene with lights and floor.
        seed: Seed of their noise.
    """

    def __init__(self, robot: SimulatedRobot, scene: Scene, seed: int) -> None:
        self._robot = robot
        self._own = robot if isinstance(robot, RobotOfItsOwn) else None
        self._scene = scene
        self.restart(seed)

    def restart(self, seed: int) -> None:
        """Restart the noise with a seed."""
        self._random = random.Random(seed)

    def ir_distances(self) -> tuple[float, float]:
        """Return the distances at which the robot's own IR meets something, left and right [m]."""
        ranges = self._robot.ranges(_IR_RAYS, 1.0)
        return float(ranges[:3].min()), float(ranges[3:].min())

    def ir(self, threshold: int = 0) -> tuple[bool, bool]:
        """Return whether an object is near, left and right; a higher threshold detects only nearer ones.

        Args:
            threshold: 1 to 100, 0 for the usual one.
        """
        reach = _ir_reach(threshold or IR_THRESHOLD)
        left, right = self.ir_distances()
        return left < reach + self._random.gauss(0, 0.002), right < reach + self._random.gauss(0, 0.002)

    def ir_level(self, side: int) -> int:
        """Return the answer to GET_DISTANCE: 0 (touching) to 99 (nothing), with the resolution of its tests."""
        seen = self.ir_distances()[side] / _ir_reach(1)
        return 99 if seen >= 1 else int(seen * IR_TESTS) * 99 // IR_TESTS

    def light(self, darkest: int) -> tuple[int, int, int]:
        """Return left, center and right, 0 (bright) to `darkest`; twice as bright as the room halves them."""
        x, y, heading = self._robot.pose
        cos, sin = math.cos(heading), math.sin(heading)
        readings = []
        for forward, left, direction in LIGHT_MOUNTS:
            light = self._scene.light(
                x + cos * forward - sin * left, y + sin * forward + cos * left, heading + direction
            )
            value = darkest / 2 / light * (1 + self._random.gauss(0, LIGHT_NOISE))
            readings.append(max(0, min(darkest, round(value))))
        return readings[0], readings[1], readings[2]

    def line(self) -> tuple[bool, bool]:
        """Return whether the floor is dark, left and right."""
        if self._scene.arena.floor == BARE_FLOOR:
            return False, False
        x, y, heading = self._robot.pose
        cos, sin = math.cos(heading), math.sin(heading)
        left, right = (
            self._scene.is_dark(x + cos * forward - sin * left, y + sin * forward + cos * left)
            for forward, left in LINE_MOUNTS
        )
        return left, right

    def obstacle(self, emitter: str, power: int, *, in_pulses: bool) -> int:
        """Return the reading of a Fluke's infrared sensor, 0 (free) to 6400 (near).

        Args:
            emitter: "left", "center" or "right".
            power: Power of the emitters, 0 to 255.
            in_pulses: True for a Fluke 2, which sends ten pulses from its only emitter.
        """
        if self._own is not None:
            return self._own.obstacle(emitter, _stronger(power, in_pulses=in_pulses))
        first = 3 * list(FLUKE_EMITTERS).index("center" if in_pulses else emitter)
        far = float(self._robot.ranges(_FLUKE_RAYS[first : first + 3], OBSTACLE_REACH).min())
        share = _returned(far, power, in_pulses=in_pulses)
        if in_pulses:
            return sum(self._random.random() < share for _ in range(FLUKE_PULSES)) * (
                OBSTACLE_TOP // FLUKE_PULSES
            )
        value = OBSTACLE_TOP * share * (1 + self._random.gauss(0, OBSTACLE_NOISE))
        return max(0, min(OBSTACLE_TOP, round(value)))

    def loudness(self) -> int:
        """Return the reading of the microphone in a quiet room."""
        return max(0, round(self._random.gauss(400, 100)))


def _ir_reach(threshold: int) -> float:
    """Return the reach of the robot's own IR at a threshold [m]."""
    return IR_REACH * max(0, 100 - threshold) / (100 - IR_THRESHOLD)


def _returned(far: float, power: int, *, in_pulses: bool) -> float:
    """Return the share of emitted light that counts as returned; half of it at a distance that grows with the power."""
    more = _stronger(power, in_pulses=in_pulses)
    if not more or far >= OBSTACLE_REACH:
        return 0.0
    return float(1 / (1 + (far / (OBSTACLE_HALF * more)) ** 4))


def _stronger(power: int, *, in_pulses: bool) -> float:
    """Return the ratio of the light's reach to its reach at the usual power."""
    if not power:
        return 0.0
    return power / IR_POWER if in_pulses else float(2.0 ** ((power - IR_POWER) / POWER_DOUBLES))

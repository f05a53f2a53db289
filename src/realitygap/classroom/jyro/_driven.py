"""A robot of a `JyroWorld` under the contract that a physical one meets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from realitygap.errors import RobotError
from realitygap.robots import Command, Label, Observation, ProgramRobot, check_command
from realitygap.world import Pose

from ._robot import SceneRobot
from ._sensors import RangeSensor


class DrivenRobot(ProgramRobot):
    """A robot of a world that a controller drives. The other robots follow their brains or their last command.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | `speed` |
    | turn | -1 | 1 | `turn_rate`, to the left |

    | observation | from 0 | to 1 | raw |
    |---|---|---|---|
    | each ray of the range sensors | nothing within range | touching | distance [m] |

    Args:
        robot: The robot, which is in a world and has a range sensor.
        sensors: The range sensors to observe. Default: all of the robot.
        speed: Speed of a full command [m/s].
        turn_rate: Turn rate of a full command [rad/s].

    Raises:
        RobotError: The robot is in no world, or has no range sensor.
    """

    label: Label = "SIM"

    def __init__(
        self,
        robot: SceneRobot,
        sensors: Sequence[RangeSensor] | None = None,
        *,
        speed: float = 1.0,
        turn_rate: float = 1.0,
    ) -> None:
        self.robot, self.world = robot, robot.world
        self.speed, self.turn_rate = speed, turn_rate
        given = robot.devices if sensors is None else sensors
        self.sensors = [sensor for sensor in given if isinstance(sensor, RangeSensor)]
        self.n_sensors = sum(len(sensor) for sensor in self.sensors)
        self.step_s = self.world.step_s
        if not self.n_sensors:
            raise RobotError(
                f"{robot.name} has no range sensor: give it one with robot.add(RangeSensor(...))."
            )

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial: reset the whole world, and place this robot at a pose if one is given."""
        self._check_open()
        self.world.reset()
        if pose is not None:
            self.robot.place(pose)

    def observe(self) -> Observation:
        """Return the readings after the last step."""
        self._check_open()
        raw = np.concatenate([sensor.readings for sensor in self.sensors])
        near = np.concatenate([sensor.nearness for sensor in self.sensors])
        return Observation(tuple(near.tolist()), self.robot.stalled, tuple(raw.tolist()))

    def drive(self, command: Command) -> None:
        """Drive one command, for one step of the world."""
        self._check_open()
        move, turn = check_command(command)
        self.robot.move(move * self.speed, turn * self.turn_rate)
        self.world.step()

    def stop(self) -> None:
        """Stop the robot."""
        self.robot.stop()

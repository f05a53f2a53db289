"""Twins with faults that neither `sim` nor a twin's file can express, each as a change of one trial's physics.

A fault changes the speeds of the wheels, the readings, or the delay of commands. It sees the time and the number of the
trial, the heading, and what the robot was told.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import inputs_of_robot
from realitygap.records import Observe, TrialRecord
from realitygap.robots import Command, Label, Observation
from realitygap.robots.twin import TwinModel, TwinRobot
from realitygap.trials import RepeatableTarget, RobotObserver, TellTrial, TrialPlan, carry_out_on_robot
from realitygap.world import Arena, Pose

Wheels = tuple[float, float]
Floats = NDArray[np.float64]
STEP_S = 0.005  # of the twin's physics
FULL_SCALE = 6400.0  # of a Fluke's obstacle reading
HALF_TRACK = 0.0765  # of the twin's wheels, about [m]


class Fault:
    """A fault that changes nothing. Its subclasses override what they change."""

    def begin(self, robot: FaultyRobot) -> None:
        """Begin a trial."""

    def wheels(self, robot: FaultyRobot, speeds: Wheels) -> Wheels:
        """Return the speeds of the wheels in the next short time [m/s]."""
        return speeds

    def readings(self, robot: FaultyRobot, readings: Floats) -> Floats:
        """Return the readings before a command, (s,) 0..1."""
        return readings

    def late(self, robot: FaultyRobot) -> float:
        """Return what is added to the delay of a command [s]."""
        return 0.0

    def command(self, robot: FaultyRobot, command: Command) -> Command:
        """Return the command that the robot executes."""
        return command


class FaultyRobot(TwinRobot):
    """A twin with faults.

    Args:
        model: The twin without them.
        faults: Its faults.
        arena: Arena of the robot.
    """

    def __init__(self, model: TwinModel, faults: Sequence[Fault], arena: Arena) -> None:
        self.faults = tuple(faults)
        self.rng = np.random.default_rng(0)
        super().__init__(model, arena)

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial as a twin does, and begin each fault."""
        super().reset(pose)
        self._servo: Any = _FaultyServo(self, self._servo)
        self.rng = np.random.default_rng([self.model.seed, self.number, 77])
        for fault in self.faults:
            fault.begin(self)

    @property
    def seconds(self) -> float:
        """Time since the trial began [s]."""
        return float(self._servo.time)

    @property
    def is_stalled(self) -> bool:
        """True if the idler reports a stall."""
        return self._idler.stalled

    def observe(self) -> Observation:
        """Read the sensors, with the faults of the readings; the same until the next command."""
        if self._seen is None:
            seen = super().observe()
            readings = np.array(seen.readings)
            for fault in self.faults:
                readings = fault.readings(self, readings)
            raw = tuple((readings * FULL_SCALE).tolist())
            self._seen = Observation(tuple(readings.tolist()), seen.stalled, raw, seen.channels)
        return self._seen

    def drive(self, command: Command) -> None:
        """Drive one command, as the faults change it."""
        for fault in self.faults:
            command = fault.command(self, command)
        super().drive(command)

    def order(self, left: float, right: float) -> None:
        """Set the speeds of the wheels, after the delay of the twin and of the faults."""
        late = sum(fault.late(self) for fault in self.faults)
        super().order(left, right)
        due, *speeds = self._heard.pop()
        due += round(late / STEP_S)
        if self._heard:
            due = max(due, self._heard[-1][0])
        self._heard.append((due, speeds[0], speeds[1]))


class _FaultyServo:
    """The motors of a twin, with the faults of the wheels."""

    def __init__(self, robot: FaultyRobot, servo: Any) -> None:
        self._robot, self._servo = robot, servo
        self.is_steady = False

    @property
    def time(self) -> float:
        return float(self._servo.time)

    @property
    def volts(self) -> float:
        return float(self._servo.volts)

    def follow(self, left: float, right: float, pose: Pose, seconds: float) -> Wheels:
        """Return speeds for the motors in a short time, left and right [m/s]."""
        speeds: Wheels = self._servo.follow(left, right, pose, seconds)
        for fault in self._robot.faults:
            speeds = fault.wheels(self._robot, speeds)
        return speeds


class FaultyTarget(RepeatableTarget):
    """A twin with faults, in this process.

    Args:
        model: The twin without them.
        faults: Its faults.
        arena: Arena of the trials.
        name: Name of the target.
    """

    label: Label = "TWIN"
    observes: Observe = "track"
    is_paced = True

    def __init__(self, model: TwinModel, faults: Sequence[Fault], arena: Arena, name: str) -> None:
        self._robot = FaultyRobot(model, faults, arena)
        self.arena, self.name, self.identity = arena, name, ""
        self.step_s, self.n_sensors = self._robot.step_s, self._robot.n_sensors

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of what networks can see."""
        return inputs_of_robot(self.n_sensors, self._robot.channels)

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """See `Target.carry_out`."""
        trials = []
        for k, plan in enumerate(plans):
            self._robot.number = plan.number
            start = plan.start or self.arena.start
            trials.append(
                carry_out_on_robot(self._robot, plan, observe, RobotObserver(self._robot), Pose(*start))
            )
            if tell is not None:
                tell(k, trials[-1])
        return trials

    def close(self) -> None:
        """Stop the robot."""
        self._robot.close()


@dataclass
class Weakens(Fault):
    """Each wheel's speed changes evenly to a share of its value between two times [s]."""

    left: float = 1.0
    right: float = 1.0
    begins: float = 0.0
    ends: float = 50.0

    def wheels(self, robot: FaultyRobot, speeds: Wheels) -> Wheels:
        """Return the speeds, weakened by the time in the trial."""
        part = min(max((robot.seconds - self.begins) / max(self.ends - self.begins, 1e-9), 0.0), 1.0)
        return speeds[0] * (1 + part * (self.left - 1)), speeds[1] * (1 + part * (self.right - 1))


@dataclass
class Wears(Fault):
    """Each wheel loses a share of its speed from trial to trial."""

    left: float = 0.0
    right: float = 0.0

    def wheels(self, robot: FaultyRobot, speeds: Wheels) -> Wheels:
        """Return the speeds, weakened by the number of the trial."""
        number = robot.number % 1000
        return speeds[0] * (1 - number * self.left), speeds[1] * (1 - number * self.right)


@dataclass
class TurnsByHeading(Fault):
    """The floor turns the robot to the left while it drives, by this [rad/m] times the sine of its heading."""

    per_m: float
    toward: float = 0.0
    periods: int = 1

    def wheels(self, robot: FaultyRobot, speeds: Wheels) -> Wheels:
        """Return the speeds, with more of one wheel by the heading."""
        ahead = (speeds[0] + speeds[1]) / 2
        turn = (
            self.per_m * math.sin(self.periods * (robot.pose.heading - self.toward)) * HALF_TRACK * abs(ahead)
        )
        return speeds[0] - turn, speeds[1] + turn


@dataclass
class SlipsBySpeed(Fault):
    """A wheel loses this share of its speed at full speed, and in proportion to its speed below."""

    share: float

    def wheels(self, robot: FaultyRobot, speeds: Wheels) -> Wheels:
        """Return the speeds, less for fast wheels."""
        left, right = (v * (1 - self.share * min(abs(v) / 0.15, 1.0)) for v in speeds)
        return left, right


@dataclass
class SlowBackward(Fault):
    """Each wheel has this share of its speed if it turns backward."""

    left: float
    right: float

    def wheels(self, robot: FaultyRobot, speeds: Wheels) -> Wheels:
        """Return the speeds, less backward."""
        left, right = speeds
        return (left * self.left if left < 0 else left), (right * self.right if right < 0 else right)


@dataclass
class Sticks(Fault):
    """For some time after a stall, the wheels have a share of their speeds."""

    share: float
    lasts: float

    def begin(self, robot: FaultyRobot) -> None:
        """Begin a trial without a stall."""
        self._until = 0.0

    def wheels(self, robot: FaultyRobot, speeds: Wheels) -> Wheels:
        """Return the speeds, less after a stall."""
        if robot.is_stalled:
            self._until = robot.seconds + self.lasts
        share = self.share if robot.seconds < self._until else 1.0
        return speeds[0] * share, speeds[1] * share


@dataclass
class Stale(Fault):
    """Readings come some commands late."""

    commands: int

    def begin(self, robot: FaultyRobot) -> None:
        """Begin a trial without readings."""
        self._seen: list[Floats] = []

    def readings(self, robot: FaultyRobot, readings: Floats) -> Floats:
        """Return readings of some commands ago."""
        self._seen.append(readings)
        return self._seen[max(0, len(self._seen) - 1 - self.commands)]


@dataclass
class DropsOut(Fault):
    """Some sensors read 0 for some commands in a row, and start to do so with a probability at each command."""

    begins: float
    commands: int
    sensors: tuple[int, ...] = (0, 1, 2)

    def begin(self, robot: FaultyRobot) -> None:
        """Begin a trial with all sensors."""
        self._left = 0

    def readings(self, robot: FaultyRobot, readings: Floats) -> Floats:
        """Return the readings, or 0."""
        if self._left == 0 and robot.rng.random() < self.begins:
            self._left = self.commands
        if self._left:
            self._left -= 1
            readings = readings.copy()
            readings[list(self.sensors)] = 0.0
        return readings


@dataclass
class Dims(Fault):
    """Readings fall evenly to a share of their values in the course of 100 commands."""

    share: float

    def readings(self, robot: FaultyRobot, readings: Floats) -> Floats:
        """Return the readings, dimmed by the time in the trial."""
        return readings * (1 - (1 - self.share) * min(robot.n_steps / 100, 1.0))


@dataclass
class DelayGrows(Fault):
    """Each second, the delay of commands grows by this [s]."""

    per_s: float

    def late(self, robot: FaultyRobot) -> float:
        """Return the growth so far."""
        return self.per_s * robot.seconds


@dataclass
class LosesCommands(Fault):
    """A command is lost with this probability: the robot continues with the one before."""

    share: float

    def begin(self, robot: FaultyRobot) -> None:
        """Begin a trial without a command."""
        self._last = Command(0.0, 0.0)

    def command(self, robot: FaultyRobot, command: Command) -> Command:
        """Return the command, or the one before."""
        if robot.rng.random() >= self.share:
            self._last = command
        return self._last


@dataclass
class Sways(Fault):
    """The robot turns to the left by this [rad/s], times the sine of the time: a loose wheel that swings."""

    rad_per_s: float
    period: float

    def wheels(self, robot: FaultyRobot, speeds: Wheels) -> Wheels:
        """Return the speeds, with more of one wheel by the time."""
        if speeds[0] == 0.0 and speeds[1] == 0.0:
            return speeds
        turn = self.rad_per_s * math.sin(math.tau * robot.seconds / self.period) * HALF_TRACK
        return speeds[0] - turn, speeds[1] + turn

"""Trials on robots that a program drives step by step, in the forms that evolutions, environments and targets need."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NotRequired, Protocol, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import RobotError
from realitygap.evolution import OUTPUTS, WHEELS, Channels, ControllerInterface, Network, inputs_of_robot
from realitygap.kernels.neat.genome import NeatRules
from realitygap.kernels.neat.network import Networks
from realitygap.records import Observe, TrialRecord
from realitygap.robots import Command, Label, channels_of, check_observation, select_channels
from realitygap.tasks import TraceArrays
from realitygap.trials import (
    NoiseKey,
    RepeatableTarget,
    RobotObserver,
    TellTrial,
    TrialBatch,
    TrialInterrupted,
    TrialPlan,
    Tried,
    carry_out_on_robot,
    check_plans,
    controller_of,
    counters_of,
    run_trial,
)
from realitygap.world import Arena, Pose, cells_along

from ._fleet import Array, Outline, is_signed
from ._settings import PlatformSettings

if TYPE_CHECKING:
    from realitygap.emulator import Witness


class FollowedRobot:
    """A robot that knows its pose, with `visited_cells`: the cells along the straight lines between its poses.

    Args:
        robot: The robot, without such a list.
        arena: Arena of the robot.
    """

    def __init__(self, robot: Any, arena: Arena) -> None:
        self._robot, self._arena = robot, arena
        self._path: list[tuple[float, ...]] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)

    @property
    def number(self) -> int:
        """The number that chooses the noise of the next trial, if the robot has a choice."""
        number: int = self._robot.number
        return number

    @number.setter
    def number(self, number: int) -> None:
        self._robot.number = number

    def reset(self, pose: Pose | None = None) -> None:
        """See `Robot.reset`."""
        self._robot.reset(pose)
        self._path = [tuple(self._robot.pose)]

    def drive(self, command: Command) -> None:
        """See `Robot.drive`."""
        self._robot.drive(command)
        self._path.append(tuple(self._robot.pose))

    @property
    def visited_cells(self) -> tuple[int, ...]:
        """The cells along its line, in order of first visit."""
        return cells_along(np.array(self._path), self._arena.grid)


class WitnessedRobot:
    """A `SeenRobot` that is emulated: its witness places it, and knows its pose and its cells.

    Args:
        robot: The robot.
        witness: Its witness.
        arena: Arena of the robot.
    """

    def __init__(self, robot: Any, witness: Witness, arena: Arena) -> None:
        self._robot, self._witness, self._arena = robot, witness, arena
        self.number = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial at a pose, or at the arena's start."""
        self._robot.stop()
        self._witness.place(pose or self._arena.start, self.number)
        self._robot.reset()

    @property
    def pose(self) -> Pose:
        """Its present pose."""
        return self._witness.pose()

    @property
    def visited_cells(self) -> tuple[int, ...]:
        """The cells along its line, in order of first visit."""
        return self._witness.cells()


def choose_number(robot: Any, number: int) -> None:
    """Set the number, and so the noise, of the trial that begins with the next `reset`, if the robot has a choice."""
    if hasattr(robot, "number"):
        robot.number = number


class AskedTrial(TypedDict):
    """A trial of a network to be run, as plain values for JSON."""

    network: dict[str, Any]  # of `Network.to_dict`
    number: int
    trace: bool


class AnsweredTrial(TypedDict):
    """A trial of a network, as plain values for JSON: with a trace, t + 1 poses, or t commands."""

    cells: list[int]  # in order of first visit
    ends: list[int]
    stalls: int
    pose: Sequence[float]  # the last one
    poses: NotRequired[list[Sequence[float]]]
    readings: NotRequired[list[list[float]]]
    stalled: NotRequired[list[bool]]
    wheels: NotRequired[list[Sequence[float]]]
    inputs: NotRequired[list[list[float]]]
    commands: NotRequired[list[list[float]]]


def trial_of(
    robot: Any, arena: Arena, network: Network, interface: ControllerInterface, n_steps: int, *, trace: bool
) -> AnsweredTrial:
    """Run a trial of a network.

    Args:
        robot: Robot with a `pose` and `visited_cells`.
        arena: Arena of the trial.
        network: The controller.
        interface: Names of the inputs and outputs of the network.
        n_steps: Number of commands.
        trace: True to return every step.

    """
    poses: list[Sequence[float]] = []
    distances: list[Sequence[float]] = []
    observer = RobotObserver(robot)

    def look(step: int) -> None:
        poses.append(tuple(robot.pose))
        if (wheels := observer.wheels()) is not None:
            distances.append(wheels)

    inputs: list[list[float]] = []
    controller = controller_of(network, interface, n_steps, inputs.append)
    try:
        driven = run_trial(robot, controller, n_steps, look=look, sees_end=True, channels=interface.channels)
    except TrialInterrupted as error:  # nothing of this trial is kept
        raise error.__cause__ or error from None
    if driven.problem:
        raise RobotError(driven.problem)
    ends = {arena.grid.cell_at(x, y) for x, y, _ in poses} - {None}
    stalled = [*driven.stalled.tolist(), driven.last_stalled]
    result: AnsweredTrial = {
        "cells": list(robot.visited_cells),
        "ends": sorted(cell for cell in ends if cell is not None),
        "stalls": sum(stalled[1:]),
        "pose": poses[-1],
    }
    if trace:
        result["poses"], result["stalled"], result["wheels"] = poses, stalled, distances
        result["readings"] = [*driven.readings.tolist(), driven.last_readings.tolist()]
        result["inputs"], result["commands"] = inputs, driven.commands.tolist()
    return result


class StepwiseTrials:
    """A platform in an arena, ready to try networks of one kind one after the other; a `PlatformTrials`.

    Args:
        platform: Settings of the platform.
        arena: Arena of the trials.
        rules: NEAT's rules, of which only the network's kind counts.
        robot: Robot with a `pose` and `visited_cells`.
        inputs: Names of the network's inputs, in order.
        bias_value: Value of the constant input.
    """

    distance_unit = 1.0
    drawn_names: tuple[str, ...] = ()

    def __init__(
        self,
        platform: PlatformSettings,
        arena: Arena,
        rules: NeatRules,
        robot: Any,
        *,
        inputs: Sequence[str],
        bias_value: float,
    ) -> None:
        self.arena, self.n_steps = arena, platform.steps
        self._reach = platform.sensors.max_range
        self._rules, self._bias_value = rules, bias_value
        self._interface = ControllerInterface(tuple(inputs), WHEELS if rules.drives_wheels else OUTPUTS)
        self._robot = robot
        self.step_s: float = robot.step_s
        self.sensors = tuple(f"range.{k}" for k in range(robot.n_sensors))

    def _run(self, asked: list[AskedTrial]) -> Iterable[AnsweredTrial]:
        for each in asked:
            choose_number(self._robot, each["number"])
            network = Network.from_dict(each["network"])
            yield trial_of(
                self._robot, self.arena, network, self._interface, self.n_steps, trace=each["trace"]
            )

    def carry_out(
        self,
        networks: Networks,
        which: NDArray[np.int32],
        key: int,
        counters: NDArray[np.uint32],
        *,
        ends: bool = False,
        trace: bool = False,
    ) -> Tried:
        """See `PlatformTrials.carry_out`. Distances are computed from readings, as for a robot."""
        rows = {
            int(row): Network(networks, int(row), self._rules, self._bias_value).to_dict()
            for row in np.unique(which)
        }
        asked: list[AskedTrial] = [
            {"network": rows[int(row)], "number": trial_number(int(key), counter), "trace": trace}
            for row, counter in zip(which, counters, strict=True)
        ]
        answers = list(self._run(asked))
        n, n_cells = len(which), self.arena.grid.n_cells
        cells, n_line = _listed([each["cells"] for each in answers], n_cells)
        end_cells, n_ends = _listed([each["ends"] for each in answers], n_cells)
        stalls = np.array([each["stalls"] for each in answers], np.int32)
        ended = np.array([each["pose"][:2] for each in answers]).reshape(n, 2) - self.arena.start[:2]
        traced = self._trace(answers if trace else [])
        distances = self._reach * (1.0 - traced.readings)
        batch = TrialBatch(cells, n_line, n_ends, stalls, np.empty((n, 0)))
        return Tried(batch, end_cells if ends else end_cells[:0], ended, traced, distances)

    def _trace(self, answers: list[AnsweredTrial]) -> TraceArrays:
        """Return every step as kernels store it: positions from the start, headings in turns."""

        def stacked(trials: Iterable[ArrayLike], width: int) -> NDArray[np.float64]:
            rows = [np.array(trial, np.float64).reshape(-1, width) for trial in trials]
            return np.stack(rows, axis=-1) if rows else np.zeros((0, width, 1))

        poses = stacked((trial["poses"] for trial in answers), 3)
        start = self.arena.start
        poses[:, :2] -= np.array([start.x, start.y])[:, None]
        poses[:, 2] /= math.tau
        inputs = stacked((trial["inputs"] for trial in answers), len(self._interface.sensed))
        if self._rules.bias_input >= 0:
            constant = np.full((len(inputs), 1, inputs.shape[2]), self._bias_value)
            inputs = np.insert(inputs, [self._rules.bias_input], constant, axis=1)
        stalled = stacked((trial["stalled"] for trial in answers), 1)[:, 0].astype(np.bool_)
        readings = stacked((trial["readings"] for trial in answers), len(self.sensors))
        commands = stacked((trial["commands"] for trial in answers), 2)
        wheels = stacked((trial["wheels"] for trial in answers), 2)
        return TraceArrays(poses, readings, inputs, commands, stalled, wheels)


def _listed(cells: list[list[int]], n_cells: int) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Return lists of cells as kernels store them, (n, c), and the length of each."""
    listed = np.zeros((len(cells), n_cells), np.uint8)
    for row, each in zip(listed, cells, strict=True):
        row[: len(each)] = each
    return listed, np.array([len(each) for each in cells], np.int32)


def trial_number(key: int, counter: NDArray[np.uint32]) -> int:
    """Return the number of a trial, a function of the key and counter that other platforms draw random numbers by."""
    text = ":".join(map(str, (key, *counter.tolist())))
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=4).digest(), "little")


class Seen(TypedDict):
    """The readings and the pose of a robot, as plain values for JSON."""

    readings: Sequence[float]
    stalled: bool
    pose: Sequence[float]
    cells: list[int]
    channels: Channels


def seen_of(robot: Any) -> Seen:
    """Return the readings and the pose of a robot, as plain values for JSON."""
    seen = check_observation(robot.observe())
    return {
        "readings": seen.readings,
        "stalled": bool(seen.stalled),
        "pose": tuple(robot.pose),
        "cells": list(robot.visited_cells),
        "channels": dict(seen.channels),
    }


class Robots(Protocol):
    """n robots, each alone in its arena, given one command a step from outside.

    Attributes:
        step_s: Duration of a command [s].
        n_sensors: Number of range sensors.
        readings: (n, s) readings of the range sensors, 0..1.
        stalled: (n,) True if the last step was blocked.
        poses: (n, 3) x [m], y [m], heading [rad].
        cells: The cells along each line, in order of first visit.
        channels: Names of the sensors that each has besides range sensors.
        values: Readings of the selected sensors.
    """

    step_s: float
    n_sensors: int
    channels: tuple[str, ...]
    readings: NDArray[np.float64]
    stalled: NDArray[np.bool_]
    poses: NDArray[np.float64]
    cells: list[tuple[int, ...]]
    values: list[Channels]

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors to read besides range sensors, from the next `begin` on."""
        ...

    def begin(self, key: NoiseKey) -> None:
        """Put all robots at the start; robot k draws the numbers of individual `key.individual` + k."""
        ...

    def drive(self, commands: NDArray[np.float64]) -> None:
        """Drive each robot by one command, (n, 2) each -1..1."""
        ...

    def close(self) -> None:
        """Let go of the robots; safe to call twice."""
        ...


class TakenRobots:
    """The state of n `Robots`, as `seen_of` describes each."""

    readings: NDArray[np.float64]
    stalled: NDArray[np.bool_]
    poses: NDArray[np.float64]
    cells: list[tuple[int, ...]]
    values: list[Channels]

    def _take(self, seen: Sequence[Seen]) -> None:
        self.readings = np.array([robot["readings"] for robot in seen], np.float64)
        self.stalled = np.array([robot["stalled"] for robot in seen], np.bool_)
        self.poses = np.array([robot["pose"] for robot in seen], np.float64)
        self.cells = [tuple(robot["cells"]) for robot in seen]
        self.values = [robot["channels"] for robot in seen]


class OwnRobots(TakenRobots):
    """`Robots` in this process.

    Args:
        robots: Robots with `visited_cells`, at least one.
    """

    def __init__(self, robots: Sequence[Any]) -> None:
        self._robots = robots
        self.step_s, self.n_sensors = robots[0].step_s, robots[0].n_sensors
        self.channels = channels_of(robots[0])

    def select(self, names: Sequence[str]) -> None:
        """See `Robots.select`."""
        for robot in self._robots:
            select_channels(robot, names)

    def begin(self, key: NoiseKey) -> None:
        """See `Robots.begin`."""
        for robot, counter in zip(self._robots, counters_of(key, len(self._robots)), strict=True):
            choose_number(robot, trial_number(key.key, counter))
            robot.reset()
        self._take([seen_of(robot) for robot in self._robots])

    def drive(self, commands: NDArray[np.float64]) -> None:
        """See `Robots.drive`."""
        for robot, (move, turn) in zip(self._robots, commands.tolist(), strict=True):
            robot.drive(Command(move, turn))
        self._take([seen_of(robot) for robot in self._robots])

    def close(self) -> None:
        """See `Robots.close`."""
        for robot in self._robots:
            robot.close()


class StepwiseFleet:
    """A `Fleet` of robots that are asked for their readings one by one.

    Args:
        platform: Settings of the platform.
        arena: Arena of the robots.
        inputs: Names of the inputs.
        robots: Open; they are closed with the fleet, and if it cannot be made.
        n: Number of robots.

    Raises:
        ControllerError: The robots lack an input.
        ValueError: The robot does not fit at the start.
    """

    def __init__(
        self, platform: PlatformSettings, arena: Arena, inputs: Sequence[str], robots: Robots, n: int
    ) -> None:
        self._robots = robots
        interface = ControllerInterface(tuple(inputs))
        try:
            platform.check_starts(arena)
            interface.check(
                inputs_of_robot(robots.n_sensors, robots.channels), "The environment", platform.spec
            )
        except BaseException:
            robots.close()
            raise
        robots.select(interface.channels)
        self._sense = interface.bind(platform.steps)
        self._inputs = tuple(inputs)
        self.arena, self.n_steps, self.step_s = arena, platform.steps, robots.step_s
        self.outline = Outline.of_body(platform.body, platform.sensors)
        self._reach = platform.sensors.max_range
        self.cells = np.zeros((n, arena.grid.n_cells), np.uint8)
        self.counts = np.zeros((n, 2), np.int32)

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """See `Fleet.stalled`."""
        return self._robots.stalled

    @property
    def ranges(self) -> Array:
        """See `Fleet.ranges`. Noise is included."""
        return self._robots.readings

    def number(self, name: str, value: float) -> Array:
        """See `Fleet.number`. Drawn numbers are not known here."""
        return np.full(len(self.counts), float(value))

    def bounds(self) -> NDArray[Any]:
        """See `Fleet.bounds`."""
        return np.array([(-1.0 if is_signed(name) else 0.0, 1.0) for name in self._inputs]).T

    def start(self, key: NoiseKey) -> None:
        """See `Fleet.start`."""
        self._step = 0
        self._ends: list[set[int]] = [set() for _ in self.counts]
        self._last = np.zeros((len(self.counts), 2))
        self._robots.begin(key)
        self._count()

    def step(self, commands: Array) -> None:
        """See `Fleet.step`."""
        self._last = np.clip(commands, -1.0, 1.0)
        self._robots.drive(self._last)
        self._step += 1
        self._count()

    def _count(self) -> None:
        for k, (cells, (x, y, _)) in enumerate(zip(self._robots.cells, self._robots.poses, strict=True)):
            self.cells[k, : len(cells)] = cells
            end = self.arena.grid.cell_at(x, y)
            self._ends[k] |= set() if end is None else {end}
            self.counts[k] = len(cells), len(self._ends[k])

    def observe(self) -> Array:
        """See `Fleet.observe`."""
        robots = self._robots
        each = zip(
            self.ranges.tolist(), self.stalled.tolist(), robots.values, self._last.tolist(), strict=True
        )
        return np.array(
            [
                self._sense(readings, stalled, self._step, {**values, "last_move": move, "last_turn": turn})
                for readings, stalled, values, (move, turn) in each
            ]
        )

    def facts(self) -> dict[str, Array]:
        """See `Fleet.facts`. Distances are computed from readings."""
        return {"pose": self._robots.poses.copy(), "readings": self._reach * (1.0 - self.ranges)}

    def close(self) -> None:
        """See `Fleet.close`."""
        self._robots.close()


class StepwiseTarget(RepeatableTarget):
    """A simulated robot of this process as a target.

    Args:
        platform: Settings of the platform.
        arena: Arena of the trials.
        robot: Robot with a `pose` and `visited_cells`.
        noise: Level a, with which the robot was opened.
        name: Name, as the user gave it.
    """

    observes: Observe = "track"

    def __init__(
        self, platform: PlatformSettings, arena: Arena, robot: Any, noise: float, *, name: str
    ) -> None:
        self.name, self.arena, self.is_paced = name, arena, platform.is_paced
        self._robot = robot
        self.label: Label = robot.label
        self.step_s: float = robot.step_s
        self.n_sensors: int = robot.n_sensors
        self.identity = f"{platform.fingerprint} {platform.version}, noise {noise:g}"

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of what networks can see."""
        return inputs_of_robot(self.n_sensors, channels_of(self._robot))

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """See `Target.carry_out`."""
        check_plans(plans, observe, self)
        trials = []
        for k, plan in enumerate(plans):
            choose_number(self._robot, plan.number)
            start = plan.start or self.arena.start
            trial = carry_out_on_robot(self._robot, plan, observe, RobotObserver(self._robot), start)
            if trial.problem:
                raise RobotError(f"Trial {plan.number} on {self.name}: {trial.problem}")
            trials.append(trial)
            if tell is not None:
                tell(k, trial)
        return trials

    def close(self) -> None:
        """Let go of the robot; safe to call twice."""
        self._robot.close()

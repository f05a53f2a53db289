"""A check that a robot keeps the contract of all robots."""

from __future__ import annotations

import math
from typing import get_args

from realitygap.errors import RealityGapError
from realitygap.robots import (
    Clock,
    Command,
    Label,
    Observation,
    Robot,
    SystemClock,
    channels_of,
    select_channels,
)

GOOD = (Command(0.0, 0.0), Command(0.3, 0.0), Command(-0.3, 0.0), Command(0.0, 0.3), Command(0.2, -0.2))
BAD = (Command(1.01, 0.0), Command(0.0, -2.0), Command(math.nan, 0.0), Command(0.0, math.inf))
STEP_SLACK_S = 1.0
"""Time by which a command may exceed `step_s`, for a slow link [s]."""


class RobotContractError(RealityGapError):
    """A robot does not keep the contract. The message lists the problems and how to fix them."""


def check_robot(robot: Robot, *, noise: float = 0.0) -> None:
    """Check a robot against the contract of `realitygap.robots.Robot`: reset, read, drive, stop, and close it.

    A physical robot moves a few centimeters ahead and back, and turns to both sides. Put it on the floor.

    Args:
        robot: Open robot. The check closes it.
        noise: Largest distance of a noisy reading from the range 0 to 1.

    Raises:
        RobotContractError: The robot does not keep the contract. The message lists all problems and how to fix them.
    """
    _Check(robot, noise).carry_out()


class _Check:
    """The problems of one robot, as they are found."""

    def __init__(self, robot: Robot, noise: float) -> None:
        self.robot = robot
        self.noise = noise
        self.problems: list[str] = []
        self.said: set[str] = set()
        self.selected: tuple[str, ...] = ()

    def carry_out(self) -> None:
        if self.is_a_robot():
            try:
                self.attributes()
                self.with_block()
            except RealityGapError:
                raise
            except Exception as error:
                self.problems.append(
                    f"It raised {type(error).__name__} ({error}); raise RobotError if the robot fails."
                )
        if self.problems:
            name = type(self.robot).__name__
            listed = "\n".join(f"  - {problem}" for problem in self.problems)
            raise RobotContractError(f"{name} does not keep the contract of a robot:\n{listed}")

    def expect(self, is_so: bool, problem: str) -> None:
        if not is_so:
            self.problems.append(problem)

    def is_a_robot(self) -> bool:
        names = (
            "label",
            "step_s",
            "n_sensors",
            "reset",
            "observe",
            "drive",
            "stop",
            "close",
            "__enter__",
            "__exit__",
        )
        missing = [name for name in names if not hasattr(self.robot, name)]
        self.expect(
            not missing, f"It has no {', '.join(missing)}; see realitygap.robots.Robot for what each does."
        )
        if channels_of(self.robot) and not hasattr(self.robot, "select"):
            missing.append("select")
            self.problems.append("It has `channels` and no `select`, which chooses those to read; add it.")
        return not missing

    def attributes(self) -> None:
        robot = self.robot
        labels = get_args(Label)
        self.expect(robot.label in labels, f"label is {robot.label!r}, expected one of {', '.join(labels)}.")
        is_time = isinstance(robot.step_s, int | float) and math.isfinite(robot.step_s) and robot.step_s >= 0
        self.expect(is_time, f"step_s is {robot.step_s!r}, expected seconds, 0 or more.")
        is_count = isinstance(robot.n_sensors, int) and robot.n_sensors >= 1
        self.expect(is_count, f"n_sensors is {robot.n_sensors!r}, expected a whole number from 1 on.")

    def with_block(self) -> None:
        robot = self.robot
        caught = False
        try:
            with robot as entered:
                self.expect(entered is robot, "__enter__ returns something else; return self.")
                self.trial()
                raise _LeaveError
        except _LeaveError:
            caught = True
        self.expect(caught, "__exit__ suppresses exceptions; return None from it.")
        self.closed()

    def trial(self) -> None:
        for names in (channels_of(self.robot), ()):
            self.selected = names
            select_channels(self.robot, names)
            self.robot.reset()
            self.observation("after reset")
            for command in GOOD:
                self.drive(command)
            self.bad_commands()
            self.robot.stop()
            self.robot.stop()
            self.observation("after stop")

    def drive(self, command: Command) -> None:
        clock: Clock = getattr(self.robot, "clock", None) or SystemClock()
        since = clock.now()
        self.robot.drive(command)
        took = clock.now() - since
        if self.robot.label == "SIM" and isinstance(clock, SystemClock):
            took = self.robot.step_s  # a simulation need not take the time that it simulates
        wanted = f"step_s is {self.robot.step_s} s"
        self.expect(
            took >= 0.99 * self.robot.step_s,
            f"drive({command}) took {took:.3f} s, and {wanted}; wait for the rest.",
        )
        self.expect(
            took <= self.robot.step_s + STEP_SLACK_S,
            f"drive({command}) took {took:.3f} s, and {wanted}; correct step_s, or find what keeps the link busy.",
        )
        self.observation(f"after drive({command})")

    def bad_commands(self) -> None:
        for command in BAD:
            try:
                self.robot.drive(command)
            except ValueError:
                continue
            self.problems.append(
                f"drive({command}) moved the robot; call realitygap.robots.check_command, which raises ValueError."
            )

    def observation(self, when: str) -> None:
        """Observe once. Report each kind of problem only the first time."""
        seen = self.robot.observe()
        if not isinstance(seen, Observation):
            self.once("type", False, f"observe() {when} gave a {type(seen).__name__}; return an Observation.")
            return
        n = self.robot.n_sensors
        for name, values in (("readings", seen.readings), ("raw", seen.raw)):
            self.once(
                name, len(values) == n, f"{name} {when} has {len(values)} numbers, and n_sensors is {n}."
            )
        low, high = 0.0 - self.noise, 1.0 + self.noise
        outside = [value for value in seen.readings if not low <= value <= high]
        problem = f"readings {when} has {outside}, expected {low:g} to {high:g}; scale and limit them."
        self.once("range", not outside, problem)
        channels = dict(seen.channels)
        expected = f"expected a number from -1 to 1 for each of {list(self.selected)}, those selected."
        is_so = set(channels) == set(self.selected) and all(-1 <= value <= 1 for value in channels.values())
        self.once("channels", is_so, f"channels {when} is {channels}, {expected}")
        problem = f"stalled {when} is {seen.stalled!r}, expected True or False."
        self.once("stalled", isinstance(seen.stalled, bool), problem)

    def once(self, what: str, is_so: bool, problem: str) -> None:
        """Work like `expect`, but report only the first problem of each kind."""
        if what not in self.said:
            self.expect(is_so, problem)
        if not is_so:
            self.said.add(what)

    def closed(self) -> None:
        robot = self.robot
        robot.close()
        robot.stop()
        for name, call in (("observe", robot.observe), ("drive", lambda: robot.drive(Command(0.0, 0.0)))):
            try:
                call()
            except RealityGapError:
                continue
            self.problems.append(f"{name}() works after close(); raise RobotError.")


class _LeaveError(Exception):
    pass

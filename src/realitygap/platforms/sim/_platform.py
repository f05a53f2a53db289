"""The platform `sim`: a robot as its file describes it, with contact, motors and sensors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from realitygap.errors import DescriptionError
from realitygap.robots import Robot
from realitygap.trials import PlatformTrials
from realitygap.world import Arena, check_drawn_starts, load_robot, read_calibration

from .._fleet import Fleet
from .._platform import Platform
from ._fleet import SimFleet
from ._robot import SimRobot
from ._scene import sim_inputs, sim_scene
from ._settings import SimSettings
from ._team import SimTeam, team_scenes
from ._trials import SimTrials

if TYPE_CHECKING:
    from realitygap.kernels.neat.genome import NeatRules


class SimPlatform(SimSettings):
    """A robot of a file, simulated with its outline, contact, motors and sensors.

    Every number of the robot and of the arena has a dotted name, such as `drive.track` or `arena.start.x`. `set` gives
    any of them another value, or a distribution from which it is drawn for each trial, run, or study. All other numbers
    are those of the robot file, which gives their sources.
    """

    @classmethod
    def kind_of_file(cls, path: Path) -> str:
        """Return "calibration" or "robot file"; empty for other files."""
        try:
            load_robot(path)
            return "robot file" if read_calibration(path) is None else "calibration"
        except DescriptionError:
            return ""

    def inputs(self, arena: Arena) -> tuple[str, ...]:
        """Return the names of all inputs that networks can have here."""
        return sim_inputs(self.model, arena)

    def drawn_names(self, arena: Arena, inputs: Sequence[str], noise: float) -> tuple[str, ...]:
        """Return the dotted names of the numbers that are drawn for trials, in the order of the records."""
        return sim_scene(self, arena, inputs, noise).drawn_names

    def check(self, arena: Arena, inputs: Sequence[str], noise: float) -> None:
        """Raise an error if networks with these inputs cannot be tried here.

        Raises:
            ValueError: The robot or the arena lacks an input, or a number is out of its range.
        """
        if arena.others:
            team_scenes(self, arena, inputs, noise)
        else:
            sim_scene(self, arena, inputs, noise)

    def check_starts(self, arena: Arena) -> None:
        """Raise an error if the robot does not fit at the start, wherever that is drawn.

        Raises:
            ValueError: It does not.
        """
        check_drawn_starts(arena, self.model)

    def open_robot(self, arena: Arena, *, noise: float = 0.0) -> Robot:
        """Open one robot."""
        return SimRobot(self, arena, noise=noise)

    def prepare(
        self, arena: Arena, rules: NeatRules, *, inputs: Sequence[str], noise: float, bias_value: float
    ) -> PlatformTrials:
        """Set the platform up for many trials in one call."""
        if arena.others:
            return SimTeam(self, arena, rules, inputs=inputs, noise=noise, bias_value=bias_value)

        return SimTrials(self, arena, rules, inputs=inputs, noise=noise, bias_value=bias_value)

    def fleet(self, arena: Arena, inputs: Sequence[str], noise: float, n: int) -> Fleet:
        """Open n robots that are driven step by step."""
        return SimFleet(self, arena, inputs, noise, n)


def as_sim(platform: Platform) -> SimPlatform | None:
    """Return the platform if it simulates a robot file, whose numbers can be fitted; None otherwise."""
    return platform if isinstance(platform, SimPlatform) else None

"""The contract of a platform: its settings, its capabilities, and how it is opened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from realitygap.errors import RealityGapError, StudyError
from realitygap.robots import Robot
from realitygap.trials import (
    OnLost,
    PlatformTrials,
    PortObserver,
    Pulse,
    RobotTarget,
    Target,
    WitnessObserver,
    own_witness,
)
from realitygap.world import Arena

from ._fleet import Fleet
from ._settings import PlatformSettings
from ._stepwise import (
    FollowedRobot,
    OwnRobots,
    StepwiseFleet,
    StepwiseTarget,
    StepwiseTrials,
    WitnessedRobot,
)

if TYPE_CHECKING:
    from realitygap.kernels.neat.block import RunRows, RunRules
    from realitygap.kernels.neat.genome import NeatRules


@dataclass(frozen=True)
class Opening:
    """Everything that opening a platform for trials one by one may need.

    Attributes:
        name: The platform as the user named it, such as `twin:worn-1.toml`.
        noise: Level a: each reading is moved by a * U(-1, 1), on top of the robot's own noise.
        key: Key of a simulator's random numbers.
        processes: Number of processes of a twin; None: one for each processor.
        witness: Address of the witness of an emulated robot in another program, HOST:PORT.
        observer: Observer, who places a robot and reports the cells that it crossed. Default: its witness.
        step_s: Duration of a robot's command [s]; None: that of its platform.
        on_lost: Reaction to a trial in which the link to a robot was lost.
        pulse: Called when a trial on a robot begins or ends, and when the robot has answered in it.
    """

    name: str
    noise: float = 0.0
    key: int = 0
    processes: int | None = None
    witness: str | None = None
    observer: PortObserver | None = None
    step_s: float | None = None
    on_lost: OnLost = "retry"
    pulse: Pulse | None = None


class Platform(PlatformSettings):
    """A named way to run trials, with its settings.

    A subclass needs `name` and either `open_robot`, from which everything else follows, or `open` and `prepare`.
    """

    def connect(self) -> Robot:
        """Connect to a physical robot, which a person places.

        Raises:
            RobotError: It cannot be reached.
        """
        raise StudyError(f"Platform {self.name!r} has no robot on a port.")

    def open_robot(self, arena: Arena, *, noise: float = 0.0) -> Robot:
        """Open one robot that is driven step by step.

        Args:
            arena: Arena of the robot. `reset` places a simulated robot at its start.
            noise: Level a.

        Raises:
            StudyError: The platform has no robot that a program can place.
            RobotError: The robot cannot be reached.
        """
        raise StudyError(f"Platform {self.name!r} has no robot that can be driven step by step.")

    def _open_seen(self, arena: Arena, noise: float) -> Any:
        """Open a simulated robot that knows its pose and its visited cells.

        Raises:
            StudyError: It does not know its pose.
        """
        try:
            robot: Any = self.open_robot(arena, noise=noise)
        except (RealityGapError, ValueError):
            raise
        except Exception as error:  # whatever an outside package does
            raise StudyError(
                f"Platform {self.name!r} cannot open its robot: {type(error).__name__}: {error}."
            ) from error
        witness = own_witness(robot)
        if not hasattr(robot, "pose") and witness is not None:
            return WitnessedRobot(robot, witness, arena)
        if not hasattr(robot, "pose"):
            robot.close()
            raise StudyError(
                f"A robot of platform {self.name!r} does not know its pose: expected an attribute `pose`, or "
                "is_physical = True, so that an operator places it and reports the crossed cells."
            )
        return robot if hasattr(robot, "visited_cells") else FollowedRobot(robot, arena)

    def open(self, arena: Arena, how: Opening) -> Target:
        """Open the platform for trials one by one."""
        if not self.is_physical:
            robot = self._open_seen(arena, how.noise)
            return StepwiseTarget(self, arena, robot, how.noise, name=how.name)
        return RobotTarget(
            self.connect,
            arena,
            how.observer or self._witness(how),
            name=how.name,
            step_s=self.command_s if how.step_s is None else how.step_s,
            on_lost=how.on_lost,
            pulse=how.pulse,
        )

    def _witness(self, how: Opening) -> PortObserver:
        """Return the witness of an emulated robot in this program, or at an address.

        Raises:
            StudyError: A person has to place the robot.
        """
        if not self.needs_person:
            return WitnessObserver()
        if how.witness is not None:
            from realitygap.emulator import connect_witness

            remote = connect_witness(how.witness)
            remote.hold()  # before the first command, because it may be driving in fast time
            return WitnessObserver(remote)
        raise StudyError(
            f"No operator places the robot of {how.name} and reports its cells. Name the witness of an "
            "emulator (HOST:PORT, from realitygap emulate ROBOT --witness PORT), or give an observer."
        )

    def prepare(
        self, arena: Arena, rules: NeatRules, *, inputs: Sequence[str], noise: float, bias_value: float
    ) -> PlatformTrials:
        """Set the platform up for many trials of networks of one kind; here one after the other."""
        self.check(arena, inputs, noise)
        robot = self._open_seen(arena, noise)
        return StepwiseTrials(self, arena, rules, robot, inputs=inputs, bias_value=bias_value)

    def run_whole(
        self,
        arena: Arena,
        neat: NeatRules,
        rules: RunRules,
        *,
        inputs: Sequence[str],
        noise: float,
        bias_value: float,
        key: int,
        first_replicate: int,
        rows: RunRows,
        room: tuple[int, int],
    ) -> bool:
        """Compute whole evolutions in one call, if `runs_whole`; return whether all genomes found room."""
        raise NotImplementedError

    def fleet(self, arena: Arena, inputs: Sequence[str], noise: float, n: int) -> Fleet:
        """Open n robots that are driven step by step, all at the same step."""
        self.check_noise(noise)
        robots = OwnRobots([self._open_seen(arena, noise) for _ in range(n)])
        return StepwiseFleet(self, arena, inputs, robots, n)

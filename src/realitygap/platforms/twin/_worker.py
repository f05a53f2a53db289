"""The process in which a twin lives: it alone reads the twin's file, and shows what a robot shows.

A line of JSON in is a request, a line of JSON out its answer. It ends when nobody is there to ask any more.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import sys
from pathlib import Path
from typing import Any, BinaryIO

from realitygap._limits import MOST_TOML_BYTES, read_file
from realitygap.errors import DescriptionError, RealityGapError, RobotError
from realitygap.evolution import ControllerInterface, Network
from realitygap.records import Observe, trial_to_dict
from realitygap.robots import Command
from realitygap.robots.twin import TwinRobot, load_twin
from realitygap.trials import RobotObserver, TrialPlan, carry_out_on_robot
from realitygap.world import Arena

from .._stepwise import AnsweredTrial, Seen, seen_of, trial_of
from ._open import SimTwin, open_twin


class _Twin:
    """A twin in an arena, and what can be asked of it."""

    def __init__(self, file: str, arena: dict[str, Any]) -> None:
        try:
            self._hash = hashlib.sha256(read_file(Path(file), MOST_TOML_BYTES, plain=True)).hexdigest()
        except OSError:
            self._hash = ""  # which `load_twin` tells better
        model = load_twin(file)
        self._arena: Arena = Arena.from_dict(arena)
        self._robot = open_twin(model, self._arena)
        self._open = functools.partial(open_twin, model, self._arena)
        self._fleet: list[TwinRobot | SimTwin] = []

    def facts(self) -> dict[str, Any]:
        """Return the facts known of any robot, and the hash of the file."""
        robot = self._robot
        return {
            "step_s": robot.step_s,
            "n_sensors": robot.n_sensors,
            "channels": robot.channels,
            "sha256": self._hash,
        }

    def carry_out(self, plan: dict[str, Any], observe: Observe) -> dict[str, Any]:
        """Return a trial, as far as it is to be observed."""
        made = TrialPlan.from_dict(plan)
        self._robot.number = made.number
        start = made.start or self._arena.start
        return trial_to_dict(
            carry_out_on_robot(self._robot, made, observe, RobotObserver(self._robot), start)
        )

    def evolve(
        self,
        network: dict[str, Any],
        inputs: list[str],
        outputs: list[str],
        steps: int,
        number: int,
        trace: bool,
    ) -> AnsweredTrial:
        """Return a trial of a network as an evolution scores it."""
        self._robot.number = number
        interface = ControllerInterface(tuple(inputs), tuple(outputs))
        return trial_of(self._robot, self._arena, Network.from_dict(network), interface, steps, trace=trace)

    def begin(self, numbers: list[int], channels: list[str]) -> list[Seen]:
        """Begin a trial of each number, each with a separate robot; return what every robot sees."""
        self._fleet += [self._open() for _ in numbers[len(self._fleet) :]]
        del self._fleet[len(numbers) :]
        for robot, number in zip(self._fleet, numbers, strict=True):
            robot.number = number
            robot.select(channels)
            robot.reset()
        return [seen_of(robot) for robot in self._fleet]

    def drive(self, commands: list[list[float]]) -> list[Seen]:
        """Drive each robot by one command; return what every robot sees then."""
        if len(commands) != len(self._fleet):  # after a process that ended
            raise RobotError(f"{len(self._fleet)} trials are under way, got {len(commands)} commands.")
        for robot, (move, turn) in zip(self._fleet, commands, strict=True):
            robot.drive(Command(move, turn))
        return [seen_of(robot) for robot in self._fleet]


def serve(requests: BinaryIO, answers: BinaryIO) -> None:
    """Answer requests until there are no more."""
    twin: _Twin | None = None
    for line in requests:
        request = json.loads(line)
        do = request.pop("do")
        try:
            if do == "open":
                twin = _Twin(**request)
                result = twin.facts()
            elif twin is None:
                raise DescriptionError("No twin is open.")
            else:
                result = getattr(twin, do)(**request)
        except (RealityGapError, ValueError) as error:
            reply: dict[str, Any] = {"error": str(error), "kind": type(error).__name__}
        else:
            reply = {"result": result}
        answers.write(json.dumps(reply, separators=(",", ":")).encode() + b"\n")
        answers.flush()


def main() -> None:
    """Serve on standard input and output; what libraries print goes to standard error."""
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)
        serve(sys.stdin.buffer, answers)


if __name__ == "__main__":
    main()

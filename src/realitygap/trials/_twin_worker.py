"""The process in which a twin lives: it alone reads the twin's file, and shows what a robot shows.

A line of JSON in is a request, a line of JSON out its answer. It ends when nobody is there to ask any more.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from realitygap.errors import DescriptionError, RealityGapError

if TYPE_CHECKING:
    from realitygap.world import Arena


class _Twin:
    """A twin in an arena, and what can be asked of it."""

    def __init__(self, file: str, arena: dict[str, Any]) -> None:
        from realitygap.robots.twin import load_twin
        from realitygap.world import Arena

        from ._open_twin import open_twin

        try:
            self._hash = hashlib.sha256(Path(file).read_bytes()).hexdigest()
        except OSError:
            self._hash = ""  # which `load_twin` tells better
        model = load_twin(file)
        self._arena: Arena = Arena.from_dict(arena)
        self._robot = open_twin(model, self._arena)

    def facts(self) -> dict[str, Any]:
        """What is known of any robot, and the hash of the file."""
        robot = self._robot
        return {"step_s": robot.step_s, "n_sensors": robot.n_sensors, "sha256": self._hash}

    def carry_out(self, plan: dict[str, Any], observe: str) -> dict[str, Any]:
        """A trial, as far as it is to be observed."""
        from realitygap.records import trial_to_dict

        from ._carry_out import carry_out_on_robot
        from ._onlooker import RobotOnlooker
        from ._plan_file import plan_from_dict

        made = plan_from_dict(plan)
        self._robot.number = made.number
        start = made.start or self._arena.start
        trial, problem = carry_out_on_robot(
            self._robot,
            made,
            observe,  # type: ignore[arg-type]  # checked by who asks
            RobotOnlooker(self._robot),
            start,
        )
        return {"trial": trial_to_dict(trial), "problem": problem}

    def evolve(self, network: dict[str, Any], steps: int, number: int, trace: bool) -> dict[str, Any]:
        """A trial of a network as an evolution scores it."""
        from realitygap.evolution import Network

        from ._twin_trial import trial_of

        self._robot.number = number
        return trial_of(self._robot, Network.from_dict(network), steps, trace=trace)


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
                result = twin.carry_out(**request) if do == "carry_out" else twin.evolve(**request)
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

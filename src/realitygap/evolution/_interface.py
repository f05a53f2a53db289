"""Names of a network's inputs and outputs, and how a robot's readings become inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

from realitygap.errors import ControllerError

PAPER_INPUTS: tuple[str, ...] = ("obstacle", "stall", "time")
OUTPUTS = ("move", "turn")
CONSTANT = "bias"

Sense = Callable[[Sequence[float], bool, int], list[float]]
"""The inputs of a network, without the constant one, from range readings, stall, and the number of the step."""


@dataclass(frozen=True)
class ControllerInterface:
    """The names of a network's inputs and outputs, in order.

    Attributes:
        inputs: As a task names them: `obstacle` (the largest range reading), `stall`, `time` (step / steps), `range.K`
            and other sensors of the robot, and `bias` for the constant input.
        outputs: `move` and `turn`, each -1..1.

    Raises:
        ControllerError: An input has no name, or the outputs are others.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...] = OUTPUTS

    def __post_init__(self) -> None:
        if not self.inputs or not all(self.inputs) or self.inputs.count(CONSTANT) > 1:
            raise ControllerError(
                f"The inputs of a controller are {list(self.inputs)}, expected a name for each, and {CONSTANT!r} at "
                "most once."
            )
        if self.outputs != OUTPUTS:
            raise ControllerError(
                f"The outputs of a controller are {', '.join(self.outputs)}, expected {', '.join(OUTPUTS)}."
            )

    @property
    def sensed(self) -> tuple[str, ...]:
        """The inputs without the constant one, which the network has by itself."""
        return tuple(name for name in self.inputs if name != CONSTANT)

    def check(self, there: Sequence[str], who: str, where: str) -> None:
        """Refuse a platform that lacks an input.

        Args:
            there: What networks can see on the platform.
            who: What the message calls the controller.
            where: What it calls the platform.

        Raises:
            ControllerError: An input is missing.
        """
        missing = [name for name in self.sensed if name not in there]
        if missing:
            has = listed(name for name in there if name != CONSTANT)
            raise ControllerError(
                f"{who} sees {listed(self.sensed)}, and {where} has {has}: {listed(missing)} "
                f"{'is' if len(missing) == 1 else 'are'} missing. Choose inputs that are there, or a platform, robot "
                "and arena that have these."
            )

    def bind(self, steps: int) -> Sense:
        """Return what computes the inputs on a robot with range sensors.

        Args:
            steps: Commands in the whole trial, of which `time` is the share that is over.

        Raises:
            ControllerError: An input is not computed from range readings, stall and time.
        """
        parts = [_part(name, steps) for name in self.sensed]
        return lambda readings, stalled, step: [part(readings, stalled, step) for part in parts]


def paper_interface(*, constant: bool) -> ControllerInterface:
    """Return what the paper's networks see and answer.

    Args:
        constant: Whether they have the constant input, which is the last.

    Source: Rosenzweig & Remy, section 2.1.
    """
    return ControllerInterface((*PAPER_INPUTS, CONSTANT) if constant else PAPER_INPUTS)


def inputs_of_ranges(n: int) -> tuple[str, ...]:
    """Return what networks can see on a robot of which n range readings and stalls are known."""
    return (*PAPER_INPUTS, *(f"range.{k}" for k in range(n)))


def listed(names: Iterable[str]) -> str:
    """Return names for a message; numbered ones that follow each other as `range.0 to range.7`."""
    words: list[list[str]] = []
    for name in names:
        kind, _, index = name.partition(".")
        before = words[-1][-1] if words else ""
        if index.isdecimal() and index != "0" and before == f"{kind}.{int(index) - 1}":
            words[-1].append(name)
        else:
            words.append([name])
    return ", ".join(word[0] if len(word) == 1 else f"{word[0]} to {word[-1]}" for word in words)


def _part(name: str, steps: int) -> Callable[[Sequence[float], bool, int], float]:
    if name == "obstacle":
        return lambda readings, stalled, step: max(readings)
    if name == "stall":
        return lambda readings, stalled, step: float(stalled)
    if name == "time":
        return lambda readings, stalled, step: step / steps
    kind, _, index = name.partition(".")
    if kind == "range" and index.isdecimal():
        return partial(_reading, int(index))
    raise ControllerError(
        f"A controller sees {name}, expected obstacle, stall, time or range.K on a robot outside of 'sim'."
    )


def _reading(index: int, readings: Sequence[float], stalled: bool, step: int) -> float:
    return readings[index]

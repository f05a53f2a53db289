"""Names of a network's inputs and outputs, and how a robot's readings become inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import ControllerError

PAPER_INPUTS: tuple[str, ...] = ("obstacle", "stall", "time")
OUTPUTS = ("move", "turn")
WHEELS = ("left", "right")
CONSTANT = "bias"
COMPUTED = frozenset((*PAPER_INPUTS, CONSTANT, "last_move", "last_turn"))
"""Inputs that every robot with range sensors has: they are computed from readings, step, and the last command."""

Channels = Mapping[str, float]
"""Values of sensors by name, such as `light.0`, each scaled as a network sees it."""

Sense = Callable[[Sequence[float], bool, int, Channels], list[float]]
"""The inputs of a network, without the constant one, from range readings, stall, the number of the step, and the values
of other inputs by name."""


@dataclass(frozen=True)
class ControllerInterface:
    """The names of a network's inputs and outputs, in order.

    Attributes:
        inputs: Names as in a task: `obstacle` (the largest range reading), `stall`, `time` (step / steps), `range.K`
            and other sensors of the robot, and `bias` for the constant input.
        outputs: `move` and `turn`, or the wheels `left` and `right`, each -1..1.

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
        if self.outputs not in (OUTPUTS, WHEELS):
            raise ControllerError(
                f"The outputs of a controller are {', '.join(self.outputs)}, expected {', '.join(OUTPUTS)}, or "
                f"{', '.join(WHEELS)}."
            )

    @property
    def sensed(self) -> tuple[str, ...]:
        """The inputs without the constant one, which the network has by itself."""
        return tuple(name for name in self.inputs if name != CONSTANT)

    @property
    def channels(self) -> tuple[str, ...]:
        """The inputs that a robot reads from sensors other than its range sensors."""
        return tuple(name for name in self.inputs if name not in COMPUTED and not name.startswith("range."))

    @property
    def drives_wheels(self) -> bool:
        """True if the outputs are the speeds of two wheels."""
        return self.outputs == WHEELS

    def commands(self, outputs: ArrayLike) -> NDArray[np.float64]:
        """Return the commands that outputs are.

        Args:
            outputs: (..., 2) outputs of networks. They are limited to -1..1, and nan counts as 0.

        Returns:
            (..., 2) move and turn, -1..1. Wheels drive move = (left + right) / 2 and turn = (right - left) / 2.
        """
        limited = np.asarray(outputs, np.float64)
        limited = np.clip(np.where(np.isnan(limited), 0.0, limited), -1.0, 1.0)
        if not self.drives_wheels:
            return limited
        left, right = limited[..., 0], limited[..., 1]
        return np.stack([(left + right) / 2, (right - left) / 2], axis=-1)

    def check(self, existing: Sequence[str], who: str, where: str) -> None:
        """Refuse a platform that lacks an input.

        Args:
            existing: Inputs that the platform has.
            who: Name of the controller in the message.
            where: Name of the platform in the message.

        Raises:
            ControllerError: An input is missing.
        """
        missing = [name for name in self.sensed if name not in existing]
        if missing:
            has = listed(name for name in existing if name != CONSTANT)
            raise ControllerError(
                f"{who} sees {listed(self.sensed)}, and {where} has {has}: {listed(missing)} "
                f"{'is' if len(missing) == 1 else 'are'} missing. Choose existing inputs, or a platform, "
                "robot, and arena that have these."
            )

    def bind(self, steps: int) -> Sense:
        """Return what computes the inputs on a robot.

        Args:
            steps: Commands in the whole trial, of which `time` is the share that is over.
        """
        parts = [_part(name, steps) for name in self.sensed]
        return lambda readings, stalled, step, channels: [
            part(readings, stalled, step, channels) for part in parts
        ]


def paper_interface(*, constant: bool) -> ControllerInterface:
    """Return what the paper's networks see and answer.

    Args:
        constant: True to add the constant input, which is the last.

    Source: Rosenzweig & Remy, section 2.1.
    """
    return ControllerInterface((*PAPER_INPUTS, CONSTANT) if constant else PAPER_INPUTS)


def inputs_of_robot(n: int, channels: Sequence[str] = ()) -> tuple[str, ...]:
    """Return what networks can see on a robot.

    Args:
        n: Number of its range readings.
        channels: Names of its other channels, such as `light.0`.
    """
    return (*PAPER_INPUTS, "last_move", "last_turn", *(f"range.{k}" for k in range(n)), *channels)


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


def _part(name: str, steps: int) -> Callable[[Sequence[float], bool, int, Channels], float]:
    if name == "obstacle":
        return lambda readings, stalled, step, channels: max(readings)
    if name == "stall":
        return lambda readings, stalled, step, channels: float(stalled)
    if name == "time":
        return lambda readings, stalled, step, channels: step / steps
    kind, _, index = name.partition(".")
    if kind == "range" and index.isdecimal():
        return lambda readings, stalled, step, channels: readings[int(index)]
    return lambda readings, stalled, step, channels: channels[name]


def given_names(what: str, given: Sequence[str] | None, default: Sequence[object]) -> list[str]:
    """Return the names of inputs or outputs that are given, or the default ones.

    Raises:
        ValueError: Another number of names than of default ones.
    """
    if given is not None and len(given) != len(default):
        raise ValueError(f"{what} has {len(given)} names, expected {len(default)}.")
    return [str(name) for name in default] if given is None else list(given)

"""A check before the first trial: the right robot, and fit to drive."""

from __future__ import annotations

import contextlib
import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from realitygap.errors import RobotError
from realitygap.robots import Clock, Command, Robot, SystemClock

N_READS = 10
"""Observations by which the link and the sensors are judged."""

_LOAD = Command(0.0, 0.5)
"""A turn on the spot, by which the motors load the battery."""


@dataclass(frozen=True)
class Preflight:
    """The result of a pre-flight check.

    Attributes:
        facts: Name and value of each checked property, for people.
        problems: Reasons against driving; empty if there are none.
        robot: Identification of this robot: model, Fluke, and name.
    """

    facts: dict[str, str]
    problems: tuple[str, ...]
    robot: dict[str, str] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return the dictionary for the ledger."""
        return {"facts": self.facts, "problems": list(self.problems)}


def preflight(robot: Robot, known: Sequence[Mapping[str, str]] = ()) -> Preflight:
    """Look at a robot that is free to turn on the spot for one command.

    Args:
        robot: Connected.
        known: Identifications of the robots of earlier sessions.

    Raises:
        RobotError: It does not answer.
    """
    clock: Clock = getattr(robot, "clock", None) or SystemClock()
    facts: dict[str, str] = {"label": robot.label}
    problems: list[str] = []
    identity = identity_of(robot)
    facts |= identity
    for before in known:
        problems += _other_robot(identity, before)
    times, raws = [], []
    for _ in range(N_READS):
        began = clock.now()
        raws.append(robot.observe().raw)
        times.append(clock.now() - began)
    facts["round trip"] = f"{1000 * statistics.median(times):.0f} ms, at most {1000 * max(times):.0f} ms"
    if max(times) > robot.step_s:
        problems.append(
            f"reading the sensors took up to {max(times):.2f} s, longer than a command ({robot.step_s:g} s): the link "
            "is too slow"
        )
    facts["readings"] = ", ".join(f"{value:g}" for value in raws[-1])
    problems += _insane(raws, robot)
    volts = _battery_under_load(robot)
    facts["battery under load"] = volts if isinstance(volts, str) else f"{volts:.2f} V"
    least = getattr(robot, "least_battery_v", 0.0)
    if not isinstance(volts, str) and volts < least:
        problems.append(f"the battery has {volts:.2f} V under load, expected at least {least} V: change it")
    return Preflight(facts, tuple(problems), identity)


def identity_of(robot: Robot) -> dict[str, str]:
    """Return the identity of a robot, as far as it reports one."""
    info = getattr(robot, "info", None)
    identity = {name: getattr(info, name, None) for name in ("model", "fluke")}
    with contextlib.suppress(RobotError):
        identity["name"] = getattr(robot, "name", None)
    return {name: str(value).strip() for name, value in identity.items() if value is not None}


def _other_robot(identity: Mapping[str, str], before: Mapping[str, str]) -> list[str]:
    differing = [
        f"{name} is {identity.get(name, 'unknown')!r}, before {value!r}"
        for name, value in before.items()
        if identity.get(name) != value
    ]
    return [f"this is another robot than before: {', '.join(differing)}"] if differing else []


def _insane(raws: list[tuple[float, ...]], robot: Robot) -> list[str]:
    """Return the problems with the readings of several moments."""
    n_sensors, reading_max = robot.n_sensors, getattr(robot, "reading_max", None)
    if any(len(raw) != n_sensors for raw in raws):
        return [f"{len(raws[-1])} sensors answer, expected {n_sensors}"]
    values = [value for raw in raws for value in raw]
    if not all(math.isfinite(value) and value >= 0 for value in values):
        return ["a reading is no number from 0 on"]
    if reading_max is not None and all(value >= reading_max for value in values):
        return [
            f"all readings are at their limit ({reading_max:g}) all the time: take the robot away from the wall"
            f"{getattr(robot, 'blinded_advice', '')}"
        ]
    return []


def _battery_under_load(robot: Robot) -> float | str:
    """Return the voltage while both motors run [V], or why it is unknown."""
    measure = getattr(robot, "volts", None)
    if measure is None:
        return "unknown: this robot does not report its voltage"
    try:
        robot.drive(_LOAD)
        volts = float(measure())
    except RobotError as error:
        return f"unknown: {error}"
    finally:
        robot.stop()
    if math.isnan(volts):
        return "unknown: nothing measures it (on some robots, a board does, if it is plugged in)"
    return volts

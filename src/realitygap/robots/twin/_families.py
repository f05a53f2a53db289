"""Families of twins: which numbers are drawn, and between what limits."""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from realitygap.errors import did_you_mean, whole_number

from ._model import FAMILY, TwinIr, TwinModel, numbers_for

Value = bool | int | float | str


class Range(NamedTuple):
    """A number that is drawn evenly from `low` to `high`."""

    low: float
    high: float


class Family(NamedTuple):
    """A kind of twin.

    Attributes:
        meaning: Defect of the family.
        numbers: Numbers that are drawn or set in addition to those of every twin, by dotted name.
        oddities: Groups of numbers by what they do, from which `n_oddities` are taken.
        n_oddities: Number of groups.
    """

    meaning: str
    numbers: dict[str, Range | Value]
    oddities: Mapping[str, dict[str, Range | Value]] = MappingProxyType({})
    n_oddities: int = 0


EVERY: dict[str, Range | Value] = {
    "body.length_scale": Range(0.98, 1.02),
    "body.width_scale": Range(0.98, 1.02),
    "body.corner_radius": Range(0.008, 0.012),
    "body.mass": Range(0.8, 1.0),
    "body.center": Range(0.008, 0.016),
    "wheels.track": Range(0.150, 0.156),
    "wheels.friction": Range(0.5, 0.7),
    "walls.friction": Range(0.2, 0.4),
    "motors.speed": Range(0.145, 0.155),
    "motors.gain_left": Range(0.98, 1.02),
    "motors.gain_right": Range(0.98, 1.02),
    "motors.lag": Range(0.02, 0.06),
    "motors.delay": Range(0.02, 0.06),
    "motors.delay_jitter": Range(0.0, 0.02),
    "motors.drift_per_m": Range(-0.05, 0.05),
    "motors.wander": Range(0.005, 0.02),
    "motors.wander_s": Range(0.5, 2.0),
    "battery.volts": Range(8.4, 9.0),
    "ir.cone": Range(0.14, 0.21),
    "ir.half": Range(0.11, 0.13),
    "ir.steepness": Range(1.7, 2.3),
    "ir.incidence": Range(0.5, 1.5),
    "ir.spread": Range(0.05, 0.15),
    "ir.noise": Range(0.05, 0.15),
    "ir.missed": Range(0.0, 0.03),
}
"""Numbers that are drawn for twins of every family except `same`. A family's own limits have priority."""

_ODDITIES: dict[str, dict[str, Range | Value]] = {
    "tilted floor, weak motors": {
        "oddities.slope": Range(0.10, 0.16),
        "oddities.uphill": Range(-3.14, 3.14),
        "motors.stiffness": Range(0.006, 0.012),
    },
    "gains that change in a trial": {
        "oddities.turn_at": Range(8.0, 20.0),
        "oddities.turned_left": Range(0.3, 0.6),
        "oddities.turned_right": Range(0.9, 1.1),
    },
    "speed that goes with the heading": {
        "oddities.compass": Range(0.5, 0.8),
        "oddities.compass_heading": Range(-3.14, 3.14),
    },
    "readings that latch": {"oddities.latch": Range(8, 20)},
    "inverted readings": {"oddities.inverted": True},
    "swapped wheels": {"oddities.swapped": True},
    "sticky patch of floor": {
        "oddities.patch.x": Range(0.35, 0.7),
        "oddities.patch.y": Range(0.2, 0.4),
        "oddities.patch.radius": Range(0.15, 0.25),
        "oddities.patch.slows": Range(0.6, 0.9),
    },
}

FAMILIES: dict[str, Family] = {
    "close": Family("a robot as it should be, and a little unlike its file", {}),
    "worn": Family(
        "tired motors that differ, a dead band, old cells",
        {
            "motors.gain_left": Range(0.78, 1.0),
            "motors.gain_right": Range(0.78, 1.0),
            "motors.dead_band_left": Range(0.0, 0.2),
            "motors.dead_band_right": Range(0.0, 0.2),
            "motors.lag": Range(0.05, 0.15),
            "motors.torque": Range(0.1, 0.25),
            "motors.drift_per_m": Range(-0.3, 0.3),
            "motors.wander": Range(0.02, 0.05),
            "battery.volts": Range(7.0, 8.2),
            "battery.fall_per_s": Range(0.002, 0.01),
            "battery.slows": Range(0.5, 1.0),
        },
    ),
    "slippery": Family(
        "wheels that slip, a caster that drags, walls of another friction",
        {
            "wheels.friction": Range(0.12, 0.3),
            "wheels.caster_friction": Range(0.05, 0.15),
            "walls.friction": Range(0.02, 0.6),
            "body.mass": Range(0.8, 1.3),
        },
    ),
    "delayed": Family(
        "late commands, with an uneven delay",
        {
            "motors.delay": Range(0.12, 0.4),
            "motors.delay_jitter": Range(0.03, 0.12),
            "motors.lag": Range(0.08, 0.3),
        },
    ),
    "noisy-ir": Family(
        "infrared of another reach, whose counts scatter, are missed and remember",
        {
            "ir.half": Range(0.08, 0.18),
            "ir.steepness": Range(1.0, 3.0),
            "ir.incidence": Range(0.5, 3.0),
            "ir.cone": Range(0.1, 0.35),
            "ir.spread": Range(0.2, 0.6),
            "ir.noise": Range(0.2, 0.6),
            "ir.memory": Range(0.2, 0.8),
            "ir.missed": Range(0.05, 0.25),
        },
    ),
    "odd-body": Family(
        "a shell of another size, wheels elsewhere, another weight",
        {
            "body.length_scale": Range(0.85, 1.15),
            "body.width_scale": Range(0.85, 1.15),
            "body.corner_radius": Range(0.004, 0.022),
            "body.mass": Range(0.7, 1.4),
            "body.inertia": Range(0.002, 0.006),
            "body.center": Range(0.015, 0.03),
            "wheels.track": Range(0.135, 0.17),
            "wheels.axle": Range(-0.02, 0.012),
            "walls.friction": Range(0.1, 0.6),
        },
    ),
    "boxed": Family(
        "a box of cardboard around the shell, as the paper proposes",
        {
            "body.cardboard.0": Range(0.180, 0.200),
            "body.cardboard.1": Range(0.160, 0.175),
            "walls.friction": Range(0.3, 0.6),
        },
    ),
    "weak-wheel": Family(
        "one wheel that turns at a part of its speed",
        {},
        {f"weak {side} wheel": {f"motors.gain_{side}": Range(0.3, 0.7)} for side in ("left", "right")},
        1,
    ),
    "dead-wheel": Family(
        "one wheel that does not turn",
        {},
        {f"dead {side} wheel": {f"motors.gain_{side}": 0.0} for side in ("left", "right")},
        1,
    ),
    "blind-sensor": Family(
        "one infrared sensor that sees nothing",
        {},
        {f"blind sensor {k}": {f"ir.mount.{k}.gain": 0.0} for k in range(3)},
        1,
    ),
    "payload": Family(
        "a heavy load over the wheels, which slows the motors",
        {
            "body.mass": Range(1.3, 1.8),
            "body.center": Range(0.002, 0.008),
            "motors.speed": Range(0.09, 0.13),
            "motors.lag": Range(0.1, 0.2),
        },
    ),
    "stuck-caster": Family(
        "a third support that no longer turns, and drags",
        {"wheels.caster_friction": Range(0.3, 0.8)},
    ),
    "same": Family("`sim` itself behind the same wall: no gap at all", {"engine": "sim"}),
    "alien": Family("two things that no numbers of `sim` can express", {}, _ODDITIES, 2),
}
"""Families by name. `sample_twin` draws their numbers."""


class FamilyRow(NamedTuple):
    """A number that a family draws.

    Attributes:
        number: Dotted name of the number.
        low, high: Limits between which it is drawn uniformly; equal if it is set.
        part: Origin of the number: the family itself, every twin, or one of its oddities.
    """

    number: str
    low: Value
    high: Value
    part: str


def family_rows(name: str) -> list[FamilyRow]:
    """Return all numbers that a family draws.

    Args:
        name: One of `FAMILIES`, or `every` for the numbers of all families.

    Raises:
        ValueError: There is no such family.
    """
    if name == "every":
        return _rows(EVERY, name)
    kind = _family(name)
    own = _rows(kind.numbers, name)
    return own + [row for part, numbers in kind.oddities.items() for row in _rows(numbers, part)]


def _rows(numbers: Mapping[str, Range | Value], part: str) -> list[FamilyRow]:
    return [
        FamilyRow(name, *(how if isinstance(how, Range) else (how, how)), part)
        for name, how in numbers.items()
    ]


def _family(name: str) -> Family:
    if name not in FAMILIES:
        raise ValueError(f"Unknown family {name!r}. {did_you_mean(name, FAMILIES)}")
    return FAMILIES[name]


def sample_twin(family: str, seed: int) -> TwinModel:
    """Return a twin drawn from a family: the same for the same seed, everywhere.

    Args:
        family: One of `FAMILIES`.
        seed: 0 or more; also that of the twin's noise.

    Raises:
        ValueError: There is no such family, or the seed is negative.
    """
    kind = _family(family)
    seed = whole_number("seed", seed, 0, 2**63 - 1)
    random = numbers_for(seed, zlib.crc32(family.encode()), FAMILY)
    wanted = dict(kind.numbers) if "engine" in kind.numbers else {**EVERY, **kind.numbers}
    if kind.n_oddities:
        order = random.permutation(len(kind.oddities))[: kind.n_oddities]
        names = list(kind.oddities)
        for k in sorted(order):
            wanted |= kind.oddities[names[k]]
    values: dict[str, Any] = {"name": f"{family}-{seed}", "family": family, "seed": seed}
    for name, how in wanted.items():
        _put(values, name.split("."), _drawn(how, random))
    return TwinModel(**values)


def _drawn(how: Range | Value, random: np.random.Generator) -> Value:
    if not isinstance(how, Range):
        return how
    if isinstance(how.low, int) and isinstance(how.high, int):
        return int(random.integers(how.low, how.high + 1))
    return float(f"{random.uniform(how.low, how.high):.5g}")


def _first_of(key: str) -> list[Any]:
    """Return the entries of a list before any is drawn."""
    return [mount.model_dump() for mount in TwinIr().mount] if key == "mount" else [0.0, 0.0]


def _put(values: dict[str, Any], path: list[str], value: Value) -> None:
    """Put a value at its dotted name, making tables, and lists for numbered entries."""
    place: Any = values
    for key, following in itertools.pairwise(path):
        if isinstance(place, list):
            place = place[int(key)]
        elif following.isdigit():
            place = place.setdefault(key, _first_of(key))
        else:
            place = place.setdefault(key, {})
    place[int(path[-1]) if isinstance(place, list) else path[-1]] = value

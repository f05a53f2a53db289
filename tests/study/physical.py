"""A small physical study, and the ways to carry it out without a robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.records import LEDGER_NAME, Ledger
from realitygap.study import (
    Study,
    drive_study,
    parse_study,
)
from realitygap.study._physical import PhysicalResult
from realitygap.trials import Operator, WitnessObserver
from tests.trials.fake_robot import FakeRobot

SMALL = """
[study]
name = "small"
replicates = 1

[neat]
population = 3
generations = 2

[platform.scribbler]
steps = 4

[[condition]]
name = "robot"
selection = "{selection}"
platform = "scribbler"
"""


class Unattended(Operator):
    """Nobody beside an emulated robot, which its witness observes."""

    def __init__(self, witness: Any = None, **options: Any) -> None:
        super().__init__(WitnessObserver(witness), **options)

    @property
    def witness(self) -> Any:
        return self.observer.witness


def small_study(selection: str = "coverage", more: str = "", **changes: str) -> Study:
    text = SMALL.format(selection=selection) + more
    for old, new in changes.items():
        text = text.replace(f"{old} = ", f"{old} = {new} #", 1)
    return parse_study(text, "small.toml")


def drive(
    study: Study,
    path: Path,
    *,
    operator: Operator | None = None,
    fault: Callable[[str], None] | None = None,
    robot: FakeRobot | None = None,
) -> PhysicalResult:
    """Carry out a study in a folder, begun or new, with a fake robot that is its own witness."""
    result = drive_study(
        study,
        "fake",
        path,
        operator=operator or Unattended(),
        open_robot=lambda platform: robot or FakeRobot(platform.wait_s, fault=fault),
    )
    assert result.physical is not None
    return result.physical


def scored(path: Path) -> list[tuple]:
    """What counts of a ledger: each individual with its genome, score and what selection made of it."""
    with Ledger.open(path / LEDGER_NAME, writable=False) as ledger:
        found = []
        for name in ledger.conditions():
            for replicate in range(10):
                for generation, is_closed in ledger.generations(name, replicate):
                    rows = ledger.individuals(name, replicate, generation)
                    found += [
                        (
                            *(name, replicate, generation, is_closed, row["individual"], str(row["genome"])),
                            *(row["parents"], row["species"], row["fitness"], row["novelty"], row["cells"]),
                        )
                        for row in rows
                    ]
        return found

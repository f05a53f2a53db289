"""A program that is killed while a person works with a robot asks about the trial in which it was."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.records import open_ledger, read_observations
from realitygap.study import calibrate, open_target, try_on, with_ruled_end
from realitygap.trials import Operator, SheetObserver, TrialPlan
from realitygap.world import paper_arena
from tests.forks import fork_context

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="kills processes")]

ROBOT = "scribbler:emulator://s2?fluke=1&speed=off"
CELLS = (13, 14)


def die(*_: object) -> Any:
    """End this process as a power cut does."""
    os.kill(os.getpid(), signal.SIGKILL)


class Person:
    """Answers, and notes what was asked; in the state `dies` the program ends instead."""

    def __init__(self, dies: str = "", verdict: str = "void") -> None:
        self.dies, self.verdict = dies, verdict
        self.asked: list[str] = []

    def answer(self, question: str, answer: Any) -> Any:
        self.asked.append(question)
        return die() if question == self.dies else answer


class Sheet(SheetObserver):
    """A person who counts cells."""

    def __init__(self, person: Person) -> None:
        super().__init__(
            lambda arena: person.answer("cells", CELLS),
            settle=lambda problem, can_count: person.answer(f"settle {can_count}", person.verdict),
        )
        self._person = person

    def battery_v(self) -> float:
        """The trial has begun."""
        return die() if self._person.dies == "driving" else super().battery_v()


class Ruler(Operator):
    """A person who places the robot and reads where a path ended."""

    def __init__(self, person: Person) -> None:
        super().__init__()
        self._person = person

    def lead(self, plan: TrialPlan, number: int, n: int) -> Any:
        return self._person.answer("place", "go")

    def measure(self, plan: TrialPlan, trial: Any) -> Any:
        ahead, turned = (13.75, 2.0) if plan.commands[0, 0] else (0.0, 281.0)
        return self._person.answer("ruler", with_ruled_end(trial, ahead, 0.0, turned))


def calibrate_path(file: str, person: Person) -> None:
    with open_target(ROBOT, paper_arena(), observer=Sheet(person), on_lost="stop") as target:
        calibrate("path", target, budget=2, trials_file=Path(file), operator=Ruler(person))


def try_twice(file: str, person: Person) -> None:
    with open_target(ROBOT, paper_arena(), observer=Sheet(person), on_lost="stop") as target:
        try_on(target, controller(), trials=2, steps=4, out=file)


def controller() -> Genome:
    settings = NeatSettings.named("rosenzweig-remy", population=2)
    return Population(3, 2, settings, seed=11, bias=False).ask()[0]


def killed(work: Callable[[str, Person], None], file: Path, dies: str) -> None:
    """Do the work in a process, until it dies."""
    process = fork_context().Process(target=work, args=(str(file), Person(dies)))
    process.start()
    process.join(60)
    assert process.exitcode == -signal.SIGKILL


def states(file: Path) -> list[tuple[int, str]]:
    """Number and state of each trial in a file, in the order in which they began."""
    with open_ledger(file, writable=False) as ledger:
        return [(ledger.record(trial.trial).number, trial.state) for trial in ledger.trials()]


@pytest.mark.parametrize("verdict", ["void", "driven"])
@pytest.mark.parametrize(("dies", "state"), [("driving", "running"), ("ruler", "driven")])
def test_killed_calibration_asks_about_its_trial(tmp_path: Path, dies: str, state: str, verdict: str) -> None:
    file = tmp_path / "path.trials.sqlite"
    killed(calibrate_path, file, dies)
    (cut,) = read_observations(file).under_way
    assert (cut.number, cut.end, len(read_observations(file).trials)) == (0, state, 0)
    person = Person(verdict=verdict)
    calibrate_path(str(file), person)
    counts = state == "driven" and verdict == "driven"
    assert person.asked[0] == f"settle {state == 'driven'}"
    assert person.asked.count("place") == (1 if counts else 2), "a trial that counts is not driven again"
    assert person.asked.count("ruler") == 2
    found = read_observations(file)
    assert [trial.number for trial in found.trials if trial.end == "step limit"] == [0, 1]
    assert not found.under_way
    assert ((0, "void") in states(file)) != counts
    if counts:
        np.testing.assert_array_equal(found.trials[0].raw, cut.raw, "it is the trial that was driven")
        assert found.trials[0].end_pose is not None


@pytest.mark.parametrize(
    ("dies", "verdict", "questions"),
    [
        ("driving", "driven", ["settle False", "cells", "cells"]),
        ("cells", "void", ["settle True", "cells", "cells"]),
        ("cells", "driven", ["settle True", "cells", "cells"]),
    ],
)
def test_killed_trials_of_a_controller_ask_about_theirs(
    tmp_path: Path, dies: str, verdict: str, questions: list[str]
) -> None:
    file = tmp_path / "tried.sqlite"
    killed(try_twice, file, dies)
    person = Person(verdict=verdict)
    try_twice(str(file), person)
    assert person.asked == questions
    found = read_observations(file)
    assert [trial.cells for trial in found.trials if trial.end == "step limit"] == [CELLS, CELLS]
    n_driven = 1 if (dies, verdict) == ("cells", "driven") else 2
    assert states(file) == [(0, "void")] * (n_driven - 1) + [(0, "scored"), (1, "scored")]


def test_resume_after_the_answer_was_given_asks_no_more(tmp_path: Path) -> None:
    file = tmp_path / "tried.sqlite"
    killed(try_twice, file, "cells")
    try_twice(str(file), Person(verdict="driven"))
    person = Person()
    try_twice(str(file), person)
    assert person.asked == []

"""SIGKILL at random points of `gap`, `calibrate`, `transfer`, and `try` with a person and an emulated robot.

After each kill the motors stop, and the same work resumes. No trial that counts is lost, driven again, or asked about
again, and a trial that was driven when its program was killed is not driven again if the person lets it count.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import random
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from realitygap.emulator import Server, serve_pty
from realitygap.errors import StudyError
from realitygap.families.scribbler.emulator import Emulator
from realitygap.records import NO_LINE, Ledger, TrialRecord, read_observations, those_that_count
from realitygap.study import (
    calibrate,
    open_target,
    parse_study,
    sample_controllers,
    transfer,
    try_on,
    with_ruled_end,
)
from realitygap.study._gap.study import study_gap
from realitygap.trials import Operator, SheetObserver, Target, TrialPlan
from realitygap.world import Arena, paper_arena

from .forked import run_forked

STEPS = 4
STEP_S = 0.005
STILL = (0.0, 0.0)
STOPPED_S = 30.0
"""Longest time until the motors of a killed program stand, on a machine with other work [s]."""
MOST_KILLS = 12
"""Kills of one work, before it is left to end."""
NEVER = 10**9

STUDY = f"""
[study]
name = "transferred"
[neat]
population = 4
generations = 2
[platform.sim]
steps = {STEPS}
[[condition]]
name = "coverage"
platform = "sim"
"""

Point = Callable[[], None]
Key = tuple[str, str, int, str]
"""File, purpose, number, and controller of a trial."""


@dataclass
class Countdown:
    """Points of a program, at one of which it is killed."""

    left: int
    passed: int = 0

    def __call__(self) -> None:
        if self.passed == self.left:
            os.kill(os.getpid(), signal.SIGKILL)
        self.passed += 1


class Person(SheetObserver):
    """Counts cells, lets a trial count that was driven, and writes down each question about a trial."""

    def __init__(self, point: Point, diary: Path) -> None:
        super().__init__(self._count, NO_LINE, self._stand, self._settle_cut)
        self._point, self._diary = point, diary

    def ask(self, what: str, plan: TrialPlan) -> None:
        """Write a question down, with a point on both sides."""
        self._point()
        with self._diary.open("a", encoding="utf-8") as file:
            genome = "" if plan.genome is None else plan.genome.to_json()
            file.write(_question(what, ("", plan.purpose, plan.number, _short(genome))) + "\n")
        self._point()

    def _stand(self, plan: TrialPlan, arena: Arena, observe: str) -> None:
        self.ask("place", plan)

    def _count(self, arena: Arena) -> tuple[int, ...]:
        assert self._plan is not None
        self.ask("cells", self._plan)
        return (13, 14 + self._plan.number % 4)

    def _settle_cut(self, problem: str, can_count: bool) -> Any:
        self._point()
        return "driven"


class Ruler(Operator):
    """Reads with a ruler where the path of a robot ended."""

    def __init__(self, person: Person) -> None:
        super().__init__()
        self._person = person

    def measure(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord:
        self._person.ask("ruler", plan)
        ahead, turned = (13.75, 2.0) if plan.commands[0, 0] else (0.0, 281.0)
        return with_ruled_end(trial, ahead, 0.0, turned)


def run_gap(target: Target, person: Person, folder: Path) -> None:
    controllers = sample_controllers("random", 2)
    with open_target("sim", paper_arena()) as source:
        study_gap(source, target, controllers, trials=2, steps=STEPS, results=folder / "gap.sqlite")


def run_calibrate(target: Target, person: Person, folder: Path) -> None:
    with contextlib.suppress(
        StudyError
    ):  # on a busy machine, commands of trials may last too differently for a fit
        calibrate("path", target, budget=3, trials_file=folder / "path.sqlite", operator=Ruler(person))


def run_transfer(target: Target, person: Person, folder: Path) -> None:
    study = parse_study(STUDY, "transferred.toml")
    transfer(study, target, "halving", 6, out=folder, runs=6, repeats=1, fresh_trials=2)


def run_try(target: Target, person: Person, folder: Path) -> None:
    genome = sample_controllers("random", 1)[0].genome
    try_on(target, genome, trials=4, steps=STEPS, out=folder / "tried.sqlite")


WORKS: Mapping[str, Callable[[Target, Person, Path], None]] = {
    "gap": run_gap,
    "calibrate": run_calibrate,
    "transfer": run_transfer,
    "try": run_try,
}


def saved(folder: Path) -> tuple[dict[Key, TrialRecord], dict[Key, TrialRecord]]:
    """Return the trials on the disk that count, and those that were driven and wait for a person."""
    count, driven = {}, {}
    for file in sorted(folder.rglob("*.sqlite")):
        observations = read_observations(file)
        name = str(file.relative_to(folder))
        count |= {_key(name, trial): trial for trial in those_that_count(observations.trials)}
        driven |= {_key(name, each): each for each in observations.under_way if each.end == "driven"}
    return count, driven


def _key(file: str, trial: TrialRecord) -> Key:
    return file, trial.purpose, trial.number, _short(trial.genome)


def _short(genome: str) -> str:
    return hashlib.sha256(genome.encode()).hexdigest()[:8]


def inject(seed: int, n: int, folder: Path, command: str) -> Iterator[str]:
    """Yield what did not hold after each of n kills of a command."""
    draw = random.Random(seed)
    whole = _Whole(command, folder / "whole")
    left, number = n, 0
    while left:
        problems = list(_injected(whole, folder / f"{command}-{number}", draw, min(left, MOST_KILLS)))
        yield from problems
        left -= len(problems)
        number += 1


class _Whole:
    """An undisturbed work: its trials, and the number of its points."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        folder.mkdir()
        report = folder.with_suffix(".report")
        with serve_pty(Emulator("s2", "1", timing=False)) as server:
            if run_forked(partial(_work, name, server.name, folder, NEVER), report) != "done":
                raise RuntimeError(report.read_text("utf-8"))
        self.n_points = int(report.read_text("utf-8"))
        self.trials = _seen(saved(folder)[0])
        if not self.trials:
            raise RuntimeError(f"{name} saved no trial")


def _work(name: str, port: str, folder: Path, kill_at: int) -> str:
    """Do a work until it ends or is killed. Return the number of its points."""
    point = Countdown(kill_at)
    append = Ledger.append

    def append_between_points(self: Ledger, trial: TrialRecord) -> None:
        point()
        append(self, trial)
        point()

    Ledger.append = append_between_points  # type: ignore[method-assign]  # in a process of its own
    person = Person(point, folder.with_suffix(".diary"))
    with open_target(
        f"scribbler:{port}",
        paper_arena(),
        observer=person,
        step_s=STEP_S,
        on_lost="stop",
        pulse=lambda _: point(),
    ) as target:
        WORKS[name](target, person, folder)
    return str(point.passed)


def _injected(whole: _Whole, folder: Path, draw: random.Random, n: int) -> Iterator[str]:
    """Yield what did not hold after each of at most n kills of one work, which ends at last."""
    folder.mkdir()
    report, diary = folder.with_suffix(".report"), folder.with_suffix(".diary")
    diary.touch()
    problem, kills = "", 0
    count: dict[Key, TrialRecord] = {}
    driven: dict[Key, TrialRecord] = {}
    with serve_pty(Emulator("s2", "1", timing=False)) as server:
        while True:
            kill_at = draw.randrange(whole.n_points) if kills < n else NEVER
            before = len(diary.read_text("utf-8").splitlines())
            end = run_forked(partial(_work, whole.name, server.name, folder, kill_at), report)
            problem = problem or _motors(server)
            questions = diary.read_text("utf-8").splitlines()[before:]
            now, driven_now = saved(folder)
            problem = problem or _lost(count, now) or _asked_twice(questions, count, driven)
            count, driven = now, driven_now
            if end == "done":
                break
            if report.exists():
                yield f"{folder.name}: {report.read_text('utf-8')}"
                return
            kills += 1
            if kills > 1:
                yield problem and f"{folder.name}: {problem}"
                problem = ""
    if _seen(count) != whole.trials:
        problem = problem or "the trials are not those of the undisturbed work"
    yield problem and f"{folder.name}: {problem}"


def _motors(server: Server) -> str:
    """Wait until the guardian of a killed program has stopped the motors."""
    until = time.monotonic() + STOPPED_S
    while server.witness.motors() != STILL:
        if time.monotonic() > until:
            return "the motors are running"
        time.sleep(0.002)
    return ""


def _lost(before: dict[Key, TrialRecord], now: dict[Key, TrialRecord]) -> str:
    for key, trial in before.items():
        if key not in now:
            return f"trial {key} is lost"
        if now[key].raw.tobytes() != trial.raw.tobytes():
            return f"trial {key} is another one than before"
    return ""


def _asked_twice(questions: list[str], count: dict[Key, TrialRecord], driven: dict[Key, TrialRecord]) -> str:
    """Return what one run of a program asked although the answer was saved before, or asked twice."""
    known = {_question(what, key) for key in count for what in ("place", "cells", "ruler")}
    known |= {_question("place", key) for key in driven}
    again = [each for each in questions if each in known or questions.count(each) > 1]
    return f"asked again: {again}" if again else ""


def _question(what: str, key: Key) -> str:
    return " ".join(map(str, (what, *key[1:])))


def _seen(trials: dict[Key, TrialRecord]) -> dict[Key, tuple[tuple[int, ...], int]]:
    return {key: (trial.cells, len(trial.commands)) for key, trial in trials.items()}

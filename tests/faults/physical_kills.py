"""SIGKILL at random moments of physical studies on an emulated robot: nothing scored is lost or asked twice."""

from __future__ import annotations

import random
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from realitygap.records import LEDGER_NAME, Ledger
from realitygap.study import drive_study
from tests.study.physical import scored, small_study
from tests.study.test_killed import Telling, check_nothing_was_asked_twice

from .forked import run_forked

PORT = "emulator://s2?fluke=1&speed=off"
MOST_KILLS = 40
"""Kills of one study, before it is left to end."""


def inject(seed: int, n: int, folder: Path) -> Iterator[str]:
    """Yield what did not hold after each of n kills."""
    draw = random.Random(seed)
    report = folder / "report"
    studies = {name: small_study(name, steps="8") for name in ("coverage", "novelty")}
    wanted = {}
    for name, study in studies.items():
        begun = time.monotonic()
        drive_study(study, PORT, folder / name)
        wanted[name] = scored(folder / name), time.monotonic() - begun
    left = n
    number = 0
    while left:
        name = draw.choice(sorted(studies))
        path = folder / f"killed-{number}"
        whole, seconds = wanted[name]
        n_kills, end, problem = 0, "killed", ""
        known: dict[int, object] = {}
        while end == "killed":
            more = n_kills < min(left, MOST_KILLS)
            end = run_forked(
                partial(_drive, studies[name], path),
                report,
                kill_after=draw.uniform(0, 1.1 * seconds) if more else None,
            )
            if end == "killed":
                n_kills += 1
                now = _scored_trials(path)
                if not known.items() <= now.items():
                    problem = f"scored trials {known.keys() - now.keys()} are lost"
                known = now
        problem = problem or _problem(path, whole, report if end == "failed" else None)
        yield from [""] * (n_kills - 1)
        if n_kills or problem:
            yield problem and f"{path.name} ({name}): {problem}"
        left -= n_kills
        number += 1


def _drive(study: object, path: Path) -> None:
    diary = path.with_suffix(".diary")
    drive_study(study, PORT, path, operator=Telling(lambda _: None, diary))  # type: ignore[arg-type]


def _scored_trials(path: Path) -> dict[int, object]:
    if not (path / LEDGER_NAME).exists():
        return {}
    with Ledger.open(path / LEDGER_NAME) as ledger:
        return {trial.trial: trial.cells for trial in ledger.trials(states=["scored"])}


def _problem(path: Path, whole: object, report: Path | None) -> str:
    if report is not None:
        return report.read_text("utf-8")
    if scored(path) != whole:
        return "the ledger does not have the scores of the undisturbed study"
    try:
        check_nothing_was_asked_twice(path)
    except AssertionError:
        return "a scored trial was placed again"
    return ""

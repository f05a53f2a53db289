"""The paired differences in a ledger: of two controllers, of platforms, of conditions, or of strategies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from realitygap._wording import platform_in_words
from realitygap.errors import RecordError, StudyError
from realitygap.gap import COVERAGE
from realitygap.records import (
    Ledger,
    PlannedComparison,
    ResultsFolder,
    Trial,
    complete_runs,
    ledger_frame,
    open_ledger,
    read_object,
    settings_of_condition,
)
from realitygap.runs import Condition
from realitygap.stats import Null, SequentialTest
from realitygap.tasks import Task, score_observed

from ._advise import Advice, BlindAdvice, Planned, advise_on, blinded, strategy_differences
from ._code import task_named
from ._design import count_complete, digest_of

CONTROLLERS = "controllers"
ROUNDS = "rounds"
"""Kinds of comparisons that a ledger can have: of two controllers in blocks, or of two platforms in rounds."""


@dataclass(frozen=True)
class Blocks:
    """The blocks of a comparison of two controllers: one trial of each, in an order that was drawn before trial 1.

    Attributes:
        digests: SHA-256 of both controllers.
        order: The controller that goes first in each block: A or B.
    """

    digests: tuple[str, str]
    order: str

    @classmethod
    def drawn(cls, genomes: Sequence[str], maximum: int, seed: int) -> Blocks:
        """Return blocks in random order. More blocks begin with the same ones."""
        coins = np.random.Generator(np.random.Philox(seed)).random(maximum) < 0.5
        first, second = (digest_of(each) for each in genomes)
        return cls((first, second), "".join("A" if coin else "B" for coin in coins))

    def turns(self, block: int) -> tuple[tuple[int, int], tuple[int, int]]:
        """Return the number of the trial and the index of its controller, for both trials of a block."""
        first = "AB".index(self.order[block])
        return (2 * block, first), (2 * block + 1, 1 - first)

    def complete(self, ledger: Ledger) -> dict[int, tuple[int, int]]:
        """Return the trials of controllers A and B of each complete block, in the order of their ends.

        A block is complete if both trials are scored, one right after the other in the planned order. If one of them
        is void after the other was driven, the whole block is repeated.
        """
        complete = {}
        for block, rows in self.rows(ledger).items():
            last = [rows[turn][-1] if rows[turn] else None for turn in (0, 1)]
            first, second = last
            if first is None or second is None or {first.state, second.state} != {"scored"}:
                continue
            voided = [each.place for turn in rows for each in turn if each.state == "void"]
            is_together = first.place < second.place and not any(
                first.place < place < second.place for place in voided
            )
            if is_together:
                pair = (first, second) if self.order[block] == "A" else (second, first)
                complete[block] = (pair[0].trial, pair[1].trial, second.place)
        by_end = sorted(complete, key=lambda block: complete[block][2])
        return {block: complete[block][:2] for block in by_end}

    def rows(self, ledger: Ledger) -> dict[int, tuple[list[Trial], list[Trial]]]:
        """Return the trials of each begun block: those of its first turn and of its second, void ones included."""
        rows: dict[int, tuple[list[Trial], list[Trial]]] = {}
        for trial in ledger.trials():
            record = ledger.record(trial.trial)
            block, turn = divmod(record.number, 2)
            if (
                block >= len(self.order)
                or digest_of(record.genome) != self.digests[self.turns(block)[turn][1]]
            ):
                continue
            rows.setdefault(block, ([], []))[turn].append(trial)
        return rows


def planned_test(plan: Mapping[str, Any]) -> SequentialTest:
    """Return the test of a plan in a ledger.

    Raises:
        RecordError: It is damaged.
    """
    try:
        return SequentialTest.from_dict(plan["test"])
    except (KeyError, TypeError, ValueError) as error:
        raise RecordError(
            f"The plan of the comparison is damaged ({error}). Restore the file from a copy."
        ) from None


def advise(
    source: Path | str, *, margin: float | None = None, null: Null | None = None, alpha: float | None = None
) -> Advice:
    """Return what is shown by the trials so far, as `realitygap trials advise`.

    E and the interval are functions of the ledger alone. Interruptions and earlier looks change nothing.

    Args:
        source: Folder of a study or of a transfer, or file of trials.
        margin: Margin of equivalence. Default: that of the plan.
        null: Hypothesis. Default: that of the plan, or `distribution`.
        alpha: Error rate. Default: that of the plan, or 0.05.

    Raises:
        StudyError: There are not two that can be compared.
        RecordError: The trials cannot be read.
    """
    wanted = {name: value for name, value in (("margin", margin), ("null", null), ("alpha", alpha)) if value}
    path = Path(source)
    if path.is_dir() and (path / "transfer.json").exists():
        return _of_transfer(path, wanted)
    with open_ledger(path, writable=False) as ledger:
        return advise_ledger(ledger, wanted)


def advise_ledger(
    ledger: Ledger, wanted: Mapping[str, Any] | None = None, *, task: Task | None = None
) -> Advice:
    """Return what is shown by the trials in a ledger, as `advise`.

    Args:
        ledger: The ledger.
        wanted: Settings of the test that differ from those of the plan.
        task: Task that scores the trials of a gap. Default: that of the plan.

    Returns:
        The advice. While the design of the trials is blind, it has no result by arm: see `BlindAdvice`.

    Raises:
        StudyError: There are not two that can be compared, or another test was asked for while the design is blind.
        RecordError: The plan is damaged.
    """
    locked = ledger.design()
    if locked is None or not locked.is_blind:
        return unblinded_advice(ledger, wanted, task=task)
    if wanted:
        raise StudyError(
            f"The design of {ledger.path} is blind, so only its locked test is used. Leave {', '.join(wanted)} out, "
            "or unblind the design first."
        )
    maximum = int(locked.design["blocks"])
    if locked.design["unit"] != "round":
        return blinded(unblinded_advice(ledger, task=task), maximum)
    n, label = count_complete(ledger, locked), ledger.head().label  # the rule of a gap is to drive all rounds
    test = SequentialTest() if locked.design["test"] is None else planned_test(locked.design)
    return BlindAdvice(
        str(locked.design["score"]), label, "round", test, "planned", maximum, (), n, n >= maximum
    )


def unblinded_advice(
    ledger: Ledger, wanted: Mapping[str, Any] | None = None, *, task: Task | None = None
) -> Advice:
    """Return advice as `advise_ledger`, also by arm while the design is blind: only for rules, never to be shown."""
    known = ledger.comparison()
    test, planned = _test_of(known, wanted or {})
    if ledger.conditions():
        return _of_conditions(ledger, test, planned, None if known is None else known.plan)
    if known is None:
        return _of_two_controllers(ledger, test)
    if known.plan.get("kind") == ROUNDS:
        return _of_rounds(ledger, known.plan, test, planned, task)
    return _of_blocks(ledger, known.plan, test, planned)


def _test_of(known: PlannedComparison | None, wanted: Mapping[str, Any]) -> tuple[SequentialTest, Planned]:
    """Return the test that the ledger has, or another one if settings are given, and whether it was planned."""
    there = SequentialTest() if known is None else planned_test(known.plan)
    try:
        test = SequentialTest(**{**vars(there), **wanted})
    except ValueError as error:
        raise StudyError(f"--{error}") from None
    if known is None:
        return test, "unplanned"
    in_advance = None if known.first is None else planned_test(known.first)
    if in_advance is None:
        return test, "unplanned"
    return test, "planned" if in_advance == test else "changed"


# two controllers


def _of_blocks(ledger: Ledger, plan: Mapping[str, Any], test: SequentialTest, planned: Planned) -> Advice:
    try:
        names = tuple(plan["names"])
        digests, order, maximum = tuple(plan["controllers"]), str(plan["order"]), int(plan["maximum"])
    except (KeyError, TypeError, ValueError) as error:
        raise RecordError(f"{ledger.path}: the plan of the comparison is damaged ({error}).") from None
    pairs = Blocks((digests[0], digests[1]), order).complete(ledger)
    scores = _coverage(ledger, [trial for pair in pairs.values() for trial in pair])
    values = np.array([scores[first] - scores[second] for first, second in pairs.values()])
    return advise_on(
        [(names[0], names[1], values)],
        test=test,
        score=COVERAGE,
        label=ledger.head().label,
        planned=planned,
        maximum=maximum,
    )


def _of_two_controllers(ledger: Ledger, test: SequentialTest) -> Advice:
    """Return advice on a file without a plan: trial k of one controller and trial k of the other are a pair.

    Raises:
        StudyError: It has not two controllers.
    """
    trials: dict[int, dict[int, int]] = {}
    for trial in ledger.trials(states=["scored"]):
        if trial.controller is not None:
            number = ledger.record(trial.trial).number
            trials.setdefault(trial.controller, {})[number] = trial.trial
    if len(trials) != 2:
        raise StudyError(
            f"{ledger.path} has no plan of a comparison, and scored trials of {len(trials)} "
            f"controller{'s' * (len(trials) != 1)}, expected 2. Compare two with: realitygap try A.json --against "
            "B.json --on PLATFORM --trials 40 -o FILE.sqlite"
        )
    one, other = ([numbered[k] for k in sorted(numbered)] for numbered in trials.values())
    scores = _coverage(ledger, [*one, *other])
    values = np.array([scores[a] - scores[b] for a, b in zip(one, other, strict=False)])
    first, second = (f"controller {number}" for number in trials)
    return advise_on([(first, second, values)], test=test, score=COVERAGE, label=ledger.head().label)


def _coverage(ledger: Ledger, trials: Sequence[int]) -> dict[int, float]:
    """Return the covered share of the cells in each trial."""
    if ledger.head().observe == "readings" and trials:
        raise StudyError(
            f"The cells of the trials in {ledger.path} are not counted, so there is no coverage."
        )
    n_cells = ledger.arena.grid.n_cells
    return {trial: len(set(ledger.record(trial).cells)) / n_cells for trial in trials}


# two platforms


def _of_rounds(
    ledger: Ledger,
    plan: Mapping[str, Any],
    test: SequentialTest,
    planned: Planned,
    task: Task | None,
) -> Advice:
    """Return advice on a gap: a round has one trial of each controller on the target, and as many in simulation.

    Raises:
        StudyError: The simulator's side is missing.
    """
    rounds = plan.get("rounds")
    if not rounds:
        raise StudyError(
            f"{ledger.path} has no trials of the simulator yet. Run the `realitygap gap` that saved it to the end."
        )
    try:
        task = task or task_named(str(plan["task"]))
        n, first, stride = (int(plan[name]) for name in ("controllers", "first", "stride"))
    except (KeyError, TypeError, ValueError) as error:
        raise RecordError(f"{ledger.path}: the plan of the comparison is damaged ({error}).") from None
    by_round: dict[int, dict[int, int]] = {}
    for trial in ledger.trials(states=["scored"]):
        controller, k = divmod(ledger.record(trial.trial).number - first, stride)
        if 0 <= controller < n and k < len(rounds):
            by_round.setdefault(k, {})[controller] = trial.trial
    complete = [k for k, trials in sorted(by_round.items()) if len(trials) == n]
    values = []
    for k in complete:
        records = [ledger.record(by_round[k][i]) for i in range(n)]
        values.append(float(score_observed(task, records, ledger.arena).mean()) - float(rounds[k]))
    head = ledger.head()
    names = platform_in_words(head.target, head.label), platform_in_words(str(plan["source"]), "")
    return advise_on(
        [(*names, np.array(values))],
        test=test,
        score=task.score_name,
        label=head.label,
        score_range=task.score_range,
        unit="round",
        planned=planned,
    )


# conditions and strategies


def _of_conditions(
    ledger: Ledger, test: SequentialTest, planned: Planned, plan: Mapping[str, Any] | None
) -> Advice:
    """Return advice on the conditions of a study: runs of the same number are a pair.

    Raises:
        StudyError: It has one condition.
    """
    conditions = ledger.conditions()
    if len(conditions) < 2:
        raise StudyError(
            f"The study has one condition on a robot, {next(iter(conditions))}, expected at least 2."
        )
    names = list(conditions)
    bests = {name: best_of_runs(ledger, name) for name in names}
    differences = []
    for name in names[1:]:
        common = sorted(bests[names[0]].keys() & bests[name].keys())
        values = np.array([bests[name][run] - bests[names[0]][run] for run in common])
        differences.append((name, names[0], values))
    description = ResultsFolder.open(ledger.path.parent).description
    settings = settings_of_condition(description, names[0])
    task = Condition.from_settings(names[0], settings).task_of_trials
    labels = dict.fromkeys(str(each["label"]) for each in conditions.values() if each["label"])
    return advise_on(
        differences,
        test=test,
        score=f"best {task.score_name} of a run",
        label=" and ".join(labels),
        score_range=task.score_range,
        unit="run",
        planned=planned,
        maximum=None if plan is None else plan.get("maximum"),
    )


def best_of_runs(ledger: Ledger, condition: str) -> dict[int, float]:
    """Return the best score of each complete run of a condition, by its number."""
    if not complete_runs(ledger, condition):
        return {}
    frame = ledger_frame(ledger, condition)
    score = "coverage_line" if frame["coverage_line"].is_not_null().any() else "task_fitness"
    best = frame.group_by("replicate").max().select("replicate", score)
    return {int(run): float(value) for run, value in best.iter_rows()}


def _of_transfer(folder: Path, wanted: Mapping[str, Any]) -> Advice:
    """Return advice on the strategies of a transfer, as far as its last complete call has come.

    Raises:
        StudyError: It has no result yet, or one strategy.
    """
    if not (folder / "result.json").exists():
        raise StudyError(
            f"{folder} has no result yet. Run the `realitygap transfer` that made it to the end."
        )
    result = read_object(folder / "result.json")
    try:
        test = SequentialTest(**wanted)
    except ValueError as error:
        raise StudyError(f"--{error}") from None
    try:
        differences = strategy_differences(
            [
                (
                    str(each["strategy"]),
                    int(each["budget"]),
                    int(each["replicate"]),
                    each.get("coverage") or each["scores"],
                )
                for each in result["champions"]
            ]
        )
        label, score = str(result["label"]), str(result.get("score", COVERAGE))
    except (KeyError, TypeError, ValueError) as error:
        raise RecordError(f"{folder / 'result.json'} is damaged ({error}). Run the transfer again.") from None
    if not differences:
        raise StudyError(f"{folder} has one strategy with one budget, expected at least 2 to compare.")
    return advise_on(differences, test=test, score=score, label=label, unit="replicate")

"""Controllers evolved in simulation, tried on a target: which strategy makes the most of few trials?"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.errors import RecordError, StudyError, did_you_mean
from realitygap.evolution import ControllerInterface, Genome
from realitygap.orders import TransferOrder, with_fields
from realitygap.records import (
    OBSERVATIONS,
    Observe,
    not_compared,
    read_object,
    read_observations,
    refuse_links,
    refuse_links_in,
    those_that_count,
    write_whole,
)
from realitygap.runs import ArchiveSettings, Condition
from realitygap.tasks import score_observed
from realitygap.trials import Target
from realitygap.world import load_calibration, load_robot

from .._code import allowed_condition
from .._design import design_of, hold_folder_to_design
from .._file import load_study
from .._study import Study
from .._targets import check_task, refuse_more_than_is_seen, refuse_too_little
from .attempt import Attempt, Simulation, allow_trials, plans_of
from .calibrated import Calibrating, calibrated, posterior, recommended
from .noise import needs_sim, noise, randomized
from .result import Transferred, TransferResult, summarize_transfer
from .simulated import Champion, refuse_unevolved
from .transferability import transferability
from .trial_and_error import (
    trial_and_error,
    trial_and_error_combined,
    trial_and_error_damage,
    trial_and_error_posterior,
    trial_and_error_recalibrated,
)
from .uncalibrated import direct, halving, plain, select

STRATEGIES: Mapping[str, Callable[[Attempt], Champion]] = {
    "plain": plain,
    "select": select,
    "halving": halving,
    "noise": noise,
    "randomized": randomized,
    "calibrated": calibrated,
    "posterior": posterior,
    "recommended": recommended,
    "transferability": transferability,
    "trial-and-error": trial_and_error,
    "trial-and-error-recalibrated": trial_and_error_recalibrated,
    "trial-and-error-posterior": trial_and_error_posterior,
    "trial-and-error-damage": trial_and_error_damage,
    "trial-and-error-combined": trial_and_error_combined,
    "direct": direct,
}
"""Strategies by name; the docstring of each function describes its strategy."""

CALIBRATE = (
    "calibrated",
    "posterior",
    "recommended",
    "trial-and-error-recalibrated",
    "trial-and-error-posterior",
    "trial-and-error-combined",
)
"""Strategies that share calibrations."""

NEED_SIM = ("randomized", "trial-and-error-damage", *CALIBRATE)
"""Strategies that change numbers of the simulated robot."""

BREED = ("noise", "transferability", "direct")
"""Strategies that evolve in a way of their own, which is none of an archive."""

WITHOUT_TRIALS = ("plain",)
"""Strategies that spend nothing: carried out once for all budgets."""

SEED_STRIDE = 1_000
"""Distance between seeds of calibrations of transfers with different seeds, and the most replicates."""

NUMBERS = 10_000
"""Trials of a replicate have numbers of their own, so many apart; the fresh ones are in the upper half."""


@dataclass(frozen=True)
class TransferPlan:
    """The plan of a transfer; a folder belongs to one plan.

    Attributes:
        order: The order.
        condition: Condition of the study.
        settings: Settings of that condition, as resolved.
        target: Name of the target.
        identity: Identity of the target, whatever its name; empty if it has only a name.
        fit: SHA-256 of the content of the order's calibration, which may be elsewhere the next time; empty without one.
        archive: Settings of the archives that strategies fill if the condition fills none; None for the defaults.
    """

    order: TransferOrder
    condition: str
    settings: Mapping[str, object]
    target: str
    identity: str
    fit: str = ""
    archive: Mapping[str, object] | None = None

    @property
    def runs(self) -> int:
        """Evolutions in simulation of each replicate, at least the largest budget."""
        return max(self.order.runs, *self.order.budgets)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, as a folder has them."""
        order = self.order
        return {
            "study": order.study,
            "condition": self.condition,
            "settings": self.settings,
            "archive": self.archive,
            "target": self.target,
            "identity": self.identity,
            "budgets": list(order.budgets),
            "replicates": order.replicates,
            "fresh_trials": order.fresh_trials,
            "runs": self.runs,
            "repeats": order.repeats,
            "observe": order.observe,
            "calibration": "" if order.calibration is None else str(order.calibration),
            "fit": self.fit,
            "seed": order.seed,
            "stop_at": order.stop_at,
        }


@with_fields(TransferOrder, without=("to", "strategy", "processes", "witness"))
def transfer(
    study: Study | str | Path,
    target: Target,
    strategies: str | Sequence[str] = "all",
    budget: int | Sequence[int] = 20,
    *,
    out: str | Path,
    allow_code: bool = False,
    tell: Callable[[str], None] | None = None,
    **options: Any,
) -> TransferResult:
    """Evolve in simulation, spend a budget of trials on a target, and try what each strategy chose on fresh trials.

    All strategies have the same evolution in simulation: `runs` runs of the condition, every individual tried `repeats`
    times. Where the study does not say how long a command of `sim` lasts, it is as long as the target's. Every trial on
    the target is saved when it ends; the same call resumes an interrupted one.

    Args:
        study: A study, its name or its file.
        target: Target, on which trials are expensive.
        strategies: Names in `STRATEGIES`; all of them when 'all'.
        budget: Trials on the target that each strategy may spend; several are carried out one by one.
        out: Folder for trials and result.
        allow_code: True to run the Python file of a task that the user has not allowed before.
        tell: Called with the progress in words.

    Raises:
        StudyError: No such study, condition or strategy, a number out of its range, or so much cannot be seen of the
            target.
        ControllerError: The target lacks what controllers see.
        TaskError: The task cannot be scored in the target's arena, or its Python file is not allowed.
        DescriptionError: The calibration is none, or of no robot that can be.
        RecordError: The folder belongs to another transfer.
        RobotError: The target failed; what was tried is safe.
    """
    order = TransferOrder(
        study=study.about.name if isinstance(study, Study) else str(study),
        to=target.name,
        strategy=[strategies] if isinstance(strategies, str) else strategies,
        budget=[budget] if isinstance(budget, int) else budget,
        out=out,
        **options,
    )
    return transfer_to(target, order, study, allow_code=allow_code, tell=tell)


def transfer_to(
    target: Target,
    order: TransferOrder,
    study: Study | str | Path,
    *,
    allow_code: bool = False,
    tell: Callable[[str], None] | None = None,
) -> TransferResult:
    """Transfer to an open target, as ordered."""
    refuse_more_than_is_seen(target, order.observe)
    chosen = allowed_condition(choose_condition(study, order.condition, order.seed), allow_code)
    chosen = _at_the_pace_of(target, chosen)
    fit = "" if order.calibration is None else _fit_of(order.calibration)
    is_default = chosen.selection == "map-elites" or chosen.archive == ArchiveSettings()
    archive = None if is_default else chosen.archive.model_dump(mode="json")
    plan = TransferPlan(order, chosen.name, chosen.settings(), target.name, target.identity, fit, archive)
    names = strategy_names(order.strategy or "all")
    folder = order.folder
    work = _Work(plan, chosen, target, folder, tell or (lambda _: None))
    work.refuse(names)
    _adopt(folder, plan)
    task = chosen.task_of_trials
    more = {"strategies": list(names), "condition": chosen.name}
    design = design_of(order, target, score=task.name, more=more)
    hold_folder_to_design(folder, target, design, lock=order.lock, say=work.tell)
    champions = [
        work.carry_out(name, n, r) for name in names for n in order.budgets for r in range(order.replicates)
    ]
    rows, best = summarize_transfer(champions, work.known(), task.score_range)
    result = TransferResult(
        order.study,
        chosen.name,
        target.name,
        target.label,
        order.replicates,
        order.fresh_trials,
        rows,
        best,
        tuple(champions),
        task.score_name,
        task.score_range,
    )
    write_whole(folder / "result.json", json.dumps(result.to_dict(), indent=2).encode(), within=folder)
    return result


def strategy_names(strategies: str | Sequence[str]) -> tuple[str, ...]:
    """Return names of strategies, 'all' resolved.

    Raises:
        StudyError: One is unknown.
    """
    given = [strategies] if isinstance(strategies, str) else list(strategies)
    names = tuple(STRATEGIES) if given == ["all"] else tuple(dict.fromkeys(given))
    for name in names:
        if name not in STRATEGIES:
            raise StudyError(f"Unknown strategy {name!r}. {did_you_mean(name, [*STRATEGIES, 'all'])}")
    return names


def choose_condition(study: Study | str | Path, name: str | None, seed: int) -> Condition:
    """Return the condition of a study that is evolved, with a seed.

    Raises:
        StudyError: No such study or condition, or one that cannot be transferred.
    """
    resolved = study if isinstance(study, Study) else load_study(study)
    conditions = {condition.name: condition for condition in resolved.conditions}
    if name is None:
        ranked = sorted(
            resolved.conditions,
            key=lambda each: (
                each.selection != "coverage",
                each.selection != "fitness",
                each.on.robot_model is None,
            ),
        )
        chosen = ranked[0]
    elif name in conditions:
        chosen = conditions[name]
    else:
        raise StudyError(
            f"Study {resolved.about.name!r} has no condition {name!r}. {did_you_mean(name, conditions)}"
        )
    refuse_unevolved(chosen)
    if chosen.arena.robots > 1:
        raise StudyError(
            f"Condition {chosen.name!r} has {chosen.arena.robots} robots in the arena, expected 1: controllers are "
            "transferred to one robot."
        )
    return chosen.model_copy(update={"seed": seed})


def _at_the_pace_of(target: Target, condition: Condition) -> Condition:
    """Return the condition with a robot whose commands last as long as the target's, unless it says itself how long."""
    if not target.is_paced:
        return condition
    return condition.model_copy(update={"on": condition.on.at_pace(target.step_s)})


@dataclass
class _Work:
    """A transfer under way."""

    plan: TransferPlan
    condition: Condition
    target: Target
    folder: Path
    tell: Callable[[str], None]
    simulation: Simulation = field(init=False)

    def __post_init__(self) -> None:
        self.simulation = Simulation(self.plan.runs, self.plan.order.repeats)

    def refuse(self, strategies: Sequence[str]) -> None:
        """Raise an error if any strategy cannot run on this target.

        Raises:
            StudyError: A strategy cannot run.
        """
        task = self.condition.task_of_trials
        check_task(task, self.target.arena)
        refuse_too_little(task, self.target)
        if self.target.inputs is not None:
            interface = ControllerInterface(self.condition.network_inputs, self.condition.output_names)
            interface.check(self.target.inputs, f"Condition {self.condition.name!r}", self.target.name)
        for strategy in strategies:
            if strategy in BREED and self.condition.selection == "map-elites":
                others = ", ".join(name for name in STRATEGIES if name not in BREED)
                raise StudyError(
                    f"Strategy {strategy!r} has a selection of its own, and condition {self.condition.name!r} has "
                    f"selection 'map-elites'. Choose other strategies ({others}), or another condition."
                )
            if strategy in NEED_SIM:
                needs_sim(self.condition, strategy)
            if strategy in CALIBRATE:
                for budget in self.plan.order.budgets:
                    self._calibration(0).refuse(self.condition, budget)

    def carry_out(self, strategy: str, budget: int, replicate: int) -> Transferred:
        """Return the champion of a strategy, with its fresh trials."""
        spends = strategy not in WITHOUT_TRIALS
        name = f"{strategy}-{budget if spends else 0}-{replicate}"
        self.tell(f"{strategy}, {budget} trials, replicate {replicate + 1} of {self.plan.order.replicates}")
        first = replicate * NUMBERS
        path = self.folder / "trials" / f"{name}.sqlite"
        observe = self._looks_at(strategy)
        with allow_trials(self.target, path, budget, first, observe=observe) as kept:
            attempt = Attempt(
                condition=self.condition,
                target=kept,
                observe=observe,
                budget=budget,
                replicate=replicate,
                stop_at=self.plan.order.stop_at,
                simulation=self.simulation,
                calibration=self._calibration(replicate),
            )
            champion = STRATEGIES[strategy](attempt)
        champion.genome.save(self.folder / "champions" / f"{name}.json")
        scores = self._fresh(champion.genome, name, first + NUMBERS // 2)
        simulated = None if champion.simulated != champion.simulated else champion.simulated
        genome = champion.genome.to_json()
        return Transferred(strategy, budget, kept.spent, replicate, genome, simulated, scores)

    def known(self) -> list[float]:
        """Return the mean scores of all champions that were tried in this folder, by this call or an earlier one."""
        fresh = self.folder / "fresh"
        files = {
            path.stem: path for ending in ("jsonl", "sqlite") for path in sorted(fresh.glob(f"*.{ending}"))
        }
        tried = [those_that_count(read_observations(file).trials) for _, file in sorted(files.items())]
        return [
            float(np.mean(score_observed(self.condition.task_of_trials, trials, self.target.arena)))
            for trials in tried
            if len(trials) >= self.plan.order.fresh_trials
        ]

    def _calibration(self, replicate: int) -> Calibrating:
        """Return the source of the replicate's calibrations."""
        order, first = self.plan.order, replicate * NUMBERS
        seed = (SEED_STRIDE * order.seed + replicate) % 2**53
        folder, file = self.folder / "calibrations", order.calibration
        return Calibrating(self.target, folder, first, replicate, seed, order.observe, file, self.tell)

    def _looks_at(self, strategy: str) -> Observe:
        """Return the least that a strategy has to see of a trial on the target."""
        needs_cells = strategy == "transferability" or (
            strategy == "direct" and self.condition.selection == "novelty"
        )
        task = self.condition.task_of_trials
        return max(task.observe, "cells", key=OBSERVATIONS.index) if needs_cells else task.observe

    def _fresh(self, genome: Genome, name: str, first: int) -> tuple[float, ...]:
        """Return the scores of a champion in fresh trials."""
        n, task = self.plan.order.fresh_trials, self.condition.task_of_trials
        path = self.folder / "fresh" / f"{name}.sqlite"
        with allow_trials(self.target, path, n, first, observe=task.observe) as fresh:
            trials = fresh.carry_out(plans_of(self.condition, [genome] * n, 0, "fresh"), task.observe)
        return tuple(score_observed(task, trials, self.target.arena).tolist())


_PARTS = ("trials", "fresh", "champions", "calibrations")
"""Folders in that of a transfer."""


def _adopt(folder: Path, plan: TransferPlan) -> None:
    """Give a folder to a plan, or check that it has it. More budgets, fresh trials, and repetitions extend it."""
    path = folder / "transfer.json"
    refuse_links(folder, path, folder / "result.json")
    refuse_links_in(folder, *_PARTS)
    if path.exists():
        there = read_object(path)
        now = json.loads(json.dumps(plan.to_dict()))
        extends = ("replicates", "budgets", "fresh_trials", "calibration", not_compared(there, now))
        different = [key for key in now if key not in extends and now[key] != there.get(key)]
        if different:
            shown = "; ".join(
                f"{key} was {there.get(key)!r}, is {now[key]!r}"
                for key in different
                if key not in ("settings", "archive")
            )
            raise RecordError(
                f"{folder} belongs to another transfer ({shown or 'the condition has other settings'}); nothing was "
                "tried and nothing is lost. Name another folder with -o."
            )
    for part in _PARTS:
        (folder / part).mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(plan.to_dict(), indent=2).encode(), within=folder)


def _fit_of(calibration: str | Path) -> str:
    """Return the SHA-256 of a calibration's file without its words, and without when, where, and by what it was made.

    Of the robot on whose numbers it builds counts what it is, and not where its file lies.
    """
    made = load_calibration(calibration)
    said = made.model_dump(
        mode="json", exclude={"date", "measured", "arena", "seed", "software", "notes", "order", "robot"}
    )
    said["robot"] = load_robot(made.robot).to_dict()
    load_robot(calibration)  # refuses one that no robot can be
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()

"""Physical conditions of a study: planned, driven, scored, and closed, generation by generation."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from realitygap.errors import LedgerError, RobotError, StudyError, TaskError
from realitygap.platforms import Platform, names_a_port, split_spec
from realitygap.records import (
    ROBOT,
    EndReason,
    Generation,
    Individual,
    Ledger,
    Score,
    Trial,
    complete_runs,
    sees,
)
from realitygap.robots import Robot, is_in_this_program
from realitygap.runs import Condition, Evolution
from realitygap.stats import SequentialTest
from realitygap.tasks import score_observed
from realitygap.trials import (
    Card,
    Operator,
    TrialInterrupted,
    Verdict,
    WitnessObserver,
    drive_trial,
    preflight,
)
from realitygap.world import Arena

from ._blocks import Block, blocks_of, turns_of
from ._study import Study
from ._targets import SEEN_AS, WOULD_SEE

OpenRobot = Callable[[Platform], Robot]
"""Opens the robot at the port, with the settings of a condition."""


@dataclass(frozen=True)
class PhysicalResult:
    """The progress of the physical conditions.

    Attributes:
        n_runs: Runs of physical conditions in the study.
        n_complete: Number of complete runs.
        n_driven: Trials driven in this sitting.
        waiting: Action that is required before the study can continue; empty if there is none.
    """

    n_runs: int
    n_complete: int
    n_driven: int
    waiting: str


def physical_conditions(study: Study) -> list[Condition]:
    """Return the conditions that a robot drives."""
    return [condition for condition in study.conditions if condition.is_physical]


class PhysicalStudy:
    """The physical conditions of a study, which resume from their ledger."""

    def __init__(
        self, study: Study, ledger: Ledger, operator: Operator, open_robot: OpenRobot, port: str
    ) -> None:
        """Take up a study.

        Args:
            study: Study as resolved.
            ledger: Open for writing.
            operator: Operator, who places the robot and reports what was drawn.
            open_robot: Called when the first trial is to be driven.
            port: Name of the robot's port in the ledger.
        """
        self._study = study
        self._conditions = physical_conditions(study)
        self._ledger = ledger
        self._operator = operator
        self._open_robot = open_robot
        self._port = port
        self._robot: Robot | None = None
        self._opened_with: Platform | None = None
        self._sitting = 0
        self._evolutions: dict[tuple[str, int], Evolution] = {}
        self._is_looked_at = False
        self.n_driven = 0

    def carry_out(self) -> str:
        """Drive and score what is missing.

        Returns:
            The action that is required before the study can continue; empty if the study is complete.

        Raises:
            RobotError: The robot failed. When the study resumes, the operator is asked about the running trial.
            LedgerError: The ledger cannot be written or trusted.
            StudyError: The operator did not accept the pre-flight, or nobody sees what a task is scored by.
            TrialInterrupted: The program is being stopped.
        """
        for condition in self._conditions:
            self._ledger.add_condition(
                condition.name,
                condition.hash(),
                condition.settings(),
                n_generations=condition.neat.generations,
                n_cells=condition.arena.arena().grid.n_cells,
            )
        if len(self._conditions) > 1:
            looks = self._study.trials
            test = SequentialTest(null=looks.null, margin=looks.margin or None)
            self._ledger.plan_comparison(
                {
                    "kind": "conditions",
                    "names": [condition.name for condition in self._conditions],
                    "maximum": self._study.about.replicates,
                    "test": test.to_dict(),
                }
            )
        try:
            for block in blocks_of(self._conditions, self._study.about.replicates, self._study.trials):
                if waiting := self._carry_out_block(block):
                    return waiting
        finally:
            self._let_go()
        return ""

    def _refuse_unseen(self, condition: Condition) -> None:
        """Refuse a task whose score the operator cannot see, before anything is driven."""
        task = condition.task_of_trials
        if not sees(self._operator.observes, task.observe):
            raise StudyError(
                f"Condition {condition.name!r}: task {task.name!r} is scored by {SEEN_AS[task.observe]}, but "
                f"no observer records them. {WOULD_SEE[task.observe]}"
            )

    # blocks

    def _carry_out_block(self, block: Block) -> str:
        missing = tuple(
            (condition, replicate, generation)
            for condition, replicate, generation in block
            if generation >= len(self._ledger.generations(condition.name, replicate))
        )
        if missing:
            self._plan(missing)
        open_ones = [each for each in block if not self._is_closed(*each)]
        if not open_ones:
            return ""
        for each in open_ones:
            self._check_planned(*each)
        self._check_pens(open_ones)
        while True:
            if waiting := self._drive_and_enter(open_ones):
                return waiting
            taken_back = self._operator.close(self._cards(self._trials(open_ones)))
            for number in taken_back:
                self._ledger.undo(number)
            # another program may have taken a score back, or declared a trial void, while the operator was asked
            if all(trial.state == "scored" for trial in self._trials(open_ones)):
                break
        for each in open_ones:
            self._close(*each)
        return ""

    def _plan(self, generations: Block) -> None:
        planned = [
            Generation(condition.name, replicate, generation, self._individuals(condition, replicate))
            for condition, replicate, generation in generations
        ]
        turns = turns_of(
            generations,
            self._study.trials,
            first_sheet=self._ledger.last_sheet() + 1,
            used_codes=self._ledger.used_codes(),
        )
        self._ledger.plan(planned, turns)

    def _individuals(self, condition: Condition, replicate: int) -> list[Individual]:
        """Return the generation that is due, bred from the scores so far."""
        rules = condition.neat_rules
        return [
            Individual(
                individual=number,
                species=asked.species,
                parents=asked.parents,
                nodes=rules.n_inputs + rules.n_outputs + asked.genome.n_hidden,
                genome=asked.record,
                key=condition.key,
            )
            for number, asked in enumerate(self._evolution(condition, replicate).ask())
        ]

    def _evolution(self, condition: Condition, replicate: int) -> Evolution:
        """Return a run in the state of the ledger, by telling it the frozen scores."""
        evolution = self._evolutions.setdefault((condition.name, replicate), Evolution(condition, replicate))
        for generation, is_closed in self._ledger.generations(condition.name, replicate):
            if is_closed and generation >= evolution.generation:
                self._check_planned(condition, replicate, generation)
                rows = self._ledger.individuals(condition.name, replicate, generation)
                cells = [row["cells"] for row in rows]
                scored = evolution.tell(self._scores(condition, [row["trial"] for row in rows], cells), cells)
                if list(scored.fitness) != [row["fitness"] for row in rows]:
                    raise LedgerError(_bred_otherwise(self._ledger, condition, replicate, generation))
        return evolution

    def _check_planned(self, condition: Condition, replicate: int, generation: int) -> None:
        """Raise an error if the planned individuals are not those that this program breeds."""
        evolution = self._evolutions.setdefault((condition.name, replicate), Evolution(condition, replicate))
        if evolution.generation != generation:
            evolution = self._evolution(condition, replicate)
        rows = self._ledger.individuals(condition.name, replicate, generation)
        if [row["genome"] for row in rows] != [asked.record for asked in evolution.ask()]:
            raise LedgerError(_bred_otherwise(self._ledger, condition, replicate, generation))

    def _check_pens(self, generations: Sequence[tuple[Condition, int, int]]) -> None:
        """Refuse fewer pens than the sheets of these generations were planned for: two lines would look alike."""
        needed = 1 + max(trial.pen for trial in self._trials(generations))
        if needed > len(self._study.trials.pens):
            raise StudyError(
                f"trials.pens names {len(self._study.trials.pens)} pens, and a sheet that is begun needs {needed}. "
                "Give as many until its generation is closed."
            )

    def _is_closed(self, condition: Condition, replicate: int, generation: int) -> bool:
        return (generation, True) in self._ledger.generations(condition.name, replicate)

    def _close(self, condition: Condition, replicate: int, generation: int) -> None:
        self._check_planned(condition, replicate, generation)
        evolution = self._evolution(condition, replicate)
        trials = [
            each
            for each in self._ledger.trials(condition.name, replicate, generation)
            if each.state == "scored"
        ]
        trials.sort(key=lambda trial: trial.individual)
        cells = [each.cells or () for each in trials]
        if len(cells) != condition.neat.population:
            raise LedgerError(
                f"{self._ledger.path}: a score was withdrawn while its generation was being closed. Run the "
                "same command again."
            )
        scored = evolution.tell(self._scores(condition, [each.trial for each in trials], cells), cells)
        self._ledger.close_generation(
            condition.name, replicate, generation, scored.fitness, scored.novelty, cells=cells
        )

    def _scores(
        self, condition: Condition, trials: Sequence[int], cells: Sequence[Sequence[int]]
    ) -> list[float]:
        """Return the scores of trials by the condition's task; coverage is that of the counted cells."""
        arena = condition.arena.arena()
        if condition.coverage is not None:
            return [len(set(each)) / arena.grid.n_cells for each in cells]
        observed = [self._ledger.record(number) for number in trials]
        try:
            return [float(each) for each in score_observed(condition.task_of_trials, observed, arena)]
        except TaskError as error:
            raise LedgerError(f"{self._ledger.path}: {error}") from error

    # trials

    def _trials(self, generations: Sequence[tuple[Condition, int, int]]) -> list[Trial]:
        """Return trials of these generations that are not void, in the order of their turns."""
        found = [
            trial
            for condition, replicate, generation in generations
            for trial in self._ledger.trials(condition.name, replicate, generation)
            if trial.state != "void"
        ]
        return sorted(found, key=lambda trial: trial.place)

    def _drive_and_enter(self, generations: Sequence[tuple[Condition, int, int]]) -> str:
        """Drive and score all trials of these generations. Return the reason if they cannot be completed."""
        while True:
            trials = self._trials(generations)
            running = [trial for trial in trials if trial.state == "running"]
            planned = [trial for trial in trials if trial.state == "planned"]
            if running:
                self._settle(running[0])
            elif planned:
                self._drive(planned[0], len(planned))
                self._enter(planned[0].sheet, generations, just_driven=planned[0].trial)
            else:
                break
        for sheet in dict.fromkeys(trial.sheet for trial in trials):
            self._enter(sheet, generations)
        left = [trial for trial in self._trials(generations) if trial.state == "driven"]
        if not left:
            return ""
        return (
            f"{len(left)} driven trials wait for their scores. Run `realitygap trials list` to see them. Enter "
            "their cells with `realitygap trials score`, or repeat a trial with `realitygap trials void`. "
            "Then run the same command again."
        )

    def _enter(
        self, sheet: int, generations: Sequence[tuple[Condition, int, int]], just_driven: int | None = None
    ) -> None:
        """Ask what was drawn: of a sheet once all its lines are drawn, before that of the trial just driven."""
        trials = [trial for trial in self._trials(generations) if trial.sheet == sheet]
        is_full = not any(trial.state in ("planned", "running") for trial in trials)
        driven = [
            trial for trial in trials if trial.state == "driven" and (is_full or trial.trial == just_driven)
        ]
        if driven:
            for number, score in self._operator.enter(self._cards(driven), is_full=is_full):
                self._ledger.score(number, score)

    def _settle(self, trial: Trial) -> None:
        problem = trial.problem or "the program ended while the trial was running"
        (card,) = self._cards([trial])
        can_count = self._condition(trial).coverage is not None  # other tasks score whole trials alone
        verdict: Verdict = self._operator.settle(card, problem) if can_count else "void"
        self._ledger.settle(trial.trial, verdict, problem)

    def _drive(self, trial: Trial, n_left: int) -> None:
        condition = self._condition(trial)
        robot = self._ready(condition.on)
        (card,) = self._cards([trial], n_left)
        self._operator.place(card)
        genome = self._evolution(condition, trial.replicate).ask()[trial.individual].genome
        network = genome.network()
        task = condition.task_of_trials
        self._ledger.start(trial.trial, self._sitting)
        try:
            driven = drive_trial(
                robot,
                network,
                condition.on.steps,
                interface=genome.interface,
                watch=lambda step, seen, command: self._operator.watch(card, step, seen, command),
                sees_end=task.needs_trace,
            )
        except TrialInterrupted as error:
            self._ledger.interrupt(trial.trial, error.trial)
            raise
        self.n_driven += 1
        if driven.end == EndReason.STEP_LIMIT:
            try:
                score = self._operator.drawn(card, driven)
            except BaseException:
                problem = "it was driven, but its cells are not recorded"
                self._ledger.interrupt(trial.trial, replace(driven, problem=problem))
                raise
            if score is None and not sees(task.observe, "cells"):
                score = Score((), ROBOT)
            if sees(task.observe, "track") and (score is None or score.path is None):
                problem = "it was driven, but its path is not recorded"
                self._ledger.interrupt(trial.trial, replace(driven, problem=problem))
                return
            self._ledger.finish(trial.trial, driven, score)
            return
        self._ledger.interrupt(trial.trial, driven)
        if driven.end == EndReason.LOST:
            raise RobotError(
                f"Link lost in trial {trial.trial} at step {len(driven.commands)} of {condition.on.steps}: "
                f"{driven.problem} The trial is saved as interrupted. Fix the robot, then connect it again to resume: "
                "you then decide whether the trial counts."
            )

    def _condition(self, trial: Trial) -> Condition:
        return next(condition for condition in self._conditions if condition.name == trial.condition)

    def _cards(self, trials: Sequence[Trial], n_left: int = 0) -> list[Card]:
        settings = self._study.trials
        return [
            Card(
                trial=trial,
                title=trial.code if settings.blind else trial.name,
                pen=settings.pens[trial.pen % len(settings.pens)] if self._draws(trial) else "none",
                n_steps=self._condition(trial).on.steps,
                n_left=n_left,
                key=self._condition(trial).key,
                arena=self._condition(trial).arena.arena(),
                observe=self._condition(trial).task_of_trials.observe,
            )
            for trial in trials
        ]

    def _draws(self, trial: Trial) -> bool:
        """Return whether the cells of a trial's line have to be counted."""
        return self._condition(trial).task_of_trials.observe == "cells"

    # the robot

    def _ready(self, platform: Platform) -> Robot:
        """Return the robot, opened and checked; reopen it if a condition has other settings."""
        wanted = platform.model_copy(update={"steps": 1})
        if self._robot is not None and self._opened_with == wanted:
            return self._robot
        self._let_go()
        self._robot, self._opened_with = self._open_robot(platform), wanted
        self._begin_sitting(self._robot)
        return self._robot

    def _begin_sitting(self, robot: Robot) -> None:
        self._operator.meet(robot)
        for condition in self._conditions:
            self._refuse_unseen(condition)
        check = preflight(robot, self._ledger.robots())
        if (check.problems or not self._is_looked_at) and not self._operator.accept(check):
            message = "; ".join(check.problems) or "the operator stopped there"
            raise StudyError(
                f"The pre-flight was not accepted, and nothing was driven: {message}. Put that right, or accept it "
                "(--despite-preflight)."
            )
        self._is_looked_at = True
        self._sitting = self._ledger.begin_sitting(
            robot.label, self._port, check.robot, check.to_dict(), [each.name for each in self._conditions]
        )

    def _let_go(self) -> None:
        if self._robot is not None:
            robot, self._robot = self._robot, None
            with contextlib.suppress(RobotError, LedgerError):  # what was said before is what matters
                robot.close()
                self._ledger.end_sitting(self._sitting)


def _bred_otherwise(ledger: Ledger, condition: Condition, replicate: int, generation: int) -> str:
    return (
        f"{ledger.path}: generation {generation} of {condition.name!r}, run {replicate}, is not what this realitygap "
        "makes of the scores before it. Was the ledger begun by another version? Use that one."
    )


def n_complete(ledger: Ledger, conditions: Sequence[Condition], replicates: int) -> int:
    """Return the number of complete runs of these conditions, of those that the study requests."""
    return sum(run < replicates for each in conditions for run in complete_runs(ledger, each.name))


def connect_robot(port: str, arena: Arena | None = None) -> OpenRobot:
    """Return what opens the robot at a port, with the settings of a condition's platform.

    Args:
        port: Name of the port, with or without the platform's name before it.
        arena: Start of a robot that is emulated in this program, unless its port gives the start.
    """

    def open_robot(platform: Platform) -> Robot:
        name, rest = split_spec(port)
        if names_a_port(port) and name != platform.name:
            raise StudyError(f"{port} is a port of platform {name!r}, expected one of {platform.name!r}.")
        robot = platform.at_port(rest if names_a_port(port) else port)
        return (robot if arena is None else robot.in_arena(arena)).connect()

    return open_robot


def default_operator(port: str) -> Operator:
    """Return the witness of an emulator in this program.

    Raises:
        StudyError: Another port, whose robot needs a person who places it and scores its trials.
    """
    if is_in_this_program(port):
        return Operator(WitnessObserver())
    raise StudyError(
        f"No operator places the robot at {port} and reports its cells. Run `realitygap drive` to be the "
        "operator; realitygap.trials.Operator(WitnessObserver(witness)) serves an emulator elsewhere."
    )

"""The gap between two platforms, measured by running the same controllers on both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from realitygap.errors import StudyError, whole_number
from realitygap.evolution import Genome
from realitygap.gap import (
    CoverageMaps,
    GapResult,
    GapSide,
    ReplayError,
    coverage_maps,
    measure_gap,
    replay_error,
)
from realitygap.orders import EstimateOrder, GapOrder
from realitygap.platforms import SimTarget, split_spec
from realitygap.playback import MovingTrial
from realitygap.records import OBSERVATIONS, Ledger, LockedDesign, Observe, TrialRecord
from realitygap.stats import (
    Estimate,
    SequentialTest,
    difference_interval,
    mean_interval,
    range_of_differences,
)
from realitygap.tasks import CoverageTask, Task, score_observed
from realitygap.trials import Target, TrialPlan
from realitygap.world import Arena, Pose

from .._advise import Advice
from .._controllers import Controller, have_same_score, task_of
from .._design import design_of, hold_to_design
from .._deviations import check_unblinded
from .._kept_target import KeptTarget
from .._paired import ROUNDS, advise_ledger
from .._targets import check_task, open_trials, refuse_too_little

Tell = Callable[[str, int, int], None]
"""Called with what is being done, the trials done, and the trials in all."""

MOST_TRIALS = 4_096
"""Maximum number of trials of a controller. Trial k of controller i has the number 4096 i + k, for any number of
trials and controllers."""

MOST_CONTROLLERS = 1_024
TARGET_FROM = MOST_TRIALS * MOST_CONTROLLERS
"""Numbers of the target's trials begin here: they never draw the noise of those in simulation."""

REEVOLVED_FROM = 2 * TARGET_FROM
REPLAYED_FROM = 3 * TARGET_FROM

STEPS = 100
"""Commands in a trial."""

REPLAYS = 4
"""Number of replays of a trial's commands in simulation."""

MOST_REPLAYED = 60
"""Trials that are replayed: the first of each controller, then the second, and so on."""


@dataclass(frozen=True)
class ShownTrials:
    """Trials of one controller on both platforms, from the same start.

    Attributes:
        controller: Index of the controller.
        source: Trials in simulation.
        target: Trials on the target.
    """

    controller: int
    source: tuple[MovingTrial, ...]
    target: tuple[MovingTrial, ...]


@dataclass(frozen=True)
class GapStudy:
    """A gap that was measured, and what figures of it are drawn from.

    Attributes:
        result: All measures.
        source: Trials in simulation.
        target: Trials on the target.
        controllers: Row k of both is of controller k.
        arena: Arena of the trials.
        source_trials: All trials in simulation, controller after controller.
        target_trials: All trials on the target, in the same order.
        maps: Maps of the cells that trials cross on both sides.
        task: Task that scored the trials.
        replay: Open-loop replays; None if the target's poses are unknown.
        observe: Observation level of the target.
        step_s: Duration of commands in simulation [s].
        shown: Trials of one controller to show in motion; None if poses are unknown.
        advice: The rounds of trials so far as a sequential test, which may be looked at after each round: a round has a
            trial of each controller on both platforms. None if trials are not saved, or the score has no range.
    """

    result: GapResult
    source: GapSide
    target: GapSide
    controllers: tuple[Controller, ...]
    arena: Arena
    source_trials: tuple[TrialRecord, ...]
    target_trials: tuple[TrialRecord, ...]
    maps: CoverageMaps | None
    task: Task
    replay: ReplayError | None
    observe: Observe
    step_s: float
    shown: ShownTrials | None = None
    advice: Advice | None = None


def study_gap(
    source: Target,
    target: Target,
    controllers: Sequence[Controller],
    *,
    task: Task | None = None,
    trials: int = 10,
    margin: float | None = None,
    observe: Observe | None = None,
    misspecified: bool | None = None,
    reevolved: Sequence[Controller] = (),
    seed: int = 1,
    tell: Tell | None = None,
    results: str | Path | None = None,
    at_its_pace: bool = False,
    steps: int = STEPS,
    order: GapOrder | None = None,
    say: Callable[[str], None] | None = None,
) -> GapStudy:
    """Try the same controllers on a simulator and on a target, and measure the gap.

    Args:
        source: The simulator.
        target: Target, on which trials are expensive. Its trials alternate between controllers, so that changes over
            time, such as a falling battery, affect all controllers equally.
        controllers: At least 2 controllers of `sample_controllers`. For champions, the result includes the part of
            their score that was luck.
        task: Scores the trials of both sides, from what an observer has of them: with the noise of readings. Coverage
            of the driven line if not given.
        trials: Number of trials of each controller on each platform, 1 to 4096.
        margin: Margin of equivalence in level, in units of the score.
        observe: Observation level of the target. With `track`, commands are also replayed in simulation. Default: the
            level that the task needs, and the crossed cells if no person has to count them.
        misspecified: True if a check showed that the simulator cannot reproduce the observations.
        reevolved: Champions that were evolved on the target. They are also tried there, and compared with the
            champions among `controllers` in simulation.
        seed: Seed of the bootstrap.
        tell: Called as trials are done.
        results: File that stores the target's trials as they end. Trials in it are not driven again.
        at_its_pace: True to give commands of a `sim` without calibration the duration that they had on the target.
        steps: Commands in each trial.
        order: The order, whose design may be locked. Default: nothing is locked.
        say: Called with the hash when the design was locked.

    Raises:
        ValueError: A number is out of range, or so much cannot be seen.
        StudyError: The two platforms are in different arenas, the task needs to see more, the order differs from a
            locked design, or all trials are driven and the design is blind.
        TaskError: The task cannot be scored in the arena.
        RecordError: The file has trials of something else, or cannot be written.
        RobotError: The robot failed; what was kept is safe.
    """
    trials = whole_number("trials", trials, 1, MOST_TRIALS)
    whole_number("number of controllers", len(controllers), 2, MOST_CONTROLLERS)
    if source.arena.grid != target.arena.grid:
        raise StudyError(f"{source.name} and {target.name} have different grids, expected the same arena.")
    task = task or CoverageTask()
    check_task(task, target.arena)
    observe = refuse_too_little(task, target, observe)
    seen = max(_as_much(observe, source), task.observe, key=OBSERVATIONS.index)
    sees_end = task.needs_trace
    plans = plans_of([each.genome for each in controllers], trials, TARGET_FROM, steps, sees_end=sees_end)
    more = plans_of([each.genome for each in reevolved], trials, REEVOLVED_FROM, steps, sees_end=sees_end)
    for platform in (source, target):
        refuse_inputs(controllers, platform)
    refuse_inputs(reevolved, target)
    file = None if results is None else open_trials(results, target, observe)
    looks = SequentialTest(margin=margin)
    comparison = {
        "kind": ROUNDS,
        "source": source.name,
        "controllers": len(controllers),
        "first": TARGET_FROM,
        "stride": MOST_TRIALS,
        "task": task.name,
        "test": looks.to_dict(),
    }
    locked = None
    if file is not None and order is not None:
        locked = hold_to_rounds(file, order, target, controllers, task, others=reevolved, say=say)
    if file is not None:
        known = file.comparison()
        if known is None or {**known.plan, "rounds": None} != {**comparison, "rounds": None}:
            file.plan_comparison(comparison)
    on_target = carry_out(target, [*plans, *more], observe, tell, file, locked)
    _, is_recorded, recorded = target.name.partition("recorded:")
    deviations = check_unblinded(recorded if is_recorded else results)
    source, pace_notes = _paced(source, target, on_target) if at_its_pace else (source, ())
    own = [replace(plan, number=plan.number - TARGET_FROM) for plan in plans]
    in_source = carry_out(source, own, seen, tell)
    one = side_of(source, in_source, len(controllers), task)
    other = side_of(target, on_target[: len(plans)], len(controllers), task)
    result = measure_gap(one, other, margin=margin, misspecified=misspecified, seed=seed)
    advice = None
    if results is not None:
        with open_trials(results, target, observe) as again:
            again.plan_comparison({**comparison, "rounds": one.values.mean(axis=0).tolist()})
            advice = advise_ledger(again, task=task) if np.isfinite(task.score_range).all() else None
    reevolved_there = on_target[len(plans) :]
    result = replace(
        result,
        score=task.score_name,
        luck=_luck(controllers, task),
        reevolved=_reevolved(controllers, source, one, reevolved, reevolved_there, target, task),
        notes=(*pace_notes, *deviations),
    )
    return GapStudy(
        result,
        one,
        other,
        tuple(controllers),
        target.arena,
        tuple(_by_controller(in_source, len(controllers))),
        tuple(_by_controller(on_target[: len(plans)], len(controllers))),
        coverage_maps(one, other),
        task,
        _replay(source, on_target[: len(plans)], len(controllers), tell),
        observe,
        source.step_s,
        advice=advice,
    )


def _paced(
    source: Target, target: Target, on_target: Sequence[TrialRecord]
) -> tuple[Target, tuple[str, ...]]:
    """Return the simulator with commands as long as most of a robot's trials had, and what there is to say of it."""
    step_s = float(np.median([trial.step_s for trial in on_target]))
    if not (isinstance(source, SimTarget) and source.is_paced and target.is_paced):
        return source, ()
    if step_s == source.step_s:
        return source, ()
    lasted = f"{step_s:g} s in place of {source.step_s:g} s"
    note = f"Commands of {source.name} last {lasted}, as those of {target.name} did."
    return source.lasting(step_s), (note,)


# trials


def refuse_inputs(controllers: Sequence[Controller], platform: Target) -> None:
    """Refuse controllers that see what a platform lacks, before a trial is spent.

    Raises:
        ControllerError: A controller sees what the platform lacks.
    """
    for each in controllers:
        if platform.inputs is not None:
            each.genome.interface.check(platform.inputs, each.name, platform.name)


def plans_of(
    genomes: Sequence[Genome], trials: int, first: int, steps: int = STEPS, *, sees_end: bool = False
) -> list[TrialPlan]:
    """Round the controllers, again and again."""
    return [
        TrialPlan(genome=genome, steps=steps, number=first + MOST_TRIALS * i + k, sees_end=sees_end)
        for k in range(trials)
        for i, genome in enumerate(genomes)
    ]


def _as_much(observe: Observe, platform: Target) -> Observe:
    return OBSERVATIONS[min(OBSERVATIONS.index(observe), OBSERVATIONS.index(platform.observes))]


def carry_out(
    platform: Target,
    plans: Sequence[TrialPlan],
    observe: Observe,
    tell: Tell | None,
    file: Ledger | None = None,
    locked: LockedDesign | None = None,
) -> list[TrialRecord]:
    """Return trials in the order of their plans: those in the file, and the others, saved as they end.

    If a design is locked, its hash decides the order of the controllers in each round.
    """
    done: set[int] = set()

    def told(k: int, _: TrialRecord) -> None:
        done.add(k)
        if tell is not None:
            tell(platform.name, len(done), len(plans))

    turns = list(range(len(plans)))
    if locked is not None:
        n = len(locked.arms)
        turns[: n * locked.design["blocks"]] = [
            n * k + arm for k in range(locked.design["blocks"]) for arm in locked.order(k)
        ]
    with KeptTarget(platform, file) as kept:
        driven = kept.carry_out([plans[turn] for turn in turns], observe, told)
    return [trial for _, trial in sorted(zip(turns, driven, strict=True), key=lambda each: each[0])]


def hold_to_rounds(
    file: Ledger,
    order: GapOrder | EstimateOrder,
    target: Target,
    controllers: Sequence[Controller],
    task: Task,
    others: Sequence[Controller] = (),
    say: Callable[[str], None] | None = None,
) -> LockedDesign | None:
    """Lock the design of an order whose rounds have a trial of each controller, or hold the order to it."""
    design = design_of(
        order,
        target,
        score=task.name,
        arms=[(each.name, each.genome.to_json()) for each in controllers],
        unit="round",
        first=TARGET_FROM,
        stride=MOST_TRIALS,
        others=[each.genome.to_json() for each in others],
    )
    return hold_to_design(file, design, lock=order.lock, blind=order.blind, say=say)


def _by_controller(trials: Sequence[TrialRecord], n: int) -> list[TrialRecord]:
    """Return trials that went round n controllers, those of a controller together."""
    return [trials[k] for i in range(n) for k in range(i, len(trials), n)]


def side_of(platform: Target, trials: Sequence[TrialRecord], n: int, task: Task) -> GapSide:
    """Return trials that went round n controllers, as a side of a gap.

    Raises:
        TaskError: A trial has less than the task needs.
    """
    n_cells = platform.arena.grid.n_cells
    ordered = _by_controller(trials, n)
    cells = np.zeros((len(ordered) if all(trial.cells for trial in ordered) else 0, n_cells), np.bool_)
    for row, trial in zip(cells, ordered, strict=False):
        row[list(trial.cells)] = True
    ends = np.empty((0, 0, 2))
    if all(len(trial.poses) for trial in ordered):
        ends = np.array([trial.poses[-1, :2] for trial in ordered]).reshape(n, -1, 2)
    scores = score_observed(task, ordered, platform.arena)
    crossed = cells.reshape(n, -1, n_cells) if len(cells) else np.empty((0, 0, 0), np.bool_)
    return GapSide(platform.name, platform.label, scores.reshape(n, -1), crossed, ends, task.score_range)


def _replay(source: Target, observed: Sequence[TrialRecord], n: int, tell: Tell | None) -> ReplayError | None:
    """Replay the target's commands in simulation from its robot's poses; its trials alternate between n controllers."""
    t = min((len(trial.commands) for trial in observed), default=0)
    seen = [k for k, trial in enumerate(observed) if len(trial.poses) > t][:MOST_REPLAYED]
    there = [observed[k] for k in seen]
    if not there or t == 0 or source.observes != "track":
        return None
    plans = [
        TrialPlan(
            start=Pose(*there[i].poses[0].tolist()),
            commands=np.clip(there[i].commands[:t], -1, 1),
            number=REPLAYED_FROM + MOST_TRIALS * i + k,
            purpose="replay",
        )
        for k in range(REPLAYS)
        for i in range(len(there))
    ]
    replayed = carry_out(source, plans, "track", tell)
    poses = np.array([trial.poses[: t + 1] for trial in replayed])
    return replay_error(
        np.array([trial.poses[: t + 1] for trial in there]),
        poses.reshape(REPLAYS, len(there), t + 1, 3),
        np.array(seen) % n,
    )


# what is kept apart from the transfer gap


def _luck(controllers: Sequence[Controller], task: Task) -> Estimate:
    """Measure the loss of champions on fresh seeds, on the platform that selected them."""
    if not have_same_score(task_of(controllers), task):
        return Estimate.refusal(0, f"The controllers were selected for another score than {task.score_name}.")
    lost = [
        each.selected_score - each.fresh_score
        for each in controllers
        if each.selected_score is not None and each.fresh_score is not None
    ]
    if not lost:
        return Estimate.refusal(0, "Not measured: pass champions with --controllers STUDY.")
    return mean_interval(lost, range_of_differences(task.score_range))


def _reevolved(
    controllers: Sequence[Controller],
    source: Target,
    in_source: GapSide,
    reevolved: Sequence[Controller],
    on_target: Sequence[TrialRecord],
    target: Target,
    task: Task,
) -> Estimate:
    """Return the quality of the target's own champions on it minus the quality of simulated champions in simulation."""
    if not reevolved:
        return Estimate.refusal(0, "Nothing was evolved on the target (--reevolved).")
    champions = [(k, each) for k, each in enumerate(controllers) if each.kind == "champion"]
    if not champions:
        return Estimate.refusal(
            0,
            "The controllers are no champions of a simulator (--controllers STUDY), so nothing was evolved there.",
        )
    family = (
        source.identity.partition(" ")[0] if isinstance(source, SimTarget) else split_spec(source.name)[0]
    )
    elsewhere = {each.selected_on for _, each in champions if split_spec(each.selected_on)[0] != family}
    if elsewhere:
        return Estimate.refusal(
            0, f"The controllers were evolved on {', '.join(sorted(elsewhere))}, and not on {source.name}."
        )
    here = in_source.means[[k for k, _ in champions]]
    on_target_means = side_of(target, on_target, len(reevolved), task).means
    return difference_interval(on_target_means, here, task.score_range, noun="champions")

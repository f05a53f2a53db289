"""The gap between two platforms by name: opened, tried, measured and explained."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from realitygap.drawing import ShownAsCard
from realitygap.errors import StudyError
from realitygap.gap import Why
from realitygap.platforms import RecordedTarget, class_of, open_target, split_spec
from realitygap.records import Observe
from realitygap.tasks import Task
from realitygap.trials import PortObserver, Pulse, Target
from realitygap.world import Arena, Calibration, load_arena

from .._code import task_named
from .._controllers import Controller, recorded_controllers, sample_controllers, task_of
from .study import STEPS, GapStudy, Tell, study_gap
from .why import calibration_of, why_gap

Say = Callable[[str], None]


@dataclass(frozen=True)
class GapBetween(ShownAsCard):
    """A gap between two platforms, and why it is there.

    Attributes:
        study: Measures, and what figures are drawn from.
        why: Part of the gap that each part of the model explains; None if not requested.
    """

    study: GapStudy
    why: Why | None

    def __repr__(self) -> str:
        return f"{type(self).__name__}{repr(self.study.result).removeprefix('GapResult')}"


def gap_between(
    sim: str,
    target: str,
    *,
    controllers: str | Path = "random",
    n_controllers: int = 30,
    task: str | Task | None = None,
    trials: int = 10,
    margin: float | None = None,
    observe: Observe | None = None,
    arena: str | Path | Arena | None = None,
    noise: float | None = None,
    randomize: Literal["no", "posterior"] = "no",
    reevolved: str | Path | None = None,
    why: bool = False,
    processes: int | None = None,
    witness: str | None = None,
    observer: PortObserver | None = None,
    pulse: Pulse | None = None,
    seed: int = 1,
    results: str | Path | None = None,
    allow_code: bool = False,
    tell: Tell | None = None,
    say: Say | None = None,
) -> GapBetween:
    """Measure the gap between a simulator and a target, both by name; as `realitygap gap`.

    Args:
        sim: The simulator: `sim`, `sim:FILE` or `jyro`.
        target: Any platform, such as `twin:FILE` or `scribbler:PORT`.
        controllers: Controllers, as in `sample_controllers`. Default for recorded trials: the controllers that drove.
        n_controllers: Number of controllers.
        task: Task that scores the trials: a kind with its defaults, such as `avoid`, python:FILE.py:function, or a
            `Task`. Default: the task for which the controllers were selected, and coverage for random ones.
        trials: Number of trials of each controller on each platform.
        margin: Margin of equivalence in level, in units of the score.
        observe: Observation level of the target. Default: the level that the task needs.
        arena: Arena by name, from a file, or an `Arena`. Default: the arena in which the controllers were selected,
            and the paper's for random ones.
        noise: The paper's a on simulators; 0.1 on `jyro` and none on others when not given.
        randomize: For a simulator that is a calibration: 'posterior' draws the robot of each trial from it.
        reevolved: Results or a study that was evolved on the target.
        why: True to compute how much of the gap each part of the model explains. The simulator must be a calibration.
        processes: Number of processes of a twin.
        witness: Witness of an emulated robot in another program: HOST:PORT.
        observer: Observer of a robot without a witness: it places the robot and reports what it drew.
        pulse: Called when a trial on a robot begins or ends, and when the robot has answered in it.
        seed: Seed of all random numbers.
        results: File for the target's trials.
        allow_code: True to run the Python file of a task that the user has not allowed before.
        tell: Called as trials are done.
        say: Called with what is done otherwise.

    Raises:
        StudyError: A platform, study or number that cannot be.
        RealityGapError: The robot failed, or files cannot be read or written.
    """
    recorded = recorded_controllers(target) if controllers == "random" else []
    steps = STEPS
    if len(recorded) == 1:
        raise StudyError(
            f"The trials in {target.partition(':')[2]} are of one controller, expected at least 2: a gap is "
            "estimated from several. Record more, for example with: realitygap gap SIM TARGET -o FILE"
        )
    if recorded:
        n_controllers, trials = min(n_controllers, len(recorded)), min(trials, recorded[0][1])
        there_before = RecordedTarget(split_spec(target)[1])
        arena, steps = there_before.arena, there_before.steps
    calibration = calibration_of(sim)
    if why and calibration is None:
        raise StudyError(
            f"--why needs a calibration, but {sim} is not one. Make one with: realitygap calibrate all --robot "
            f"{target} --observe {observe or 'cells'} -o fit.toml; then measure the gap of sim:fit.toml."
        )
    if why and noise:
        raise StudyError(
            f"--why switches parts of the model in without the paper's noise, and --noise is {noise:g}. Leave one out."
        )
    if why and trials < 2:
        raise StudyError("--why needs at least 2 trials of each controller, to separate the gap from noise.")
    tell_of = say or (lambda _: None)
    if recorded:
        tell_of(f"The {n_controllers} controllers of {target}, {trials} trials each.")
        chosen = [each for each, _ in recorded[:n_controllers]]
    else:
        tell_of(f"Drawing {n_controllers} controllers: {controllers}.")
        chosen = sample_controllers(controllers, n_controllers, seed, allow_code=allow_code)
    there = (
        [] if reevolved is None else sample_controllers(reevolved, n_controllers, seed, allow_code=allow_code)
    )
    scored_by = task_of(chosen) if task is None else task_named(task, allow_code=allow_code)
    if why and scored_by.name != "coverage":
        raise StudyError(
            f"--why shares out the gap in coverage, and the score here is {scored_by.score_name}. Leave --why out, or "
            "name the task (--task coverage)."
        )
    place = _arena(arena, chosen, controllers)
    if chosen[0].condition is not None:
        steps = chosen[0].condition.on.steps
    if there and not recorded:
        _refuse_elsewhere(there, f"--reevolved {reevolved}", target)
    if there:
        _refuse_elsewhere(chosen, f"--controllers {controllers}", sim)
    with (
        _open(sim, place, noise, 2 * seed, randomize=randomize) as source,
        _open(target, place, noise, 2 * seed + 1, processes, witness, observer, pulse) as costly,
    ):
        if costly.label == "REAL" and results is None and not isinstance(costly, RecordedTarget):
            raise StudyError(
                f"{n_controllers * trials} trials on {target} would not be saved. Name a file for them (-o "
                "FILE.jsonl), so that the same command can resume."
            )
        found = study_gap(
            source,
            costly,
            chosen,
            task=scored_by,
            trials=trials,
            margin=margin,
            observe=observe,
            misspecified=_misspecified(calibration),
            reevolved=there,
            seed=seed,
            tell=tell,
            results=results,
            at_its_pace=calibration is None or not calibration.step_s,
            steps=steps,
        )
    parts = None
    if why and calibration is not None:
        tell_of("Switching parts of the model: 64 choices, each with draws from the posterior.")
        genomes = [each.genome for each in chosen]
        parts = why_gap(
            calibration, place, genomes, found.target, steps=steps, step_s=found.step_s, seed=seed
        )
    return GapBetween(found, parts)


def _arena(arena: str | Path | Arena | None, chosen: Sequence[Controller], named: str | Path) -> Arena:
    """Return the arena of the gap.

    Raises:
        StudyError: None is named, and the controllers were selected in several.
    """
    if isinstance(arena, Arena):
        return arena
    if arena is not None:
        return load_arena(arena)
    selected_in = [each.condition.arena.arena().alone for each in chosen if each.condition is not None]
    if any(other != selected_in[0] for other in selected_in):
        names = ", ".join(sorted({each.name for each in selected_in}))
        raise StudyError(
            f"The controllers of {named} were selected in several arenas ({names}). Name one (--arena)."
        )
    return selected_in[0] if selected_in else load_arena("paper")


def _refuse_elsewhere(evolved: Sequence[Controller], named: str, platform: str) -> None:
    """Raise an error if a controller was evolved on another platform, before trials are spent on it.

    Raises:
        StudyError: A controller was evolved elsewhere.
    """
    for each in evolved:
        where = each.selected_on or "nowhere"
        if each.kind != "champion" or where.partition(":")[0] != platform.partition(":")[0]:
            raise StudyError(
                f"{each.name} of {named} was evolved {'on ' if each.selected_on else ''}{where}, expected "
                f"champions evolved on {platform}. The re-evolved gap compares champions evolved on each "
                "platform."
            )


def _misspecified(calibration: Calibration | None) -> bool | None:
    """Return the verdict of a calibration's predictive check; for a partial calibration, True or None, never False."""
    if calibration is None:
        return None
    return calibration.misspecified if calibration.kind == "all" else calibration.misspecified or None


def _open(
    spec: str,
    arena: Arena,
    noise: float | None,
    key: int,
    processes: int | None = None,
    witness: str | None = None,
    observer: PortObserver | None = None,
    pulse: Pulse | None = None,
    randomize: Literal["no", "posterior"] = "no",
) -> Target:
    level = class_of(spec).default_noise if noise is None else noise
    return open_target(
        spec, arena, processes=processes, witness=witness, observer=observer, pulse=pulse, noise=level,
        key=key, randomize=randomize,
    )  # fmt: skip

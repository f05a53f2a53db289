"""Controllers to try on both sides of a gap: unrelated networks, or champions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import polars as pl

from realitygap.errors import StudyError, whole_number
from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.platforms import RecordedPlatform, RecordedTarget, score_genomes, split_spec
from realitygap.records import ResultsFolder
from realitygap.runs import Condition, genome_of, partners_of, run_replicates
from realitygap.tasks import CoverageTask, Task
from realitygap.trials import NoiseKey

from ._code import allowed_condition, allowed_task
from ._file import DEFAULT_NEAT, load_study

FRESH_TRIALS = 20
"""Number of trials that test a champion again on the platform that selected it, each with new noise."""

_COLUMNS = ["replicate", "generation", "individual", "key"]


@dataclass(frozen=True)
class Controller:
    """A controller and its origin.

    Attributes:
        genome: Genome of its network.
        name: Name, such as random-3, or coverage-10/7 for the champion of run 7.
        kind: random, or champion.
        selected_score: Score for which it was selected, such as coverage [0..1]; None if it was not selected.
        fresh_score: Mean score on fresh noise on the platform that selected it; None if it was not selected or the
            score cannot be computed.
        selected_on: Platform that selected it; empty if it was not selected.
        condition: Condition that selected it; None if it was not selected.
    """

    genome: Genome
    name: str
    kind: Literal["random", "champion"] = "champion"
    selected_score: float | None = None
    fresh_score: float | None = None
    selected_on: str = ""
    condition: Condition | None = None


def sample_controllers(
    kind: str | Path, n: int, seed: int = 1, *, allow_code: bool = False
) -> list[Controller]:
    """Draw n controllers.

    Args:
        kind: `random` for unrelated networks of the paper's NEAT with the paper's inputs. A folder of results, from
            whose champions n are drawn. Or the name or file of a study: its first condition that can be computed gets
            n runs. If there are several tasks, coverage is used, or otherwise the first task.
        n: Number of controllers, at least 1.
        seed: Seed of the draw, and of the runs of a study.
        allow_code: True to run the Python file of a task that the user has not allowed before.

    Raises:
        ValueError: n is out of range.
        StudyError: There is no such study, it has no usable condition, or there are too few champions.
        RecordError: There are no such results.
        TaskError: The Python file of a task is not allowed.
    """
    n = whole_number("n", n, 1)
    if str(kind) == "random":
        return _random(n, seed)
    if Path(kind).is_dir():
        controllers = _of_folder(ResultsFolder.open(kind), kind, allow_code)
        if len(controllers) < n:
            raise StudyError(
                f"{kind} has champions of {len(controllers)} runs, but {n} controllers were requested. Add "
                "runs, or request fewer."
            )
        chosen = sorted(np.random.default_rng(seed).permutation(len(controllers))[:n])
        return _with_fresh_scores([controllers[k] for k in chosen])
    return _with_fresh_scores(_of_study(kind, n, seed, allow_code))


def task_of(controllers: Sequence[Controller]) -> Task:
    """Return the task for which controllers were selected; coverage of the driven line if they were not."""
    for each in controllers:
        if each.condition is not None:
            return each.condition.task_of_trials
    return CoverageTask()


def have_same_score(one: Task, other: Task) -> bool:
    """Return whether two tasks score trials alike, whatever their networks see."""
    return _score_settings(one) == _score_settings(other)


def _score_settings(task: Any) -> dict[str, Any]:
    sensed = ("inputs", "bias_input", "time_input")
    return {"name": task.name, **{k: v for k, v in task.model_dump().items() if k not in sensed}}


def recorded_controllers(target: str) -> list[tuple[Controller, int]]:
    """Return the controllers of a target of recorded trials, and of how many trials of each there are at least.

    Args:
        target: Name of the target. Only recorded targets have controllers.

    Raises:
        RecordError: The file cannot be read.
    """
    name, path = split_spec(target)
    if name != RecordedPlatform.name or not path:
        return []
    recorded = RecordedTarget(path).controllers
    least = min(n for _, n in recorded)
    return [(Controller(genome, f"recorded-{k}", "random"), least) for k, (genome, _) in enumerate(recorded)]


def _random(n: int, seed: int) -> list[Controller]:
    settings = NeatSettings.named(DEFAULT_NEAT)
    found: list[Genome] = []
    for replicate in range(-(-n // settings.population)):
        found += Population(3, 2, settings, seed=seed, replicate=replicate, bias=False).ask()
    return [Controller(genome, f"random-{k}", "random") for k, genome in enumerate(found[:n])]


@dataclass(frozen=True)
class _Champion:
    """The best individual of a run, and the condition that it was selected in."""

    condition: Condition
    row: dict[str, Any]

    @property
    def controller(self) -> Controller:
        return Controller(
            genome_of(self.condition, self.row),
            f"{self.condition.name}/{self.row['replicate']}",
            selected_score=float(self.row[_column_of(self.condition)]),
            selected_on=self.condition.platform,
            condition=self.condition,
        )


def _of_folder(folder: ResultsFolder, name: str | Path, allow_code: bool) -> list[_Champion]:
    described = folder.description["conditions"]
    conditions = [Condition.from_settings(each["name"], dict(each["settings"])) for each in described]
    selected = [each for each in conditions if each.selection != "random"]
    if not selected:
        raise StudyError(
            f"{name} has no champions, because its conditions have no selection. Name other results, or `random`."
        )
    found: list[_Champion] = []
    first = _coverage_first(selected)[0]
    for condition in selected:
        if have_same_score(condition.task_of_trials, first.task_of_trials):
            rows = folder.read(
                condition.name, columns=[*_COLUMNS, *condition.genome_columns, _column_of(condition)]
            )
            # Only the task is run again. Its descriptors need no permission.
            task = allowed_task(condition.task_of_trials, allow_code)
            condition = condition.model_copy(update={"task": task})
            found += [_Champion(condition, row) for row in _best_of_runs(condition, rows)]
    return found


def _of_study(name: str | Path, n: int, seed: int, allow_code: bool) -> list[_Champion]:
    study = load_study(name, seed=seed, replicates=n)
    for condition in _coverage_first(study.conditions):
        if condition.selection != "random" and not condition.is_physical:
            condition = allowed_condition(condition, allow_code)
            rows = run_replicates(condition, 0, n)
            return [_Champion(condition, row) for row in _best_of_runs(condition, rows)]
    raise StudyError(
        f"The study {name} has no condition with selection that can be computed. Name another, or `random`."
    )


def _coverage_first(conditions: Sequence[Condition]) -> list[Condition]:
    """Return conditions in their order, but those of the paper's task before the others."""
    return sorted(conditions, key=lambda each: each.coverage is None)


def _column_of(condition: Condition) -> str:
    """Return the column of the score for which a condition selects, or, with novelty, of its task's."""
    return "task_fitness" if condition.coverage is None else f"coverage_{condition.counted_cells}"


def _best_of_runs(condition: Condition, rows: pl.DataFrame) -> Iterator[dict[str, Any]]:
    """Return the first of the best in each run."""
    column = _column_of(condition)
    best = rows.filter(pl.col(column) == pl.col(column).max().over("replicate"))
    return best.unique("replicate", keep="first", maintain_order=True).iter_rows(named=True)


def _with_fresh_scores(champions: list[_Champion]) -> list[Controller]:
    """Return champions tried again on fresh noise; those that a robot drove are as they are."""
    found: list[Controller] = []
    for champion in champions:
        controller, condition, row = champion.controller, champion.condition, champion.row
        if not condition.on.is_simulator:
            found.append(controller)
            continue
        _, scores = score_genomes(
            condition.on,
            condition.arena.arena(),
            [controller.genome],
            condition.task_of_trials,
            noise=condition.noise,
            noise_keys=[NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"])],
            repeats=range(1, FRESH_TRIALS + 1),
            inputs=condition.network_inputs,
            partners=[partners_of(condition, row)],
        )
        found.append(replace(controller, fresh_score=float(scores.mean())))
    return found

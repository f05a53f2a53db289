"""Summaries of all rows for tables and figures, computed in one pass over the chunks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, Required, TypedDict

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap._wording import significant
from realitygap.errors import RecordError, did_you_mean
from realitygap.records import ResultsFolder
from realitygap.report._driven import DrivenCondition, read_driven
from realitygap.runs import Condition

Measure = Literal["line", "ends"]
"""Kind of counted cells: those that the driven line crosses, or those in which steps end."""

_COLUMNS = ["condition", "replicate", "generation", "coverage_line", "coverage_ends"]
_BEST = {
    "condition": pl.String(),
    "replicate": pl.UInt32(),
    "generation": pl.UInt32(),
    "trials": pl.UInt32(),
    "line": pl.Float64(),
    "ends": pl.Float64(),
}


class DescribedCondition(TypedDict, total=False):
    """A condition in the description of a study, as its folder has it.

    Attributes:
        name: Its name.
        settings: Settings as resolved, as JSON.
        hash: Hash of the settings.
        label: Origin of its numbers: SIM, TWIN, EMULATED, or REAL.
        baseline: Name of the condition with which it is compared.
        published: Published values, one for each run.
        published_source: Source of these values.
    """

    name: Required[str]
    settings: Mapping[str, Any]
    hash: str
    label: str
    baseline: str | None
    published: list[float] | None
    published_source: str | None


class DescribedStudy(TypedDict, total=False):
    """The description of a study, as its folder has it.

    Attributes:
        name, title, note, software: Texts, empty or missing if the study has none.
        seed: Seed of the study.
        replicates: Planned number of runs of each condition.
        pair: True if all conditions draw the same random numbers.
        report: Choices for the report, such as `points`.
        conditions: The conditions.
    """

    name: str
    title: str
    note: str
    software: str
    seed: int
    replicates: int
    pair: bool
    report: Mapping[str, str] | None
    conditions: Required[list[DescribedCondition]]


@dataclass(frozen=True)
class Tally:
    """A study's description and the best of each of its generations.

    Attributes:
        folder: Folder from which it was read.
        description: Study as resolved.
        best: One row per condition, replicate and generation, in key order: `trials`, how many individuals; `line` and
            `ends`, the highest coverage among them [0..1].
        driven: State of each condition that a robot drove, from the ledger.
        uncounted: Names of the conditions that are left out, because their cells were not counted.
        allow_code: True to run Python files that the user has not allowed before.
    """

    folder: ResultsFolder
    description: DescribedStudy
    best: pl.DataFrame
    driven: Mapping[str, DrivenCondition] = field(default_factory=dict)
    uncounted: tuple[str, ...] = ()
    allow_code: bool = False
    _whole_runs: dict[tuple[str, int], pl.DataFrame] = field(default_factory=dict, repr=False, compare=False)

    def counted_only(self) -> Tally:
        """Return the tally without the conditions whose cells were not counted.

        Raises:
            RecordError: none is left.
        """
        uncounted = _uncounted(self.best)
        best = self.best.filter(~pl.col("condition").is_in(list(uncounted)))
        if best.is_empty():
            raise RecordError(
                f"Nobody counted the cells of {', '.join(uncounted)} in {self.folder.path}, and a report shows "
                "coverage. The scores of the task are printed at the end of a study; in Python: "
                "realitygap.report.summarize_tasks(FOLDER)."
            )
        conditions = [each for each in self.conditions if each["name"] not in uncounted]
        description: Any = {**self.description, "conditions": conditions}
        return Tally(self.folder, description, best, self.driven, uncounted, self.allow_code)

    @property
    def conditions(self) -> list[DescribedCondition]:
        """The conditions as the description has them."""
        return self.description["conditions"]

    def condition(self, name: str) -> DescribedCondition:
        """Return one condition by name.

        Raises:
            ValueError: there is none of that name.
        """
        names = [condition["name"] for condition in self.conditions]
        if name not in names:
            raise ValueError(f"Unknown condition {name!r}. {did_you_mean(name, names)}")
        return self.conditions[names.index(name)]

    def resolved(self, name: str) -> Condition:
        """Return one condition by name with its settings as this version reads them.

        Raises:
            ValueError: there is none of that name.
            RecordVersionError: its settings are not those of this version.
        """
        condition = Condition.from_settings(name, dict(settings_of(self.condition(name))))
        return condition.allowed() if self.allow_code else condition

    @property
    def with_runs(self) -> list[DescribedCondition]:
        """The conditions that have runs."""
        names = set(self.runs["condition"])
        return [condition for condition in self.conditions if condition["name"] in names]

    @property
    def labels(self) -> list[str]:
        """The labels of all conditions, each once, in order."""
        return sorted({label_of(condition) for condition in self.conditions})

    def selecting_by(self, selection: str) -> list[DescribedCondition]:
        """Return the conditions that have runs and this selection."""
        return [condition for condition in self.with_runs if selection_of(condition) == selection]

    def name_of(self, condition: str | None) -> str:
        """The name of a condition; that of the first with runs when none is given.

        Raises:
            ValueError: there is none of that name.
        """
        return str(self.runs["condition"][0]) if condition is None else self.condition(condition)["name"]

    @cached_property
    def runs(self) -> pl.DataFrame:
        """One row per condition and replicate, in key order: `line` and `ends`, the best of the whole run."""
        return self.best.group_by("condition", "replicate", maintain_order=True).agg(
            pl.col("line", "ends").max()
        )

    @cached_property
    def measure(self) -> Measure:
        """Measure that figures show: coverage by step ends if all conditions select by it, otherwise along the line."""
        cells = [settings_of(condition).get("task", {}).get("cells") for condition in self.conditions]
        return "ends" if set(cells) == {"ends"} else "line"

    @property
    def coverage_column(self) -> str:
        """The column of rows with the coverage that figures show."""
        return f"coverage_{self.measure}"

    @property
    def counted(self) -> str:
        """The way in which the cells are counted that figures show, in words."""
        return "along the line driven" if self.measure == "line" else "at the ends of steps"

    def run_bests(self, condition: str, measure: Measure) -> npt.NDArray[np.float64]:
        """Return the best coverage of each run of a condition, in the order of replicates, (n,) [0..1]."""
        return self.runs.filter(pl.col("condition") == condition)[measure].to_numpy()

    def score_column(self, condition: str) -> str:
        """The column of rows that says which trial of a condition is the best: its coverage, or its task's score."""
        is_coverage = task_of(self.condition(condition)) == "coverage"
        return self.coverage_column if is_coverage else "task_fitness"

    def run_scores(self, condition: str) -> npt.NDArray[np.float64]:
        """Return the best score of each run of a condition by its task, in the order of replicates, (n,)."""
        if task_of(self.condition(condition)) == "coverage":
            return self.run_bests(condition, self.measure)
        bests = bests_of(self.folder, condition)
        return bests.max(axis=1) if len(bests) else np.empty(0)

    def replicates(self, condition: str) -> npt.NDArray[np.uint32]:
        """Return the replicates of a condition, in order, (n,)."""
        return self.runs.filter(pl.col("condition") == condition)["replicate"].to_numpy()

    def typical_replicate(self, condition: str) -> int:
        """The run whose best trial by the task is the median: the lower middle one, and the first of several alike.

        Raises:
            ValueError: the condition has no runs.
        """
        bests = self.run_scores(condition)
        if len(bests) == 0:
            raise ValueError(f"Condition {condition!r} has no runs yet.")
        middle = np.sort(bests)[(len(bests) - 1) // 2]
        return int(self.replicates(condition)[np.argmax(bests == middle)])

    def generation_bests(self, condition: str, measure: Measure) -> npt.NDArray[np.float64]:
        """Return the best coverage in each generation of each run, (n, g) [0..1]; NaN after a run's last generation."""
        rows = self.best.filter(pl.col("condition") == condition)
        if rows.is_empty():
            return np.empty((0, 0))
        run = rows["replicate"].rle_id().to_numpy()
        generation = rows["generation"].to_numpy()
        values = np.full((run[-1] + 1, generation.max() + 1), np.nan)
        values[run, generation] = rows[measure].to_numpy()
        return values

    def rows_of(self, condition: str, replicate: int, columns: Sequence[str] | None = None) -> pl.DataFrame:
        """All rows of one run; several figures show the same few runs, so whole ones are read once.

        Raises:
            ValueError: there is no such run.
        """
        key = condition, replicate
        rows = self._whole_runs.get(key)
        if rows is None:
            rows = self.folder.read(condition, [replicate], columns)
            if columns is None:
                self._whole_runs[key] = rows
        elif columns is not None:
            rows = rows.select(columns)
        if not rows.is_empty():
            return rows
        replicates = [int(run) for run in self.replicates(condition)]
        has = f"its runs are {replicates[0]} to {replicates[-1]}" if replicates else "it has none yet"
        if replicates and replicates != list(range(replicates[0], replicates[-1] + 1)):
            has += f", {len(replicates)} of them"
        raise ValueError(f"Condition {condition!r} has no run {replicate} in {self.folder.path}: {has}.")

    def n_trials(self, condition: str | None = None) -> int:
        """Return the number of individuals tried, in one condition or in the whole study."""
        rows = self.best if condition is None else self.best.filter(pl.col("condition") == condition)
        return int(rows["trials"].sum())


Results = Tally | ResultsFolder | str | Path
"""The results of a study, the path to them, or what `read_tally` read of them."""


def read_tally(folder: Results, *, with_uncounted: bool = False, allow_code: bool = False) -> Tally:
    """Read a study chunk by chunk; memory holds one chunk, and one row for each generation of each run.

    Args:
        folder: Results of a study, or the path to them. A tally is returned as it is.
        with_uncounted: True to include conditions whose cells were not counted; their coverage is NaN.
        allow_code: True to run Python files that the user has not allowed before.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    if isinstance(folder, Tally):
        return folder
    folder = folder if isinstance(folder, ResultsFolder) else ResultsFolder.open(folder)
    parts = [
        frame.group_by("condition", "replicate", "generation", maintain_order=True).agg(
            pl.len().alias("trials"),
            pl.col("coverage_line").max().alias("line"),
            pl.col("coverage_ends").max().alias("ends"),
        )
        for frame in folder.frames(columns=_COLUMNS)
    ]
    best = pl.concat(parts) if parts else pl.DataFrame(schema=_BEST)
    driven = read_driven(folder)
    if best.is_empty():
        raise no_trials(folder, driven)
    description: Any = folder.description
    description["conditions"] = [_labeled(each, driven) for each in conditions_of(description)]
    tally = Tally(folder, description, best, driven, allow_code=allow_code)
    return tally if with_uncounted else tally.counted_only()


def largest(rows: pl.DataFrame, column: str) -> int:
    """Return the largest number in a column of whole numbers."""
    return int(rows[column].to_numpy().max())


def no_trials(folder: ResultsFolder, driven: Mapping[str, DrivenCondition]) -> RecordError:
    """Return the error for a folder without trials."""
    begun = (
        " No run on a robot is complete; `realitygap trials list` shows how far they are." if driven else ""
    )
    return RecordError(
        f"{folder.path} holds no trials yet, so there is nothing to report. Run the study first.{begun}"
    )


def _uncounted(best: pl.DataFrame) -> tuple[str, ...]:
    """Names of the conditions of which no cells are known."""
    counted = best.group_by("condition", maintain_order=True).agg(pl.col("line").is_not_null().any())
    return tuple(counted.filter(~pl.col("line"))["condition"])


def labeled_conditions(folder: ResultsFolder) -> list[DescribedCondition]:
    """The conditions of a study, with the label of the robot that drove them, which only the ledger knows."""
    driven = read_driven(folder)
    return [_labeled(each, driven) for each in conditions_of(folder.description)]


def _labeled(condition: DescribedCondition, driven: Mapping[str, DrivenCondition]) -> DescribedCondition:
    label = driven[condition["name"]].label if condition["name"] in driven else None
    return condition if label is None else {**condition, "label": label}


def conditions_of(description: Mapping[str, Any]) -> list[DescribedCondition]:
    """The conditions in a study's description, which may name them alone."""
    described: list[DescribedCondition | str] = description["conditions"]
    return [{"name": each} if isinstance(each, str) else each for each in described]


def settings_of(condition: DescribedCondition) -> Mapping[str, Any]:
    """Return the resolved settings of a condition; empty if the description has none."""
    settings = condition.get("settings")
    return settings if isinstance(settings, dict) else {}


def selection_of(condition: DescribedCondition) -> str:
    """Return the selection method of a condition, as named in its settings."""
    return str(settings_of(condition).get("selection", "unknown")).encode("utf-8", "replace").decode()


def bests_of(folder: ResultsFolder, condition: str) -> npt.NDArray[np.float64]:
    """Return the best fitness by the task in each generation of each run, (n, g)."""
    parts = [
        frame.group_by("replicate", "generation", maintain_order=True).agg(pl.col("task_fitness").max())
        for frame in folder.frames(condition, ["replicate", "generation", "task_fitness"])
    ]
    if not parts:
        return np.empty((0, 0))
    best = pl.concat(parts).sort("replicate", "generation")
    return best["task_fitness"].to_numpy().reshape(best["replicate"].n_unique(), -1)


def replicates_of(folder: ResultsFolder, condition: str) -> tuple[int, ...]:
    """Return the numbers of the runs of a condition, in order."""
    return tuple(
        sorted(
            {run for frame in folder.frames(condition, ["replicate"]) for run in frame["replicate"].unique()}
        )
    )


def task_of(condition: DescribedCondition) -> str:
    """The kind of a condition's task."""
    return str(settings_of(condition).get("task", {}).get("kind", "coverage"))


def score_text(score: float | None) -> str:
    """Return a score of a task with four digits that count; a dash if there is none."""
    return "–" if score is None else significant(score, 4, keep_zeros=True)


def label_of(condition: DescribedCondition) -> str:
    """Return the label for the origin of the numbers, printed on every figure: SIM, TWIN, EMULATED or REAL."""
    return str(condition.get("label") or "unlabeled").encode("utf-8", "replace").decode()


Names = tuple[str, ...]


def declared(settings: Mapping[str, Any]) -> tuple[Names, Names]:
    """Return the names of the inputs and the outputs of networks, as `runs.Condition` has them."""
    controller, task = (dict(settings.get(name) or {}) for name in ("controller", "task"))
    outputs = tuple(controller.get("outputs") or ("move", "turn"))
    if controller.get("inputs"):
        return tuple(controller["inputs"]), outputs
    inputs = tuple(task.get("inputs") or ("obstacle", "stall", "time"))
    if "kind" in task:
        return inputs, outputs
    bias = task.get("bias_input", "with-novelty")
    has_bias = bias == "always" or (bias == "with-novelty" and settings.get("selection") == "novelty")
    return (*inputs, "bias") if has_bias else inputs, outputs

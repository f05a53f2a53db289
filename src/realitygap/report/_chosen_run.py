"""One run of a study that a figure shows, with the paths of its trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.errors import RealityGapError
from realitygap.report._driven import driven_paths
from realitygap.report._tally import DescribedCondition, Results, Tally, label_of, read_tally, task_of
from realitygap.report.charts.arena import Track
from realitygap.runs import Condition, replay
from realitygap.world import Arena


@dataclass(frozen=True)
class TracedPath:
    """A trial that is drawn.

    Attributes:
        generation, individual: Identity of the trial.
        coverage: Coverage [0..1], by the tally's measure.
        cells: Cells along the line, columns * row + column.
        tracks: (t + 1, 3) x, y [m], heading [rad], and (t + 1,) True if the step was blocked, of each robot. Empty if
            the trial cannot be recomputed.
    """

    generation: int
    individual: int
    coverage: float
    cells: tuple[int, ...]
    tracks: tuple[Track, ...]

    @property
    def end(self) -> npt.NDArray[np.float64]:
        """Last position of the first robot [m], (2,)."""
        return self.tracks[0][0][-1, :2]


@dataclass(frozen=True)
class ChosenRun:
    """A run of a condition.

    Attributes:
        tally: Tally of its study.
        name: Name of the condition.
        replicate: Number of the run.
        is_typical: True if the run was not chosen by number, so that it is the typical one.
    """

    tally: Tally
    name: str
    replicate: int
    is_typical: bool

    @property
    def described(self) -> DescribedCondition:
        """The condition as the study's description has it."""
        return self.tally.condition(self.name)

    @cached_property
    def condition(self) -> Condition:
        """The condition as this version reads it.

        Raises:
            RecordVersionError: its settings are not those of this version.
        """
        return self.tally.resolved(self.name)

    @cached_property
    def arena(self) -> Arena:
        """The arena of the condition."""
        return self.condition.placed_arena

    @property
    def label(self) -> str:
        """SIM, TWIN, EMULATED or REAL."""
        return label_of(self.described)

    @property
    def rows(self) -> pl.DataFrame:
        """All rows of the run."""
        return self.tally.rows_of(self.name, self.replicate)

    def trace(self, rows: pl.DataFrame) -> tuple[list[TracedPath], str]:
        """Return the paths of rows of the run, and their origin or the reason why some are missing, in words."""
        paths, problem = self._driven(rows) if self.condition.is_physical else self._recomputed(rows)
        return paths, self._origin(paths, problem)

    def _recomputed(self, rows: pl.DataFrame) -> tuple[list[TracedPath], str]:
        paths, problem = [], ""
        for row in rows.iter_rows(named=True):
            tracks: tuple[Track, ...] = ()
            try:
                robots = replay(self.condition, row).robots
                tracks = tuple((robot.poses, robot.stalled) for robot in robots)
            except (RealityGapError, ValueError) as error:
                # another version's genome or numbers; the cells visited are in the row
                problem = str(error)
            paths.append(self._path(row, tracks))
        return paths, problem

    def _driven(self, rows: pl.DataFrame) -> tuple[list[TracedPath], str]:
        """Return the trials of a robot: with the line if an emulator's witness recorded it, otherwise only cells."""
        seen = driven_paths(self.tally.folder, self.name, self.replicate)
        paths = []
        for row in rows.iter_rows(named=True):
            poses = seen.get((row["generation"], row["individual"]))
            tracks = () if poses is None else ((poses, np.zeros(len(poses), np.bool_)),)
            paths.append(self._path(row, tracks))
        return paths, ""

    def _path(self, row: dict[str, Any], tracks: tuple[Track, ...]) -> TracedPath:
        coverage = row[self.tally.coverage_column]
        return TracedPath(row["generation"], row["individual"], coverage, tuple(row["cells"]), tracks)

    @property
    def which(self) -> str:
        """The reason for this run, as the end of a clause; empty if it was chosen by number."""
        if not self.is_typical or len(self.tally.replicates(self.name)) == 1:
            return ""
        worth = "coverage" if task_of(self.described) == "coverage" else "score"
        return f", the run with the median best {worth}"

    def _origin(self, paths: Sequence[TracedPath], problem: str) -> str:
        if self.condition.is_physical:
            if all(path.tracks for path in paths):
                return "Paths as recorded by the emulator’s witness, without marks for blocked steps."
            return "Shaded: the entered cells. The paths themselves were not recorded."
        if problem:
            return f"Some paths are missing: the trials could not be recomputed. {problem}"
        several = " Each color is a robot." if any(len(path.tracks) > 1 for path in paths) else ""
        return f"Recomputed from the records.{several}"


def choose_run(folder: Results, condition: str | None = None, replicate: int | None = None) -> ChosenRun:
    """Return a run of a study.

    Args:
        folder: Results of a study, or the path to them.
        condition: Condition. Default: the first one with runs.
        replicate: Run. Default: the typical one, whose best trial by the task is the median of its condition.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such condition, or it has no runs.
    """
    tally = read_tally(folder)
    name = tally.name_of(condition)
    chosen = tally.typical_replicate(name) if replicate is None else replicate
    return ChosenRun(tally, name, chosen, replicate is None)

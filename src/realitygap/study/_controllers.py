"""Controllers to try on both sides of a gap: unrelated networks, or champions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import polars as pl

from realitygap.errors import StudyError, whole_number
from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.records import ResultsFolder
from realitygap.runs import Condition, genome_of, run_replicates
from realitygap.trials import NoiseKey, RecordedTarget, retry_genomes

from ._file import DEFAULT_NEAT, load_study

FRESH_TRIALS = 20
"""How often a champion is tried again where it was selected, each time on noise of its own."""

_COLUMNS = ["replicate", "generation", "individual", "genome", "key", "coverage_line", "coverage_ends"]
_PAPER_INPUTS = ("obstacle", "stall", "time")


@dataclass(frozen=True)
class Controller:
    """A controller and where it comes from.

    Attributes:
        genome: Its network.
        name: Such as random-3, or coverage-10/7 for the champion of run 7.
        kind: random, or champion.
        selected_score: Coverage [0..1] for which it was selected; None where it was not.
        fresh_score: Its mean coverage on fresh noise where it was selected; None where it was not, or where that
            cannot be computed.
        selected_on: The platform where it was selected; empty where it was not.
    """

    genome: Genome
    name: str
    kind: Literal["random", "champion"] = "champion"
    selected_score: float | None = None
    fresh_score: float | None = None
    selected_on: str = ""


def sample_controllers(kind: str | Path, n: int, seed: int = 1) -> list[Controller]:
    """Draw n controllers with the inputs of the paper.

    Args:
        kind: `random` (unrelated networks of the paper's NEAT), a folder of results, of whose champions n are drawn,
            or the name or file of a study, of whose first condition that can be computed n runs are made.
        n: How many, at least 1.
        seed: Of the draw, and of the runs of a study.

    Raises:
        ValueError: n is out of range.
        StudyError: There is no such study, it has no condition of use, or there are not so many champions.
        RecordError: There are no such results.
    """
    n = whole_number("n", n, 1)
    if str(kind) == "random":
        return _random(n, seed)
    if Path(kind).is_dir():
        found = _of_folder(ResultsFolder.open(kind), kind)
        if len(found) < n:
            raise StudyError(
                f"{kind} has champions of {len(found)} runs, and {n} controllers are asked for. Run more replicates, "
                "or ask for fewer."
            )
        chosen = sorted(np.random.default_rng(seed).permutation(len(found))[:n])
        return _with_fresh_scores([found[k] for k in chosen])
    return _with_fresh_scores(_of_study(kind, n, seed))


def recorded_controllers(target: str) -> list[tuple[Controller, int]]:
    """The controllers of a target of recorded trials, and of how many trials of each there are at least.

    Args:
        target: By name; of any other there are none.

    Raises:
        RecordError: The file cannot be read.
    """
    name, _, path = target.partition(":")
    if name != "recorded" or not path:
        return []
    found = RecordedTarget(path).controllers
    least = min(n for _, n in found)
    return [(Controller(genome, f"recorded-{k}", "random"), least) for k, (genome, _) in enumerate(found)]


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
            selected_score=float(self.row[f"coverage_{self.condition.counted_cells}"]),
            selected_on=self.condition.platform,
        )


def _of_folder(folder: ResultsFolder, name: str | Path) -> list[_Champion]:
    found: list[_Champion] = []
    for described in folder.description["conditions"]:
        condition = Condition.from_settings(described["name"], dict(described["settings"]))
        if _is_of_use(condition):
            rows = folder.read(condition.name, columns=_COLUMNS)
            found += [_Champion(condition, row) for row in _best_of_runs(condition, rows)]
    if not found:
        raise StudyError(
            f"{name} has no champions of the task coverage whose networks see {', '.join(_PAPER_INPUTS)}, as targets "
            "show it. Name other results, or `random`."
        )
    return found


def _of_study(name: str | Path, n: int, seed: int) -> list[_Champion]:
    study = load_study(name, seed=seed, replicates=n)
    for condition in study.conditions:
        if _is_of_use(condition) and not condition.is_physical:
            rows = run_replicates(condition, 0, n)
            return [_Champion(condition, row) for row in _best_of_runs(condition, rows)]
    raise StudyError(
        f"The study {name} has no condition of the task coverage that can be computed and whose networks see "
        f"{', '.join(_PAPER_INPUTS)}. Name another, or `random`."
    )


def _is_of_use(condition: Condition) -> bool:
    inputs = tuple(name for name in condition.network_inputs if name != "bias")
    return condition.coverage is not None and condition.selection != "random" and inputs == _PAPER_INPUTS


def _best_of_runs(condition: Condition, rows: pl.DataFrame) -> Iterator[dict[str, Any]]:
    """The first of the best in each run."""
    column = f"coverage_{condition.counted_cells}"
    best = rows.filter(pl.col(column) == pl.col(column).max().over("replicate"))
    return best.unique("replicate", keep="first", maintain_order=True).iter_rows(named=True)


def _with_fresh_scores(champions: list[_Champion]) -> list[Controller]:
    """Champions tried again on fresh noise; those that a robot drove are as they are."""
    found: list[Controller] = []
    for champion in champions:
        controller, condition, row = champion.controller, champion.condition, champion.row
        if condition.platform not in ("jyro", "sim"):
            found.append(controller)
            continue
        batch = retry_genomes(
            condition.simulated_on,
            condition.arena.arena(),
            [controller.genome],
            noise=condition.noise,
            noise_keys=[NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"])],
            repeats=range(1, FRESH_TRIALS + 1),
            inputs=condition.network_inputs,
        )
        fresh = float(getattr(batch, f"coverage_{condition.counted_cells}").mean())
        found.append(
            Controller(
                controller.genome,
                controller.name,
                selected_score=controller.selected_score,
                fresh_score=fresh,
                selected_on=controller.selected_on,
            )
        )
    return found

"""The mean score on a target, estimated from a table of scores."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from realitygap._wording import counted
from realitygap.errors import TableError, did_you_mean
from realitygap.logs import ScoreRow, read_scores
from realitygap.orders import EstimateOrder, range_ends
from realitygap.stats import assisted_mean, range_of_differences

from ._compare import platforms_in
from ._estimated import EstimatedScore

Means = Mapping[str, float]
"""Mean score of each unit, by its name: of a controller or of a block."""


def estimate_in_table(order: EstimateOrder) -> EstimatedScore:
    """Estimate a mean score from a table of scores.

    Units are controllers, each with the mean of its trials. For a single controller, and for a difference of two, they
    are blocks: conditions such as a start, in which trials of both platforms were run.

    Raises:
        TableError: The table cannot be read, or has no such units.
    """
    table = read_scores(Path(order.sim), controller=order.controller or "", score=order.score or "")
    rows = _of_task(table, order.task)
    sim, real = platforms_in(rows, order.sim_name, order.real_name, ("--sim-name", "--real-name"))
    within = range_ends(order.range)
    for row in rows:
        if not within[0] <= row.score <= within[1]:
            raise TableError(
                f"{row.place}: the score is {row.score:g}, expected {within[0]:g} to {within[1]:g}. Give the range: "
                "--range LOW:HIGH"
            )
    by_platform = {name: [row for row in rows if row.platform == name] for name in (sim, real)}
    noun = "controller" if order.of is None else "block"
    simulated, driven = (_units(of, name, order) for name, of in by_platform.items())
    if only := [name for name in driven if name not in simulated]:
        raise TableError(
            f"{counted(len(only), noun)} {'is' if len(only) == 1 else 'are'} on {real} only, such as {only[0]}. "
            f"Simulate each {noun} that was tried on {real}."
        )
    others = [name for name in simulated if name not in driven]
    whose = "all controllers" if order.of is None else order.of
    if order.minus is not None:
        whose, within = f"{order.of} minus {order.minus}", range_of_differences(within)
    assisted = assisted_mean(
        np.array([*driven.values()]),
        np.array([simulated[name] for name in driven]),
        np.array([simulated[name] for name in others]),
        fleet=order.fleet,
        noise=_noise(by_platform[real]) if order.of is None else None,
        within=within,
        noun=f"{noun}s",
    )
    return EstimatedScore(
        assisted,
        f"Mean score of {whose} on {real}, assisted by {sim}",
        noun,
        np.array([*driven.values()]),
        np.array([simulated[name] for name in (*driven, *others)]),
        f"{counted(len(driven), noun)} on {real}; {counted(len(simulated), noun)} on {sim}",
        "score",
        order,
    )


def _of_task(rows: Sequence[ScoreRow], task: str | None) -> list[ScoreRow]:
    """Return the rows of a task.

    Raises:
        TableError: There is no such task, or there are several and none is named.
    """
    tasks = list(dict.fromkeys(row.task for row in rows))
    if task is None and len(tasks) > 1:
        raise TableError(
            f"The table has {counted(len(tasks), 'task')}: {', '.join(tasks)}. Name one (--task)."
        )
    if task is not None and task not in tasks:
        raise TableError(f"There is no task {task!r}. {did_you_mean(task, tasks)}")
    return [row for row in rows if task is None or row.task == task]


def _units(rows: Sequence[ScoreRow], platform: str, order: EstimateOrder) -> Means:
    """Return the mean score of each unit on a platform.

    Raises:
        TableError: A controller is missing there, or its trials have no blocks.
    """
    if order.of is None:
        return _means((row.controller, row.score) for row in rows)
    first = _blocks(rows, platform, order.of)
    if order.minus is None:
        return first
    second = _blocks(rows, platform, order.minus)
    return {block: score - second[block] for block, score in first.items() if block in second}


def _blocks(rows: Sequence[ScoreRow], platform: str, controller: str) -> Means:
    own = [row for row in rows if row.controller == controller]
    if not own:
        names = list(dict.fromkeys(row.controller for row in rows))
        raise TableError(
            f"There is no controller {controller!r} on {platform}. {did_you_mean(controller, names)}"
        )
    if not all(row.block for row in own):
        raise TableError(
            f"Trials of {controller} on {platform} have no blocks. If all begin alike, the noise on both platforms is "
            "independent, and a simulator cannot help. Vary the start, and name it in a column block."
        )
    return _means((row.block, row.score) for row in own)


def _means(scores: Iterable[tuple[str, float]]) -> Means:
    """Return the mean of the scores of each name."""
    found: dict[str, list[float]] = {}
    for name, score in scores:
        found.setdefault(name, []).append(score)
    return {name: float(np.mean(of)) for name, of in found.items()}


def _noise(rows: Sequence[ScoreRow]) -> float | None:
    """Return the mean variance of a controller's mean that is noise of trials; None if one has a single trial."""
    found: dict[str, list[float]] = {}
    for row in rows:
        found.setdefault(row.controller, []).append(row.score)
    if any(len(of) < 2 for of in found.values()):
        return None
    return float(np.mean([np.var(of, ddof=1) / len(of) for of in found.values()]))

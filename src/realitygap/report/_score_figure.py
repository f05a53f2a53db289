"""The score of another task than coverage by generation: one figure per score, one panel per condition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.errors import RealityGapError
from realitygap.records import ResultsFolder
from realitygap.report._coverage_figure import (
    Axis,
    Panel,
    count_drawable,
    draw_panels,
    marks_of,
    say_interval,
    say_runs,
)
from realitygap.report._drawing import Drawing, draw_wide
from realitygap.report._marks import decimals_for
from realitygap.report._tally import (
    bests_of,
    label_of,
    labeled_conditions,
    replicates_of,
    settings_of,
    task_of,
)
from realitygap.runs import Condition


def draw_scores(folder: ResultsFolder | str | Path) -> list[Drawing]:
    """Best score by generation, for conditions of other tasks than coverage.

    Args:
        folder: Results of a study, or the path to them.

    Returns:
        One figure for each score; none if all conditions are of coverage, or have no runs.

    Raises:
        RecordError: there is no such folder, or a file in it is damaged.
    """
    folder = folder if isinstance(folder, ResultsFolder) else ResultsFolder.open(folder)
    panels: dict[tuple[str, float, float], list[Panel]] = {}
    labels: dict[tuple[str, float, float], set[str]] = {}
    for condition in labeled_conditions(folder):
        score = _score_of(condition)
        if score is not None and len(values := bests_of(folder, condition["name"])):
            label = label_of(condition)
            labels.setdefault(score, set()).add(label)
            panels.setdefault(score, []).append(
                Panel(
                    title=condition["name"],
                    note=f"{label}, n = {len(values)}",
                    values=values,
                    n_drawn=count_drawable(values),
                    run_bests=values.max(axis=1),
                    published=(),
                    replicates=replicates_of(folder, condition["name"]),
                )
            )
    return [
        _draw(score, group, sorted(labels[score]), f"scores-{number}")
        for number, (score, group) in enumerate(panels.items())
    ]


def _score_of(condition: Mapping[str, Any]) -> tuple[str, float, float] | None:
    """Name, least and greatest value of a condition's score; None for coverage."""
    settings, kind = settings_of(condition), task_of(condition)
    if kind == "coverage":
        return None
    try:
        task = Condition.from_settings(condition["name"], dict(settings)).task_of_trials
        return (task.score_name, *task.score_range)
    except RealityGapError:  # settings of another version
        return f"score of {kind}", -np.inf, np.inf


def _draw(of: tuple[str, float, float], panels: list[Panel], labels: Sequence[str], name: str) -> Drawing:
    score, least, greatest = of
    axis = _axis(score, panels, least, greatest)
    caption = (
        f"Best {score} of each generation, by generation (from 0). {' and '.join(labels)}. {say_runs(panels)} Blue: "
        f"the median over the runs{say_interval(panels)}. Gray column, “run”: the best of whole runs, with its median, "
        "interval and quartiles."
    )
    alt = (
        f"Best {score} by generation in {len(panels)} panels, one per condition: a line for each run, the median with "
        "its interval, and the best of the runs. Their numbers are in the table of scores."
    )
    marks = marks_of(panels, decimals_for(np.concatenate([panel.run_bests for panel in panels])))
    return draw_wide(lambda width: draw_panels(panels, width, axis), name, caption, alt, marks=marks)


def _axis(score: str, panels: Sequence[Panel], least: float, greatest: float) -> Axis:
    """An axis with round numbers around everything shown, and no value that a score cannot have."""
    from matplotlib.ticker import MaxNLocator

    shown = np.concatenate([panel.values.ravel() for panel in panels])
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    if high - low < 1e-9:
        low, high = max(low - 0.5, least), min(high + 0.5, greatest)
    ticks = np.asarray(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    step = float(ticks[1] - ticks[0])
    decimals = next(d for d in range(12) if abs(round(step, d) - step) < 1e-9 * step)
    ticks = ticks[(ticks >= least - 1e-9) & (ticks <= greatest + 1e-9)]
    return Axis(
        score, min(low, float(ticks[0])), max(high, float(ticks[-1])), tuple(ticks.tolist()), decimals
    )

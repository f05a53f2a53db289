"""A figure of one trial: its path, the readings of the sensors, and the commands of the network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.drawing import Ink
from realitygap.errors import whole_number
from realitygap.report._driven import refuse_replay
from realitygap.report._tally import Results, Tally, label_of, largest, read_tally
from realitygap.report.charts.arena import draw_arena, draw_cells, draw_start, draw_tracks
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import Dash, head
from realitygap.report.charts.sheet import Sheet
from realitygap.runs import Condition, replay
from realitygap.trials import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Values = npt.NDArray[np.floating]

_READINGS: tuple[tuple[str, Dash], ...] = (
    (Ink.PEN1, "solid"),
    (Ink.PEN0, (0, (5, 1.5))),
    (Ink.PEN2, (0, (1.3, 1.5))),
)


@dataclass(frozen=True)
class ChosenTrial:
    """A row of results with what belongs to it.

    Attributes:
        condition: Condition as resolved.
        label: SIM, TWIN, EMULATED or REAL.
        row: Row of the results.
        measure: Column of coverage that figures show.
    """

    condition: Condition
    label: str
    row: dict[str, Any]
    measure: str

    @property
    def title(self) -> str:
        """Name of the trial."""
        row = self.row
        return (
            f"{row['condition']}, run {row['replicate']}, generation {row['generation']}, "
            f"individual {row['individual']}"
        )


def choose_trial(
    tally: Tally,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
    *,
    of_last: bool = False,
) -> ChosenTrial:
    """A trial by its numbers; of what is not given, the first condition, the typical run, its best trial.

    Args:
        tally: Tally of the study.
        condition: Condition to choose from.
        replicate: Run to choose from.
        generation: Generation of the run. Default: the one with the run's best trial.
        individual: Individual of the generation.
        of_last: True to take the best of the last generation if no generation is given.

    Raises:
        ValueError: there is none such; the message says which there are.
    """
    name = tally.name_of(condition)
    for what, number in (("generation", generation), ("individual", individual)):
        if number is not None:
            whole_number(what, number)
    replicate = tally.typical_replicate(name) if replicate is None else replicate
    rows = tally.rows_of(name, replicate)
    if individual is not None and generation is None:
        raise ValueError(f"Individual {individual} of which generation? Name it too.")
    last = largest(rows, "generation")
    if generation is None and of_last:
        generation = last
    if generation is not None:
        if not 0 <= generation <= last:
            raise ValueError(
                f"Run {replicate} of {name!r} has no generation {generation}: its generations are 0 to {last}."
            )
        rows = rows.filter(pl.col("generation") == generation)
    if individual is not None:
        if not 0 <= individual < rows.height:
            raise ValueError(
                f"Generation {generation} has no individual {individual}: its individuals are 0 to {rows.height - 1}."
            )
        rows = rows.filter(pl.col("individual") == individual)
    row = rows.row(int(rows[tally.score_column(name)].arg_max() or 0), named=True)
    return ChosenTrial(tally.resolved(name), label_of(tally.condition(name)), row, tally.coverage_column)


def best_trials(folder: Results) -> pl.DataFrame:
    """Return the best trial of each condition that has runs, the highest score first.

    Args:
        folder: Results of a study, or the path to them.

    Returns:
        Columns `condition`, `label`, `run`, `generation`, `individual`, and `score`: the coverage, or the score of the
        condition's task. A score that selected its trial is the best of many noisy ones, so luck is part of it.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder)
    rows = []
    for condition in tally.with_runs:
        name = condition["name"]
        run = int(tally.replicates(name)[np.argmax(tally.run_scores(name))])
        best = choose_trial(tally, name, run)
        numbers = {"run": run, **{key: best.row[key] for key in ("generation", "individual")}}
        rows.append(
            {
                "condition": name,
                "label": best.label,
                **numbers,
                "score": float(best.row[tally.score_column(name)]),
            }
        )
    return pl.DataFrame(rows).sort("score", descending=True, maintain_order=True)


def draw_trial(
    folder: Results,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
) -> Drawing:
    """Draw one trial, recomputed from its row: path, readings and commands.

    Args:
        folder: Results of a study, or the path to them.
        condition: Condition. Default: the first one.
        replicate: Run. Default: the typical one, as in `draw_paths`.
        generation: Generation of the run. Default: that of its best trial.
        individual: Individual of the generation. Default: the best one by the task.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, it holds no trials yet, or the trial comes out
            otherwise than recorded.
        ValueError: there is no such trial.
    """
    tally = read_tally(folder)
    trial = choose_trial(tally, condition, replicate, generation, individual)
    trajectory = _replayed(trial)
    coverage = trial.row[trial.measure]
    n_steps, n_stalls = len(trajectory.commands), int(trajectory.stalled.sum())
    several = "Each color is a robot. Readings, commands and blocked steps are of the first, dark blue. "
    caption = (
        f"{trial.title}: {n_steps} steps of {trajectory.step_s:g} s, {n_stalls} of them blocked (×; gray stripes), "
        f"coverage {coverage:.3f} {tally.counted}. Dot: start; circle: end; shaded: cells visited. Readings are "
        "distances without noise; obstacle is what the network saw, 1 being nearest, with noise. "
        f"{several if trajectory.others else ''}{trial.label}, n = 1 trial. Recomputed from the records."
    )
    alt = f"Path, readings and commands of one trial. {caption}"
    return draw_wide(lambda width: _draw(trial, trajectory, width), "trial", caption, alt)


def _replayed(trial: ChosenTrial) -> Trajectory:
    if trial.condition.is_physical:
        raise refuse_replay(trial.condition.name)
    return replay(trial.condition, trial.row)


# drawing


def _draw(trial: ChosenTrial, trajectory: Trajectory, width: float) -> Sheet:
    places = [["path", "readings"], ["path", "input"], ["path", "command"]]
    sheet = Sheet(width, places, [None, None, None], widths=[5.4, 2.4], gap=0.2, pad=0.16)
    arena, row = trial.condition.arena_of(trajectory), trial.row
    tracks = [(robot.poses, robot.stalled) for robot in trajectory.robots]
    field = sheet.panels["path"]
    draw_arena(field, arena)
    draw_cells(field, row["cells"], arena)
    draw_start(field, arena, trial.condition.on.body)
    draw_tracks(field, tracks)
    head(field, shorten(trial.title, 60), f"{shorten(trial.label, 12)}, coverage {row[trial.measure]:.3f}")
    times = trajectory.step_s * np.arange(len(trajectory.poses))
    n_sensors = trajectory.readings.shape[1]
    names = ("left", "middle", "right") if n_sensors == 3 else [f"sensor {k}" for k in range(n_sensors)]
    readings, inputs, commands = (sheet.panels[name] for name in ("readings", "input", "command"))
    _draw_lines(readings, times, trajectory.readings.T, names, "distance [m]")
    readings.set_ylim(0, 1.08 * trial.condition.on.sensors.max_range)
    _draw_lines(inputs, times[1:], trajectory.inputs[:, :1].T, trial.condition.network_inputs[:1], "input")
    _draw_lines(commands, times[1:], trajectory.commands.T, ("move", "turn"), "command")
    commands.set_ylim(-1.1, 1.1)
    for axes in (readings, inputs, commands):
        axes.set_xlim(0, times[-1])
        _draw_stripes(axes, times, trajectory)
        axes.tick_params(labelbottom=axes is commands)
    commands.set_xlabel("time [s]", labelpad=2)
    return sheet


def _draw_lines(axes: Axes, times: Values, rows: Values, names: Sequence[str], unit: str) -> None:
    for (color, dashes), values, name in zip(_READINGS, rows, names, strict=False):
        axes.plot(times, values, color=color, linestyle=dashes, linewidth=1.1, label=name, clip_on=False)
    axes.set_ylabel(unit)
    axes.legend(
        loc="center left",
        bbox_to_anchor=(1.01, 0.5),
        frameon=False,
        fontsize=7.0,
        handlelength=1.6,
        borderaxespad=0.0,
        handletextpad=0.4,
    )


def _draw_stripes(axes: Axes, times: Values, trajectory: Trajectory) -> None:
    """The steps in which the robot was blocked."""
    step = trajectory.step_s
    edges = np.flatnonzero(np.diff(np.concatenate([[0], trajectory.stalled.astype(np.int8), [0]])))
    for start, end in edges.reshape(-1, 2):
        axes.axvspan(times[start] - step, times[end - 1], color=Ink.RULE, alpha=0.6, linewidth=0, zorder=0)

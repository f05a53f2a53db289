"""The replay: trials of a typical run and the best one of each run, recomputed and packed for the page's script.

Every number is rounded to a whole multiple of its unit in `UNITS`, so that what the page shows is within half a
unit of what was computed. A trial is one run of bytes: columns of differences from one step to the next, each
difference as a zigzag number of 7 bits a byte. The bytes of all trials are compressed together (RFC 1951).
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl
from markupsafe import Markup

from realitygap.errors import RealityGapError
from realitygap.playback import RobotShape, first_visits, pack_pen, pack_scene, pack_shape
from realitygap.report._placed import as_json, hash_of
from realitygap.report._tally import DescribedCondition, Tally, label_of, score_text, task_of
from realitygap.report._template import template_text
from realitygap.report.charts.arena import arena_extent
from realitygap.runs import Condition, elites_of, replay
from realitygap.trials import Trajectory

UNITS = {"length": 1e-3, "angle": 5e-3, "output": 5e-3}
"""Units to which numbers are rounded: positions and readings [m], headings [rad], inputs and outputs of networks."""

N_PENS = 4
"""Trials shown at once: of more, bodies and rays cover one another."""

MOST_STEPS = 115_000
"""Steps embedded in a page, of all trials together: some 8 bytes each. The best trial of each run of the paper's study
fits."""


@dataclass(frozen=True)
class _Run:
    """The trials of one run that are embedded, ready for JSON, and what to say of it.

    Attributes:
        data: Data for the script; None if no trial could be embedded.
        n_embedded, n_trials: Number of embedded trials and of all trials of the run.
        note: Note on what is missing and why; empty if nothing is.
        replayed: Runs of the condition whose best trial is embedded.
    """

    name: str
    replicate: int
    data: dict[str, Any] | None
    n_embedded: int
    n_trials: int
    note: str
    replayed: tuple[int, ...] = ()


@dataclass(frozen=True)
class Still:
    """A trial for readers without a script.

    Attributes:
        picture: Drawing of its whole path as one `svg` element.
        caption: Caption.
    """

    picture: Markup
    caption: str


@dataclass(frozen=True)
class ReplayOnPage:
    """The replay of a page.

    Attributes:
        css: Style sheet of the player.
        script: Script of the player.
        script_hash: Hash of the script, as the page's policy names it.
        data: Trials, for the script.
        still: Trial that the replay starts with; None without one.
        runs: The typical run of each condition.
        notes: Sentences on trials that are missing.
        labels: Labels of the runs.
        has_all_runs: True if the best trial of each run can be played.
    """

    css: Markup
    script: Markup
    script_hash: str
    data: Markup
    still: Still | None
    runs: list[_Run]
    notes: list[str]
    labels: list[str]
    has_all_runs: bool

    @property
    def embedded(self) -> list[_Run]:
        """The runs with trials that can be played."""
        return [run for run in self.runs if run.data is not None]

    @property
    def trials(self) -> dict[str, frozenset[tuple[int, int]]]:
        """Generation and individual of the trials of the typical run that can be played, by condition."""
        return {
            run.name: frozenset((generation, individual) for generation, individual, *_ in run.data["trials"])
            for run in self.runs
            if run.data is not None
        }

    @property
    def replayed(self) -> dict[str, tuple[int, ...]]:
        """The runs whose best trial can be played, by condition."""
        return {run.name: run.replayed for run in self.runs}


def content(tally: Tally, lead: str) -> ReplayOnPage:
    """Return the replay of a page, with a note on trials that cannot be recomputed and are left out.

    Args:
        tally: The study.
        lead: Name of the condition with whose best trial the replay starts. If it has none, the first condition that
            has some takes its place.
    """
    candidates = tally.with_runs
    room = MOST_STEPS // max(len(candidates), 1)
    trials = bytearray()
    runs = [_pack_run(tally, condition, room, trials) for condition in candidates]
    with_trials = [run for run in runs if run.data is not None]
    packed = [run.data for run in with_trials]
    first = next((k for k, run in enumerate(with_trials) if run.name == lead), 0)
    player = resources.files("realitygap.playback")
    module = player.joinpath("player.js").read_text("utf-8").replace("export default { render };", "")
    # no module: those run last, after the script that looks for tables wider than the page
    script = f'"use strict";\n(async () => {{\n{module}{template_text("replay.js")}}})();\n'
    return ReplayOnPage(
        css=Markup(player.joinpath("player.css").read_text("utf-8") + template_text("replay.css")),
        script=Markup(script),
        script_hash=hash_of(script),
        data=as_json(
            {
                "units": UNITS,
                "pens": [pack_pen(pen) for pen in range(N_PENS)],
                "measure": tally.measure,
                "lead": first,
                "bytes": base64.b64encode(zlib.compress(trials, 9, -zlib.MAX_WBITS)).decode(),
                "conditions": packed,
            }
        ),
        still=_still(tally, with_trials[first]) if packed else None,
        runs=runs,
        notes=_notes(runs),
        labels=sorted({label_of(condition) for condition in candidates}),
        has_all_runs=all(len(run.replayed) == len(tally.replicates(run.name)) for run in runs),
    )


def _notes(runs: Sequence[_Run]) -> list[str]:
    """Return notes on missing content, each with the names of the conditions that it concerns."""
    notes = dict.fromkeys(run.note for run in runs if run.note)
    return [f"{', '.join(run.name for run in runs if run.note == note)}: {note}" for note in notes]


# without a script


def _still(tally: Tally, run: _Run) -> Still:
    """The best trial of a run."""
    data = run.data or {}
    generation, individual = data["trials"][data["best"]][:2]
    row = tally.rows_of(run.name, run.replicate).row(
        by_predicate=(pl.col("generation") == generation) & (pl.col("individual") == individual), named=True
    )
    condition = tally.resolved(run.name)
    label, task = label_of(tally.condition(run.name)), task_of(tally.condition(run.name))
    value = float(row[tally.score_column(run.name)])
    worth = f"coverage {value:.3f}" if task == "coverage" else f"score of {task} {score_text(value)}"
    caption = (
        f"{label}. Best path of {run.name}, run {run.replicate}: generation {generation}, individual {individual}, "
        f"{worth}."
    )
    return Still(_picture(condition, replay(condition, row), caption), caption)


def _picture(condition: Condition, trajectory: Trajectory, text: str) -> Markup:
    """The arena with the whole path of each robot [mm], in the classes of the style sheet."""
    arena = condition.placed_arena
    (left, right), (bottom, top) = arena_extent(arena)
    grid = arena.grid

    def path(points: npt.NDArray[np.float64]) -> str:
        placed = (points[:, :2] - [left, top]) * [1000, -1000]
        return "M" + "L".join(f"{x:.0f} {y:.0f}" for x, y in placed)

    corners = np.array([[0, 0], [grid.columns, 0], [grid.columns, grid.rows], [0, grid.rows], [0, 0]])
    reach = path(corners * grid.cell + [grid.x, grid.y])
    walls = "".join(path(np.array(wall).reshape(2, 2)) for wall in arena.walls)
    trails = "".join(f'<path class="rg-trail" d="{path(robot.poses)}"/>' for robot in trajectory.robots)
    return Markup(
        '<svg class="rg-field" viewBox="0 0 {:.0f} {:.0f}" role="img" aria-label="{}"><path class="rg-reach" d="{}"/>'
        '<path class="rg-walls" d="{}"/>{}</svg>'
    ).format(1000 * (right - left), 1000 * (top - bottom), text, reach, walls, Markup(trails))


# one run


def _pack_run(tally: Tally, described: DescribedCondition, room: int, packed: bytearray) -> _Run:
    """Return a run; the bytes of its trials are appended to those of all."""
    name = described["name"]
    replicate = tally.typical_replicate(name)
    rows = tally.rows_of(name, replicate)
    try:
        condition = tally.resolved(name)
        if condition.is_physical:
            note = "its trials were driven by a robot, and cannot be computed again to be played."
            return _Run(name, replicate, None, 0, rows.height, note)
        n_fitting = room // (condition.on.steps + 1) // condition.arena.robots
        column = tally.score_column(name)
        has_elites = condition.selection == "map-elites" and rows.height > n_fitting
        chosen = _elites(condition, rows, n_fitting) if has_elites else _choose(rows, n_fitting, column)
        trials = [_pack_row(condition, row, packed) for row in chosen.iter_rows(named=True)]
        bests = _bests(tally, name, replicate, n_fitting - len(trials))
        others = [
            [int(row["replicate"]), *_pack_row(condition, row, packed)] for row in bests.iter_rows(named=True)
        ]
    except (RealityGapError, ValueError):
        note = (
            "its trials cannot be recomputed by this version of realitygap; use the one that ran the study."
        )
        return _Run(name, replicate, None, 0, rows.height, note)
    if not trials:
        note = f"a trial of {condition.on.steps:,} steps is too long to be embedded in a page."
        return _Run(name, replicate, None, 0, rows.height, note)
    note = ""
    if len(trials) < rows.height:
        which = "elites of its archive" if has_elites else "the best ones of each generation"
        note = f"{len(trials):,} of {rows.height:,} trials, {which}; all would make the page too large."
    data = _set_up(condition) | {
        "name": name,
        "run": replicate,
        "label": label_of(described),
        "total": rows.height,
        "trials": trials,
        "best": chosen[tally.score_column(name)].arg_max() or 0,
        "bests": others,
    }
    replayed = (replicate, *(run for run, *_ in others))
    return _Run(name, replicate, data, len(trials), rows.height, note, replayed)


def _bests(tally: Tally, name: str, typical: int, most: int) -> pl.DataFrame:
    """Return the best trial of each other run, the first of several alike, of as many runs as fit."""
    runs = [int(run) for run in tally.replicates(name) if run != typical][: max(0, most)]
    if not runs:
        return pl.DataFrame()
    column = pl.col(tally.score_column(name))
    rows = tally.folder.read(name, runs)
    best = rows.filter(column == column.max().over("replicate"))
    return best.unique("replicate", keep="first", maintain_order=True)


def _elites(condition: Condition, rows: pl.DataFrame, most: int) -> pl.DataFrame:
    """Return the elites of a run, the fittest of them if there are more than fit."""
    best = elites_of(condition, rows).sort("fitness", descending=True, maintain_order=True).head(most)
    return best.sort("generation", "individual")


def _choose(rows: pl.DataFrame, most: int, column: str) -> pl.DataFrame:
    """Return all rows if they fit; otherwise the best few of each generation, or of evenly spread generations."""
    if rows.height <= most:
        return rows
    generations = rows["generation"].unique().sort().to_numpy()
    n_shown = min(len(generations), most)
    if n_shown == 0:
        return rows.clear()
    shown = generations[np.unique(np.linspace(0, len(generations) - 1, n_shown).round().astype(int))]
    rank = pl.col(column).rank("ordinal", descending=True).over("generation")
    return rows.filter(pl.col("generation").is_in(shown.tolist()) & (rank <= most // n_shown))


def _set_up(condition: Condition) -> dict[str, Any]:
    """Return the arena, and the robot's shape and sensors; lengths in meters."""
    shape = RobotShape.of(condition.on)
    return {
        "scene": pack_scene(condition.placed_arena, condition.name),
        **pack_shape(shape),
        "sensors": _sensor_names([left for _, left, _ in shape.mounts]),
        "steps": condition.on.steps,
    }


def _sensor_names(lefts: Sequence[float]) -> list[str]:
    if len(lefts) == 3 and lefts[0] > lefts[1] > lefts[2]:
        return ["left", "middle", "right"]
    return [f"sensor {k}" for k in range(len(lefts))]


def _pack_row(condition: Condition, row: Mapping[str, Any], packed: bytearray) -> list[Any]:
    """Return the trial as the page's script takes it, and append its bytes.

    That is the generation, the individual, the numbers of cells along the line and at the ends of steps, the duration
    of a step, the place of the first robot's bytes, and that of each other one.
    """
    trajectory = replay(condition, row)
    grid = condition.arena.arena().grid
    visits = first_visits(np.stack([robot.poses for robot in trajectory.robots]), grid)
    cells, _, end_steps = visits
    places = []
    for robot in trajectory.robots:
        places.append(len(packed))
        packed += pack_trial(robot, *visits)
    return [
        int(row["generation"]),
        int(row["individual"]),
        len(cells),
        len(end_steps),
        trajectory.step_s,
        *places,
    ]


def pack_trial(
    trajectory: Trajectory,
    cells: npt.NDArray[np.int64],
    steps: npt.NDArray[np.int64],
    end_steps: npt.NDArray[np.int64],
) -> bytes:
    """A trial as bytes, column after column; the page's script takes them apart in the same order.

    Columns: x, y, heading, each sensor's reading (t + 1 numbers each); what the network saw, move, turn (t);
    blocked or not (t + 1); cells, steps and end_steps as in `first_visits`.
    """
    lengths = np.column_stack([trajectory.poses[:, :2], trajectory.readings])
    lengths = np.rint(lengths / UNITS["length"]).astype(np.int64)
    headings = np.rint(trajectory.poses[:, 2] / UNITS["angle"]).astype(np.int64)
    outputs = np.column_stack([trajectory.inputs[:, 0], trajectory.commands])
    outputs = np.rint(outputs / UNITS["output"]).astype(np.int64)
    columns = [
        lengths[:, 0],
        lengths[:, 1],
        headings,
        *lengths[:, 2:].T,
        *outputs.T,
        trajectory.stalled.astype(np.int64),
        cells,
        steps,
        end_steps,
    ]
    return _differences(*columns)


def _differences(*columns: npt.NDArray[np.int64]) -> bytes:
    differences = np.concatenate([np.diff(column, prepend=0) for column in columns])
    return _sevens(np.where(differences < 0, -2 * differences - 1, 2 * differences))


def _sevens(numbers: npt.NDArray[np.int64]) -> bytes:
    """Numbers >= 0 as groups of 7 bits, the lowest first; all but the last of a number have the 8th bit set."""
    n_groups = max(1, -(-int(numbers.max(initial=0)).bit_length() // 7))
    left = numbers[:, None] >> 7 * np.arange(n_groups + 1)
    groups = left[:, :-1] & 127 | np.where(left[:, 1:] > 0, 128, 0)
    is_used = left[:, :-1] > 0
    is_used[:, 0] = True
    return groups[is_used].astype(np.uint8).tobytes()

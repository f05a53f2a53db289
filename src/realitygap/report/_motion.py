"""Trials of results in motion: recomputed from their rows, or as an emulator's witness saw them."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import polars as pl

from realitygap.errors import RecordError, did_you_mean
from realitygap.playback import WIDTH, MovingTrial, RobotShape, WatchedRobot, in_motion, play, save_movie
from realitygap.records import (
    LEDGER_NAME,
    PATH_PARTS,
    Ledger,
    RecordWarning,
    ResultsFolder,
    TrialRecord,
    refuse_results,
)
from realitygap.report._driven import driven_paths, refuse_replay
from realitygap.report._tally import Results, Tally, largest, read_tally
from realitygap.report._trial_figure import ChosenTrial, choose_trial
from realitygap.robots import Robot
from realitygap.runs import genome_of, replay, trace_row

Each = Literal["individual", "generation", "condition"]
"""Selection of several trials: each individual of a generation, or the best of each generation or condition."""


_SURPLUS: dict[Each, tuple[str, ...]] = {
    "individual": ("individual",),
    "generation": ("generation", "individual"),
    "condition": ("condition", "generation", "individual"),
}
"""Numbers that are meaningless if several trials are shown."""

_MOST = 8
"""Trials shown together."""


def write_movie(
    results: Results | MovingTrial | Iterable[Results | MovingTrial],
    path: str | Path,
    *,
    each: Each | None = None,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
    speed: float = 1.0,
    title: str = "",
    width: int = WIDTH,
) -> Path:
    """Write trials in motion as GIF or MP4: rays, trails in the pens' colors, and the cells that they visit.

    Args:
        results: Results of a study, or the path to them; or several, of each of which one trial is shown, or trials
            that `realitygap.playback.in_motion` made.
        path: Path that ends in .gif or .mp4. An existing file is replaced once the new one is complete.
        each: Show several trials: each individual of a generation (the first eight), the best one of each generation,
            or of each condition. Not given: one trial of each results.
        condition: Condition. Default: the first one.
        replicate: Run. Default: the typical one, whose best trial is the median.
        generation: Generation of the run. Default: that of its best trial.
        individual: Individual of the generation. Default: the best one by the task.
        speed: 1 is as fast as it was; 2 is twice as fast.
        title: Title in the head. Default: the names of the trials.
        width: Width of the pictures [px].

    Returns:
        The path.

    Raises:
        RealityGapError: for an .mp4 there is no ffmpeg.
        RecordError: results are damaged or hold no trials yet, a trial comes out otherwise than recorded, or what a
            robot drove was not seen; or the file cannot be written.
        TypeError: a number is not whole, or something else than results or trials is given.
        ValueError: there is no such trial or ending; speed or width is out of range; the arenas differ.
    """
    path = Path(path)
    refuse_results(path)
    named, trials = _trials_of(results, each, condition, replicate, generation, individual)
    return save_movie(trials, path, speed=speed, title=title or named, width=width)


def _trials_of(
    what: Results | MovingTrial | Iterable[Results | MovingTrial], each: Each | None, *numbers: Any
) -> tuple[str, list[MovingTrial]]:
    """Trials that are given, or those of results by their numbers, and what to call them together."""
    many = [what] if isinstance(what, Tally | ResultsFolder | str | Path | MovingTrial) else list(what)
    ready = [one for one in many if isinstance(one, MovingTrial)]
    folders = [one for one in many if not isinstance(one, MovingTrial)]
    if ready and folders:
        raise TypeError("Results and trials are given together, expected the ones or the others.")
    return ("", ready) if ready else choose_moving(folders, each, *numbers)


def choose_moving(
    folders: Sequence[Results],
    each: Each | None = None,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
) -> tuple[str, list[MovingTrial]]:
    """Trials by their numbers, and what to call them together; arguments as in `write_movie`."""
    if each is not None and each not in get_args(Each):
        raise ValueError(f"Unknown each {each!r}. {did_you_mean(each, list(get_args(Each)))}")
    numbers = (condition, replicate, generation, individual)
    if len(folders) != 1 and each is not None:
        raise ValueError(
            f"{len(folders)} results with each {each!r}, expected one: of several, one trial each is shown."
        )
    with warnings.catch_warnings():
        warnings.simplefilter("default", RecordWarning)
        tallies = [read_tally(folder) for folder in folders]
    if each is not None:
        return _several(tallies[0], each, *numbers)
    chosen = [(tally, choose_trial(tally, *numbers)) for tally in tallies]
    if len(chosen) == 1:
        (one,) = chosen
        return one[1].title, _moving(*one, one[1].title)
    return f"{len(chosen)} studies", [
        robot
        for tally, trial in chosen
        for robot in _moving(tally, trial, str(tally.description.get("name", tally.folder.path.name)))
    ]


def _several(
    tally: Tally,
    each: Each,
    condition: str | None,
    replicate: int | None,
    generation: int | None,
    individual: int | None,
) -> tuple[str, list[MovingTrial]]:
    given = {"condition": condition, "generation": generation, "individual": individual}
    named = [name for name in _SURPLUS[each] if given[name] is not None]
    if named:
        raise ValueError(f"Not for each {each!r}: {', '.join(named)}. Leave that out.")
    if each == "condition":
        names = list(dict.fromkeys(tally.runs["condition"].to_list()))[:_MOST]
        trials = [choose_trial(tally, name, replicate) for name in names]
        study = str(tally.description.get("name", "study"))
        return f"{study}: the best of each condition", [
            robot for trial in trials for robot in _moving(tally, trial, trial.row["condition"])
        ][:_MOST]
    name = tally.name_of(condition)
    replicate = tally.typical_replicate(name) if replicate is None else replicate
    rows = tally.rows_of(name, replicate)
    if each == "individual":
        first = choose_trial(tally, name, replicate, generation)
        generation = int(first.row["generation"])
        count = rows.filter(pl.col("generation") == generation).height
        trials = [choose_trial(tally, name, replicate, generation, k) for k in range(min(count, _MOST))]
        title = f"{name}, run {replicate}, generation {generation}"
    else:
        last = largest(rows, "generation")
        shown = np.unique(np.linspace(0, last, min(last + 1, _MOST)).round().astype(int)).tolist()
        trials = [choose_trial(tally, name, replicate, k) for k in shown]
        title = f"{name}, run {replicate}: the best of each generation"
    return title, [robot for trial in trials for robot in _moving(tally, trial, f"{each} {trial.row[each]}")][
        :_MOST
    ]


def _moving(tally: Tally, trial: ChosenTrial, title: str) -> list[MovingTrial]:
    """All robots of a trial; of more robots than pens, those that have one."""
    if trial.condition.is_physical:
        return [_driven(tally, trial, title)]
    condition = trial.condition
    trajectory = replay(condition, trial.row)
    return [
        in_motion(
            robot,
            condition.arena_of(trajectory),
            condition.on,
            title=f"{title}, robot {k}" if trajectory.others else title,
            label=condition.label,
        )
        for k, robot in enumerate(trajectory.robots[:_MOST])
    ]


def touch_network(
    folder: Results, weights: Mapping[str, float], cut: Collection[str], **numbers: Any
) -> tuple[list[MovingTrial], dict[str, float], tuple[str, ...]]:
    """Run a trial of a study again with a changed network, in its simulator and with the same noise.

    Args:
        folder: Results of a study, or the path to them.
        weights: New weights by link, such as obstacle → move.
        cut: Inputs that the network loses.
        numbers: Numbers of the trial, as in `choose_trial`.

    Returns:
        The trial as recorded and the changed one, the recorded weights by link, and the inputs.

    Raises:
        ValueError: The condition is not on a simulator.
    """
    tally = read_tally(folder)
    trial = choose_trial(tally, **numbers)
    condition, genes = trial.condition, trial.row["genome"]
    if not condition.on.is_simulator:
        raise ValueError("Networks are changed in simulators only. Choose a condition on a simulator.")
    evolved = genome_of(condition, trial.row).interface
    names = (*evolved.inputs, *evolved.outputs)
    ends = [
        [names[n] if n < len(names) else f"hidden {n}" for n in genes[end]] for end in ("source", "target")
    ]
    links = [f"{source} → {target}" for source, target in zip(*ends, strict=True)]
    changed = {
        **genes,
        "weight": [weights.get(link, weight) for link, weight in zip(links, genes["weight"], strict=True)],
        "enabled": [on and source not in cut for source, on in zip(ends[0], genes["enabled"], strict=True)],
    }
    trajectory = trace_row(condition, trial.row, genome_of(condition, {"genome": changed}))
    arena = condition.arena_of(trajectory)
    again = in_motion(trajectory, arena, condition.on, title="changed", label=condition.label)
    known = {
        link: weight for link, weight, on in zip(links, genes["weight"], genes["enabled"], strict=True) if on
    }
    return [*_moving(tally, trial, "as evolved")[:1], again], known, evolved.inputs


def _driven(tally: Tally, trial: ChosenTrial, title: str) -> MovingTrial:
    """Return the trial that the emulator's witness recorded; trials of a robot on paper have cells only.

    Raises:
        RecordError: nobody saw where it drove.
    """
    name, replicate = trial.condition.name, int(trial.row["replicate"])
    which = (int(trial.row["generation"]), int(trial.row["individual"]))
    poses = driven_paths(tally.folder, name, replicate).get(which)
    if poses is None:
        raise refuse_replay(name)
    record = _record_of(tally, name, replicate, which)
    robot = trial.condition.on
    shape, arena = RobotShape.of(robot), trial.condition.arena.arena()
    n_rows = len(poses)
    rays = np.full((n_rows, len(shape.mounts)), np.nan)
    stalled = np.zeros(n_rows, np.bool_)
    for k, (readings, is_stalled) in enumerate(zip(record.readings, record.stalled, strict=True)):
        rows = slice(PATH_PARTS * k, PATH_PARTS * (k + 1))
        if len(readings) == len(shape.mounts):
            rays[rows] = (1.0 - readings) * shape.reach
        stalled[rows] = is_stalled
    times = record.times[: len(record.commands)]
    step_s = float(times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else robot.command_s
    return MovingTrial.of_rows(
        title, trial.label, arena, shape, step_s, poses, rays, stalled, parts=PATH_PARTS
    )


def _record_of(tally: Tally, name: str, replicate: int, which: tuple[int, int]) -> TrialRecord:
    with Ledger.open(tally.folder.path / LEDGER_NAME, writable=False) as ledger:
        for trial in ledger.trials(name, replicate, states=["scored"]):
            if (trial.generation, trial.individual) == which:
                return ledger.record(trial.trial)
    raise RecordError(f"The ledger has no scored trial of generation {which[0]}, individual {which[1]}.")


def watch(
    what: Robot | Results | MovingTrial | Iterable[Results | MovingTrial],
    *,
    each: Each | None = None,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
    speed: float = 1.0,
) -> Any:
    """Show trials, or a robot while it is used, below a notebook's cell.

    Args:
        what: Results or trials, as in `write_movie`; or a robot, which is shown while the program drives it.
        each, condition, replicate, generation, individual: Selection of trials of results; see `write_movie`.
        speed: Speed at the start: 0.25, 0.5, 1, 2, 4 or 8.

    Returns:
        A widget; for a robot a `realitygap.playback.WatchedRobot`, which is used instead of the robot.

    Raises:
        RealityGapError: anywidget is not there (the extra `notebook`).
        RecordError: results are damaged or hold no trials yet, or a trial comes out otherwise than recorded.
        ValueError: there is no such trial; the arenas differ; the speed is none of these.
    """
    if isinstance(what, Robot):
        return WatchedRobot(what, speed=speed)
    title, trials = _trials_of(what, each, condition, replicate, generation, individual)
    return play(trials, title=title, speed=speed)

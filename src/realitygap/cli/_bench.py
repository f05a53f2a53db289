"""`realitygap bench`: how fast this machine is, and how good NEAT."""

from __future__ import annotations

from typing import Annotated, Any

import typer

import realitygap
from realitygap._limits import parse_toml
from realitygap._terminal import echo
from realitygap.errors import StudyError, did_you_mean

from ._options import Json, print_json
from ._progress import RunsBar

DEFAULT_SEEDS = 100
_ONLY_TASKS = "Only with a task"
_PEAK = "Peak of one core, measured: {:.0f} GFlop/s of multiply-adds in single precision"


def bench(
    task: Annotated[
        str | None,
        typer.Argument(
            metavar="[TASK]",
            help="Task for NEAT: xor, double-pole, double-pole-no-velocity, maze-medium or maze-hard; or realism, the "
            "speed of the platform sim. [default: the speed of the platform jyro]",
        ),
    ] = None,
    settings: Annotated[
        str | None,
        typer.Option(help="Named set of NEAT's settings. [default: default]", rich_help_panel=_ONLY_TASKS),
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option(
            min=1,
            help=f"Number of runs. [default: {DEFAULT_SEEDS}; mazes 40]",
            rich_help_panel=_ONLY_TASKS,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=2**63 - 1,
            help="Seed of the random numbers. [default: 1]",
            rich_help_panel=_ONLY_TASKS,
        ),
    ] = None,
    change: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE", help="Change one setting of NEAT. Repeatable.", rich_help_panel=_ONLY_TASKS
        ),
    ] = None,
    as_json: Json = False,
    seconds: Annotated[
        float | None,
        typer.Option(
            min=0.01,
            max=3600,
            help="Duration of each measurement. [default: 2]",
            rich_help_panel="Only for speed and realism",
        ),
    ] = None,
) -> None:
    """Measure the speed of this machine.

    With a TASK, it counts how many evaluations NEAT needs for that task instead.

    Speed: robot-steps and whole paper runs per second, on one core and on all cores. A robot-step includes its noise
    and its line coverage. A paper run includes NEAT, and a recorded run also writes its rows. Compilation is not
    counted. Robot-steps per GFlop of the core's peak compare machines of different speed.

    Realism: robot-steps per second of one core on the platform sim. The robot has a real outline, sliding contact,
    noisy infrared sensors, and a noisy drive. All its numbers differ from trial to trial.

    A task: runs of NEAT from many seeds, next to the results of Stanley & Miikkulainen (2002). An evaluation is one
    network tried once, counted up to and including the first one that solves the task. Figures are over the runs that
    solved the task.

    A maze: the same number of runs with novelty and with nearness to the exit as the reward, next to the results of
    Lehman & Stanley (2011). A run in which no network reaches the exit counts as its limit of evaluations.

    Example: realitygap bench --json

    Example: realitygap bench realism

    Example: realitygap bench xor --settings stanley-2002 --seeds 100

    Example: realitygap bench double-pole --seeds 20 --change crossover=0

    Example: realitygap bench maze-medium --seeds 10

    In Python: realitygap.study.measure_speed()

    In Python: realitygap.study.measure_realism()

    In Python: realitygap.study.measure_task("xor", "stanley-2002", seeds=100)

    In Python: realitygap.study.measure_maze("maze-medium", seeds=10)
    """
    if task is None or task == "realism":
        given = {"--settings": settings, "--seeds": seeds, "--seed": seed, "--change": change or None}
        for option, value in given.items():
            if value is not None:
                raise StudyError(f"{option} is only for a task, as in: realitygap bench xor {option} ...")
        measured_speed = _bench_speed if task is None else _bench_realism
        measured_speed(2.0 if seconds is None else seconds, as_json=as_json)
        return
    if seconds is not None:
        raise StudyError(
            "--seconds is only for the measurement of speed, which has no task, and with realism."
        )
    _check_task(task)
    measured = _bench_maze if task.startswith("maze") else _bench_task
    measured(
        task,
        "default" if settings is None else settings,
        seeds,
        1 if seed is None else seed,
        _changes(change or []),
        as_json=as_json,
    )


def _check_task(task: str) -> None:
    known = [*realitygap.tasks.CLASSICAL_TASKS, *realitygap.tasks.MAZE_TASKS, "realism"]
    if task not in known:
        near = did_you_mean(task, known)
        meant = f" {near}" if near.startswith("Did") else ""
        raise StudyError(f"Unknown task {task!r}.{meant} Known: {', '.join(known)}.")


def _changes(texts: list[str]) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    for key, value in map(_changed_setting, texts):
        if key in changes:
            raise StudyError(
                f"--change gives {key} twice: {changes[key]!r} and {value!r}. Leave one of them out."
            )
        changes[key] = value
    return changes


def _changed_setting(text: str) -> tuple[str, Any]:
    """Return a setting's name and its value, which is written as in a study file or is a word."""
    key, sign, value = text.partition("=")
    if not key or not sign:
        raise StudyError(f"--change {text}: expected KEY=VALUE, such as crossover=0.")
    try:
        return key.strip(), parse_toml(f"value = {value}")["value"]
    except ValueError:
        return key.strip(), value.strip()


def _bench_task(
    task: str, settings: str, seeds: int | None, seed: int, changes: dict[str, Any], *, as_json: bool
) -> None:
    seeds = DEFAULT_SEEDS if seeds is None else seeds
    with RunsBar(quiet=as_json) as bar:
        figures = realitygap.study.measure_task(
            task, settings, seeds=seeds, seed=seed, changes=changes, tell=bar.show
        )
    if as_json:
        print_json(figures | {"seed": seed})
        return
    published = figures["published"]
    names = {
        "mean_evaluations": "mean evaluations",
        "median_evaluations": "median",
        "sd_evaluations": "standard deviation",
        "worst_evaluations": "worst",
        "mean_hidden": "mean hidden nodes",
        "mean_connections": "mean enabled connections",
        "mean_generalization": "mean generalization, of 625",
        "sd_generalization": "its standard deviation",
    }
    echo(f"{task}, {figures['settings']}, seed {seed}")
    echo(f"{'':28} {'ours':>10} {'published':>10}")
    ours = f"{figures['solved']} of {seeds}"
    source = f"{published['solved']} of {published['n']}"
    echo(f"{'solved':28} {ours:>10} {source:>10}")
    for key, name in names.items():
        if key in figures:
            echo(f"{name:28} {_shown(key, figures[key]):>10} {_shown(key, published.get(key)):>10}")
    echo(f"Published: {published['source']}.")


def _bench_maze(
    task: str, settings: str, seeds: int | None, seed: int, changes: dict[str, Any], *, as_json: bool
) -> None:
    with RunsBar(quiet=as_json) as bar:
        figures = realitygap.study.measure_maze(
            task,
            settings,
            seeds=realitygap.study.MAZE_SEEDS if seeds is None else seeds,
            seed=seed,
            changes=changes,
            tell=bar.show,
        )
    if as_json:
        print_json(figures | {"seed": seed})
        return
    columns = [figures["novelty"], figures["novelty"]["published"]]
    columns += [figures["objective"], figures["objective"]["published"]]
    echo(f"{task}, {figures['settings']}, seed {seed}; at most {figures['limit']:,} evaluations a run")
    echo(f"{'':20}" + "".join(f"{name:>12}" for name in ("novelty", "published", "objective", "published")))
    names = {
        "solved": "solved",
        "seeds": "of so many runs",
        "mean_evaluations": "mean evaluations",
        "median_evaluations": "median",
        "sd_evaluations": "standard deviation",
    }
    for key, name in names.items():
        echo(f"{name:20}" + "".join(f"{_shown(key, column.get(key)):>12}" for column in columns))
    echo(f"Published: {figures['source']}.")


def _shown(key: str, value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:,.2f}" if key in ("mean_hidden", "mean_connections") else f"{value:,.0f}"


def _bench_realism(seconds: float, *, as_json: bool) -> None:
    figures = realitygap.study.measure_realism(seconds)
    if as_json:
        print_json(figures)
        return
    names = {
        "avoiding": "avoiding walls",
        "pressed": "pressed into walls",
        "boxes": "avoiding, two boxes",
    }
    echo(f"{'one core':28} {'robot-steps/s':>14} {'per GFlop':>12} {'stalled':>8}")
    for key, name in names.items():
        stalled, per_gflop = figures["stalled"][key], figures["per_gflop"][key]
        echo(f"{name:28} {figures[key]:>14,.0f} {per_gflop:>12,.0f} {stalled:>8.1%}")
    echo(_PEAK.format(figures["peak_gflops"]))


def _bench_speed(seconds: float, *, as_json: bool) -> None:
    figures = realitygap.study.measure_speed(seconds)
    if as_json:
        print_json(figures)
        return
    names = {
        "robot_steps_per_second": "robot-steps/s",
        "robot_steps_two_hidden_per_second": "robot-steps/s with two hidden nodes",
        "paper_runs_per_second": "paper runs/s",
        "paper_runs_novelty_per_second": "paper runs/s with novelty",
        "paper_runs_recorded_per_second": "paper runs/s with their rows written",
    }
    for key, name in names.items():
        one, all_cores = figures[key]["per_core"], figures[key]["all_cores"]
        echo(f"{name:38} {one:14,.0f} a core {all_cores:14,.0f} on all {figures['machine']['processors']}")
    echo(f"{'robot-steps per GFlop of peak':38} {figures['robot_steps_per_gflop']:14,.0f} a core")
    echo(_PEAK.format(figures["peak_gflops"]))
    echo(f"{figures['neat_share']:.0%} of a paper run is NEAT and records, the rest its trials")
    echo(
        f"{figures['machine']['processor']}; " + ", ".join(f"{k} {v}" for k, v in figures["versions"].items())
    )

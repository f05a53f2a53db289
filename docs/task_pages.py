"""Parts of pages on tasks: mazes, tasks beside coverage, and the classical tasks, from what was measured of them."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from realitygap.runs import MAZE_REWARDS
from realitygap.stats import exact_share_interval
from realitygap.tasks import (
    CLASSICAL_TASKS,
    MAZE_TASKS,
)

TASK_STUDIES_DATA = Path(__file__).parent / "data" / "tasks.csv"
MAZES_DATA = Path(__file__).parent / "data" / "mazes.csv"
TASKS_DATA = Path(__file__).parent / "data" / "classical-tasks.csv"
XOR_SIZES_DATA = Path(__file__).parent / "data" / "xor-sizes.csv"


def task_parts() -> dict[str, str]:
    """All parts, by file."""
    return {
        "parts/classical-tasks.md": classical_tasks(),
        "parts/open-choices.md": open_choices(),
        "parts/xor-sizes.md": xor_sizes(),
        "parts/ablations.md": ablations(),
        "parts/mazes.md": mazes(),
        "parts/tasks.md": task_studies(),
    }


# mazes


def maze_runs(maze: str, reward: str) -> tuple[int, NDArray[np.float64]]:
    """How many runs solved a maze, and the evaluations of all, the limit for those that did not."""
    with MAZES_DATA.open(newline="", encoding="utf-8") as file:
        own = [row for row in csv.DictReader(file) if (row["maze"], row["reward"]) == (maze, reward)]
    return sum(int(row["solved"]) for row in own), np.array([float(row["evaluations"]) for row in own])


def resampled(statistic: Callable[..., Any], *samples: NDArray[np.float64]) -> str:
    """A statistic's 95 % interval by resampling runs (BCa); nothing where all runs are alike."""
    if any(len(set(sample)) == 1 for sample in samples):
        return ""
    found = stats.bootstrap(
        samples, statistic, n_resamples=9999, vectorized=True, paired=False, rng=np.random.default_rng(1)
    )
    low, high = found.confidence_interval
    return f" [{low:,.0f}, {high:,.0f}]" if high >= 100 else f" [{low:.1f}, {high:.1f}]"


def share_interval(solved: int, n: int) -> str:
    """So many runs of so many, with the exact 95 % interval of their share."""
    share = exact_share_interval(solved, n)
    return f"{solved} of {n} [{share.low:.0%}, {share.high:.0%}]"


def maze_line(maze: str, reward: str) -> str:
    """One line of the table: ours and what was published."""
    solved, evaluations = maze_runs(maze, reward)
    published = MAZE_TASKS[maze].published[reward]
    n = published["seeds"]
    cells = [
        reward,
        share_interval(solved, len(evaluations)),
        f"{evaluations.mean():,.0f}{resampled(np.mean, evaluations)}",
        f"{np.median(evaluations):,.0f}",
        f"{evaluations.std(ddof=1):,.0f}",
        share_interval(published["solved"], n) if "solved" in published else "",
        mean_with_interval(published, n),
    ]
    return f"| {' | '.join(cells)} |"


def mazes() -> str:
    """Novelty and objective in the mazes, beside the published results."""
    lines = [
        "| | solved [95 %] | mean evaluations [95 %] | median | sd | published: solved | mean evaluations |",
        "|---|---|---|---|---|---|---|",
    ]
    ratios = []
    for maze, task in MAZE_TASKS.items():
        lines.append(f"| **{maze}** | | | | | | |")
        lines += [maze_line(maze, reward) for reward in MAZE_REWARDS]
        novelty, objective = maze_runs(maze, "novelty")[1], maze_runs(maze, "objective")[1]
        ratio = resampled(
            lambda a, b, axis=-1: np.mean(a, axis=axis) / np.mean(b, axis=axis), objective, novelty
        )
        means = [task.published[reward].get("mean_evaluations") for reward in ("objective", "novelty")]
        known = f"; published {means[0] / means[1]:.1f}" if None not in means else ""
        ratios.append(f"{maze} {objective.mean() / novelty.mean():.1f}{ratio}{known}")
    text = (
        "Mean evaluations of the objective over those of novelty, with 95 % intervals: "
        + ". ".join(ratios)
        + "."
    )
    return "\n".join([*lines, "", text]) + "\n"


# tasks beside coverage


def task_studies() -> str:
    """What the named studies of tasks came to, by `make_tasks.py`."""
    with TASK_STUDIES_DATA.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    lines = ["| study | condition | runs | first | last | run [95 %] |", "|---|---|---|---|---|---|"]
    for row in rows:
        first, last, median, low, high = (
            figure(row[key], 2) for key in ("first", "last", "median", "low", "high")
        )
        name = row["study"] if row["condition"] == row["study"] else ""
        lines.append(
            f"| {f'`{name}`' if name else ''} | {row['condition']} | {row['n']} | {first} | {last} "
            f"| {median} [{low}, {high}] |"
        )
    return "\n".join(lines) + "\n"


# classical tasks

# Evaluations and failures [%] of the paper's ablations (EC02, table 3).
PUBLISHED_ABLATIONS = {
    "full": (3_600, 0),
    "no mating": (5_557, 0),
    "random start": (23_033, 5),
    "no speciation": (25_600, 25),
    "no growth": (30_239, 80),
}


def task_rows(group: str) -> list[dict[str, str]]:
    """What `make_classical_tasks.py` wrote: tasks, open choices or ablations."""
    with TASKS_DATA.open(newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if row["group"] == group]


def mean_with_interval(row: Mapping[str, Any], n: int, of: str = "evaluations") -> str:
    """The mean number of evaluations, or of something else, and its 95 % interval; `n` runs solved the task."""
    if not row.get(f"mean_{of}"):
        return ""
    mean = float(row[f"mean_{of}"])
    if not row.get(f"sd_{of}"):
        return f"{mean:,.0f}"
    half = float(stats.t.ppf(0.975, n - 1)) * float(row[f"sd_{of}"]) / n**0.5
    return f"{mean:,.0f} [{mean - half:,.0f}, {mean + half:,.0f}]"


def figure(value: Any, digits: int = 0) -> str:
    """A number in a table; nothing where there is none."""
    return f"{float(value):,.{digits}f}" if value not in (None, "") else ""


def task_line(name: str, row: Mapping[str, Any], n: int) -> str:
    """One line of the table of tasks."""
    solved = int(row["solved"])
    cells = [name, f"{solved} of {n}", mean_with_interval(row, solved)]
    cells += [figure(row.get(f"{each}_evaluations")) for each in ("median", "sd", "worst")]
    cells += [figure(row.get(f"mean_{each}"), 2) for each in ("hidden", "connections")]
    cells.append(mean_with_interval(row, solved, "generalization"))
    return "| " + " | ".join(cells) + " |"


def classical_tasks() -> str:
    """Our results on the classical tasks below the published ones."""
    rows = task_rows("tasks")
    lines = [
        "| | solved | mean evaluations [95 %] | median | sd | worst | hidden nodes | connections "
        "| of 625 [95 %] |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for task in CLASSICAL_TASKS.values():
        lines.append(f"| **{task.title}** | | | | | | | | |")
        lines.append(task_line("published", task.published, task.published["n"]))
        lines += [
            task_line(f"`{row['settings']}`", row, int(row["seeds"]))
            for row in rows
            if row["task"] == task.name
        ]
    seeds = sorted({row["seed"] for row in rows})
    return "\n".join([*lines, "", f"Seed {', '.join(seeds)}. {published_generalization(rows)}"]) + "\n"


def published_generalization(rows: list[dict[str, str]]) -> str:
    """How far chance alone may have moved the published mean of the generalization test."""
    ours = [row for row in rows if row["sd_generalization"]]
    spread = max(float(row["sd_generalization"]) for row in ours)
    published = CLASSICAL_TASKS[ours[0]["task"]].published
    n = published["n"]
    interval = mean_with_interval({**published, "sd_generalization": spread}, n, "generalization")
    return (
        f"The spread of the starts passed is not published. With our larger spread, {n} runs give {interval}."
    )


def open_choices() -> str:
    """What values that the paper leaves open do to XOR."""
    ours = [row for row in task_rows("tasks") if (row["task"], row["settings"]) == ("xor", "stanley-2002")]
    lines = ["| `stanley-2002` with | solved | mean evaluations [95 %] | median |", "|---|---|---|---|"]
    for row in ours + task_rows("open"):
        n, solved = int(row["seeds"]), int(row["solved"])
        name = f"`{row['name']}`" if row["name"] else "nothing changed"
        lines.append(
            f"| {name} | {solved} of {n} | {mean_with_interval(row, solved)} "
            f"| {figure(row['median_evaluations'])} |"
        )
    return "\n".join(lines) + "\n"


XOR_GROUPS = {
    "one change": "one choice changed",
    "together": "several changed together",
    "counted": "nothing changed, another network counted",
}


def xor_sizes() -> str:
    """Return evaluations and sizes of XOR's solvers under other readings of the paper, below the published ones."""
    with XOR_SIZES_DATA.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    published = CLASSICAL_TASKS["xor"].published
    lines = [
        "| `stanley-2002` with | solved | mean evaluations (SE) | hidden nodes (SE) | connections (SE) |",
        "|---|---|---|---|---|",
        f"| **published** | {published['solved']} of {published['n']} | {published['mean_evaluations']:,} "
        f"({published['sd_evaluations'] / published['n'] ** 0.5:,.0f}) "
        f"| {published['mean_hidden']} ({1.11 / published['n'] ** 0.5:.2f}) | {published['mean_connections']} |",
    ]
    for group, title in XOR_GROUPS.items():
        lines.append(f"| **{title}** | | | | |")
        for row in rows:
            if row["group"] == group:
                cells = [row["name"], f"{row['solved']} of {row['runs']}"]
                cells += [
                    f"{figure(row[f'mean_{name}'], digits)} ({figure(row[f'se_{name}'], digits)})"
                    for name, digits in (("evaluations", 0), ("hidden", 2), ("connections", 2))
                ]
                lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", f"Seed {rows[0]['seed']}. SE: standard error of the mean."]) + "\n"


def share_failed(solved: int, n: int) -> str:
    """The share of runs that failed and its exact 95 % interval."""
    share = exact_share_interval(n - solved, n)
    return f"{100 * (n - solved) / n:.0f} % of {n} [{100 * share.low:.0f}, {100 * share.high:.0f}]"


def ablations() -> str:
    """What NEAT loses without each of its parts, beside the published losses."""
    lines = [
        "| | evaluations [95 %] | failures [95 %] | published evaluations | published failures |",
        "|---|---|---|---|---|",
    ]
    for row in task_rows("ablations"):
        n, solved = int(row["seeds"]), int(row["solved"])
        evaluations, failures = PUBLISHED_ABLATIONS[row["name"]]
        lines.append(
            f"| {row['name']} | {mean_with_interval(row, solved)} | {share_failed(solved, n)} "
            f"| {evaluations:,} | {failures} % |"
        )
    return "\n".join(lines) + "\n"

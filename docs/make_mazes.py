"""Novelty and objective in Lehman & Stanley's mazes: the numbers and the picture of the page "Mazes".

    uv run python docs/make_mazes.py

Carries out what `realitygap bench maze-medium` and `maze-hard` do, with a seed on which no setting was tuned, and
writes docs/data/mazes.csv, one row a run, and docs/images/mazes.svg. Takes 2 minutes on 2 cores. `--runs` makes fewer
runs, for a first look; `--figure-only` draws from the data that is there.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from realitygap.evolution import NeatSettings
from realitygap.runs import MAZE_REWARDS, MazeReward, MazeTrials, run_maze
from realitygap.study import MAZE_SEEDS, measure_maze
from realitygap.tasks import MAZE_TASKS
from realitygap.world import load_arena

DATA = Path(__file__).parent / "data" / "mazes.csv"
IMAGE = Path(__file__).parent / "images" / "mazes.svg"
SEED = 4711
COLUMNS = ["maze", "reward", "seed", "replicate", "solved", "evaluations"]
COLORS = {"novelty": "#b8480a", "objective": "#0a4f8f"}
TITLES = {"maze-medium": "medium maze", "maze-hard": "hard maze"}
SHOWN = 10_000  # trials whose ends are drawn
STYLE = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "svg.fonttype": "path",
    "svg.hashsalt": "realitygap",
}


def measure(n_runs: int) -> None:
    """Carry out all runs and write them down."""
    rows = []
    for maze in MAZE_TASKS:
        print(maze, flush=True)
        figures = measure_maze(maze, seeds=n_runs, seed=SEED)
        for reward in MAZE_REWARDS:
            for replicate, evaluations in enumerate(figures[reward]["evaluations"]):
                solved = int(evaluations is not None)
                rows.append([maze, reward, SEED, replicate, solved, evaluations or figures["limit"]])
    with DATA.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([COLUMNS, *rows])
    print(f"Written: {DATA}")


def draw_solved(axes: Axes, maze: str, rows: list[dict[str, str]]) -> None:
    """The share of runs that had solved a maze after so many evaluations."""
    for reward in MAZE_REWARDS:
        own = [row for row in rows if (row["maze"], row["reward"]) == (maze, reward)]
        done = np.sort([int(row["evaluations"]) for row in own if row["solved"] == "1"])
        at = np.concatenate([[0], done, [250_000]]) / 1000
        share = np.concatenate([np.arange(len(done) + 1), [len(done)]]) / len(own)
        axes.step(at, share, where="post", color=COLORS[reward], label=f"{reward}, {len(done)} of {len(own)}")
    axes.set(
        xlim=(0, 250), ylim=(0, 1.02), xlabel="evaluations, thousands", ylabel="share of runs that solved it"
    )
    axes.set_title(f"SIM, {TITLES[maze]}, seed {SEED}", fontsize=8.5, loc="left")
    axes.legend(frameon=False, loc="center right")


def draw_ends(axes: Axes, reward: MazeReward, replicate: int) -> None:
    """Where the first trials of a run in the hard maze ended, and the way of the network that solved it."""
    name = "maze-hard"
    arena, task = load_arena(name), MAZE_TASKS[name]
    trials = MazeTrials(arena)
    run = run_maze(task, trials, reward, NeatSettings(**task.settings), SEED, replicate, keep_ends=True)
    shown = run.ends[:SHOWN]
    axes.scatter(*shown.T, s=1.2, color=COLORS[reward], alpha=0.5, linewidths=0, rasterized=True)
    for x1, y1, x2, y2 in arena.walls:
        axes.plot([x1, x2], [y1, y2], color="#20262e", linewidth=1.2, solid_capstyle="round")
    if run.solver is not None:
        poses = trials.path(run.solver).poses
        axes.plot(poses[:, 0], poses[:, 1], color="#20262e", linewidth=0.8)
    axes.plot(arena.start.x, arena.start.y, "o", markersize=4, color="#20262e")
    axes.plot(arena.goal.x, arena.goal.y, "*", markersize=8, color="#20262e")
    axes.set_aspect("equal")
    axes.set_axis_off()
    what = f"solved after {run.evaluations:,}" if run.solved else "not solved"
    axes.set_title(
        f"Ends of the first {len(shown):,} trials, {reward}\nSIM, n = 1 run (replicate {replicate}), {what}",
        fontsize=8.5,
        linespacing=1.4,
        loc="left",
    )


def typical(rows: list[dict[str, str]], reward: str) -> int:
    """The run in the hard maze whose evaluations are the median of its reward's."""
    own = [row for row in rows if (row["maze"], row["reward"]) == ("maze-hard", reward)]
    ordered = sorted(own, key=lambda row: int(row["evaluations"]))
    return int(ordered[(len(ordered) - 1) // 2]["replicate"])


def draw() -> None:
    """Draw the picture from the data."""
    with DATA.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 6.2), layout="constrained", dpi=150)
        axes = figure.subplots(2, 2)
        for place, maze in zip(axes[0], MAZE_TASKS, strict=True):
            draw_solved(place, maze, rows)
        for place, reward in zip(axes[1], MAZE_REWARDS, strict=True):
            draw_ends(place, reward, typical(rows, reward))
        figure.savefig(IMAGE, metadata={"Date": None, "Creator": None})
    print(f"Written: {IMAGE}")


def main() -> None:
    """Measure and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--runs", type=int, default=MAZE_SEEDS, help="of each reward in each maze")
    parser.add_argument("--figure-only", action="store_true", help="draw from the data that is there")
    wanted = parser.parse_args()
    if not wanted.figure_only:
        measure(wanted.runs)
    draw()


if __name__ == "__main__":
    main()

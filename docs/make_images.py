"""The pictures of the README and the landing page: the paper's study, and one network of it on three platforms.

    uv run python docs/make_images.py

Runs `realitygap run paper` (100 runs of each condition) in a temporary folder and draws from its records: the paths of
a typical run next to the best coverage of the nine conditions, and the divergence between `jyro`, `sim`, and a twin of
the family close.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from realitygap import Condition, ResultsFolder, replay, run_study
from realitygap.report import save_divergence
from realitygap.robots.twin import sample_twin

IMAGE = Path(__file__).parent / "images" / "paper.svg"
DIVERGENCE = Path(__file__).parent / "images" / "divergence.svg"
SHOWN = "coverage-50"
COLORS = {"coverage": "#0a4f8f", "novelty": "#b8480a", "random": "#6d7580"}
DASHES = {0.1: (0, (1, 1.2)), 0.5: "solid", 0.8: (0, (4, 1.5))}
GENERATIONS = ["#b9d3ec", "#86b1dc", "#4d8ac4", "#1f63a5", "#062f57"]
STYLE = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "svg.fonttype": "path",
    "svg.hashsalt": "realitygap",
}


def bests(folder: ResultsFolder, condition: str) -> np.ndarray:
    """(n, g) best coverage along the line, of each generation of each run of a condition."""
    rows = folder.read(condition, columns=["replicate", "generation", "coverage_line"])
    best = rows.group_by("replicate", "generation", maintain_order=True).agg(pl.col("coverage_line").max())
    return best["coverage_line"].to_numpy().reshape(best["replicate"].n_unique(), -1)


def draw_run(axes: Axes, folder: ResultsFolder) -> None:
    """The best path of each generation of the run whose best coverage is the median of all runs."""
    values = bests(folder, SHOWN)
    of_runs = values.max(axis=1)
    replicate = int(np.argmax(of_runs == np.sort(of_runs)[(len(of_runs) - 1) // 2]))
    described = next(each for each in folder.description["conditions"] if each["name"] == SHOWN)
    condition = Condition.from_settings(SHOWN, described["settings"])
    arena = condition.arena.arena()
    _draw_arena(axes, arena)
    rows = folder.read(SHOWN, [replicate])
    for generation, color in enumerate(GENERATIONS):
        of_generation = rows.filter(pl.col("generation") == generation)
        best = of_generation.row(int(of_generation["coverage_line"].arg_max()), named=True)
        poses = replay(condition, best).poses
        axes.plot(poses[:, 0], poses[:, 1], color=color, linewidth=1.4, solid_joinstyle="round")
        axes.plot([], [], color=color, label=f"generation {generation}: {best['coverage_line']:.3f}")
    _draw_robot(axes, poses[-1], condition)
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.02),
        ncols=2,
        frameon=False,
        fontsize=7.5,
        handlelength=1.6,
    )
    axes.set_title(
        f"Best path of each generation, and its coverage\nSIM, {SHOWN}, the typical run (n = 1 of {len(values)})",
        fontsize=8.5,
        linespacing=1.4,
        loc="left",
    )


def _draw_arena(axes: Axes, arena) -> None:
    grid = arena.grid
    for column in range(grid.columns):
        for row in range(grid.rows):
            place = (grid.x + column * grid.cell, grid.y + row * grid.cell)
            axes.add_patch(
                Rectangle(
                    place, grid.cell, grid.cell, facecolor="#f4f6f8", edgecolor="#d3d8de", linewidth=0.5
                )
            )
    for x1, y1, x2, y2 in arena.walls:
        axes.plot([x1, x2], [y1, y2], color="#1c1f24", linewidth=1.6, solid_capstyle="projecting")
    axes.plot(arena.start.x, arena.start.y, "o", color="#c2182b", markersize=4, zorder=5)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _draw_robot(axes: Axes, pose: np.ndarray, condition: Condition) -> None:
    x, y, heading = pose
    forward, left = np.array(condition.on.body.corners).T
    corners = np.column_stack(
        [
            x + forward * np.cos(heading) - left * np.sin(heading),
            y + forward * np.sin(heading) + left * np.cos(heading),
        ]
    )
    axes.add_patch(Polygon(corners, fill=False, edgecolor="#5a626d", linewidth=0.8, zorder=4))


def draw_study(axes: Axes, folder: ResultsFolder) -> int:
    """Median best coverage of each generation, all conditions; returns the runs of each."""
    ends = []
    for described in folder.description["conditions"]:
        settings = described["settings"]
        values = bests(folder, described["name"])
        medians = np.median(values, axis=0)
        style = {"color": COLORS[settings["selection"]], "linestyle": DASHES[settings["noise"]]}
        axes.plot(range(len(medians)), medians, linewidth=1.5, **style)
        ends.append([medians[-1], described["name"], style["color"]])
    _write_names(axes, ends, len(medians) - 1)
    axes.set_xticks(range(len(medians)))
    axes.set_xlabel("generation")
    axes.set_ylabel("best coverage of the generation")
    axes.set_ylim(0.1, 0.4)
    axes.grid(axis="y", color="#e3e7eb", linewidth=0.5)
    axes.set_title(
        f"Median over the runs, by selection and noise [%]\nSIM, n = {len(values)} runs of each condition",
        fontsize=8.5,
        linespacing=1.4,
        loc="left",
    )
    return len(values)


def _write_names(axes: Axes, ends: list[list], last: int) -> None:
    """Each condition's name beside the end of its line, no two on top of each other."""
    ends.sort()
    gap = 0.0155
    places = [value for value, _, _ in ends]
    for _ in range(200):
        for k in range(1, len(places)):
            short = gap - (places[k] - places[k - 1])
            if short > 0:
                places[k] += short / 2
                places[k - 1] -= short / 2
    for (value, name, color), place in zip(ends, places, strict=True):
        axes.plot([last, last + 0.12], [value, place], color=color, linewidth=0.5, clip_on=False)
        axes.text(last + 0.16, place, name, color=color, va="center", fontsize=7.5)


def main() -> None:
    """Run the study and write the picture."""
    mpl.rcParams.update(STYLE)
    with tempfile.TemporaryDirectory() as temporary:
        folder = run_study("paper", Path(temporary) / "paper").folder
        figure = Figure(figsize=(9.6, 3.7), facecolor="white")
        draw_run(figure.add_axes((0.01, 0.15, 0.52, 0.70)), folder)
        draw_study(figure.add_axes((0.60, 0.13, 0.30, 0.72)), folder)
        DIVERGENCE.parent.mkdir(exist_ok=True)
        twin = Path(temporary) / "close-1.toml"
        twin.write_text(sample_twin("close", 1).to_toml(), "utf-8")
        save_divergence(folder, DIVERGENCE, condition="novelty-50", against=f"sim,twin:{twin}")
    IMAGE.parent.mkdir(exist_ok=True)
    figure.savefig(IMAGE, metadata={"Date": None, "Creator": None})
    IMAGE.write_text(_shorter(IMAGE.read_text("utf-8")), "utf-8")
    for image in (IMAGE, DIVERGENCE):
        print(f"Written: {image} ({image.stat().st_size / 1000:.0f} kB)")


def _shorter(svg: str) -> str:
    """Hundredths of a point are enough."""
    return re.sub(
        r' d="[^"]*"',
        lambda path: re.sub(r"-?\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", path[0]),
        svg,
    )


if __name__ == "__main__":
    main()

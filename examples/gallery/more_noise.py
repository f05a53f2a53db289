"""A champion under more noise than it was bred with.

The best networks of twenty runs at three levels of noise are tried again, fifty times at each of nine levels. What a
trial promised once is not what a network does on the average.
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import realitygap
from realitygap.platforms import retry_genomes
from realitygap.runs import genome_of
from realitygap.trials import NoiseKey

LEVELS = np.linspace(0, 1.6, 9)
COLORS = {"novelty-10": "#3d9bd6", "novelty-50": "#0a4f8f", "novelty-80": "#7a1f4d"}

study = realitygap.run_study("paper", "results/paper", replicates=20)
figure = Figure(figsize=(6.4, 3.4), layout="constrained")
axes = figure.add_subplot()
for described in study.folder.description["conditions"]:
    if described["name"] not in COLORS:
        continue
    condition = realitygap.Condition.from_settings(described["name"], described["settings"])
    rows = (
        study.folder.read(condition.name)
        .sort("coverage_line", descending=True)
        .unique("replicate", keep="first")
    )
    champions = list(rows.sort("replicate").iter_rows(named=True))
    keys = [NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"]) for row in champions]
    genomes = [genome_of(condition, row) for row in champions]
    arena, means = condition.arena.arena(), []
    for noise in LEVELS:
        again = retry_genomes(
            condition.on, arena, genomes, noise=noise, noise_keys=keys, repeats=range(1, 51)
        )
        means.append(again.coverage_line.reshape(len(genomes), -1).mean(axis=1))
    low, middle, high = np.percentile(means, [25, 50, 75], axis=1)
    color = COLORS[condition.name]
    axes.fill_between(LEVELS, low, high, color=color, alpha=0.15, linewidth=0)
    axes.plot(LEVELS, middle, color=color, label=f"bred at {condition.noise:g}", linewidth=1.8)
    bred = np.median([row["coverage_line"] for row in champions])
    axes.plot(condition.noise, bred, "o", color=color, markerfacecolor="white")
axes.set(xlabel="noise", ylabel="coverage", ylim=(0, None))
axes.set_title(
    "Mean of 50 trials, median and quartiles of n = 20 champions (SIM)\ncircles: the trial that chose them",
    fontsize=9,
    loc="left",
)
axes.spines[["top", "right"]].set_visible(False)
axes.legend(frameon=False)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "noise.png", dpi=130)

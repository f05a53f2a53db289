"""Light seeking.

A Khepera with eight light sensors and eight that feel what is near begins in any direction and looks for a lamp behind
boxes. The best network of the first generation and that of the last are tried again, thirty times each. The task, the
arena and the robot are files.
"""

import sys

from matplotlib.figure import Figure

import realitygap
from realitygap.platforms import trace_genomes
from realitygap.runs import genome_of
from realitygap.trials import NoiseKey

study = realitygap.run_study("light", "results/light", replicates=1)
described = next(each for each in study.folder.description["conditions"] if each["name"] == "light")
condition = realitygap.Condition.from_settings("light", described["settings"])
rows, arena = study.folder.read("light"), condition.arena.arena()

figure = Figure(figsize=(9.6, 4.9))
for k, generation in enumerate((0, int(rows["generation"].max()))):
    best = rows.filter(rows["generation"] == generation).sort("fitness", descending=True).row(0, named=True)
    genome = genome_of(condition, best)
    driven = trace_genomes(
        condition.on,
        arena,
        [genome] * 30,
        noise=condition.noise,
        noise_key=NoiseKey(7, generation),
        inputs=condition.network_inputs,
    )
    axes = figure.add_axes((0.005 + 0.5 * k, 0.005, 0.49, 0.93))
    for obstacle in arena.obstacles:
        axes.fill(*zip(*obstacle.outline(), strict=True), color="#c8ced6")
    for light in arena.lights:
        for radius, color in ((26, "#f6e3a1"), (11, "#e0a100")):
            axes.plot(light.x, light.y, "o", color=color, markersize=radius, markeredgewidth=0)
    for poses in driven.poses:
        axes.plot(*poses[:, :2].T, color="#0a4f8f", alpha=0.35, linewidth=0.9)
        axes.plot(*poses[-1, :2], "o", color="#b8480a", markersize=3.5, zorder=3)
    for x1, y1, x2, y2 in arena.walls:
        axes.plot([x1, x2], [y1, y2], color="#1c1f24", linewidth=2.4, solid_capstyle="projecting")
    axes.set_title(f"generation {generation} (SIM, n = 30 trials)", fontsize=10, loc="left")
    axes.set_aspect("equal")
    axes.set_axis_off()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "light.png", dpi=110)

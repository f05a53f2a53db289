"""One network, a hundred Scribblers.

No two robots are alike. Track, wheels, drift, and delay of each are drawn separately, as with `[platform.sim.set]` in a
study file. One network drives them all. The other picture shows a hundred trials of one robot, whose sensors and motors
are noisy. The network is the one of two hundred random networks that drives farthest without noise.
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import realitygap
from realitygap.platforms import SimPlatform, trace_genomes, try_genomes
from realitygap.trials import NoiseKey
from realitygap.world import Distribution, paper_arena

DRAWN = {
    "drive.track": Distribution(normal=[0.153, 0.004]),
    "drive.gain_left": Distribution(normal=[1.0, 0.04]),
    "drive.gain_right": Distribution(normal=[1.0, 0.04]),
    "drive.drift_per_m": Distribution(uniform=[-0.3, 0.3]),
    "drive.delay": Distribution(uniform=[0.0, 0.2]),
}

arena, key = paper_arena(), NoiseKey(1)
settings = realitygap.NeatSettings.named("rosenzweig-remy").model_copy(update={"population": 200})
genomes = realitygap.Population(n_inputs=3, n_outputs=2, settings=settings, seed=1).ask()
tried = try_genomes(SimPlatform(noise=False, steps=60), arena, genomes, noise=0.0, noise_key=key)
chosen = [genomes[int(np.argmax(tried.coverage_line))]] * 100

figure = Figure(figsize=(9.6, 2.95))
for k, (title, numbers) in enumerate((("one robot, a hundred times", {}), ("a hundred robots", DRAWN))):
    driven = trace_genomes(SimPlatform(set=numbers, steps=60), arena, chosen, noise=0.0, noise_key=key)
    axes = figure.add_axes((0.01 + 0.5 * k, 0.01, 0.48, 0.87))
    for poses in driven.poses:
        axes.plot(*poses[:, :2].T, color="#0a4f8f", alpha=0.16, linewidth=0.8)
        axes.plot(*poses[-1, :2], ".", color="#b8480a", markersize=3.5, zorder=3)
    for x1, y1, x2, y2 in arena.walls:
        axes.plot([x1, x2], [y1, y2], color="#1c1f24", linewidth=2.4, solid_capstyle="projecting")
    coverage = driven.coverage_line.mean()
    axes.set_title(f"{title} (SIM, n = 100): mean coverage {coverage:.2f}", fontsize=9.5, loc="left")
    axes.set_aspect("equal")
    axes.set_axis_off()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "robots.png", dpi=120)

"""Three ways to meet a wall.

One network of the paper's simulator, on the Scribbler as it is, in `sim`: A freezes at walls as in Jyro, B stops but may
turn, C slides along them. Without noise, so that all that differs is contact.
"""

import sys

import realitygap
from realitygap.playback import in_motion
from realitygap.robots import SimPlatform
from realitygap.runs import genome_of
from realitygap.trials import NoiseKey, trace_genome

study = realitygap.run_study("paper", "results/paper", replicates=20)
described = next(each for each in study.folder.description["conditions"] if each["name"] == "novelty-50")
condition = realitygap.Condition.from_settings("novelty-50", described["settings"])
rows = study.folder.read("novelty-50")
row = rows.row(int(rows["coverage_line"].arg_max()), named=True)

trials = []
for contact in ("freeze", "stop", "slide"):
    platform = SimPlatform(contact=contact, noise=False, steps=60)
    arena, genome = condition.arena.arena(), genome_of(condition, row)
    trajectory = trace_genome(platform, arena, genome, noise=0.0, noise_key=NoiseKey(1))
    trials.append(in_motion(trajectory, arena, platform, title=contact))
picture = sys.argv[1] if len(sys.argv) > 1 else "wall.gif"
realitygap.write_movie(trials, picture, speed=8, width=400)

"""Three ways to meet a wall.

One network on the Scribbler of `sim`: A freezes at walls as in Jyro, B stops but may turn, C slides along them. Nothing
is noisy, so that all that differs is contact. Of two hundred random networks, it is the one for whose coverage contact
matters most.
"""

import sys

import numpy as np

import realitygap
from realitygap.platforms import SimPlatform, trace_genome, try_genomes
from realitygap.playback import in_motion
from realitygap.trials import NoiseKey
from realitygap.world import paper_arena

arena, key = paper_arena(), NoiseKey(1)
settings = realitygap.NeatSettings.named("rosenzweig-remy").model_copy(update={"population": 200})
genomes = realitygap.Population(n_inputs=3, n_outputs=2, settings=settings, seed=1).ask()
platforms = [SimPlatform(contact=contact, noise=False, steps=60) for contact in ("freeze", "stop", "slide")]
coverage = [try_genomes(one, arena, genomes, noise=0.0, noise_key=key).coverage_line for one in platforms]
chosen = genomes[int(np.argmax(coverage[2] - coverage[0]))]

trials = []
for platform in platforms:
    trajectory = trace_genome(platform, arena, chosen, noise=0.0, noise_key=key)
    trials.append(in_motion(trajectory, arena, platform, title=platform.contact))
picture = sys.argv[1] if len(sys.argv) > 1 else "wall.gif"
realitygap.write_movie(trials, picture, title="freeze, stop or slide", speed=6, width=480)

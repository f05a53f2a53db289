"""A generation of eight, all at once.

The paper shows eight individuals as eight pens on one sheet. Here they drive: rays are as long as what the sensors read
and turn from gray to red as something comes near, a dashed outline is blocked, cells fill in as somebody visits them.
"""

import sys

import realitygap

study = realitygap.run_study("paper", "results/paper", replicates=20)
realitygap.write_movie(
    study.folder,
    sys.argv[1] if len(sys.argv) > 1 else "eight.gif",
    each="individual",
    condition="novelty-50",
    generation=4,
    speed=2,
    width=368,
)

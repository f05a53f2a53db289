"""Light seeking.

A Khepera with eight light sensors and eight that feel what is near: from one generation to the next it learns to find
the lamp, whichever way it faces at first, and not to stay behind boxes. The task, the arena and the robot are files.
"""

import sys

import realitygap

study = realitygap.run_study("light", "results/light", replicates=1)
realitygap.write_movie(
    study.folder,
    sys.argv[1] if len(sys.argv) > 1 else "light.gif",
    each="generation",
    condition="light",
    speed=10,
    width=380,
)

"""IR-SIM, a 2-D robot simulator in Python: what `peers.py` times of it.

One robot of our outline with differential drive in the paper's arena, a lidar of three rays with Gaussian noise, a
step of 0.5 s, headless, controlled by the same formula as Enki's. A robot that touches a wall stops for good there, as
its collision mode has it, so it is put back to its start now and then, and pressing into walls is not timed. It has no
contact that slides, no delay and no cells.
"""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path
from typing import Any

from environments import Peer, answer_as_worker, repeated

PEER = Peer(
    name="irsim",
    title="IR-SIM",
    requirements=("ir-sim==2.12.0",),
    packages=("ir-sim", "numpy", "shapely"),
    figures=("realism_avoiding",),
)
STEPS, RESET_EVERY, REPEATS = 300, 50, 5
REACH = 0.2

WORLD = """
world: {height: 0.6096, width: 1.0668, step_time: 0.5, sample_time: 0.5, collision_mode: stop}
robot:
  - kinematics: {name: diff}
    shape:
      name: polygon
      vertices: [[0.089, -0.06], [0.089, 0.06], [0.07, 0.0795], [-0.07, 0.0795],
                 [-0.089, 0.06], [-0.089, -0.06], [-0.07, -0.0795], [0.07, -0.0795]]
    state: [0.53, 0.3, 0]
    vel_max: [0.15, 2.0]
    sensors: [{name: lidar2d, range_min: 0, range_max: 0.2, angle_range: 0.4, number: 3, noise: true, std: 0.02}]
obstacle:
  - shape: {name: linestring, vertices: [[0, 0], [1.0668, 0], [1.0668, 0.6096], [0, 0.6096], [0, 0]]}
    state: [0, 0, 0]
"""


def time_avoiding() -> dict[str, Any]:
    """Robot-steps a second."""
    import irsim
    import numpy as np

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.yaml"
        path.write_text(WORLD, "utf-8")
        world = irsim.make(str(path), display=False, log_level="ERROR")

    def rate() -> float:
        since = time.perf_counter()
        for step in range(STEPS):
            if step % RESET_EVERY == 0:
                world.reset()
            near = max(1 - reading / REACH for reading in world.get_lidar_scan()["ranges"])
            ahead, turn = math.tanh(1 - 3 * near), math.tanh(2 * near)
            world.step(np.array([[0.15 * ahead], [2.0 * turn]]))
        return STEPS / (time.perf_counter() - since)

    return repeated(rate, REPEATS)


if __name__ == "__main__":
    answer_as_worker(PEER, {"realism_avoiding": time_avoiding})

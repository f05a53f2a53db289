"""A robot behind Fast DDS in Enki: a study on it, a calibration by its odometry, and the gap before and after.

    python benchmarks/ros2.py --out docs/data/ros2.json

This plan was committed before the first run. The robot of `tests/families/ros2` differs from its robot file: its
wheels are weaker, unequal, slower to follow, and noisy, and its odometry counts with an error and with noise. All
messages pass through Fast DDS and our driver, in real time, in a separate network. The label is EMULATED (Enki over
Fast DDS).

1. A study of 8 individuals and 3 generations is driven on it: 24 trials, of which none may be lost or driven twice.
2. `calibrate all` uses 20 trials, whose poses are those of its odometry. A witness only puts it at its starts.
3. `gap` compares 10 random controllers, 4 trials of each on the robot, with the simulator before and after the
   calibration. The witness reports the true cells. The fit saw none of these trials.

Goal: the RMS gap of coverage falls by at least 60 %. All seeds are 1. A run that ends early is repeated whole.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
SEED = 1
GOAL = 0.6
MOUNTS = ((0.04, 0.03, 0.6), (0.05, 0.0, 0.0), (0.04, -0.03, -0.6))
ROBOT = """
name = "fast"
sources = ["the nominal numbers of this benchmark"]
step_s = 0.2
[[body]]
corner = [[0, 0]]
radius = 0.05
[contact]
ang = 400
[drive]
speed = 0.15
track = 0.1
lag = 0.05
delay = 0.02
heading_noise_per_m = 0.02
travel_noise_per_m = 0.002
[each.range]
reach = 0.3
response = "linear"
cone = 0.1
rays = 5
noise_uniform = 0.01
{sensors}
[encoder]
noise_per_m = 0.005
[driver]
family = "ros2"
odometry = "odom"
ranges = ["range_0", "range_1", "range_2"]
bump = "bumper"
"""
BODY: dict[str, Any] = {
    "axle": 0.104,
    "gains": (0.78, 0.86),
    "lag": 0.16,
    "delay": 0.09,
    "wheel_noise": 0.01,
    "odometry_scale": (1.01, 0.995),
    "odometry_noise": 0.003,
    "range": MOUNTS,
    "range_limits": (0.001, 0.3),
    "cone": 0.2,
    "range_noise": 0.004,
    "seed": SEED,
}
"""How the robot differs from its file."""
STUDY = """
[study]
name = "on-ros2"
replicates = 1
seed = 1
[neat]
population = 8
generations = 3
[platform.ros2]
robot = "fast.toml"
steps = 60
[[condition]]
name = "coverage"
selection = "coverage"
platform = "ros2"
"""


def run(folder: Path, *words: str) -> str:
    """Run a command of realitygap in a folder; return what it prints."""
    print("$ realitygap", *words, flush=True)
    done = subprocess.run(
        [sys.executable, "-m", "realitygap", *words],
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        check=True,
    )
    return done.stdout


def measure(folder: Path) -> dict[str, Any]:
    """Drive all parts; return their figures."""
    sys.path.insert(0, str(ROOT))
    from tests.families.ros2.fast_dds import FastRobot

    sensors = "\n".join(f"[[range]]\nx = {x}\ny = {y}\ndirection = {d}" for x, y, d in MOUNTS)
    (folder / "fast.toml").write_text(ROBOT.format(sensors=sensors))
    (folder / "study.toml").write_text(STUDY)
    with FastRobot(domain=1, **BODY) as robot:
        where = ["--witness", robot.serve()]
        port = "ros2:/?domain=1&interface=lo&robot=fast.toml"
        run(folder, "drive", "study.toml", "--port", port, *where)
        run(folder, "calibrate", "all", "--robot", port, *where, "--camera", "own", "--observe", "track",
            "--budget", "20", "--seed", str(SEED), "-o", "fit.toml")  # fmt: skip
        gaps = {}
        for name in ("fast", "fit"):
            told = run(folder, "gap", f"sim:{name}.toml", port, *where, "--n-controllers", "10", "--trials", "4",
                       "--seed", str(SEED), "-o", "trials.sqlite", "--json")  # fmt: skip
            gaps[name] = json.loads(told)
    return {"before": gaps["fast"], "after": gaps["fit"], "robot": BODY, "seed": SEED, "goal": GOAL}


def main() -> None:
    """Run all parts in a network of their own, in which nobody else can drive the robot."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="JSON file of the figures")
    options = parser.parse_args()
    if os.environ.get("IN_OWN_NETWORK") != "1":
        own = ["unshare", "-n"] if os.geteuid() == 0 else ["unshare", "-rn"]
        up = 'ip link set lo up && IN_OWN_NETWORK=1 exec "$@"'
        command = [*own, "sh", "-c", up, "sh", sys.executable, __file__, "--out", str(options.out.resolve())]
        raise SystemExit(subprocess.run(command, check=False).returncode)
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(Path(folder))
    options.out.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()

"""Readings of a Thymio in a simulator, less those of `sim` at the same poses, by the rays of a sensor that meet a wall.

    python benchmarks/playground_readings.py FILE --robot thymio-playground

The file has the trials of a calibration with poses, such as `playground-31-track-20.sqlite` in `calibrations`, a folder
of the results of `python -m benchmarks.closing_thymio run FOLDER --plan playground`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from realitygap.calibration.infrared._readings import rays_of
from realitygap.platforms import SimEnsemble, SimPlatform
from realitygap.records import read_observations
from realitygap.study import choose_condition


def main() -> None:
    """Print a line for each number of rays."""
    parser = argparse.ArgumentParser(description="Readings less those of sim, by the rays that meet a wall.")
    parser.add_argument("file", type=Path, help="trials with poses")
    parser.add_argument("--robot", default="thymio", help="robot in sim")
    options = parser.parse_args()
    trials = read_observations(options.file).trials
    arena = choose_condition("sim-thymio", None, 1).arena.arena()
    platform = SimPlatform(robot=options.robot)
    poses = np.concatenate([trial.poses[: len(trial.readings)] for trial in trials])
    readings = np.concatenate([trial.readings for trial in trials])
    stands = np.zeros((len(poses), 1, 2))
    made = SimEnsemble(platform, arena).replay(poses, stands, {}, 1, keep=("readings",)).readings[0, :, 0]
    off: dict[int, list[float]] = {}
    for k, sensor in enumerate(platform.robot.range):
        distances, _ = rays_of(sensor, poses, arena)
        for n, difference in zip(
            (distances < sensor.reach).sum(axis=1), readings[:, k] - made[:, k], strict=True
        ):
            off.setdefault(int(n), []).append(float(difference))
    print("rays that meet a wall   readings   median difference")
    for n, differences in sorted(off.items()):
        print(f"{n:21} {len(differences):10,} {np.median(differences):19.3f}")


if __name__ == "__main__":
    main()

"""Range sensors of every robot file, fitted to what they read themselves, with a prior from the same file."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.calibration import fit_sensor, placements_of, sensor_plans
from realitygap.platforms import SimPlatform, SimTarget
from realitygap.world import load_robot, paper_arena, robot_names

FITTED = ("ir", "pulses", "lorentz")
NAMES = ("amplitude", "decay", "half_width", "noise_gain", "noise_uniform", "burst")
FEWEST = 0.8
"""Share of the 90 % intervals. There are about 65. If each held its number with a chance of .9, chance alone would fail
one run in 100 or fewer."""


@pytest.mark.long
def test_every_robot_file_recovers_its_sensors_within_intervals() -> None:
    """Intervals hold the file's numbers; what is not identified is left out, and is a small part.

    Each robot has its own key: with one key for all, sensors of different robots read the same noise, and their
    intervals miss together.
    """
    held: dict[tuple[str, str], bool] = {}
    not_identified, seen = [], set()
    for key, name in enumerate(robot_names()):
        robot = load_robot(name)
        fitted = robot.range and all(sensor.response in FITTED for sensor in robot.range)
        if not fitted or robot.range in seen:
            continue
        seen.add(robot.range)
        with SimTarget(SimPlatform(robot=robot), paper_arena(), key=key) as target:
            trials = target.carry_out(sensor_plans(paper_arena(), robot), "cells")
        for k, placements in enumerate(placements_of(trials, robot, paper_arena())):
            if not any(placement.readings.any() for placement in placements):
                continue  # it looks away from the wall
            fit = fit_sensor(robot, k, placements, np.random.default_rng([key, k]))
            for each in fit.fitted:
                number = each.name.rpartition(".")[2]
                if number in NAMES and each.identified:
                    held[name, each.name] = each.low <= getattr(robot.range[k], number) <= each.high
                elif number in NAMES:
                    not_identified.append((name, each.name))
    assert len(seen) >= 5
    assert len(held) >= 55, not_identified
    assert np.mean(list(held.values())) >= FEWEST, [at for at, is_held in held.items() if not is_held]


def test_sensors_that_cannot_be_fitted_are_refused_before_a_trial() -> None:
    for name in robot_names():
        robot = load_robot(name)
        if any(sensor.response not in FITTED for sensor in robot.range):
            with pytest.raises(ValueError, match="expected ir, pulses or lorentz"):
                sensor_plans(paper_arena(), robot)


def test_placements_keep_the_body_clear_of_the_wall() -> None:
    """Once the nearest placements pushed an e-puck back from the wall, and its readings changed."""
    arena = paper_arena()
    right = max(x for wall in arena.walls for x in wall[::2])
    for name in ("e-puck", "khepera", "scribbler-s2-fluke2"):
        robot = load_robot(name)
        rim = max(x for part in robot.body for x, _ in part.outline())
        starts = [plan.start for plan in sensor_plans(arena, robot)]
        assert all(start is not None and start.x + rim < right for start in starts), name
        nearest = max(start.x for start in starts if start is not None)
        assert right - nearest - max(sensor.x for sensor in robot.range) < 0.2 * robot.range[0].reach, name

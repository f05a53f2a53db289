"""Trials in which a robot meets walls at many angles, on both sides and with both ends."""

from __future__ import annotations

import math

import numpy as np

from realitygap.trials import TrialPlan
from realitygap.world import Arena, Pose, RobotModel

from ._motion_plans import STEPS, roomiest_place

N_PLANS = 10
PUSH = 6  # commands into a wall: some to reach it, the others to observe the motion along it
AROUND = (0.35, 0.6, 0.9)  # turns between two walls, as commands

Commands = list[tuple[float, float]]


def contact_plans(arena: Arena, robot: RobotModel, n: int = N_PLANS) -> list[TrialPlan]:
    """Return trials to fit contact to: pushes head on and slantwise, scrapes to both sides, with either end.

    The result of an encounter is not known beforehand, so angles are random. Each trial begins at another heading, and
    after each push the robot backs off and turns by another angle.

    Args:
        arena: Arena. Trials begin at the place with the most room.
        robot: Robot with the numbers of its file.
        n: Number of trials.

    Raises:
        ValueError: There is no room for the robot to turn in place.
    """
    middle, _ = roomiest_place(arena, robot)
    plans = []
    for k in range(n):
        rng = np.random.default_rng(1000 + k)
        start = Pose(
            middle.x, middle.y, math.remainder(middle.heading + 2.399963 * k, math.tau)
        )  # golden angle
        commands: Commands = []
        while len(commands) < STEPS:
            commands += _encounter(rng)
        given = np.array(commands[:STEPS])
        plans.append(TrialPlan(start, commands=given, steps=STEPS, number=k, purpose="contact"))
    return plans


def _encounter(rng: np.random.Generator) -> Commands:
    speed = float(rng.choice([1.0, 0.6])) * (1.0 if rng.random() < 0.7 else -1.0)
    scrape = float(rng.choice([0.0, 0.0, 0.15, 0.3])) * (1.0 if rng.random() < 0.5 else -1.0)
    turn = float(rng.choice(AROUND)) * (1.0 if rng.random() < 0.5 else -1.0)
    push: Commands = [(speed, scrape)] * PUSH
    back: Commands = [(-math.copysign(0.8, speed), 0.0)] * int(rng.integers(1, 3))
    return [*push, *back, *([(0.0, turn)] * int(rng.integers(1, 4)))]

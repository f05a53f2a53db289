"""Trials of `sim` with parameters drawn at random, as a camera and encoders would see them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from realitygap.calibration import ranges_of, scribbler_prior
from realitygap.calibration._prior import parameters_of, robot_numbers
from realitygap.platforms import SimEnsemble, SimPlatform
from realitygap.records import TrialRecord
from realitygap.trials import TrialPlan
from realitygap.world import load_robot, paper_arena

ROBOT, ARENA = load_robot("scribbler-s2-fluke2"), paper_arena()
PRIOR = scribbler_prior(ROBOT)
KNOWN = parameters_of(ROBOT, PRIOR)
ENSEMBLE = SimEnsemble(SimPlatform(robot=ROBOT), ARENA, ranges=ranges_of(PRIOR, ROBOT), threads=1)


def drawn(seed: int, names: Iterable[str]) -> dict[str, float]:
    """A value of each parameter from its prior."""
    rng = np.random.default_rng(seed)
    return {name: float(KNOWN[name].prior.of(rng.uniform(size=1))[0]) for name in names}


def carried_out(plans: Sequence[TrialPlan], truth: dict[str, float], seed: int) -> list[TrialRecord]:
    """What is seen of plans on a robot with these parameters."""
    numbers = robot_numbers(KNOWN, ROBOT, {name: np.array([value]) for name, value in truth.items()})
    starts = np.array([[*(plan.start or ARENA.start)] for plan in plans])
    commands = np.array([plan.commands for plan in plans])
    done = ENSEMBLE.replay(starts, commands, numbers, seed)
    return [
        TrialRecord(
            start=tuple(starts[k]),
            step_s=ROBOT.step_s,
            commands=commands[k],
            readings=np.asarray(done.readings[0, k, :-1], np.float64),
            stalled=done.stalled[0, k, :-1],
            cells=tuple(np.flatnonzero(done.cells[0, k]).tolist()),
            wheels=np.asarray(done.wheels[0, k], np.float64),
            poses=np.asarray(done.poses[0, k], np.float64),
        )
        for k in range(len(plans))
    ]

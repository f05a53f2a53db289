"""Why there is a gap: parts of the model taken from a calibration, one choice of them after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import StudyError
from realitygap.evolution import Genome
from realitygap.gap import Why, coalitions, explain_gap, square_differences
from realitygap.platforms import Play, SimEnsemble, SimPlatform, split_spec
from realitygap.world import Arena, Calibration, load_robot, read_calibration

from .study import STEPS, GapStudy

PARTS = ("body", "contact", "sensor noise", "motor", "turn per step", "delay")
"""Parts of a model that are replaced separately. Each number of a robot is in one of them."""

_OWN = {
    "drive.axle": "body",
    "drive.track": "turn per step",
    "drive.turn_rate": "turn per step",
    "drive.delay": "delay",
    "drive.delay_jitter": "delay",
}
_BY_FIRST = {"body": "body", "contact": "contact", "drive": "motor", "stall": "contact", "encoders": "motor"}

DRAWS = 8
"""Number of draws from the posterior, in addition to the estimate."""

TRIALS = 8
"""Number of trials of each controller in simulation with each choice of parts."""


def part_of(number: str) -> str:
    """Return the part of the model that a number of a robot belongs to: motor for `drive.lag`."""
    return _OWN.get(number) or _BY_FIRST.get(number.partition(".")[0], "sensor noise")


def calibration_of(spec: str) -> Calibration | None:
    """Return the calibration that `sim:FILE` names; None for any other name.

    Raises:
        StudyError: The file cannot be read.
    """
    name, file = split_spec(spec)
    if name != SimPlatform.name or not file or not Path(file).is_file():
        return None
    try:
        return read_calibration(file)
    except ValueError as error:
        raise StudyError(str(error)) from None


def why_gap(
    calibration: Calibration,
    gap: GapStudy,
    *,
    steps: int = STEPS,
    seed: int = 1,
    draws: int = DRAWS,
    trials: int = TRIALS,
) -> Why:
    """Find how much of the gap each part of the model carries.

    The simulator is run with the robot's defaults, and with the calibration's numbers of each choice of six parts:
    body, contact, sensor noise, motor, turn per step, delay. The fall of the RMS gap is shared out by Shapley values.

    Args:
        calibration: Calibration whose numbers replace those of the robot.
        gap: The gap, with at least 2 trials of each controller on the target.
        steps: Commands in a trial.
        seed: Seed of the noise.
        draws: Number of draws from the posterior, in addition to the estimate, for intervals; fewer if the calibration
            has fewer.
        trials: Number of trials of each controller with each choice of parts, at least 2.

    Raises:
        StudyError: The calibration changes nothing, or the target has one trial of each controller.
    """
    target, genomes = gap.target, [each.genome for each in gap.controllers]
    if target.trials < 2:
        raise StudyError(
            f"{target.name} has one trial of each controller, so noise and gap cannot be separated. Request 2 "
            "or more."
        )
    robot = load_robot(calibration.robot)
    default = {name: value for name, value in robot.numbers().items() if isinstance(value, float | int)}
    fitted = {name: value for name, value in calibration.numbers.items() if name in default}
    if not fitted:
        raise StudyError(
            f"The calibration changes no number of {calibration.robot}, so nothing can be switched in. Make one that "
            "does: realitygap calibrate all."
        )
    values = _choices(default, _rows(fitted, calibration, draws))
    platform = SimPlatform(robot=robot, step_s=gap.step_s)
    quality = _carry_out(platform, gap.arena, genomes, steps, values, seed, trials)
    m, c = len(quality), len(genomes)
    squares = square_differences(quality, np.broadcast_to(target.values, (m, *target.values.shape)))
    differences = target.means - quality.mean(axis=2)
    numbers = [sum(part_of(name) == part for name in fitted) for part in PARTS]
    shape = (-1, 2 ** len(PARTS), c)
    return explain_gap(differences.reshape(shape), squares.reshape(shape), PARTS, numbers, seed=seed)


def _rows(
    fitted: Mapping[str, float], calibration: Calibration, draws: int
) -> dict[str, NDArray[np.float64]]:
    """Return rows of each number, (1 + d,): the estimate, and draws spread evenly over all draws."""
    n = calibration.n_draws
    which = np.unique(np.linspace(0, n - 1, min(draws, n)).round().astype(int)) if n else np.empty(0, int)
    return {
        name: np.array([value, *np.asarray(calibration.draws.get(name, [value] * n))[which]])
        for name, value in fitted.items()
    }


def _choices(
    default: Mapping[str, float], rows: Mapping[str, NDArray[np.float64]]
) -> dict[str, NDArray[np.float64]]:
    """Return each number with all choices of parts, for each row, ((1 + d) * 2^g,)."""
    chosen = coalitions(len(PARTS))
    return {
        name: np.array(
            [
                value if choice[PARTS.index(part_of(name))] else default[name]
                for value in values
                for choice in chosen
            ]
        )
        for name, values in rows.items()
    }


def _carry_out(
    platform: SimPlatform,
    arena: Arena,
    genomes: Sequence[Genome],
    steps: int,
    values: Mapping[str, NDArray[np.float64]],
    seed: int,
    trials: int,
) -> NDArray[np.float64]:
    """Return coverage, with controllers of one kind together, (m, c, r). All choices draw the same noise."""
    kinds: dict[tuple[object, ...], list[int]] = {}
    for k, genome in enumerate(genomes):
        kinds.setdefault((genome.rules, genome.interface, genome.bias_value), []).append(k)
    m = len(next(iter(values.values())))
    scores = np.empty((m, len(genomes), trials))
    ensemble = SimEnsemble(platform, arena)
    for number, places in enumerate(kinds.values()):
        n = len(places) * trials
        play = Play(
            np.tile([*arena.start], (n, 1)),
            steps,
            genomes=tuple(genomes[k] for k in places for _ in range(trials)),
        )
        coverage = ensemble.summarize(
            play, values, seed + number, lambda done: done.coverage, keep=(), same_noise=True
        )
        scores[:, places] = coverage.reshape(m, len(places), trials)
    return scores

"""All parameters of a robot together, from whole trials on a target: `calibrate all`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from realitygap.calibration import (
    Effort,
    Evidence,
    Parameter,
    Posterior,
    Vectors,
    evidence_of,
    excitation,
    fit_all,
    numbers_of,
    random_controllers,
    ranges_of,
    scribbler_prior,
)
from realitygap.errors import whole_number
from realitygap.evolution import Genome
from realitygap.records import Observe, ObservedTrial
from realitygap.robots import SimPlatform
from realitygap.trials import SimEnsemble, Target, TrialPlan
from realitygap.world import Arena, Calibration, Distribution, Fitted, RobotModel

METHOD = (
    "approximate Bayesian computation with score summaries (Alsing & Wandelt 2018), regression adjustment (Beaumont et "
    "al. 2002) and truncated rounds (Deistler et al. 2022)"
)
STEPS = 100  # of a trial
IDENTIFIED = 0.5  # of the prior's spread, below which the observations tell a parameter from its prior


def calibrate_all(
    target: Target,
    *,
    robot: RobotModel | str | None = None,
    observe: Observe = "cells",
    budget: int,
    seed: int = 0,
    effort: Effort = "full",
    tell: Callable[[str], None] | None = None,
    keep: Callable[[ObservedTrial], None] | None = None,
    threads: int | None = None,
) -> Calibration:
    """Carry out trials on a target and fit all parameters of `sim` to what was observed.

    Half of the trials are commands that change often, from many places; the other half are random controllers from
    the arena's start.

    Args:
        target: What is calibrated.
        robot: On whose numbers the fit builds, by name, file or as it is; the default one of `sim` when not given.
        observe: How much of the target is seen.
        budget: Trials to carry out; with 0 the robot stays as its file has it.
        seed: Of all random numbers.
        effort: How many simulations.
        tell: Told what is going on.
        keep: Given each trial as it comes, to be kept.
        threads: Of the simulations.

    Raises:
        RobotError: The target failed; what `keep` was given is not lost.
        ValueError: So much cannot be seen of the target.
    """
    whole_number("budget", budget, 0)
    platform = SimPlatform(step_s=target.step_s, **({} if robot is None else {"robot": robot}))
    plans = budget_plans(target.arena, platform.body_radius, budget, seed)
    if tell is not None and plans:
        tell(f"{len(plans)} trials on {target.name}, {observe} observed")
    trials = target.carry_out(plans, observe, None if keep is None else lambda _, trial: keep(trial))
    name = robot if isinstance(robot, str) else platform.robot.name
    return calibration_of(
        trials, platform, target.arena, robot_name=name, target=target.name, label=target.label, observe=observe,
        seed=seed, effort=effort, tell=tell, threads=threads,
    )  # fmt: skip


def budget_plans(arena: Arena, radius: float, budget: int, seed: int) -> list[TrialPlan]:
    """The trials of a calibration, excitation and controllers in turn."""
    rng = np.random.default_rng([seed, 1])
    given = excitation(arena, radius, (budget + 1) // 2, STEPS, rng)
    driven = [
        TrialPlan(genome=genome, steps=STEPS)
        for genome in random_controllers(budget // 2, int(rng.integers(2**31)))
    ]
    plans = [plan for k in range(len(given)) for plan in (given[k], *driven[k : k + 1])]
    return [TrialPlan(**{**vars(plan), "number": k}) for k, plan in enumerate(plans)]


def calibration_of(
    trials: Sequence[ObservedTrial],
    platform: SimPlatform,
    arena: Arena,
    *,
    robot_name: str,
    target: str,
    label: Any,
    observe: Observe,
    seed: int = 0,
    effort: Effort = "full",
    tell: Callable[[str], None] | None = None,
    threads: int | None = None,
) -> Calibration:
    """The calibration from trials that were recorded; arguments as in `calibrate_all`."""
    prior = scribbler_prior(platform.robot)
    common: dict[str, Any] = {
        "kind": "all", "robot": robot_name, "target": target, "label": label, "observe": observe, "trials": len(trials),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }  # fmt: skip
    if not trials:
        return _as_it_is(common, prior, platform.robot)
    genomes = [Genome.from_json(trial.genome) if trial.genome else None for trial in trials]
    evidence = evidence_of(trials, genomes, arena.grid.n_cells)
    ensemble = SimEnsemble(platform, arena, ranges=ranges_of(prior, platform.robot), threads=threads)

    def simulate(one: Evidence, numbers: Any, key: int) -> Vectors:
        return ensemble.summarize(one.play, numbers, key, one.of, keep=one.keep)

    posterior = fit_all(evidence, simulate, prior, platform.robot, seed=seed, effort=effort, tell=tell)
    middle = {name: np.median(value, keepdims=True) for name, value in posterior.values.items()}
    numbers = numbers_of(prior, middle, platform.robot)
    draws = numbers_of(prior, posterior.values, platform.robot)
    return Calibration(
        **common,
        method=METHOD,
        fitted=tuple(_fitted(parameter, posterior) for parameter in prior),
        numbers={name: float(value[0]) for name, value in numbers.items()},
        draws={name: tuple(value.tolist()) for name, value in draws.items()},
    )


def _fitted(parameter: Parameter, posterior: Posterior) -> Fitted:
    draws = posterior.values[parameter.name]
    low, middle, high = np.quantile(draws, [0.05, 0.5, 0.95])
    spread = float(parameter.scale(draws).std()) / parameter.width
    identified = spread < IDENTIFIED / np.sqrt(12.0)
    return Fitted(
        name=parameter.name,
        estimate=float(middle),
        low=float(low),
        high=float(high),
        prior_low=parameter.prior.lowest,
        prior_high=parameter.prior.highest,
        identified=bool(identified),
        unit=parameter.unit,
        advice="" if identified else f"To identify it, record {parameter.advice}.",
    )


def _as_it_is(common: dict[str, Any], prior: Sequence[Parameter], robot: RobotModel) -> Calibration:
    """Of no trials: the robot's own numbers."""
    plain = {
        name: value.center if isinstance(value, Distribution) else value
        for name, value in robot.numbers().items()
    }
    numbers = {effect.number: plain[effect.number] for parameter in prior for effect in parameter.expand}
    return Calibration(
        **common,
        method="none: no trials",
        numbers=numbers,
        draws={name: (value,) for name, value in numbers.items()},
        notes=("No trial was observed: these are the robot file's numbers.",),
    )

"""How good fits of all parameters are, as JSON: intervals on `sim` itself, and prediction on twins.

`python benchmarks/calibration.py sim --robots 12` draws robots from the prior, carries out 20 trials of each in `sim`,
and says what share of the 90 % intervals hold the truth (simulation-based calibration);
`python benchmarks/calibration.py twins close worn --seeds 1 2 --observe track cells` calibrates against twins of these
families, 20 trials each, and says the root mean square over held-out random controllers of how far the coverage that
`sim` predicts is off, noise taken out, before (the robot as its file has it) and after (draws of the posterior).
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.calibration import numbers_of, random_controllers, scribbler_prior, values_of
from realitygap.robots import SimPlatform
from realitygap.robots.twin import sample_twin
from realitygap.study import calibrate_all
from realitygap.trials import SimEnsemble, SimTarget, TrialPlan, TwinTarget
from realitygap.world import paper_arena

ARENA = paper_arena()
PLATFORM = SimPlatform()
BUDGET = 20  # trials of a calibration
HELD_OUT = 99  # seed of the controllers that are predicted
N_ROBOTS = 120  # of the posterior that predict
FIRST = 10_000  # number of the first held-out trial: none of the calibration's


def on_sim(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """What each way to observe gives on robots drawn from the prior."""
    prior = scribbler_prior(PLATFORM.robot)
    for observe in options.observe:
        inside = []
        for k in range(options.robots):
            places = np.clip(np.random.default_rng(k).normal(size=(1, len(prior))), -3, 3)
            values = values_of(prior, places)
            numbers = {name: float(v[0]) for name, v in numbers_of(prior, values, PLATFORM.robot).items()}
            with SimTarget(SimPlatform(set=numbers), ARENA, key=k) as target:
                found = calibrate_all(target, observe=observe, budget=BUDGET, seed=k, effort=options.effort)
            inside.append([fit.low <= values[fit.name][0] <= fit.high for fit in found.fitted])
        shares = np.mean(inside, axis=0)
        each = {
            parameter.name: round(float(share), 3) for parameter, share in zip(prior, shares, strict=True)
        }
        yield {"observe": observe, "robots": options.robots, "covered": float(np.mean(inside)), "each": each}


def on_twins(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """What each way to observe gives on each twin."""
    controllers = random_controllers(options.controllers, HELD_OUT)
    plans = [
        TrialPlan(genome=genome, number=FIRST + options.trials * j + r)
        for j, genome in enumerate(controllers)
        for r in range(options.trials)
    ]
    for family in options.families:
        for seed in options.seeds:
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder, "twin.toml")
                file.write_text(sample_twin(family, seed).to_toml())
                with TwinTarget(str(file), ARENA, options.processes) as target:
                    seen = [len(t.cells) / ARENA.grid.n_cells for t in target.carry_out(plans, "cells")]
                    truth = np.array(seen).reshape(len(controllers), options.trials)
                    before = _rms_gap(_coverage({}, controllers), truth)
                    for observe in options.observe:
                        found = calibrate_all(
                            target, observe=observe, budget=BUDGET, seed=seed, effort=options.effort
                        )
                        after = _rms_gap(_coverage(found.draws, controllers), truth)
                        yield {
                            "twin": f"{family}-{seed}", "observe": observe, "before": before, "after": after,
                            "fall": 1 - after / before if before else None, "misspecified": found.misspecified,
                        }  # fmt: skip


def _coverage(draws: dict[str, Any], controllers: list[Any]) -> np.ndarray[Any, Any]:
    """(m, c) what robots of the posterior visit; without draws, what the robot of the file does."""
    starts = np.tile([ARENA.start.x, ARENA.start.y, ARENA.start.heading], (len(controllers), 1))
    which = np.linspace(0, len(next(iter(draws.values()), ())) - 1, N_ROBOTS).astype(int)
    values = {name: np.asarray(value)[which] for name, value in draws.items()}
    values = values or {"drive.track": np.full(N_ROBOTS, PLATFORM.robot.numbers()["drive.track"])}
    return SimEnsemble(PLATFORM, ARENA).drive(controllers, starts, 100, values, 5, keep=()).coverage


def _rms_gap(predicted: np.ndarray[Any, Any], truth: np.ndarray[Any, Any]) -> float:
    """Over controllers, of predicted (m, c) against observed (c, r) coverage; the noise of both means taken out."""
    off = predicted.mean(axis=0) - truth.mean(axis=1)
    noise = truth.var(axis=1, ddof=1) / truth.shape[1] + predicted.var(axis=0, ddof=1) / len(predicted)
    return float(np.sqrt(max(np.mean(off**2 - noise), 0.0)))


def main() -> None:
    """Measure and print a line of JSON for each result."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=["sim", "twins"])
    parser.add_argument(
        "families", nargs="*", default=["close", "worn", "delayed", "slippery"], metavar="FAMILY"
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--observe", nargs="+", default=["track", "cells"])
    parser.add_argument("--robots", type=int, default=12)
    parser.add_argument("--controllers", type=int, default=40)
    parser.add_argument("--trials", type=int, default=6)
    parser.add_argument("--effort", choices=["small", "full"], default="small")
    parser.add_argument("--processes", type=int)
    options = parser.parse_args()
    for result in on_sim(options) if options.what == "sim" else on_twins(options):
        print(json.dumps(result), flush=True)


if __name__ == "__main__":
    main()

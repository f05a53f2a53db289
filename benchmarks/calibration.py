"""How good fits of all parameters are, as lines of JSON.

`python benchmarks/calibration.py sim --n 12 --observe track cells` draws robots from the prior, carries out 20 trials
of each in `sim`, and says which of the 90 % intervals hold the truth (simulation-based calibration) and how far
identified parameters are off: how many are near the truth, and how many the posteriors themselves have near it.

`python benchmarks/calibration.py motion` (`contact`, `sensors`) does the same for what that calibration fits, with
poses; other numbers are those of the robot's file.

`python benchmarks/calibration.py flags --families alien` says which twins are flagged as what `sim` cannot make.

`python benchmarks/calibration.py same --n 30` measures the gap to twins that have none, and says which intervals
exclude no gap.

`python benchmarks/calibration.py twins --families close worn --n 2 --observe track cells` calibrates against twins, 20
trials each, and says the root mean square over held-out random controllers of how far the coverage that `sim` predicts
is off, noise taken out, before (the robot as its file has it) and after (draws of the posterior).

With --out lines go to a file, too, and what is in it is not measured again; docs/make_calibration.py reads it.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.calibration import (
    Effect,
    Floats,
    Parameter,
    numbers_of,
    random_controllers,
    scribbler_prior,
    values_of,
)
from realitygap.calibration.infrared._parameters import AMPLITUDE, BURST, DECAY, DROP
from realitygap.platforms import SimEnsemble, SimPlatform, SimTarget, TwinTarget
from realitygap.robots.twin import sample_twin
from realitygap.study import calibrate, calibrate_all, gap_between
from realitygap.trials import TrialPlan
from realitygap.world import Calibration, Fitted, paper_arena

ARENA = paper_arena()
PLATFORM = SimPlatform()
BUDGET = 20  # trials of a calibration
HELD_OUT = 99  # seed of the controllers that are predicted
N_HELD_OUT, N_TRIALS = 40, 6  # of these, and of each of them
N_SAME, N_TRIALS_SAME = 30, 10  # likewise of gaps that are none
N_ROBOTS = 120  # of the posterior that predict
FIRST = 10_000  # number of the first held-out trial: none of the calibration's
QUANTILE = 1.6449  # of a normal, at 95 %
NEAR, NEAR_PRIOR = 0.05, 0.1  # how far an identified parameter may be off, of itself or of its prior's width


def on_sim(_: str, seed: int, observe: str) -> dict[str, Any]:
    """Whether intervals hold the truth of a robot drawn from the prior, and whether estimates are near it."""
    prior = scribbler_prior(PLATFORM.robot)
    places = np.clip(np.random.default_rng(seed).normal(size=(1, len(prior))), -3, 3)
    values = values_of(prior, places)
    numbers = {name: float(v[0]) for name, v in numbers_of(prior, values, PLATFORM.robot).items()}
    with SimTarget(SimPlatform(set=numbers), ARENA, key=seed) as target:
        found = calibrate_all(target, observe=observe, budget=BUDGET, seed=seed, threads=1, effort="small")  # type: ignore[arg-type]
    return _judged(prior, values, found) | {"misspecified": found.misspecified}


def on_motion(_: str, seed: int, observe: str) -> dict[str, Any]:
    """The same of a robot with a drive drawn from the prior, and `calibrate motion`."""
    return _one_kind("motion", _prior_of("drive."), seed, observe)


def on_contact(_: str, seed: int, observe: str) -> dict[str, Any]:
    """The same of a robot with contact drawn from the prior, and `calibrate contact`."""
    return _one_kind("contact", _prior_of("contact."), seed, observe)


def on_sensors(_: str, seed: int, observe: str) -> dict[str, Any]:
    """The same of a robot with range sensors drawn from the prior, each by itself, and `calibrate sensors`."""
    prior = [
        replace(
            parameter, name=f"range.{k}.{parameter.name}", expand=(Effect(f"range.{k}.{parameter.name}"),)
        )
        for k in range(len(PLATFORM.robot.range))
        for parameter in (AMPLITUDE, DECAY, *DROP, BURST)
    ]
    return _one_kind("sensors", prior, seed, observe)


def _prior_of(group: str) -> list[Parameter]:
    return [parameter for parameter in scribbler_prior(PLATFORM.robot) if parameter.name.startswith(group)]


def _one_kind(kind: str, prior: list[Parameter], seed: int, observe: str) -> dict[str, Any]:
    """Whether one kind of calibration finds what was drawn; other numbers are as the robot's file has them."""
    uniform = np.random.default_rng(seed).random(len(prior))
    values = {p.name: p.prior.of(np.array([place])) for p, place in zip(prior, uniform, strict=True)}
    numbers = {name: float(v[0]) for name, v in numbers_of(prior, values, PLATFORM.robot).items()}
    with SimTarget(SimPlatform(set=numbers), ARENA, key=seed) as target:
        found = calibrate(kind, target, observe=observe, seed=seed)  # type: ignore[arg-type]
    return _judged(prior, values, found)


def _judged(prior: Sequence[Parameter], values: Mapping[str, Floats], found: Calibration) -> dict[str, Any]:
    """Whether the interval of each parameter holds it, and whether what is identified is near it."""
    fitted = {fit.name: fit for fit in found.fitted}
    held, near, expected = {}, {}, {}
    for parameter in prior:
        if (fit := fitted.get(parameter.name)) is None:
            continue
        truth = float(values[parameter.name][0])
        held[parameter.name] = bool(fit.low <= truth <= fit.high)
        off = abs(float(parameter.scale(fit.estimate)) - float(parameter.scale(truth))) / parameter.width
        if fit.identified:
            near[parameter.name] = bool(off <= NEAR_PRIOR or abs(fit.estimate - truth) <= NEAR * abs(truth))
            expected[parameter.name] = _expected_near(parameter, fit)
    return {"held": held, "near": near, "expected": expected}


def _expected_near(parameter: Parameter, fit: Fitted) -> float:
    """How likely the posterior has it that the truth is near the estimate: half a normal to either side of it."""
    low, middle, high = (float(parameter.scale(value)) for value in (fit.low, fit.estimate, fit.high))
    sides = []
    for end, factor in ((low, 1 - NEAR), (high, 1 + NEAR)):
        reach = max(NEAR_PRIOR * parameter.width, abs(float(parameter.scale(factor * fit.estimate)) - middle))
        spread = abs(end - middle) / QUANTILE
        sides.append(math.erf(reach / spread / math.sqrt(2)) if spread else 1.0)
    return sum(sides) / 2


def flags(family: str, seed: int, observe: str) -> dict[str, Any]:
    """Whether a twin is flagged."""
    with _twin(family, seed) as target:
        found = _calibrated(target, observe, seed)
    return {"misspecified": found.misspecified, "notes": list(found.notes)}


def same(family: str, seed: int, _: str) -> dict[str, Any]:
    """Whether the interval of the gap to a twin excludes that there is none."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "twin.toml")
        file.write_text(sample_twin(family, seed).to_toml())
        result = gap_between(
            "sim", f"twin:{file}", n_controllers=N_SAME, trials=N_TRIALS_SAME, processes=1, seed=seed
        ).study.result
    return {"rms": [result.rms.low, result.rms.high], "excludes_no_gap": result.excludes_no_gap}


def on_twins(family: str, seed: int, observe: str) -> dict[str, Any]:
    """How far predictions of held-out controllers are off, before and after calibrating."""
    controllers = random_controllers(N_HELD_OUT, HELD_OUT)
    plans = [
        TrialPlan(genome=genome, number=FIRST + N_TRIALS * j + r)
        for j, genome in enumerate(controllers)
        for r in range(N_TRIALS)
    ]
    with _twin(family, seed) as target:
        seen = [len(t.cells) / ARENA.grid.n_cells for t in target.carry_out(plans, "cells")]
        truth = np.array(seen).reshape(len(controllers), N_TRIALS)
        found = _calibrated(target, observe, seed)
    before = _rms_gap(_coverage({}, controllers), truth)
    after = _rms_gap(_coverage(found.draws, controllers), truth)
    fall = 1 - after / before if before else None
    return {"before": before, "after": after, "fall": fall, "misspecified": found.misspecified}


@contextmanager
def _twin(family: str, seed: int) -> Iterator[TwinTarget]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "twin.toml")
        file.write_text(sample_twin(family, seed).to_toml())
        with TwinTarget(str(file), ARENA, 1) as target:
            yield target


def _calibrated(target: TwinTarget, observe: str, seed: int) -> Calibration:
    return calibrate_all(target, observe=observe, budget=BUDGET, seed=seed, threads=1, effort="small")  # type: ignore[arg-type]


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


MEASURES = {
    "sim": on_sim, "motion": on_motion, "contact": on_contact, "sensors": on_sensors,
    "flags": flags, "same": same, "twins": on_twins,
}  # fmt: skip
FAMILIES = {"flags": ["alien"], "same": ["same"], "twins": ["close", "worn", "delayed", "slippery"]}


def one(key: tuple[str, str, int, str]) -> dict[str, Any]:
    """A line: what was measured, of what, and what was found."""
    what, family, seed, observe = key
    found = MEASURES[what](family, seed, observe)
    return {"what": what, "family": family, "seed": seed, "observe": observe} | found


def key_of(line: str) -> tuple[str, str, int, str]:
    """What a line is about."""
    row = json.loads(line)
    return row["what"], row["family"], row["seed"], row["observe"]


def main() -> None:
    """Measure, and print each result as it comes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=list(MEASURES))
    parser.add_argument("--families", nargs="+", metavar="FAMILY", help="of twins")
    parser.add_argument("--n", type=int, default=12, help="robots or twins of each family")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--observe", nargs="+", default=["track"], choices=["track", "encoders", "cells"])
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--out", type=Path, help="a file that lines are added to")
    options = parser.parse_args()
    there = options.out.read_text("utf-8").splitlines() if options.out and options.out.exists() else []
    done = {key_of(line) for line in there}
    keys = [
        (options.what, family, seed, observe)
        for seed in range(options.first_seed, options.first_seed + options.n)
        for family in options.families or FAMILIES.get(options.what, ["sim"])
        for observe in options.observe
    ]
    with ProcessPoolExecutor(options.processes, get_context("spawn")) as pool:
        for row in pool.map(one, [key for key in keys if key not in done]):
            line = json.dumps(row)
            print(line, flush=True)
            if options.out:
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(line + "\n")


if __name__ == "__main__":
    main()

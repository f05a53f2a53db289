"""Whether one likelihood replaces the fits that there are, by the rule in docs/decisions/one-likelihood.md.

    python benchmarks/one_likelihood.py --data DIR --out trial.jsonl
    python benchmarks/one_likelihood.py --verdict trial.jsonl

DIR has the folders labyrinth and optiodom. Each pair of fits is a line of JSON. A run that was stopped continues with
the first pair that is not in the file. `--first-seed N` takes other twins and robots than those of the rule, to develop
with.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from calibration import _rms_gap, _twin
from one_likelihood_candidate import UnifiedMotion, fit_log
from real_data import LABYRINTH_MAP, LABYRINTH_ROBOT
from realitygap.calibration import (
    Floats,
    Posterior,
    _all_from_poses,
    fit_from_poses,
    numbers_of,
    path_errors,
    random_controllers,
    scribbler_prior,
    summary_of,
    values_of,
)
from realitygap.calibration._log_parameters import LogNumbers
from realitygap.calibration._motion_log import _split, _steps_of
from realitygap.logs import mapped_logs, robot_of
from realitygap.platforms import SimEnsemble, SimPlatform, SimTarget
from realitygap.records import TrialRecord
from realitygap.study import calibrate_from_log
from realitygap.study._calibrate import whole
from realitygap.study._calibrate.from_log import _motion_log, _usable
from realitygap.trials import TrialPlan
from realitygap.world import paper_arena

ARENA, PLATFORM = paper_arena(), SimPlatform()
FIRST_SEED = 8801
FAMILIES = ("close", "worn", "delayed", "slippery")
N_TWINS, N_ROBOTS = 12, 6
TRIALS = 20
CONTROLLERS, REPEATS = 12, 3
GAP_FLOOR = 0.005
COVERED = 0.88
WORSE, LONGER = 1.05, 1.05
ENDS = (0.05, 0.95)
CANDIDATES = ("one likelihood", "single commands")
"""In the order in which they replace the present fit."""

OPTIODOM_ROBOT = """\
base = "pioneer"
name = "optiodom"
[drive]
speed = 1.0
track = 0.2
lag = 0.0
"""
OPTIODOM_MAP = f"""\
[text]
header = false
[wheels]
time = 1
left = 6
right = 5
unit = "ticks"
per = "row"
ticks_per_m = {43.7 * 64 / (np.pi * 0.084)}
[poses]
time = 1
x = 2
y = 3
heading = 4
"""
"""Ticks are of encoders. Gear, ticks a turn, and diameter of the wheels are those of the data's paper."""


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return a result and its processor time [s]."""
    began = time.process_time()
    result = call()
    return result, time.process_time() - began


# all parameters from whole trials


def fits_of(
    trials: Sequence[TrialRecord], seed: int, *, present_first: bool
) -> dict[str, tuple[dict[str, Floats], float]]:
    """Return draws of the parameters and the processor time, by fit."""
    everything = whole._Fit(PLATFORM, ARENA, seed, lambda _: None, 1)
    posteriors: dict[str, tuple[Posterior, float]] = {}

    def single_commands(*arguments: Any, **options: Any) -> Posterior:
        posteriors["single commands"] = timed(partial(fit_from_poses, *arguments, **options))
        return posteriors["single commands"][0]

    def present() -> None:
        with patch.object(whole, "fit_from_poses", single_commands):
            posteriors["present"] = timed(lambda: everything.posterior(trials, "small"))

    def one_likelihood() -> None:
        with patch.object(_all_from_poses, "MotionOfCommands", UnifiedMotion):
            posteriors["one likelihood"] = timed(
                lambda: fit_from_poses(
                    trials, everything.ensemble, everything.prior, everything.robot, ARENA, seed=seed
                )
            )

    for fit in (present, one_likelihood) if present_first else (one_likelihood, present):
        fit()
    return {name: (posterior.values, seconds) for name, (posterior, seconds) in posteriors.items()}


def on_twin(k: int, first_seed: int) -> dict[str, Any]:
    """Gaps to a twin after each calibration."""
    family, seed = FAMILIES[k % len(FAMILIES)], first_seed + k // len(FAMILIES)
    controllers = random_controllers(CONTROLLERS, first_seed + 500)
    held_out = [
        TrialPlan(genome=genome, number=10_000 + REPEATS * j + r)
        for j, genome in enumerate(controllers)
        for r in range(REPEATS)
    ]
    with _twin(family, seed) as target:
        trials = list(target.carry_out(whole.all_plans(ARENA, PLATFORM.robot, TRIALS, seed), "track"))
        cells = [len(trial.cells) / ARENA.grid.n_cells for trial in target.carry_out(held_out, "cells")]
    truth = np.array(cells).reshape(CONTROLLERS, REPEATS)
    prior = scribbler_prior(PLATFORM.robot)
    starts = np.tile([ARENA.start.x, ARENA.start.y, ARENA.start.heading], (CONTROLLERS, 1))
    row: dict[str, Any] = {"family": family, "seed": seed}
    for name, (values, seconds) in fits_of(trials, seed, present_first=k % 2 == 0).items():
        some = {key: value[:: max(len(value) // 120, 1)] for key, value in values.items()}
        numbers = numbers_of(prior, some, PLATFORM.robot)
        made = SimEnsemble(PLATFORM, ARENA).drive(controllers, starts, 100, numbers, 5, keep=()).coverage
        row[name] = {"gap": _rms_gap(made, truth) + GAP_FLOOR, "seconds": seconds}
    return row


def on_robot(k: int, first_seed: int) -> dict[str, Any]:
    """Intervals of each calibration that hold the numbers of a robot drawn from the prior."""
    seed = first_seed + 100 + k
    prior = scribbler_prior(PLATFORM.robot)
    places = np.clip(np.random.default_rng(seed).normal(size=(1, len(prior))), -3, 3)
    truth = values_of(prior, places)
    numbers = {name: float(v[0]) for name, v in numbers_of(prior, truth, PLATFORM.robot).items()}
    with SimTarget(SimPlatform(set=numbers), ARENA, key=seed) as target:
        trials = list(target.carry_out(whole.all_plans(ARENA, PLATFORM.robot, TRIALS, seed), "track"))
    row: dict[str, Any] = {"seed": seed}
    for name, (values, seconds) in fits_of(trials, seed, present_first=k % 2 == 0).items():
        ends = {key: np.quantile(value, ENDS) for key, value in values.items()}
        held = {key: bool(low <= truth[key][0] <= high) for key, (low, high) in ends.items()}
        row[name] = {"held": held, "seconds": seconds}
    return row


# logs of other people's robots


def on_real_log(data: Path, name: str, *, present_first: bool) -> dict[str, Any]:
    """Errors of the drive on the unseen half of a log, read as `realitygap calibrate` reads it."""
    is_labyrinth = name == "labyrinth"
    path = data / "labyrinth" if is_labyrinth else data / "optiodom" / f"{name}.csv"
    with tempfile.TemporaryDirectory() as folder:
        robot_file, map_file = Path(folder, "robot.toml"), Path(folder, "map.toml")
        robot_file.write_text(LABYRINTH_ROBOT if is_labyrinth else OPTIODOM_ROBOT, "utf-8")
        map_file.write_text(LABYRINTH_MAP if is_labyrinth else OPTIODOM_MAP, "utf-8")

        def present() -> dict[str, float]:
            made = calibrate_from_log(path, map_file=map_file, base=robot_file, hold_out=0.5)
            errors: dict[str, float] = made.evidence["held_out"]["errors"]
            return errors

        mapped = mapped_logs(path, map_file)
        robot = robot_of(mapped[0].log_map, str(robot_file))[1]
        ((log_read, _),) = _usable(str(path), mapped, robot, drop_bad_rows=False)[0]
        log = _motion_log(log_read)
        split = _split(log, 0.5)

        def candidate() -> float:
            seen = log.until(split)
            numbers = LogNumbers.of(robot, (seen,))
            best = np.median(fit_log(seen, numbers, np.random.default_rng(0)), axis=0)
            (steps,) = _steps_of(log, numbers.values(best[None]))
            return summary_of([path_errors(log, {"fitted": steps}, split)]).mean["fitted"]

        results = {}
        fits = {"present": present, "one likelihood": candidate}
        for key in fits if present_first else reversed(fits):
            results[key] = timed(fits[key])
    (errors, present_s), (error, seconds) = results["present"], results["one likelihood"]
    return {
        "seed": name,
        "nominal": errors["nominal numbers"],
        "present": {"error": errors["fitted"], "seconds": present_s},
        "one likelihood": {"error": error, "seconds": seconds},
    }


# the verdict


def verdict(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what the rule decides, in lines."""
    of = {kind: [row for row in rows if row["what"] == kind] for kind in ("twin", "robot", "real")}

    def ratio(kind: str, key: str, name: str) -> float:
        return float(np.exp(np.mean([np.log(row[name][key] / row["present"][key]) for row in of[kind]])))

    def held(name: str) -> tuple[int, int]:
        marks = [mark for row in of["robot"] for mark in row[name]["held"].values()]
        return sum(marks), len(marks)

    def seconds(name: str) -> float:
        return float(sum(row[name]["seconds"] for kind in ("twin", "robot") for row in of[kind]))

    lines = [f"{len(of['twin'])} of {N_TWINS} twins, {len(of['robot'])} of {N_ROBOTS} robots"]
    if of["real"]:
        lines.append(f"REAL logs: {len(of['real'])}, error {ratio('real', 'error', 'one likelihood'):.3f}")
        for row in of["real"]:
            errors = ", ".join(f"{name} {row[name]['error']:.4f}" for name in ("present", "one likelihood"))
            lines.append(f"  {row['seed']}: nominal {row['nominal']:.4f}, {errors} m")
    if len(of["twin"]) < N_TWINS or len(of["robot"]) < N_ROBOTS:
        return [*lines, "undecided: pairs are missing"]
    (old, n), old_s = held("present"), seconds("present")
    lines.append(f"present fit: coverage {old} / {n}, {old_s:.1f} s")
    for name in CANDIDATES:
        gap, (new, _), new_s = ratio("twin", "gap", name), held(name), seconds(name)
        passed = gap <= WORSE and new / n >= min(COVERED, old / n) and new_s <= LONGER * old_s
        lines.append(
            f"{name}: gap {gap:.3f}, coverage {new} / {n}, {new_s:.1f} s: {'as good' if passed else 'not as good'}"
        )
        for family in FAMILIES:
            some = [
                np.log(row[name]["gap"] / row["present"]["gap"])
                for row in of["twin"]
                if row["family"] == family
            ]
            lines.append(f"  {family}: gap {np.exp(np.mean(some)):.3f}")
    return lines


def pairs_of(data: Path | None, seed: int) -> Iterator[tuple[str, str | int, Callable[[], dict[str, Any]]]]:
    """Yield the kind, the name, and the measurement of each pair."""
    if data:
        names = sorted(file.stem for file in (data / "optiodom").glob("*-run-*.csv"))
        for k, name in enumerate(["labyrinth", *names]):
            yield "real", name, partial(on_real_log, data, name, present_first=k % 2 == 0)
    for k in range(N_TWINS):
        yield "twin", f"{FAMILIES[k % len(FAMILIES)]} {k}", partial(on_twin, k, seed)
        if k % 2:
            yield "robot", f"robot {k // 2}", partial(on_robot, k // 2, seed)


def main() -> None:
    """Measure, and print each pair as it comes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--data", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, metavar="FILE")
    parser.add_argument("--verdict", type=Path, metavar="FILE")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--pairs", type=int, help="pairs to measure, at most")
    options = parser.parse_args()
    if options.verdict:
        print(
            "\n".join(verdict([json.loads(line) for line in options.verdict.read_text("utf-8").splitlines()]))
        )
        return
    lines = options.out.read_text("utf-8").splitlines() if options.out and options.out.exists() else []
    done = {(row["what"], row["name"]) for row in map(json.loads, lines)}
    missing = [pair for pair in pairs_of(options.data, options.first_seed) if pair[:2] not in done]
    if missing:
        on_robot(90, options.first_seed)  # compiled code is loaded before the first time counts
    for what, name, measure in missing[: options.pairs]:
        line = json.dumps({"what": what, "name": name} | measure())
        print(line, flush=True)
        if options.out:
            with options.out.open("a", encoding="utf-8") as file:
                file.write(line + "\n")


if __name__ == "__main__":
    main()

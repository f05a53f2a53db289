"""Whether one likelihood replaces the fits that there are, by the rule in docs/decisions/one-likelihood.md.

    python benchmarks/one_likelihood.py --data DIR --out trial.jsonl

DIR has the folders labyrinth and optiodom. Each pair of fits is a line of JSON; `--verdict trial.jsonl` states what the
rule decides. `--first-seed N` takes other twins, robots, and logs than those of the rule, to develop with.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from calibration import _rms_gap, _twin
from one_likelihood_candidate import UnifiedMotion, best_place, fit_log
from realitygap.calibration import (
    Floats,
    MotionLog,
    Posterior,
    _all_from_poses,
    _motion,
    fit_from_poses,
    fit_motion,
    motion_log,
    motion_plans,
    numbers_of,
    path_errors,
    random_controllers,
    scribbler_prior,
    summary_of,
    values_of,
)
from realitygap.calibration._log_fit import LogProblem, sample_log_posterior
from realitygap.calibration._log_parameters import LogNumbers
from realitygap.calibration._motion_log import _best, _split, _steps_of
from realitygap.platforms import SimEnsemble, SimPlatform, SimTarget
from realitygap.records import TrialRecord
from realitygap.study._calibrate.whole import _Fit, all_plans
from realitygap.trials import TrialPlan
from realitygap.world import RobotModel, load_robot, paper_arena

ARENA, PLATFORM = paper_arena(), SimPlatform()
FIRST_SEED = 7401
FAMILIES = ("close", "worn", "delayed", "slippery")
N_TWINS, N_ROBOTS, N_MOTION, N_LOGS = 12, 6, 4, 12
LEAST = {"twin": 6, "robot": 3, "motion": 3, "log": 8, "real": 3}
BUDGETS_S = {"logs": 120.0, "motion": 90.0, "whole": 420.0}
"""Processor time of the parts, in the order in which they run."""
TRIALS = 20
CONTROLLERS, REPEATS = 12, 3
GAP_FLOOR = 0.005
COVERED = 0.88
WORSE = {"twin": 1.05, "log": 1.05, "real": 1.0}
LONGER, LARGER = 1.05, 1.001
ENDS = (0.05, 0.95)
COMPARED = ("drive.gain", "drive.asymmetry", "drive.track", "drive.axle", "camera.left", "camera.heading")
TICKS_PER_M = 43.7 * 64 / (np.pi * 0.084)
"""Of the robot of optiodom: gear, ticks a turn, and diameter of its wheels."""


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return a result and its processor time [s]."""
    began = time.process_time()
    result = call()
    return result, time.process_time() - began


# all parameters from whole trials


def fits_of(trials: Sequence[TrialRecord], seed: int) -> dict[str, tuple[dict[str, Floats], float]]:
    """Return draws of the parameters and the processor time, by fit."""
    everything = _Fit(PLATFORM, ARENA, seed, lambda _: None, 1)
    present, present_s = timed(lambda: everything.posterior(trials, "small"))

    def unified() -> Posterior:
        with patch.object(_all_from_poses, "MotionOfCommands", UnifiedMotion):
            return fit_from_poses(
                trials, everything.ensemble, everything.prior, everything.robot, ARENA, seed=seed
            )

    candidate, candidate_s = timed(unified)
    return {"present": (present.values, present_s), "candidate": (candidate.values, candidate_s)}


def on_twin(k: int, first_seed: int) -> dict[str, Any]:
    """Gaps to a twin after both calibrations."""
    family, seed = FAMILIES[k % len(FAMILIES)], first_seed + k // len(FAMILIES)
    controllers = random_controllers(CONTROLLERS, first_seed + 500)
    held_out = [
        TrialPlan(genome=genome, number=10_000 + REPEATS * j + r)
        for j, genome in enumerate(controllers)
        for r in range(REPEATS)
    ]
    with _twin(family, seed) as target:
        trials = list(target.carry_out(all_plans(ARENA, PLATFORM.robot, TRIALS, seed), "track"))
        cells = [len(trial.cells) / ARENA.grid.n_cells for trial in target.carry_out(held_out, "cells")]
    truth = np.array(cells).reshape(CONTROLLERS, REPEATS)
    prior = scribbler_prior(PLATFORM.robot)
    starts = np.tile([ARENA.start.x, ARENA.start.y, ARENA.start.heading], (CONTROLLERS, 1))
    row: dict[str, Any] = {"what": "twin", "family": family, "seed": seed}
    for name, (values, seconds) in fits_of(trials, seed).items():
        some = {key: value[:: max(len(value) // 120, 1)] for key, value in values.items()}
        numbers = numbers_of(prior, some, PLATFORM.robot)
        made = SimEnsemble(PLATFORM, ARENA).drive(controllers, starts, 100, numbers, 5, keep=()).coverage
        row[name] = {"gap": _rms_gap(made, truth) + GAP_FLOOR, "seconds": seconds}
    return row


def on_robot(k: int, first_seed: int) -> dict[str, Any]:
    """Intervals of both calibrations that hold the numbers of a robot drawn from the prior."""
    seed = first_seed + 100 + k
    prior = scribbler_prior(PLATFORM.robot)
    places = np.clip(np.random.default_rng(seed).normal(size=(1, len(prior))), -3, 3)
    truth = values_of(prior, places)
    numbers = {name: float(v[0]) for name, v in numbers_of(prior, truth, PLATFORM.robot).items()}
    with SimTarget(SimPlatform(set=numbers), ARENA, key=seed) as target:
        trials = list(target.carry_out(all_plans(ARENA, PLATFORM.robot, TRIALS, seed), "track"))
    row: dict[str, Any] = {"what": "robot", "seed": seed}
    for name, (values, seconds) in fits_of(trials, seed).items():
        ends = {key: np.quantile(value, ENDS) for key, value in values.items()}
        held = {key: bool(low <= truth[key][0] <= high) for key, (low, high) in ends.items()}
        row[name] = {"held": held, "seconds": seconds}
    return row


# the minimum of motion


def on_motion(k: int, first_seed: int) -> dict[str, Any]:
    """Sums of squares that both optimizers reach, in all problems of a calibration of the motion."""
    seed = first_seed + 200 + k
    prior = [one for one in scribbler_prior(PLATFORM.robot) if one.name.startswith("drive.")]
    uniform = np.random.default_rng(seed).random(len(prior))
    truth = {one.name: one.prior.of(np.array([at])) for one, at in zip(prior, uniform, strict=True)}
    numbers = {name: float(v[0]) for name, v in numbers_of(prior, truth, PLATFORM.robot).items()}
    plans = motion_plans(ARENA, PLATFORM.robot)
    with SimTarget(SimPlatform(set=numbers), ARENA, key=seed) as target:
        trials = list(target.carry_out(plans, "track"))
    row: dict[str, Any] = {"what": "motion", "seed": seed}
    fits = {"present": _motion.best_place, "candidate": best_place}
    spent: dict[str, list[tuple[float, float]]] = {name: [] for name in fits}

    def both(*problem: Any) -> tuple[Floats, float]:
        results = {}
        for name, fit in fits.items():
            results[name], seconds = timed(partial(fit, *problem))
            spent[name].append((results[name][1], seconds))
        return results["present"]

    simulate = SimEnsemble(PLATFORM, ARENA, threads=1).replay
    with patch.object(_motion, "best_place", both):
        fit_motion(trials, simulate, PLATFORM.robot, ARENA, seed=seed)
    for name, pairs in spent.items():
        row[name] = {"costs": [cost for cost, _ in pairs], "seconds": sum(seconds for _, seconds in pairs)}
    return row


# logs


def drawn_log(k: int, first_seed: int) -> tuple[MotionLog, RobotModel, dict[str, float]]:
    """Return a log of a robot with drawn numbers, and those numbers; the gains of every second robot wander."""
    rng = np.random.default_rng(first_seed + 300 + k)
    robot = load_robot("khepera").with_numbers({"drive.lag": 0.0})
    speed, track0, n, step_s = robot.drive.speed, robot.drive.track, 600, 0.1
    truth = {
        "drive.gain": float(np.exp(0.03 * rng.standard_normal())),
        "drive.asymmetry": float(0.02 * rng.standard_normal()),
        "drive.track": float(track0 * np.exp(0.03 * rng.standard_normal())),
        "drive.axle": float(0.004 * rng.standard_normal()),
        "camera.left": float(0.004 * rng.standard_normal()),
        "camera.heading": float(0.02 * rng.standard_normal()),
    }
    commands = np.repeat(rng.uniform(-0.3, 0.8, (n // 10, 2)), 10, axis=0)
    wander = np.zeros((n, 2))
    for row in range(1, n):
        wander[row] = 0.95 * wander[row - 1] + 0.01 * rng.standard_normal(2) * (k % 2)
    gains = truth["drive.gain"] + truth["drive.asymmetry"] * np.array([0.5, -0.5])
    ways = commands * gains * (1 + wander) * speed * step_s
    x = y = 0.0
    heading = float(rng.uniform(-3, 3))
    poses = np.empty((n, 3))
    for row in range(n):
        poses[row] = x, y, heading
        left, right = ways[row]
        length = (left + right) / 2
        turn = (right - left) / truth["drive.track"]
        turn += 0.03 * np.sqrt((abs(left) + abs(right)) / 2) * rng.standard_normal()
        x += length * np.cos(heading + turn / 2) * np.sinc(turn / (2 * np.pi))
        y += length * np.sin(heading + turn / 2) * np.sinc(turn / (2 * np.pi))
        heading += turn
    ahead, left = -truth["drive.axle"], truth["camera.left"]
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    seen = poses + np.stack([ahead * cosine - left * sine, ahead * sine + left * cosine,
                             np.full(n, truth["camera.heading"])], 1)  # fmt: skip
    seen += rng.normal(0, [0.001, 0.001, 0.005], seen.shape)
    return motion_log(np.arange(n) * step_s, commands, poses=seen), robot, truth


def real_logs(data: Path) -> Iterator[tuple[str, MotionLog, RobotModel]]:
    """Yield the logs of other people's robots."""
    wheel, body = load_robot("pioneer"), {"drive.lag": 0.0, "drive.speed": 1.0}
    for file in sorted((data / "optiodom").glob("*-run-*.csv")):
        rows = np.loadtxt(file, delimiter=",")
        lasts = np.diff(rows[:, 0], append=2 * rows[-1, 0] - rows[-2, 0])
        ticks = np.concatenate([rows[1:, [5, 4]], rows[-1:, [5, 4]]])  # left and right, until the next row
        commands = ticks / TICKS_PER_M / lasts[:, None]
        poses = np.column_stack([rows[:, 1:3], np.unwrap(rows[:, 3])])
        yield (
            file.stem,
            motion_log(rows[:, 0], commands, poses=poses),
            wheel.with_numbers({**body, "drive.track": 0.2}),
        )
    odometry = np.loadtxt(data / "labyrinth" / "odom.txt", usecols=(1, 3, 2))
    truth = np.loadtxt(data / "labyrinth" / "gt.txt", usecols=(1, 2, 3))
    at = np.column_stack([np.interp(odometry[:, 0], truth[:, 0], truth[:, k]) for k in (1, 2)])
    inside = (odometry[:, 0] >= truth[0, 0]) & (odometry[:, 0] <= truth[-1, 0])
    log = motion_log(odometry[inside, 0], -odometry[inside, 1:], poses=at[inside])
    yield "labyrinth", log, wheel.with_numbers({**body, "drive.track": 0.157})


def log_pair(log: MotionLog, robot: RobotModel, truth: Mapping[str, float]) -> dict[str, Any]:
    """Return errors on the unseen half of a log, and intervals, of both fits."""
    split = _split(log, 0.5)
    seen = log.until(split)
    numbers = LogNumbers.of(robot, (seen,))
    row: dict[str, Any] = {}

    def present() -> tuple[Floats, Floats]:
        rng = np.random.default_rng(0)
        posterior = sample_log_posterior(LogProblem((seen,), (0,), numbers), rng)
        return _best(posterior), posterior.draws

    def candidate() -> tuple[Floats, Floats]:
        draws = fit_log(seen, numbers, np.random.default_rng(0))
        return np.median(draws, axis=0), draws

    for name, fit in (("present", present), ("candidate", candidate)):
        (best, draws), seconds = timed(fit)
        points = np.stack([best, best])
        points[0, : len(numbers.free)] = 0.0
        nominal, fitted = _steps_of(log, numbers.values(points))
        errors = summary_of([path_errors(log, {"nominal": nominal, "fitted": fitted}, split)])
        values = numbers.values(draws)
        ends = {key: np.quantile(values[key], ENDS).tolist() for key in COMPARED}
        row[name] = {
            "error": errors.mean["fitted"], "nominal": errors.mean["nominal"], "seconds": seconds, "ends": ends,
            "held": {key: ends[key][0] <= true <= ends[key][1] for key, true in truth.items()},
        }  # fmt: skip
    return row


def on_log(k: int, first_seed: int) -> dict[str, Any]:
    """Both fits of a log that was drawn."""
    log, robot, truth = drawn_log(k, first_seed)
    return {"what": "log", "seed": k, "wanders": bool(k % 2), **log_pair(log, robot, truth)}


# the verdict


def verdict(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what the rule decides, in lines."""
    of = {kind: [row for row in rows if row["what"] == kind] for kind in LEAST}

    def ratio(kind: str, key: str) -> float:
        return float(
            np.exp(np.mean([np.log(row["candidate"][key] / row["present"][key]) for row in of[kind]]))
        )

    def held(kind: str, name: str) -> tuple[int, int]:
        marks = [mark for row in of[kind] for mark in row[name]["held"].values()]
        return sum(marks), len(marks)

    def seconds(kinds: Sequence[str]) -> tuple[float, float]:
        sums = [
            sum(row[name]["seconds"] for kind in kinds for row in of[kind])
            for name in ("candidate", "present")
        ]
        return sums[0], sums[1]

    lines = []
    for part, kinds in (("whole", ("twin", "robot")), ("logs", ("log", "real")), ("motion", ("motion",))):
        counts = {kind: len(of[kind]) for kind in kinds}
        if any(counts[kind] < LEAST[kind] for kind in kinds):
            lines.append(f"{part}: {counts}, too few pairs: nothing is replaced")
            continue
        new_s, old_s = seconds(kinds)
        passed, reasons = new_s <= LONGER * old_s, [f"time {new_s:.1f} / {old_s:.1f} s"]
        if part == "motion":
            worst = max(
                new / old
                for row in of["motion"]
                for new, old in zip(row["candidate"]["costs"], row["present"]["costs"], strict=True)
            )
            passed &= worst <= LARGER
            reasons.append(f"largest ratio of sums {worst:.5f}")
        else:
            for kind, key in {"whole": [("twin", "gap")], "logs": [("log", "error"), ("real", "error")]}[
                part
            ]:
                passed &= ratio(kind, key) <= WORSE[kind]
                reasons.append(f"{kind}: {key} {ratio(kind, key):.3f}")
            kind = "robot" if part == "whole" else "log"
            (new, n), (old, _) = held(kind, "candidate"), held(kind, "present")
            passed &= new / n >= min(COVERED, old / n)
            reasons.append(f"coverage {new} / {n} against {old} / {n}")
        lines.append(
            f"{part}: {counts}, {'; '.join(reasons)}: the {'candidate' if passed else 'present fit'} wins"
        )
    return lines


def main() -> None:
    """Measure, and print each pair as it comes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--data", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, metavar="FILE")
    parser.add_argument("--verdict", type=Path, metavar="FILE")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--parts", nargs="+", choices=list(BUDGETS_S), default=list(BUDGETS_S))
    parser.add_argument("--pairs", type=int, help="of each part, at most")
    options = parser.parse_args()
    if options.verdict:
        print(
            "\n".join(verdict([json.loads(line) for line in options.verdict.read_text("utf-8").splitlines()]))
        )
        return
    seed = options.first_seed
    whole: list[Callable[[], dict[str, Any]]] = []
    for k in range(N_TWINS):
        whole.append(partial(on_twin, k, seed))
        whole += [partial(on_robot, k // 2, seed)] if k % 2 else []
    logs: list[Callable[[], dict[str, Any]]] = []
    for name, log, robot in real_logs(options.data) if options.data else ():
        logs.append(
            lambda name=name, log=log, robot=robot: {"what": "real", "name": name} | log_pair(log, robot, {})
        )
    logs += [partial(on_log, k, seed) for k in range(N_LOGS)]
    pairs = {"logs": logs, "motion": [partial(on_motion, k, seed) for k in range(N_MOTION)], "whole": whole}
    for part in options.parts:
        began = time.process_time()
        for pair in pairs[part][: options.pairs]:
            if time.process_time() - began > BUDGETS_S[part]:
                break
            line = json.dumps(pair())
            print(line, flush=True)
            if options.out:
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(line + "\n")


if __name__ == "__main__":
    main()

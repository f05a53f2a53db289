"""One sitting: held-out controllers on the robot, calibrations by each budget, and the gap of each."""

from __future__ import annotations

import json
import time
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import numpy as np

from realitygap.evolution import Genome
from realitygap.gap import GapSide, measure_gap
from realitygap.platforms import Opening, platform_of
from realitygap.records import Observe, read_object, write_whole
from realitygap.runs import Condition, named, population_of
from realitygap.study import choose_condition
from realitygap.study._calibrate.whole import calibrate_all
from realitygap.study._transfer.attempt import allow_trials, plans_of
from realitygap.study._transfer.calibrated import Numbers, fitted_condition
from realitygap.study._transfer.noise import needs_sim
from realitygap.study._transfer.simulated import crossed_cells, evolve_champions, try_repeatedly
from realitygap.trials import NoiseKey, Target
from realitygap.world import Calibration, load_calibration

from .plan import Plan, Sitting

JUDGING, CALIBRATING = 10_000_000, 5_000_000
"""Numbers of the first trials for it, so that no two parts of the study draw the same noise."""

OTHERS: dict[str, Numbers] = {"point": "calibrated", "draws": "posterior"}
"""Gaps that are also stored, by their name in the file. The goals are about the recommended numbers."""


@dataclass(frozen=True)
class SittingOfStudy:
    """A sitting, and what is done in it, in the folder of the study."""

    plan: Plan
    sitting: Sitting
    folder: Path

    @property
    def missing(self) -> list[str]:
        """Units without a result."""
        return [unit for unit in self.plan.units(self.sitting) if not self.path(unit).exists()]

    def path(self, unit: str) -> Path:
        """Return the file of a unit's result."""
        return self.folder / "units" / f"{self.sitting}-{unit}.json"

    def carry_out(self) -> None:
        """Compute all units that are missing, each into a file that is written whole."""
        with self.open() as target:
            for unit in self.missing:
                since = time.perf_counter()
                result = self._judge(target) if unit == "judged" else self._gap(target, *unit.split("-")[1:])
                result |= {"family": self.sitting.family, "seed": self.sitting.number, "unit": unit}
                result["seconds"] = round(time.perf_counter() - since, 1)
                write_whole(self.path(unit), json.dumps(result).encode(), within=self.folder)

    def open(self) -> AbstractContextManager[Target]:
        """Open the robot's simulator."""
        spec, condition = self.plan.platforms[self.sitting.family], self.condition
        step_s = condition.on.command_s
        return platform_of(spec).at_pace(step_s).open(condition.arena.arena(), Opening(spec, step_s=step_s))

    @cached_property
    def condition(self) -> Condition:
        """The condition that is evolved, on the uncalibrated simulator."""
        return choose_condition(self.plan.study, None, self.plan.seed)

    @cached_property
    def controllers(self) -> list[Genome]:
        """The held-out controllers: random ones, then as many champions of runs without a common founder."""
        n, seed = self.plan.controllers, self.plan.controllers_seed + self.sitting.number
        condition = choose_condition(self.plan.study, None, seed)
        n_random = n // 2
        random: list[Genome] = []
        replicate = n
        while len(random) < n_random:
            random += [named(genome, condition) for genome in population_of(condition, replicate).ask()]
            replicate += 1
        champions = evolve_champions(condition, range(n - n_random), repeats=1)
        return random[:n_random] + [champion.genome for champion in champions]

    def _judge(self, target: Target) -> dict[str, Any]:
        """Return the crossed cells of each trial on the robot, and each controller's share of stalled steps."""
        n = self.plan.trials
        repeated = [genome for genome in self.controllers for _ in range(n)]
        trials = target.carry_out(plans_of(self.condition, repeated, JUDGING, "held out"), "cells")
        of_controllers = [trials[k : k + n] for k in range(0, len(trials), n)]
        return {
            "trials": n,
            "n_cells": target.arena.grid.n_cells,
            "label": target.label,
            "cells": [[trial.cells for trial in some] for some in of_controllers],
            "stalled": [float(np.mean([trial.stalled for trial in some])) for some in of_controllers],
        }

    def _on_robot(self) -> GapSide:
        judged = read_object(self.path("judged"))
        crossed = np.zeros((self.plan.controllers, self.plan.trials, judged["n_cells"]), bool)
        for k, trials in enumerate(judged["cells"]):
            for j, cells in enumerate(trials):
                crossed[k, j, cells] = True
        return _side(f"sitting {self.sitting}", judged["label"], crossed)

    def _in_simulation(self, condition: Condition) -> GapSide:
        n = self.plan.trials
        keys = [NoiseKey(condition.key, self.sitting.number, 0, k) for k in range(len(self.controllers))]
        crossed = crossed_cells(try_repeatedly(condition, self.controllers, keys, range(n))[0], n)
        return _side(condition.name, condition.label, crossed)

    def _gap(self, target: Target, observe: str, budget: str) -> dict[str, Any]:
        """Measure the gap to the uncalibrated simulator, or to the calibration with this number of trials."""
        if budget == "0":
            return self._measured(self.condition, None)
        calibration = self._calibration(target, cast("Observe", observe), int(budget))
        found = self._measured(fitted_condition(self.condition, calibration, "recommended"), calibration)
        for name, numbers in OTHERS.items():
            other = self._measured(fitted_condition(self.condition, calibration, numbers), calibration)
            found[name] = other["gap"]["rms"]
        return found | {
            "observe": observe, "budget": int(budget), "recommended": calibration.recommended
        }  # fmt: skip

    def _measured(self, condition: Condition, calibration: Calibration | None) -> dict[str, Any]:
        source, target = self._in_simulation(condition), self._on_robot()
        misspecified = None if calibration is None else calibration.misspecified
        gap = measure_gap(source, target, misspecified=misspecified, seed=self.plan.seed)
        found: dict[str, Any] = {"observe": "none", "budget": 0, "gap": gap.to_dict()}
        found["means"] = {"source": source.means.tolist(), "target": target.means.tolist()}
        n_random = self.plan.controllers // 2
        found["parts"] = {
            name: measure_gap(_part(source, part), _part(target, part), seed=self.plan.seed).to_dict()["rms"]
            for name, part in (("random", slice(0, n_random)), ("champions", slice(n_random, None)))
        }
        if calibration is not None:
            found["calibration"] = {
                "trials": calibration.trials,
                "misspecified": calibration.misspecified,
                "misspecification_p": calibration.misspecification_p,
                "fitted": [fitted.model_dump(exclude={"advice"}) for fitted in calibration.fitted],
            }
        return found

    def _calibration(self, target: Target, observe: Observe, budget: int) -> Calibration:
        """Return the calibration with this number of trials; run it first if it does not exist."""
        place = self.folder / "calibrations" / f"{self.sitting}-{observe}-{budget}"
        path = place.with_suffix(".toml")
        if not path.exists():
            trials = place.with_suffix(".sqlite")
            with allow_trials(target, trials, budget, CALIBRATING, observe=observe) as kept:
                robot = needs_sim(self.condition, "calibrated").robot
                calibration = calibrate_all(
                    kept,
                    robot=robot,
                    observe=observe,
                    budget=budget,
                    seed=self.sitting.number,
                    effort="small",
                )
            write_whole(path, calibration.to_toml().encode(), within=self.folder)
        return load_calibration(path)


def _side(name: str, label: Any, crossed: np.ndarray[Any, np.dtype[np.bool_]]) -> GapSide:
    return GapSide(name, label, crossed.mean(axis=2), crossed, score_range=(0.0, 1.0))


def _part(side: GapSide, part: slice) -> GapSide:
    """Return a side of the gap with a part of its controllers."""
    return GapSide(side.name, side.label, side.values[part], side.cells[part], score_range=side.score_range)

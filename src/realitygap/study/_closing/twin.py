"""One twin of the study `closing-the-gap`: judged, calibrated by each budget, transferred to."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import numpy as np

from realitygap.evolution import Genome
from realitygap.gap import GapSide, measure_gap
from realitygap.records import Observe, read_object, write_whole
from realitygap.runs import Condition, named, population_of
from realitygap.trials import NoiseKey, Target
from realitygap.world import Calibration, load_calibration

from .._transfer.attempt import allow_trials, plans_of
from .._transfer.calibrated import SELECTING, Numbers, fitted_condition
from .._transfer.noise import needs_sim
from .._transfer.simulated import crossed_cells, evolve_champions, try_repeatedly
from .._transfer.strategies import choose_condition, transfer
from .plan import ClosingPlan, TwinName

JUDGING, CALIBRATING = 10_000_000, 5_000_000
"""Numbers of the first trials for it, so that no two parts of the study draw the same noise."""

OTHERS: dict[str, Numbers] = {"point": "calibrated", "draws": "posterior"}
"""Gaps that are also stored, by their name in the file."""

STRATEGIES = ("plain", "select", "direct")
"""Compared with `posterior`; what they do does not depend on what calibrating sees."""


@dataclass(frozen=True)
class ClosingTwin:
    """A twin, and what is done with it.

    Attributes:
        plan: Plan of the study.
        name: Name of the twin.
        folder: Folder of the study.
        open_twin: Function that opens it as a target.
        calibrate: Function like `calibrate_all`.
        tell: Called with each finished unit.
    """

    plan: ClosingPlan
    name: TwinName
    folder: Path
    open_twin: Callable[[], Target]
    calibrate: Callable[..., Calibration]
    tell: Callable[[str], None]

    def carry_out(self) -> None:
        """Compute all units that are missing."""
        missing = [unit for unit in self.plan.units(self.name) if not self._path(unit).exists()]
        if not missing:
            return
        with self.open_twin() as target:
            for unit in missing:
                since = time.perf_counter()
                result = self._unit(unit, target)
                result |= {"family": self.name.family, "seed": self.name.seed, "unit": unit}
                result["seconds"] = round(time.perf_counter() - since, 1)
                write_whole(self._path(unit), json.dumps(result).encode(), within=self.folder)
                self.tell(f"{self.name} {unit}")

    def _path(self, unit: str) -> Path:
        return self.folder / "units" / f"{self.name}-{unit}.json"

    def _unit(self, unit: str, target: Target) -> dict[str, Any]:
        if unit == "judged":
            return self._judge(target)
        if unit == "transfer":
            return self._transfer(target)
        _, observe, budget = unit.split("-")
        return self._gap(target, observe, int(budget))

    @cached_property
    def condition(self) -> Condition:
        """The condition evolved in simulation, on the uncalibrated simulator."""
        return choose_condition(self.plan.study, None, self.plan.seed)

    @cached_property
    def genomes(self) -> list[Genome]:
        """The held-out controllers."""
        plan = self.plan
        seed = plan.seed_of_controllers(self.name)
        return held_out(plan.controllers, plan.study, seed, are_founders=not plan.has_own_controllers)

    # the same controllers on both sides

    def _judge(self, target: Target) -> dict[str, Any]:
        """Return the held-out controllers on the twin: crossed cells of each trial, and the share of stalled steps."""
        n = self.plan.trials
        repeated = [genome for genome in self.genomes for _ in range(n)]
        trials = target.carry_out(plans_of(self.condition, repeated, JUDGING, "held out"), "cells")
        cells = [trial.cells for trial in trials]
        return {
            "trials": n,
            "n_cells": target.arena.grid.n_cells,
            "label": target.label,
            "cells": [cells[k : k + n] for k in range(0, len(cells), n)],
            "stalled": [
                float(np.mean([t.stalled for t in trials[k : k + n]])) for k in range(0, len(trials), n)
            ],
        }

    def _on_twin(self) -> GapSide:
        judged = read_object(self._path("judged"))
        crossed = np.zeros((self.plan.controllers, self.plan.trials, judged["n_cells"]), bool)
        for k, trials in enumerate(judged["cells"]):
            for j, cells in enumerate(trials):
                crossed[k, j, cells] = True
        return GapSide(
            f"twin {self.name}", judged["label"], crossed.mean(axis=2), crossed, score_range=(0.0, 1.0)
        )

    def _in_simulation(self, condition: Condition) -> GapSide:
        n = self.plan.trials
        keys = [NoiseKey(condition.key, self.name.seed, 0, k) for k in range(len(self.genomes))]
        crossed = crossed_cells(try_repeatedly(condition, self.genomes, keys, range(n))[0], n)
        return GapSide(condition.name, condition.label, crossed.mean(axis=2), crossed, score_range=(0.0, 1.0))

    def _gap(self, target: Target, observe: str, budget: int) -> dict[str, Any]:
        """Measure the gap to the uncalibrated simulator, or to the calibration with this number of trials."""
        if not budget:
            return self._measured(self.condition, None)
        calibration = self._calibration(target, cast("Observe", observe), budget)
        found = self._measured(fitted_condition(self.condition, calibration, self.plan.numbers), calibration)
        others = {
            name: self._measured(fitted_condition(self.condition, calibration, numbers), calibration)
            for name, numbers in OTHERS.items()
        }
        rms = {name: other["gap"]["rms"] for name, other in others.items()}
        return {**found, **rms, "observe": observe, "budget": budget, "recommended": calibration.recommended}

    def _measured(self, condition: Condition, calibration: Calibration | None) -> dict[str, Any]:
        source, target = self._in_simulation(condition), self._on_twin()
        misspecified = None if calibration is None else calibration.misspecified
        gap = measure_gap(source, target, misspecified=misspecified, seed=self.plan.seed)
        found: dict[str, Any] = {"observe": "none", "budget": 0, "gap": gap.to_dict()}
        found["means"] = {"source": source.means.tolist(), "target": target.means.tolist()}
        found["parts"] = {
            name: measure_gap(_part(source, part), _part(target, part), seed=self.plan.seed).to_dict()["rms"]
            for name, part in self._kinds().items()
        }
        if calibration is not None:
            found["calibration"] = {
                "trials": calibration.trials,
                "misspecified": calibration.misspecified,
                "misspecification_p": calibration.misspecification_p,
                "fitted": [fitted.model_dump(exclude={"advice"}) for fitted in calibration.fitted],
            }
        return found

    def _kinds(self) -> dict[str, slice]:
        """Return which of the held-out controllers are random, and which are champions."""
        n = self.plan.controllers // 2
        return {"random": slice(0, n), "champions": slice(n, None)}

    def _calibration(self, target: Target, observe: Observe, budget: int) -> Calibration:
        """Return the calibration with this number of trials; run it first if it does not exist."""
        place = self.folder / "calibrations" / f"{self.name}-{observe}-{budget}"
        path = place.with_suffix(".toml")
        if not path.exists():
            with allow_trials(
                target, place.with_suffix(".sqlite"), budget, CALIBRATING, observe=observe
            ) as kept:
                calibration = self.calibrate(
                    kept,
                    robot=needs_sim(self.condition, "calibrated").robot,
                    observe=observe,
                    budget=budget,
                    seed=self.name.seed,
                    effort=self.plan.effort,
                )
            write_whole(path, calibration.to_toml().encode(), within=self.folder)
        return load_calibration(path)

    # transfer

    def _transfer(self, target: Target) -> dict[str, Any]:
        """Judge each strategy at equal budget. For `posterior`, calibration has its share of the budget."""
        budget = self.plan.transfer_budget
        rows = self._strategies(target, "any", STRATEGIES, None)
        for observe in self.plan.observations:
            calibrating = budget - budget // SELECTING
            self._calibration(target, observe, calibrating)
            file = self.folder / "calibrations" / f"{self.name}-{observe}-{calibrating}.toml"
            (row,) = self._strategies(target, observe, ("posterior",), file)
            rows.append({**row, "strategy": f"posterior, {observe}"})
        return {"budget": budget, "label": target.label, "strategies": rows}

    def _strategies(
        self, target: Target, part: str, names: Sequence[str], calibration: Path | None
    ) -> list[dict[str, Any]]:
        plan = self.plan
        result = transfer(
            plan.study,
            target,
            names,
            plan.transfer_budget,
            out=self.folder / "transfers" / f"{self.name}-{part}",
            replicates=plan.replicates,
            fresh_trials=plan.fresh_trials,
            runs=plan.runs,
            repeats=plan.repeats,
            calibration=calibration,
            seed=self.name.seed,
        )
        return [
            {
                "strategy": row.strategy,
                "quality": row.quality.to_dict(),
                "simulated": row.simulated,
                "coverage": [
                    float(np.mean(each.scores)) for each in result.champions if each.strategy == row.strategy
                ],
            }
            for row in result.strategies
        ]


def _part(side: GapSide, part: slice) -> GapSide:
    """Return a side of the gap with a part of its controllers."""
    return GapSide(side.name, side.label, side.values[part], side.cells[part], score_range=side.score_range)


def held_out(n: int, study: str, seed: int, *, are_founders: bool) -> list[Genome]:
    """Return controllers by which simulators are judged: first random ones, then as many champions of separate runs.

    Args:
        n: Number of controllers.
        study: Study whose condition on the simulator as it is evolves the champions, one run for each.
        seed: Seed that no other evolution and no calibration uses.
        are_founders: Whether the random ones are founders of the champions' runs. Otherwise they are of other runs.
    """
    condition = choose_condition(study, None, seed)
    n_random, first = n // 2, 0 if are_founders else n
    random: list[Genome] = []
    for replicate in range(first, first - (-n_random // condition.neat.population)):
        random += [named(genome, condition) for genome in population_of(condition, replicate).ask()]
    champions = evolve_champions(condition, range(n - n_random), repeats=1)
    return random[:n_random] + [champion.genome for champion in champions]

"""A twin of the study: its controllers driven, the simulator fitted by each arm, and what evolves in it tried."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap import __version__
from realitygap.calibration import numbers_of, scribbler_prior
from realitygap.errors import StudyError
from realitygap.evolution import Genome
from realitygap.platforms import TwinTarget
from realitygap.records import Observe, TrialRecord, write_whole
from realitygap.robots.twin import sample_twin
from realitygap.runs import Condition, named, population_of
from realitygap.study import choose_condition
from realitygap.study._calibrate.kinds import KINDS
from realitygap.study._calibrate.one import calibrate
from realitygap.study._calibrate.whole import all_plans
from realitygap.study._transfer.attempt import allow_trials, plans_of
from realitygap.study._transfer.calibrated import fitted_condition
from realitygap.study._transfer.simulated import evolve_champions, try_repeatedly
from realitygap.tasks import score_observed
from realitygap.trials import NoiseKey, Target, TellTrial, TrialPlan
from realitygap.world import Calibration, load_calibration

from .plan import HERE, Arm, Plan, Twin, Unit, code_digest

Scores = NDArray[np.float64]
CALIBRATING, JUDGING, AGAIN, CHAMPIONS = 1_000_000, 2_000_000, 3_000_000, 4_000_000
"""Numbers of the first trials for it, so that no two parts of the study draw the same noise."""

STRIDE = 100_000  # between the trials of arms
TASK_STRIDE = 20_000_000  # between those of tasks
TASKS = ("coverage", "avoid", "wall")
N_PRIOR = 500
"""Draws of the prior."""


def condition_of(task: str, seed: int) -> Condition:
    """Return the condition in which a task is evolved."""
    if task == "coverage":
        return choose_condition("sim-paper", "coverage-sim", seed)
    return choose_condition(HERE / "tasks.toml", task, seed)


@dataclass(frozen=True)
class Recorded:
    """A target that answers with trials that were driven before, whatever is asked of it."""

    name: str
    label: str
    target: Target
    trials: Sequence[TrialRecord]

    def __getattr__(self, name: str) -> Any:
        return getattr(self.target, name)

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """Return the first trials, with no more than `observe` of them."""
        trials = [trial.seen_as(observe) for trial in self.trials[: len(plans)]]
        for k, trial in enumerate(trials):
            if tell is not None:
                tell(k, trial)
        return trials


@dataclass(frozen=True)
class TwinOfStudy:
    """A twin, and what is done with it, in the folder of the study."""

    plan: Plan
    twin: Twin
    folder: Path

    @property
    def missing(self) -> list[Unit]:
        """Units without a result. Those of an outside arm whose fit is not there are left out."""
        return [
            unit for unit in self.plan.units(self.twin) if not self.path(unit).exists() and self._can(unit)
        ]

    def _can(self, unit: Unit) -> bool:
        arm = self.plan.arm.get(unit.what)
        return (
            arm is None
            or arm.fit != "outside"
            or self.fit_path(arm).exists()
            or self.failure_path(arm).exists()
        )

    def path(self, unit: Unit) -> Path:
        """Return the file of a unit's result."""
        return self.folder / "units" / f"{self.twin}-{unit}.json"

    def fit_path(self, arm: Arm) -> Path:
        """Return the file of an arm's calibration."""
        return self.folder / "fits" / f"{self.twin}-{arm.name}.toml"

    def failure_path(self, arm: Arm) -> Path:
        """Return the file of the message of an outside fit that failed."""
        return self.fit_path(arm).with_suffix(".failed.txt")

    def trials_path(self, budget: int, kind: str = "all") -> Path:
        """Return the file of the trials that calibrate."""
        return self.folder / "trials" / f"{self.twin}-{kind}-{budget}.sqlite"

    def carry_out(self) -> None:
        """Compute all units that are missing, each into a file that is written whole. A fit that fails is a result."""
        if not self.missing:
            return
        with self.open() as target:
            for unit in self.missing:
                since = time.perf_counter()
                result = self._judge(target, unit.task) if unit.what == "judged" else self._arm(target, unit)
                result |= {
                    "twin": str(self.twin),
                    "family": self.twin.family,
                    "task": unit.task,
                    "what": unit.what,
                }
                result |= {"plan": self.plan.digest, "code": code_digest(), "software": __version__}
                result["label"] = target.label
                result["seconds"] = round(time.perf_counter() - since, 1)
                write_whole(self.path(unit), json.dumps(result).encode(), within=self.folder)

    def open(self) -> AbstractContextManager[Target]:
        """Open the twin, which another process simulates. Its file is made if it is not there."""
        path = self.folder / "twins" / f"{self.twin}.toml"
        if not path.exists():
            model = sample_twin(self.twin.family, self.plan.seed_of(self.twin, "twin"))
            write_whole(path, model.to_toml().encode(), within=self.folder)
        arena = condition_of("coverage", 1).arena.arena()
        return TwinTarget(str(path), arena, 1, name=f"twin:{self.twin}")

    # held-out controllers

    def condition(self, task: str, purpose: str) -> Condition:
        """Return the condition on the uncalibrated simulator, whose random numbers are those of a purpose."""
        return condition_of(task, self.plan.seed_of(self.twin, f"{purpose} {task}"))

    def controllers(self, task: str) -> list[Genome]:
        """Return the held-out controllers: random ones, then champions of independent runs without a common founder."""
        n, condition = self.plan.controllers, self.condition(task, "controllers")
        random: list[Genome] = []
        replicate = n
        while len(random) < n:
            random += [named(genome, condition) for genome in population_of(condition, replicate).ask()]
            replicate += 1
        champions = evolve_champions(condition, range(n), repeats=1)
        return random[:n] + [champion.genome for champion in champions]

    def _judge(self, target: Target, task: str) -> dict[str, Any]:
        """Return the scores of the held-out controllers on the twin, in two batches."""
        genomes, condition = self.controllers(task), self.condition(task, "controllers")
        batches = [
            self._on_twin(target, condition, genomes, self.plan.trials, _first(task, number)).tolist()
            for number in (JUDGING, AGAIN)
        ]
        return {
            "kinds": ["random"] * self.plan.controllers + ["champion"] * self.plan.controllers,
            "scores": batches,
        }

    def _on_twin(
        self, target: Target, condition: Condition, genomes: Sequence[Genome], n: int, first: int
    ) -> Scores:
        """Return the scores (c, n) of genomes on the twin."""
        task = condition.task_of_trials
        plans = plans_of(condition, [genome for genome in genomes for _ in range(n)], first, "held out")
        trials = target.carry_out(plans, task.observe)
        return score_observed(task, trials, target.arena).reshape(len(genomes), n)

    # arms

    def _arm(self, target: Target, unit: Unit) -> dict[str, Any]:
        arm = self.plan.arm[unit.what]
        result: dict[str, Any] = {"champions": [], "calibration": None}
        try:
            calibration = self._calibration(target, arm)
        except (StudyError, ValueError) as error:
            return {**result, "failed": str(error), "scores": []}
        if calibration is not None:
            result["calibration"] = {
                "misspecified": calibration.misspecified,
                "misspecification_p": calibration.misspecification_p,
                "fitted": [fitted.model_dump(exclude={"advice"}) for fitted in calibration.fitted],
            }
        judging = self._simulator(unit.task, "judging", calibration)
        result["scores"] = self._simulated(judging, self.controllers(unit.task), self.plan.trials).tolist()
        if arm.evolves:
            result["champions"] = [
                self._champion(target, unit, calibration, k) for k in range(self.plan.replicates)
            ]
        return result

    def _simulator(self, task: str, purpose: str, calibration: Calibration | None) -> Condition:
        condition = self.condition(task, purpose)
        if calibration is None:
            return condition
        numbers = "posterior" if calibration.draws else "calibrated"
        return fitted_condition(condition, calibration, numbers)  # type: ignore[arg-type]

    def _simulated(self, condition: Condition, genomes: Sequence[Genome], n: int) -> Scores:
        keys = [NoiseKey(condition.key, 0, 0, k) for k in range(len(genomes))]
        return try_repeatedly(condition, genomes, keys, range(n))[1]

    def _champion(
        self, target: Target, unit: Unit, calibration: Calibration | None, replicate: int
    ) -> dict[str, Any]:
        """Evolve in an arm's simulator; try the best champion there on fresh noise, and on the twin."""
        plan = self.plan
        evolving = self._simulator(unit.task, f"evolution {replicate}", calibration)
        champion = evolve_champions(evolving, range(plan.runs), repeats=plan.repeats)[0]
        fresh = self._simulator(unit.task, f"fresh {replicate}", calibration)
        arm = list(plan.arm).index(unit.what)
        first = _first(unit.task, CHAMPIONS + (arm * 10 + replicate) * STRIDE)
        return {
            "ranked": champion.simulated,
            "simulated": self._simulated(fresh, [champion.genome], plan.fresh_simulated)[0].tolist(),
            "target": self._on_twin(target, evolving, [champion.genome], plan.fresh_trials, first)[
                0
            ].tolist(),
        }

    def _calibration(self, target: Target, arm: Arm) -> Calibration | None:
        """Return the calibration of an arm; make it first if it is not there."""
        if arm.fit == "none":
            return None
        path = self.fit_path(arm)
        if arm.fit == "outside" and not path.exists():
            raise StudyError(self.failure_path(arm).read_text())
        if not path.exists():
            made = self._prior() if arm.fit == "prior" else self._fitted(target, arm)
            write_whole(path, made.to_toml().encode(), within=self.folder)
        return load_calibration(path)

    def _prior(self) -> Calibration:
        """Return the prior in the form of a calibration."""
        robot = self._robot
        prior = scribbler_prior(robot)
        rng = np.random.default_rng(self.plan.seed_of(self.twin, "prior"))
        values = {parameter.name: parameter.prior.of(rng.random(N_PRIOR)) for parameter in prior}
        draws = numbers_of(prior, values, robot)
        own = robot.centers()
        return Calibration(
            kind="all", robot=robot.name, target=f"twin:{self.twin}", label="TWIN", observe="cells", trials=0,
            date="", method="None: draws of the prior.", numbers={name: own[name] for name in draws},
            draws={name: tuple(each.tolist()) for name, each in draws.items()},
        )  # fmt: skip

    def _fitted(self, target: Target, arm: Arm) -> Calibration:
        budget = arm.budget or self.plan.budget
        trials = self.calibrating(target, budget, "path" if arm.fit == "path" else "all")
        recorded = Recorded(target.name, target.label, target, trials)
        return calibrate(
            arm.fit, recorded, robot=self._robot.name, observe=arm.observe, budget=budget,
            seed=self.plan.seed_of(self.twin, "fit"),
        )  # type: ignore[arg-type]  # fmt: skip

    @cached_property
    def _robot(self) -> Any:
        return self.condition("coverage", "controllers").on.robot  # type: ignore[attr-defined]

    def calibrating(self, target: Target, budget: int, kind: str = "all") -> list[TrialRecord]:
        """Return the trials that calibrate, with poses; they are driven once, and saved."""
        path = self.trials_path(budget, kind)
        seed = self.plan.seed_of(self.twin, "calibrating")
        plans = (
            all_plans(target.arena, self._robot, budget, seed)
            if kind == "all"
            else KINDS["path"].plans(target.arena, self._robot, budget)
        )
        first = CALIBRATING + (STRIDE if kind == "path" else 0) + 1000 * budget
        with allow_trials(target, path, len(plans), first, observe="track") as kept:
            return kept.carry_out(plans, "track")


def _first(task: str, number: int) -> int:
    """Return the number of the first trial of a task."""
    return number + TASKS.index(task) * TASK_STRIDE

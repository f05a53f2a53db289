"""One attempt to transfer: what a strategy has at hand, and what all strategies share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from realitygap.evolution import Genome
from realitygap.records import Observe
from realitygap.runs import Condition
from realitygap.tasks import score_observed
from realitygap.trials import Target, TrialPlan
from realitygap.world import Calibration, RobotModel

from .._kept_target import KeptTarget
from .._targets import open_trials
from .repertoire import Repertoire, evolve_repertoire, repertoire_condition
from .simulated import Champion, evolve_champions


class Simulation:
    """Evolution in simulation, the same for all strategies: runs and repeats.

    Args:
        runs: Runs in a replicate.
        repeats: Trials of each individual.
    """

    def __init__(self, runs: int, repeats: int) -> None:
        self.runs, self.repeats = runs, repeats
        self._known: dict[tuple[str, int, int], list[Champion]] = {}
        self._repertoires: dict[tuple[str, int], Repertoire] = {}

    def champions(
        self,
        condition: Condition,
        replicate: int,
        *,
        runs: int | None = None,
    ) -> list[Champion]:
        """Return the champions of a replicate's runs under a condition, the best in simulation first.

        Args:
            condition: Condition for `evolve_champions`; with selection map-elites, elites are the champions.
            replicate: Replicate of the transfer.
            runs: Number of runs of the replicate. Default: all.
        """
        if condition.selection == "map-elites":
            return list(self.repertoire(condition, replicate).champions)
        n = self.runs if runs is None else runs
        key = (condition.hash(), replicate, n)
        if key not in self._known:
            first = replicate * self.runs
            self._known[key] = evolve_champions(condition, range(first, first + n), repeats=self.repeats)
        return self._known[key]

    def repertoire(self, condition: Condition, replicate: int, parts: int = 1) -> Repertoire:
        """Return the repertoire of a replicate under a condition, from as many trials as all of its runs.

        Args:
            condition: Condition for `repertoire_condition`.
            replicate: Replicate of the transfer.
            parts: Number of repertoires that share the trials.
        """
        neat = condition.neat
        n_trials = self.runs * neat.population * neat.generations * self.repeats
        evolving = repertoire_condition(condition, n_trials, parts)
        key = (evolving.hash(), replicate)
        if key not in self._repertoires:
            self._repertoires[key] = evolve_repertoire(evolving, replicate)
        return self._repertoires[key]


class Calibrates(Protocol):
    """A source of the calibrations that strategies share."""

    def __call__(self, condition: Condition, left: int) -> tuple[Calibration, RobotModel]:
        """Return the calibration for the remaining trials, and its base robot.

        Its `trials` are what it spends of them.
        """
        ...


@dataclass(frozen=True)
class Attempt:
    """The resources of a strategy.

    Attributes:
        condition: Condition that is evolved in simulation.
        target: Target, which allows `budget` trials.
        observe: Observation level of trials on the target.
        budget: Trials on the target.
        replicate: Replicate of the transfer, from 0 on.
        stop_at: Share of the highest predicted score at which trial and error ends; None to use the whole budget.
        simulation: Simulation that evolves.
        calibration: Makes or reads a calibration.
    """

    condition: Condition
    target: KeptTarget
    observe: Observe
    budget: int
    replicate: int
    stop_at: float | None
    simulation: Simulation
    calibration: Calibrates

    @property
    def left(self) -> int:
        """Trials that are left."""
        return self.budget - self.target.spent

    def champions(self, condition: Condition | None = None) -> list[Champion]:
        """Return champions evolved under a condition, the attempt's own by default; the best in simulation first."""
        return self.simulation.champions(condition or self.condition, self.replicate)

    def repertoire(self, condition: Condition | None = None, parts: int = 1) -> Repertoire:
        """Return a repertoire evolved under a condition, the attempt's own by default; see `Simulation.repertoire`."""
        return self.simulation.repertoire(condition or self.condition, self.replicate, parts)

    def try_on_target(self, genomes: Sequence[Genome]) -> tuple[list[float], list[tuple[int, ...]]]:
        """Try genomes on the target, once each; the score of each, and the cells that it visited, if they are known."""
        plans = plans_of(self.condition, genomes, self.target.spent)
        trials = self.target.carry_out(plans, self.observe)
        scores = score_observed(self.condition.task_of_trials, trials, self.target.arena)
        return scores.tolist(), [trial.cells for trial in trials]

    def score_on_target(self, champions: Sequence[Champion]) -> list[float]:
        """Return the score of each champion in one trial on the target."""
        return self.try_on_target([champion.genome for champion in champions])[0]


def allow_trials(target: Target, path: Path, n: int, first_number: int, *, observe: Observe) -> KeptTarget:
    """Return a target that allows n trials, and saves them.

    Args:
        target: Target that runs the trials.
        path: File of the trials, in an existing folder.
        n: Number of trials that it allows.
        first_number: Number added to that of each plan, so that parts of a study draw other random numbers.
        observe: Highest observation level.

    Raises:
        RecordError: The file is of another target, damaged, or cannot be written.
    """
    file = open_trials(path, target, observe, within=path.parent)
    return KeptTarget(target, file, budget=n, first_number=first_number, is_exclusive=True)


def plans_of(
    condition: Condition, genomes: Sequence[Genome], first: int, purpose: str = "controller"
) -> list[TrialPlan]:
    """Return a trial for each genome, as long as those of the condition, numbered from `first` on."""
    steps, sees_end = condition.on.steps, condition.task_of_trials.needs_trace
    return [
        TrialPlan(genome=genome, steps=steps, number=first + k, purpose=purpose, sees_end=sees_end)
        for k, genome in enumerate(genomes)
    ]

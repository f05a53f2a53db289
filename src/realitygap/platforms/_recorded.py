"""The platform `recorded`: it runs nothing, and returns the earlier trials of a file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, cast

import numpy as np
from pydantic import Field

from realitygap.errors import RecordError
from realitygap.evolution import Genome
from realitygap.logs import head_of, mapping_of, read_logs, robot_of, trial_of
from realitygap.records import (
    OBSERVATIONS,
    Observations,
    Observe,
    TrialRecord,
    is_observations,
    read_observations,
    those_that_count,
)
from realitygap.robots import Label
from realitygap.trials import RepeatableTarget, Target, TellTrial, TrialPlan, check_plans
from realitygap.world import Arena

from ._platform import Opening, Platform

MOST_NUMBER = 2**63 - 1


class RecordedPlatform(Platform):
    """The trials in a file of observed trials."""

    name: ClassVar[str] = "recorded"
    summary: ClassVar[str] = "earlier trials: looked up in a file or a log"
    rest: ClassVar[str] = "FILE"
    rest_setting: ClassVar[str] = "file"
    needs_rest: ClassVar[bool] = True
    is_for_studies: ClassVar[bool] = False

    file: str = Field("", description="File of the trials.")

    def open(self, arena: Arena, how: Opening) -> Target:
        """Open the file; the arena is the one that it names."""
        return RecordedTarget(self.file, name=how.name)


class RecordedTarget(RepeatableTarget):
    """The trials of controllers that a file holds.

    The k-th plan with a controller gets its k-th trial with as many steps.

    Trials that were cut off are left out; of several with one number and controller the last counts.

    Args:
        path: A file of observed trials, or a log with a mapping next to it.
        name: Name, as the user gave it.

    Attributes:
        controllers: Number of trials of each controller in the file, in the order in which they were recorded.
        steps: Commands in most of them.

    Raises:
        RecordError: It cannot be read, or has no whole trial of a controller.
        LogError: It is a log, and does not go together with its mapping.
    """

    is_paced = True
    inputs = None

    def __init__(self, path: str | Path, name: str = "") -> None:
        is_own = is_observations(path) or not Path(path).exists()
        record = read_observations(path) if is_own else _imported(path)
        whole = {
            (trial.genome, trial.number): trial for trial in those_that_count(record.trials) if trial.genome
        }
        if not whole:
            raise RecordError(
                f"{path} has no whole trial of a controller. If it is a log, name the controller that drove it: "
                "controller = FILE in its mapping."
            )
        self._path = Path(path)
        self._trials = list(whole.values())
        self.name = name or f"recorded:{path}"
        self.label = cast("Label", record.head.label)
        self.identity = record.head.identity
        self.arena = Arena.from_dict(cast("dict[str, Any]", dict(record.head.arena)))
        self.step_s = float(np.median([trial.step_s for trial in self._trials]))
        self.n_sensors = self._trials[0].readings.shape[1]
        counted: Observe = "track" if all(trial.cells for trial in self._trials) else "readings"
        self.observes = min((counted, *(trial.observe for trial in self._trials)), key=OBSERVATIONS.index)
        counts = Counter(trial.genome for trial in self._trials)
        self.steps = Counter(len(trial.commands) for trial in self._trials).most_common(1)[0][0]
        self.controllers = [(Genome.from_json(text), n) for text, n in counts.items()]

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """See `Target.carry_out`. Start, duration, and number of a trial are those of the record.

        Raises:
            RecordError: There are too few trials of a controller.
        """
        check_plans(plans, observe, self, MOST_NUMBER)
        taken: Counter[str] = Counter()
        trials = []
        for k, plan in enumerate(plans):
            genome = "" if plan.genome is None else plan.genome.to_json()
            matches = [
                trial
                for trial in self._trials
                if genome and trial.genome == genome and len(trial.commands) == plan.steps
            ]
            if taken[genome] >= len(matches):
                raise RecordError(
                    f"{self._path} has {len(matches)} trials of {plan.steps} steps of a controller, but one more "
                    f"was requested; most of its trials have {self.steps} steps. Request fewer, or record "
                    "more."
                )
            trial = matches[taken[genome]].seen_as(observe)
            taken[genome] += 1
            trials.append(trial)
            if tell is not None:
                tell(k, trial)
        return trials

    def close(self) -> None:
        """Nothing is held."""


def _imported(path: str | Path) -> Observations:
    """Return the trials of a log, with the mapping next to it."""
    log_map, _ = mapping_of(path)
    name, robot = robot_of(log_map)
    logs = list(read_logs(path, log_map, robot))
    trials = tuple(trial_of(log, log_map, number) for number, log in enumerate(logs))
    return Observations(head_of(path, log_map, name, logs[0]), trials)

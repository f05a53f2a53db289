"""A twin as a target: it runs in separate processes, and shows only the data of a robot."""

from __future__ import annotations

from collections.abc import Sequence

from realitygap.errors import RobotError
from realitygap.evolution import inputs_of_robot
from realitygap.records import Observe, TrialRecord, trial_from_dict
from realitygap.robots import Label
from realitygap.trials import RepeatableTarget, TellTrial, TrialPlan, check_plans
from realitygap.world import Arena

from ._plan_file import plan_to_dict
from ._pool import TwinPool


class TwinTarget(RepeatableTarget):
    """A twin, whose file this process never opens.

    Trial `number` is the same in any process and at any time.

    Args:
        file: File of the twin.
        arena: Arena of the trials.
        processes: Number of processes. Default: one for each processor that may be used.
        name: Name, as the user gave it. Default: twin:FILE.

    Raises:
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The twin's process does not come up.
    """

    label: Label = "TWIN"
    observes: Observe = "track"
    is_paced = True

    def __init__(self, file: str, arena: Arena, processes: int | None = None, *, name: str = "") -> None:
        self.name = name or f"twin:{file}"
        self.arena = arena
        self._pool = TwinPool(file, arena, processes)
        self.step_s = self._pool.step_s
        self.n_sensors = self._pool.n_sensors
        self.identity = f"twin {self.sha256}"

    @property
    def pids(self) -> tuple[int, ...]:
        """IDs of its processes."""
        return self._pool.pids

    @property
    def sha256(self) -> str:
        """SHA-256 of its file, as the process read it."""
        return self._pool.sha256

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of what networks can see."""
        return inputs_of_robot(self.n_sensors, self._pool.channels)

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """See `Target.carry_out`. Ctrl-C ends its processes."""
        check_plans(plans, observe, self)
        requests = [{"do": "carry_out", "plan": plan_to_dict(plan), "observe": observe} for plan in plans]
        trials: list[TrialRecord] = []
        try:
            for answer in self._pool.ask_all(requests):
                trial = trial_from_dict(answer)
                if trial.problem:
                    raise RobotError(f"Trial {trial.number} on {self.name}: {trial.problem}")
                trials.append(trial)
                if tell is not None:
                    tell(len(trials) - 1, trial)
        except (KeyboardInterrupt, SystemExit):
            self.close()
            raise
        return trials

    def close(self) -> None:
        """End its processes; safe to call twice."""
        self._pool.close()

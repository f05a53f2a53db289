"""Uses of processes that each have a twin: as a target, for networks of a study, and for robots step by step."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError, StudyError
from realitygap.evolution import inputs_of_robot
from realitygap.records import Observe, TrialRecord, trial_from_dict
from realitygap.robots import Label
from realitygap.trials import NoiseKey, RepeatableTarget, TellTrial, TrialPlan, check_plans, counters_of
from realitygap.world import Arena

from .._stepwise import AnsweredTrial, AskedTrial, Seen, StepwiseTrials, TakenRobots, trial_number
from ._pool import TwinPool

_pools: weakref.WeakValueDictionary[tuple[str, str, Arena], TwinPool] = weakref.WeakValueDictionary()
_last: list[TwinPool] = []  # the one used last is kept: the next chunk or trial wants it, too
_lock = threading.Lock()


class TwinTrials(StepwiseTrials):
    """The platform `twin` in an arena, ready to try networks of one kind; a `PlatformTrials`.

    A trial is a function of its random numbers' key and of the network: whichever process carries it out, and however
    many there are. Its robot is a `TwinPool`.
    """

    def _run(self, asked: list[AskedTrial]) -> Iterable[AnsweredTrial]:
        names = {"inputs": self._interface.inputs, "outputs": self._interface.outputs}
        more = {"do": "evolve", **names, "steps": self.n_steps}
        answers: Iterable[AnsweredTrial] = self._robot.ask_all([{**each, **more} for each in asked])
        return answers


def release_twins() -> None:
    """Release the twins that are stored for further trials. The processes of unused ones end."""
    with _lock:
        _last.clear()


def close_twins() -> None:
    """End the processes of all twins of studies, also during a trial."""
    with _lock:
        pools = list(_pools.values())
        _last.clear()
    for pool in pools:
        pool.close()


def shared_pool(file: str, sha256: str, arena: Arena) -> TwinPool:
    """Return the processes of a twin in an arena, which all trials share.

    Raises:
        StudyError: The file is another than that of the hash.
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
    """
    with _lock:
        name = (file, sha256, arena)
        pool = _pools.get(name)
        if pool is None or pool.is_closed:
            pool = TwinPool(file, arena)
            if sha256 not in ("", pool.sha256):
                pool.close()
                raise StudyError(
                    f"The twin's file {file} has changed: its SHA-256 begins with {pool.sha256[:12]}, expected "
                    f"{sha256[:12]}. Restore the old file, or restart with the new one."
                )
            _pools[name] = pool
        _last[:] = [pool]
    return pool


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
        requests = [{"do": "carry_out", "plan": plan.to_dict(), "observe": observe} for plan in plans]
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


class TwinRobots(TakenRobots):
    """n robots of a twin in a separate process, each alone in its arena.

    Commands from outside drive the trials that `try_genomes` gives networks with these commands and the same key.

    Args:
        file: File of the twin.
        arena: Arena of the robots.
        n: Number of robots.

    Attributes:
        step_s: Duration of a command [s].
        readings: (n, s) readings of the range sensors, 0..1.
        stalled: (n,) True if the last step was blocked.
        poses: (n, 3) x [m], y [m], heading [rad].
        cells: The cells along each line, in order of first visit.
        channels: Names of the sensors that each has besides range sensors.
        values: Readings of the selected sensors.

    Raises:
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The process does not come up.
    """

    def __init__(self, file: str, arena: Arena, n: int) -> None:
        self._pool = TwinPool(file, arena, 1)
        self._arena, self._n = arena, n
        self.step_s, self.n_sensors = self._pool.step_s, self._pool.n_sensors
        self.channels = self._pool.channels
        self._selected: tuple[str, ...] = ()

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors to read besides range sensors, from the next `begin` on."""
        self._selected = tuple(names)

    def begin(self, key: NoiseKey) -> None:
        """Put all robots at the start; robot k draws the numbers of individual `key.individual` + k.

        A closed twin is opened again, because some checkers of environments close one and continue to use it.
        """
        if self._pool.is_closed:
            self._pool = TwinPool(self._pool.file, self._arena, 1)
        numbers = [trial_number(key.key, counter) for counter in counters_of(key, self._n)]
        self._take(self._ask({"do": "begin", "numbers": numbers, "channels": self._selected}))

    def drive(self, commands: NDArray[np.float64]) -> None:
        """Drive each robot by one command, (n, 2) each -1..1.

        Raises:
            RobotError: No trial is under way.
        """
        self._take(self._ask({"do": "drive", "commands": commands.tolist()}))

    def close(self) -> None:
        """End the process; safe to call twice."""
        self._pool.close()

    def _ask(self, request: dict[str, Any]) -> Sequence[Seen]:
        answer: Sequence[Seen] = next(self._pool.ask_all([request]))
        return answer

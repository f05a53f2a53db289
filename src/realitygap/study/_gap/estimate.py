"""The mean score of controllers on a target, estimated from few trials there and many in simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap._wording import counted, number, platform_in_words, with_interval, worth_verdict
from realitygap.errors import StudyError
from realitygap.gap import GapSide
from realitygap.orders import EstimateOrder, takes_order
from realitygap.platforms import RecordedPlatform, RecordedTarget, open_target, split_spec
from realitygap.stats import FEW_UNITS, Assisted, assisted_mean, least_correlation
from realitygap.tasks import Task
from realitygap.trials import PortObserver, Pulse, Target
from realitygap.world import Arena, Calibration

from .._code import task_named
from .._controllers import Controller, recorded_controllers, sample_controllers, task_of
from .._targets import check_task, open_trials, refuse_too_little
from .between import Say, arena_of, noise_on
from .study import STEPS, TARGET_FROM, Tell, carry_out, plans_of, refuse_inputs, side_of
from .why import calibration_of


@dataclass(frozen=True)
class EstimatedScore:
    """A mean score on a target, assisted by a simulator.

    Attributes:
        assisted: The estimate, and the one from the target alone.
        source: All controllers in simulation; the first ones are those of `target`.
        target: Driven controllers on the target.
        score: Score of trials, with its unit.
        order: The order, from which it can be estimated again.
    """

    assisted: Assisted
    source: GapSide
    target: GapSide
    score: str
    order: EstimateOrder

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.assisted.estimate}, target alone {self.assisted.real_only})"

    @property
    def title(self) -> str:
        """The estimated mean in words."""
        sim, target = (platform_in_words(side.name, side.label) for side in (self.source, self.target))
        whose = f"of these {self.source.n} controllers " if self.order.fleet else ""
        return f"Mean {self.score} {whose}on {target}, assisted by {sim}"

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Name and value of each result, in words."""
        assisted = self.assisted
        estimate = with_interval(assisted.estimate)
        correlation = f"{number(assisted.correlation)} (helps above {least_correlation(self.target.n):.2f})"
        rows = [("estimate", f"{estimate}  {assisted.estimate.refused}".rstrip())]
        rows.append(("target alone", with_interval(assisted.real_only)))
        if assisted.width_ratio is not None:
            rows.append(("width of interval", f"{assisted.width_ratio:.2f} of that of the target alone"))
        return rows if self.target.n < 3 else [*rows, ("correlation", correlation)]

    @property
    def verdict(self) -> str:
        """The worth of the simulation, as a sentence."""
        if self.assisted.worth is None:
            return "Use the estimate from the target alone."
        return worth_verdict(self.assisted.worth, "controller", helps=self.assisted.helps)

    @property
    def notes(self) -> tuple[str, ...]:
        """Limits of the intervals, each a sentence."""
        if self.assisted.estimate.ends is None or self.target.n >= FEW_UNITS:
            return ()
        return (
            f"With fewer than {FEW_UNITS} controllers on the target, intervals of skewed scores miss more often than "
            "5 of 100 times.",
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the estimates, what they rest on, and the verdict, as in the output of `--json`."""
        assisted = self.assisted
        return {
            "estimate": assisted.estimate.to_dict(),
            "target_alone": assisted.real_only.to_dict(),
            "width_ratio": assisted.width_ratio,
            "worth": assisted.worth,
            "correlation": assisted.correlation,
            "helps": assisted.helps,
            "verdict": self.verdict,
            "notes": list(self.notes),
            "score": self.score,
            "source": self.source.name,
            "target": self.target.name,
            "labels": [self.source.label, self.target.label],
            "controllers": [self.source.n, self.target.n],
            "trials": [self.source.trials, self.target.trials],
        }


@takes_order(EstimateOrder)
def estimate_score(
    order: EstimateOrder,
    *,
    observer: PortObserver | None = None,
    pulse: Pulse | None = None,
    allow_code: bool = False,
    tell: Tell | None = None,
    say: Say | None = None,
) -> EstimatedScore:
    """Estimate a mean score on a target from few trials there and many in simulation, as `realitygap estimate`.

    Args:
        observer: Observer of a robot without a witness: it places the robot and reports what it drew.
        pulse: Called when a trial on a robot begins or ends, and when the robot has answered in it.
        allow_code: True to run the Python file of a task that the user has not allowed before.
        tell: Called as trials are done.
        say: Called with what is done otherwise.

    Raises:
        StudyError: A platform, study or number that cannot be, or a calibration from the very trials of the target.
        RealityGapError: The robot failed, or files cannot be read or written.
    """
    _refuse_own_calibration(order, calibration_of(order.sim))
    controllers, n = _drawn(order, allow_code=allow_code)
    if say is not None:
        say(f"Driving {n} of {len(controllers)} controllers: {order.controllers}.")
    task = task_of(controllers) if order.task is None else task_named(order.task, allow_code=allow_code)
    arena, steps = _place(order, controllers)
    check_task(task, arena)
    with (
        open_target(order.sim, arena, noise=noise_on(order.sim, order.noise), key=2 * order.seed) as source,
        open_target(
            order.target,
            arena,
            processes=order.processes,
            witness=order.witness,
            observer=observer,
            pulse=pulse,
            noise=noise_on(order.target, order.noise),
            key=2 * order.seed + 1,
        ) as target,
    ):
        if target.label == "REAL" and order.results is None and not isinstance(target, RecordedTarget):
            raise StudyError(
                f"{n * order.trials} trials on {order.target} would not be saved. Name a file for them (-o "
                "FILE.sqlite), so that the same command can resume."
            )
        real = _tried(target, controllers[:n], order.trials, task, order, steps, tell)
        simulated = _tried(source, controllers, order.sim_trials, task, None, steps, tell)
    noise = None if real.trials < 2 else float(real.noise.mean())
    means = simulated.means
    assisted = assisted_mean(
        real.means,
        means[:n],
        means[n:],
        fleet=order.fleet,
        noise=noise,
        within=task.score_range,
        noun="controllers",
    )
    return EstimatedScore(assisted, simulated, real, task.score_name, order)


def _refuse_own_calibration(order: EstimateOrder, calibration: Calibration | None) -> None:
    """Refuse a simulator that was fitted to the very trials of the target: its scores would depend on theirs."""
    name, file = split_spec(order.target)
    if calibration is None or name != RecordedPlatform.name:
        return
    used = [calibration.target.partition(":")[2], *map(str, calibration.order.get("data", ()))]
    if any(each and Path(each).resolve() == Path(file).resolve() for each in used):
        raise StudyError(
            f"{order.sim} was fitted to the trials in {file}, so the estimate would use them twice. Expected a "
            "calibration from other trials: record new ones, or calibrate with a part of them."
        )


def _drawn(order: EstimateOrder, *, allow_code: bool) -> tuple[list[Controller], int]:
    """Return all controllers, those for the target first, and their number.

    Raises:
        StudyError: There are too few, or those of recorded trials are not among them.
    """
    recorded = recorded_controllers(order.target)
    n = min(order.n_controllers, len(recorded)) if recorded else order.n_controllers
    total = max(n, len(recorded)) + order.others
    drawn = sample_controllers(order.controllers, total, order.seed, allow_code=allow_code)
    if recorded:
        where = {each.genome.to_json(): k for k, each in enumerate(drawn)}
        chosen = [where.get(each.genome.to_json(), -1) for each, _ in recorded[:n]]
        if -1 in chosen:
            raise StudyError(
                f"{order.target} has controllers that {order.controllers} with seed {order.seed} does not draw. Name "
                "where they are from (--controllers, --seed): the others must come from the same place."
            )
        least = min(trials for _, trials in recorded[:n])
        if least < order.trials:
            raise StudyError(
                f"{order.target} has {counted(least, 'trial')} of some controller, expected {order.trials}. Use "
                f"--trials {least}."
            )
    elif Path(order.controllers).is_dir():  # another number of others leaves the driven ones as they are
        few = sample_controllers(order.controllers, n, order.seed, allow_code=allow_code)
        names = [each.name for each in drawn]
        chosen = [names.index(each.name) for each in few]
    else:
        chosen = list(range(n))
    rest = sorted(set(range(total)) - set(chosen))
    return [drawn[k] for k in (*chosen, *rest)], n


def _place(order: EstimateOrder, controllers: Sequence[Controller]) -> tuple[Arena, int]:
    """Return the arena, and the commands of a trial."""
    name, file = split_spec(order.target)
    if name == RecordedPlatform.name:
        recorded = RecordedTarget(file)
        return recorded.arena, recorded.steps
    condition = controllers[0].condition
    return arena_of(order, controllers), STEPS if condition is None else condition.on.steps


def _tried(
    platform: Target,
    controllers: Sequence[Controller],
    trials: int,
    task: Task,
    order: EstimateOrder | None,
    steps: int,
    tell: Tell | None,
) -> GapSide:
    """Return the trials of controllers on a platform; of the target, saved if the order has a file."""
    refuse_inputs(controllers, platform)
    genomes = [each.genome for each in controllers]
    first = 0 if order is None else TARGET_FROM
    plans = plans_of(genomes, trials, first, steps, sees_end=task.needs_trace)
    observe, file = task.observe, None
    if order is not None:
        observe = refuse_too_little(task, platform, order.observe)
        file = None if order.results is None else open_trials(order.results, platform, observe)
    return side_of(platform, carry_out(platform, plans, observe, tell, file), len(controllers), task)

"""The mean score of controllers on a target, estimated from few trials there and many in simulation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from realitygap._wording import counted, platform_in_words
from realitygap.errors import StudyError
from realitygap.gap import GapSide
from realitygap.orders import EstimateOrder, takes_order
from realitygap.platforms import RecordedPlatform, RecordedTarget, split_spec
from realitygap.stats import assisted_mean
from realitygap.tasks import Task
from realitygap.trials import PortObserver, Pulse, Target
from realitygap.world import Arena

from .._code import task_named
from .._controllers import Controller, recorded_controllers, sample_controllers, task_of
from .._design import refuse_lock_without_file
from .._deviations import check_unblinded
from .._estimate_table import estimate_in_table
from .._estimated import EstimatedScore
from .._targets import check_task, open_trials, refuse_too_little
from .between import Say, arena_of, both_open
from .study import STEPS, TARGET_FROM, Tell, carry_out, hold_to_rounds, plans_of, refuse_inputs, side_of
from .why import calibration_of


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
    if not order.target:
        return estimate_in_table(order)
    _refuse_own_calibration(order.sim, order.target)
    refuse_lock_without_file(order, order.results)
    controllers, n = _drawn(order, allow_code=allow_code)
    if say is not None:
        say(f"Driving {n} of {len(controllers)} controllers: {order.controllers}.")
    task = task_of(controllers) if order.task is None else task_named(order.task, allow_code=allow_code)
    arena, steps = _place(order, controllers)
    check_task(task, arena)
    with both_open(order, arena, n * order.trials, observer=observer, pulse=pulse) as (source, target):
        real = _tried(target, controllers[:n], order.trials, task, order, steps, tell, say)
        deviations = check_unblinded(order.results)
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
    names = [platform_in_words(side.name, side.label) for side in (simulated, real)]
    whose = f"of these {counted(simulated.n, 'controller')} " if order.fleet else ""
    basis = "; ".join(
        f"{side.label}: {counted(side.n, 'controller')} with {counted(side.trials, 'trial')} each"
        for side in (real, simulated)
    )
    basis = " ".join((f"{basis}." if deviations else basis, *deviations))
    title = f"Mean {task.score_name} {whose}on {names[1]}, assisted by {names[0]}"
    return EstimatedScore(assisted, title, "controller", real.means, means, basis, task.score_name, order)


def _refuse_own_calibration(sim: str, target: str) -> None:
    """Refuse a simulator that was fitted to the very trials of the target: its scores would depend on theirs."""
    calibration, (name, file) = calibration_of(sim), split_spec(target)
    if calibration is None or name != RecordedPlatform.name:
        return
    used = [calibration.target.partition(":")[2], *map(str, calibration.order.get("data", ()))]
    if any(each and Path(each).resolve() == Path(file).resolve() for each in used):
        raise StudyError(
            f"{sim} was fitted to the trials in {file}, so the estimate would use them twice. Expected a "
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
    say: Say | None = None,
) -> GapSide:
    """Return the trials of controllers on a platform; of the target, saved if the order has a file."""
    refuse_inputs(controllers, platform)
    genomes = [each.genome for each in controllers]
    first = 0 if order is None else TARGET_FROM
    plans = plans_of(genomes, trials, first, steps, sees_end=task.needs_trace)
    observe, file, locked = task.observe, None, None
    if order is not None:
        observe = refuse_too_little(task, platform, order.observe)
        file = None if order.results is None else open_trials(order.results, platform, observe)
        locked = None if file is None else hold_to_rounds(file, order, platform, controllers, task, say=say)
    driven = carry_out(platform, plans, observe, tell, file, locked)
    return side_of(platform, driven, len(controllers), task)

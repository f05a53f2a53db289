"""The gap between two platforms by name: opened, tried, measured and explained."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import realitygap
from realitygap.drawing import ShownAsCard
from realitygap.errors import StudyError
from realitygap.gap import Why
from realitygap.orders import EstimateOrder, GapOrder, takes_order
from realitygap.platforms import RecordedTarget, class_of, open_target, split_spec
from realitygap.stats import Estimate
from realitygap.tasks import Task
from realitygap.trials import PortObserver, Pulse, Target
from realitygap.world import Arena, Calibration, load_arena

from .._code import task_named
from .._controllers import Controller, recorded_controllers, sample_controllers, task_of
from .._design import refuse_lock_without_file
from .shown import with_shown
from .study import STEPS, GapStudy, Tell, study_gap
from .why import calibration_of, why_gap

Say = Callable[[str], None]


@dataclass(frozen=True)
class GapBetween(ShownAsCard):
    """A gap between two platforms, and why it is there.

    Attributes:
        study: Measures, and what figures are drawn from.
        why: Part of the gap that each part of the model explains; None if not requested.
        order: The order, from which the gap can be measured again; None if a part of it has no name.
    """

    study: GapStudy
    why: Why | None
    order: GapOrder | None = None

    def __repr__(self) -> str:
        return f"{type(self).__name__}{repr(self.study.result).removeprefix('GapResult')}"

    @property
    def level(self) -> Estimate:
        """Mean score on the target minus that on the simulator."""
        return self.study.result.level

    @property
    def rms(self) -> Estimate:
        """RMS gap: the typical size of a controller's difference, without the noise of trials."""
        return self.study.result.rms

    @property
    def rank_correlation(self) -> Estimate:
        """Spearman's rank correlation of the controllers' scores on both platforms."""
        return self.study.result.srcc

    @property
    def noise_ceiling(self) -> Estimate:
        """Rank correlation that noise alone would leave of a perfect one."""
        return self.study.result.noise_ceiling

    @property
    def verdict(self) -> str:
        """The finding in a sentence."""
        return self.study.result.verdict

    def plot(self) -> realitygap.report.Drawing:
        """Draw the mean score of each controller on both platforms, with intervals. On the line there is no gap."""
        return realitygap.report.draw_gap_pairs(self.study)

    def report(self, path: str | Path = "gap.html") -> Path:
        """Write the report of the gap and return its path, as `realitygap.report.write_gap_report`."""
        return realitygap.report.write_gap_report(self, path)


@takes_order(GapOrder)
def gap_between(
    order: GapOrder,
    *,
    task: Task | None = None,
    arena: Arena | None = None,
    observer: PortObserver | None = None,
    pulse: Pulse | None = None,
    allow_code: bool = False,
    tell: Tell | None = None,
    say: Say | None = None,
    shown: int | None = None,
) -> GapBetween:
    """Measure the gap between a simulator and a target, both by name; as `realitygap gap`.

    The task may also be a `Task`, and the arena an `Arena`.

    Args:
        observer: Observer of a robot without a witness: it places the robot and reports what it drew.
        pulse: Called when a trial on a robot begins or ends, and when the robot has answered in it.
        allow_code: True to run the Python file of a task that the user has not allowed before.
        tell: Called as trials are done.
        say: Called with what is done otherwise.
        shown: Index of the controller to show in motion. Default: the one with the highest score in simulation.

    Raises:
        StudyError: A platform, study or number that cannot be.
        RealityGapError: The robot failed, or files cannot be read or written.
    """
    calibration = calibration_of(order.sim)
    if order.why and calibration is None:
        raise StudyError(
            f"--why needs a calibration, but {order.sim} is not one. Make one with: realitygap calibrate all --robot "
            f"{order.target} --observe {order.observe or 'cells'} -o fit.toml; then measure the gap of sim:fit.toml."
        )
    tell_of = say or (lambda _: None)
    setting = _setting(order, task, arena, tell_of, allow_code=allow_code)
    champions = (
        []
        if order.reevolved is None
        else sample_controllers(order.reevolved, setting.n_controllers, order.seed, allow_code=allow_code)
    )
    if order.why and setting.task.name != "coverage":
        raise StudyError(
            f"--why shares out the gap in coverage, and the score here is {setting.task.score_name}. Leave --why out, "
            "or name the task (--task coverage)."
        )
    if champions and not setting.is_recorded:
        _refuse_elsewhere(champions, f"--reevolved {order.reevolved}", order.target)
    if champions:
        _refuse_elsewhere(setting.controllers, f"--controllers {order.controllers}", order.sim)
    refuse_lock_without_file(order, order.results)
    n_trials = setting.n_controllers * setting.trials
    with both_open(
        order, setting.arena, n_trials, observer=observer, pulse=pulse, randomize=order.randomize
    ) as (source, costly):
        gap = study_gap(
            source,
            costly,
            setting.controllers,
            task=setting.task,
            trials=setting.trials,
            margin=order.margin,
            observe=order.observe,
            misspecified=_misspecified(calibration),
            reevolved=champions,
            seed=order.seed,
            tell=tell,
            results=order.results,
            at_its_pace=calibration is None or not calibration.step_s,
            steps=setting.steps,
            order=order,
            say=say,
        )
        gap = with_shown(gap, source, costly, controller=shown, steps=setting.steps)
    parts = None
    if order.why and calibration is not None:
        tell_of("Switching parts of the model: 64 choices, each with draws from the posterior.")
        parts = why_gap(calibration, gap, steps=setting.steps, seed=order.seed)
    return GapBetween(gap, parts, order if task is None and arena is None else None)


@contextlib.contextmanager
def both_open(
    order: GapOrder | EstimateOrder,
    arena: Arena,
    n_trials: int,
    *,
    observer: PortObserver | None,
    pulse: Pulse | None,
    randomize: Literal["no", "posterior"] = "no",
) -> Iterator[tuple[Target, Target]]:
    """Open the simulator and the target of an order; `n_trials` will be driven on the target.

    Raises:
        StudyError: Trials of a real robot would not be saved, or a platform cannot be opened.
    """
    with (
        open_target(
            order.sim,
            arena,
            noise=_noise_on(order.sim, order.noise),
            key=2 * order.seed,
            randomize=randomize,
        ) as source,
        open_target(
            order.target,
            arena,
            processes=order.processes,
            witness=order.witness,
            observer=observer,
            pulse=pulse,
            noise=_noise_on(order.target, order.noise),
            key=2 * order.seed + 1,
        ) as target,
    ):
        if target.label == "REAL" and order.results is None and not isinstance(target, RecordedTarget):
            raise StudyError(
                f"{n_trials} trials on {order.target} would not be saved. Name a file for them (-o FILE.sqlite), so "
                "that the same command can resume."
            )
        yield source, target


@dataclass(frozen=True)
class _Setting:
    """Controllers of an order, and everything that comes with them.

    Attributes:
        controllers: The controllers.
        trials: Number of trials of each controller on each platform.
        task: Task that scores the trials.
        arena: Arena of the trials.
        steps: Commands in a trial.
        is_recorded: True if the trials of the target are recorded ones, of controllers that come with them.
    """

    controllers: list[Controller]
    trials: int
    task: Task
    arena: Arena
    steps: int
    is_recorded: bool

    @property
    def n_controllers(self) -> int:
        return len(self.controllers)


def _setting(
    order: GapOrder, task: Task | None, arena: Arena | None, say: Say, *, allow_code: bool
) -> _Setting:
    """Return the controllers, and the task and the arena that come with them unless the order names others.

    Raises:
        StudyError: There are no such controllers, or no such task or arena.
    """
    recorded = recorded_controllers(order.target) if order.controllers == "random" else []
    if len(recorded) == 1:
        raise StudyError(
            f"The trials in {order.target.partition(':')[2]} are of one controller, expected at least 2: a gap is "
            "estimated from several. Record more, for example with: realitygap gap SIM TARGET -o FILE"
        )
    trials, steps = order.trials, STEPS
    if recorded:
        n, trials = min(order.n_controllers, len(recorded)), min(trials, recorded[0][1])
        say(f"The {n} controllers of {order.target}, {trials} trials each.")
        controllers = [controller for controller, _ in recorded[:n]]
        target = RecordedTarget(split_spec(order.target)[1])
        arena, steps = target.arena, target.steps
    else:
        say(f"Drawing {order.n_controllers} controllers: {order.controllers}.")
        controllers = sample_controllers(
            order.controllers, order.n_controllers, order.seed, allow_code=allow_code
        )
    if task is None:
        task = task_of(controllers) if order.task is None else task_named(order.task, allow_code=allow_code)
    place = arena or arena_of(order, controllers)
    condition = controllers[0].condition
    steps = steps if condition is None else condition.on.steps
    return _Setting(controllers, trials, task, place, steps, bool(recorded))


def arena_of(order: GapOrder | EstimateOrder, controllers: Sequence[Controller]) -> Arena:
    """Return the arena of an order: the one that it names, or the one that its controllers come with.

    Raises:
        StudyError: None is named, and the controllers were selected in several.
    """
    if order.arena is not None:
        return load_arena(order.arena)
    selected_in = [each.condition.arena.arena().alone for each in controllers if each.condition is not None]
    if any(other != selected_in[0] for other in selected_in):
        names = ", ".join(sorted({each.name for each in selected_in}))
        raise StudyError(
            f"The controllers of {order.controllers} were selected in several arenas ({names}). Name one (--arena)."
        )
    return selected_in[0] if selected_in else load_arena("paper")


def _refuse_elsewhere(evolved: Sequence[Controller], named: str, platform: str) -> None:
    """Raise an error if a controller was evolved on another platform, before trials are spent on it.

    Raises:
        StudyError: A controller was evolved elsewhere.
    """
    for each in evolved:
        where = each.selected_on or "nowhere"
        if each.kind != "champion" or where.partition(":")[0] != platform.partition(":")[0]:
            raise StudyError(
                f"{each.name} of {named} was evolved {'on ' if each.selected_on else ''}{where}, expected "
                f"champions evolved on {platform}. The re-evolved gap compares champions evolved on each "
                "platform."
            )


def _misspecified(calibration: Calibration | None) -> bool | None:
    """Return the verdict of a calibration's predictive check; for a partial calibration, True or None, never False."""
    if calibration is None:
        return None
    return calibration.misspecified if calibration.kind == "all" else calibration.misspecified or None


def _noise_on(platform: str, noise: float | None) -> float:
    """Return the noise level a of the paper on a platform, which has its own default."""
    return class_of(platform).default_noise if noise is None else noise

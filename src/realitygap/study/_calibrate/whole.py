"""All parameters of a robot together, from whole trials on a target: `calibrate all`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial

import numpy as np

from realitygap._version import __version__
from realitygap._wording import significant
from realitygap.calibration import (
    CONTACT,
    LEAST_STEPS,
    MOTION,
    Effort,
    Evidence,
    Fit,
    Floats,
    Misfit,
    Parameter,
    Pattern,
    Posterior,
    evidence_of,
    excitation,
    fit_all,
    fit_from_commands,
    fit_from_poses,
    information_of,
    is_identified,
    misfits,
    mixed,
    next_trials,
    numbers_of,
    of_one_length,
    random_controllers,
    ranges_of,
    residual_patterns,
    scribbler_prior,
    step_of,
    values_of,
)
from realitygap.errors import whole_number
from realitygap.platforms import SimEnsemble, SimPlatform
from realitygap.records import Observe, TrialRecord
from realitygap.trials import Target, TrialPlan
from realitygap.world import Arena, Calibration, Fitted, RobotModel

from .held_out_trials import compare_on_trials, evidence_in, simulate_evidence
from .marker import is_under_camera, with_marker, without_marker

METHOD = (
    "Whole trials carried out anew in `sim`: approximate Bayesian computation in rounds (Deistler, Goncalves & Macke "
    "2022) with score summaries (Alsing & Wandelt 2018) and regression adjustment (Beaumont, Zhang & Balding 2002). "
    "With poses, three of four draws are from likelihoods of single commands (multiple shooting, Bock 1983). Without "
    "poses, they are from fits to whole trials with the same commands (covariance matrix adaptation, Hansen 2016; "
    "weighted likelihood bootstrap, Newton & Raftery 1994)."
)
ALL_TRIALS = 20  # if no budget is given
LEAST_TO_CHOOSE = 10  # of the budget, for which the last trials are chosen
STEPS = 100  # of a trial
N_CANDIDATES = 12  # of which the next trials are chosen
N_ASKED = 400  # robots of the posterior that are asked what a trial would tell
OF_COMMANDS = 3  # draws of given commands for each of whole trials: predicted more than 1 did, on twins
BEFORE_CHOICE = 0.6  # of the budget is carried out before trials are chosen


def calibrate_all(
    target: Target,
    *,
    robot: RobotModel | str | None = None,
    observe: Observe = "cells",
    budget: int,
    seed: int = 0,
    effort: Effort = "full",
    choose: bool = False,
    tell: Callable[[str], None] | None = None,
    keep: Callable[[TrialRecord], None] | None = None,
    threads: int | None = None,
) -> Calibration:
    """Run trials on a target, and fit all parameters of `sim` to the observations.

    Half of the trials are commands that change often, from many places; the other half are random controllers from
    the arena's start.

    Args:
        target: Target of the calibration.
        robot: Robot on which the fit builds: a name, a file, or a model. Default: that of `sim`.
        observe: Observation level.
        budget: Number of trials; with 0, the robot stays as in its file.
        seed: Seed of all random numbers.
        effort: Amount of simulation.
        choose: True to choose the last trials of 10 and more after a first fit, as those that say most about how
            controllers that were not tried will do.
        tell: Called with the progress in words.
        keep: Called with each trial when it ends.
        threads: Number of threads of the simulations.

    Raises:
        RobotError: The target failed; what `keep` was given is not lost.
        ValueError: So much cannot be seen of the target.
    """
    whole_number("budget", budget, 0)
    platform = SimPlatform(step_s=target.step_s, **({} if robot is None else {"robot": robot}))
    say = tell or (lambda _: None)
    keep_trial = None if keep is None else lambda _, trial: keep(trial)
    plans = all_plans(target.arena, platform.robot, budget, seed)
    is_chosen = choose and budget >= LEAST_TO_CHOOSE
    first = round(BEFORE_CHOICE * budget) if is_chosen else budget
    say(f"{first} trials on {target.name}, {observe} observed")
    carried_out = list(target.carry_out(plans[:first], observe, keep_trial))
    trials, left_out = of_one_length(carried_out)
    if trials:
        platform = platform.model_copy(update={"step_s": step_of(trials)})
    fit = _Fitter(platform, target.arena, seed, say, threads)
    if is_chosen:
        chosen = fit.chosen(fit.posterior(trials, "small"), budget - first, first)
        say(f"{len(chosen)} more trials, chosen")
        carried_out += target.carry_out(chosen, observe, keep_trial)
        trials, left_out = of_one_length(carried_out)
    marker = None
    if is_under_camera(target.name, target.label, observe):
        trials, marker = without_marker(trials, platform.robot, target.arena, seed)
    parts = with_marker(fit.parts(trials, effort), marker)
    return Calibration(
        kind="all",
        robot=robot if isinstance(robot, str) else platform.robot.name,
        target=target.name,
        label=target.label,
        observe=observe,
        trials=len(carried_out),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        arena=target.arena.name,
        seed=seed,
        software=f"realitygap {__version__}",
        method=parts.method,
        fitted=parts.fitted,
        numbers=dict(parts.numbers),
        draws={name: tuple(np.asarray(value).tolist()) for name, value in parts.draws.items()},
        step_s=step_of(trials) if trials else 0.0,
        misspecified=parts.misspecified,
        misspecification_p=parts.misspecification_p,
        notes=(*parts.notes, left_out) if left_out else parts.notes,
        evidence=parts.evidence,
        verdict=parts.verdict,
        reasons=parts.reasons,
    )


def all_plans(arena: Arena, robot: RobotModel, budget: int = ALL_TRIALS, seed: int = 0) -> list[TrialPlan]:
    """Return the trials of a calibration of everything: excitation and random controllers in turn."""
    rng = np.random.default_rng([seed, 1])
    given = excitation(arena, robot.radius, (budget + 1) // 2, STEPS, rng)
    driven = [
        TrialPlan(genome=genome, steps=STEPS)
        for genome in random_controllers(budget // 2, int(rng.integers(2**31)))
    ]
    plans = [plan for k in range(len(given)) for plan in (given[k], *driven[k : k + 1])]
    return [TrialPlan(**{**vars(plan), "number": k}) for k, plan in enumerate(plans)]


def fit_everything(
    trials: Sequence[TrialRecord],
    robot: RobotModel,
    arena: Arena,
    seed: int,
) -> Fit:
    """Return the fit of all parameters to trials that were recorded; arguments as in `calibrate_all`.

    Raises:
        ValueError: Trials with commands of several lengths of time.
    """
    platform = SimPlatform(robot=robot, **({"step_s": step_of(trials)} if trials else {}))
    return _Fitter(platform, arena, seed, lambda _: None, None).parts(trials, "full")


class _Fitter:
    """A robot in an arena, ready to be fitted."""

    def __init__(
        self, platform: SimPlatform, arena: Arena, seed: int, tell: Callable[[str], None], threads: int | None
    ) -> None:
        self.robot = platform.robot
        self.arena = arena
        self.seed = seed
        self.tell = tell
        self.prior = scribbler_prior(self.robot)
        self.ensemble = SimEnsemble(
            platform, arena, ranges=ranges_of(self.prior, self.robot), threads=threads
        )

        self.simulate = partial(simulate_evidence, self.ensemble)

    def evidence(self, trials: Sequence[TrialRecord]) -> list[Evidence]:
        return evidence_in(self.ensemble, trials)

    def posterior(self, trials: Sequence[TrialRecord], effort: Effort) -> Posterior:
        """Return the part of the prior that remains."""
        return self._posteriors(trials, effort)[0]

    def _posteriors(
        self, trials: Sequence[TrialRecord], effort: Effort
    ) -> tuple[Posterior, Posterior | None]:
        """Return the part of the prior that remains, and with poses, the part of it that single commands leave.

        What remains is three parts of a fit whose minimum is sharp, and one part that of whole trials by simulation
        alone: where `sim` cannot make both, the first knows how the robot moves and the second what comes of it. With
        poses, the first is that of single commands. Without poses, it is that of whole trials with the same commands.
        """
        usable = [trial for trial in trials if len(trial.commands) >= LEAST_STEPS]
        if not usable:
            return self._posterior_of_trials(trials, effort), None
        is_seen = all(trial.observe == "track" for trial in usable)
        if is_seen:
            sharp = fit_from_poses(
                usable, self.ensemble, self.prior, self.robot, self.arena, seed=self.seed, tell=self.tell
            )
            blind = [trial.seen_as("cells") for trial in usable]
            whole = self._posterior_of_trials(blind, effort)
        else:
            whole = self._posterior_of_trials(trials, effort)
            sharp = fit_from_commands(
                usable,
                self.ensemble,
                self.prior,
                self.robot,
                self.arena,
                whole,
                seed=self.seed,
                effort=effort,
            )
            self.tell(f"commands: {sum(len(trial.commands) for trial in usable)}, given again")
        return mixed(sharp, whole, self.prior, share=OF_COMMANDS), sharp if is_seen else None

    def _posterior_of_trials(self, trials: Sequence[TrialRecord], effort: Effort) -> Posterior:
        return fit_all(
            self.evidence(trials), self.simulate, self.prior, self.robot,
            seed=self.seed, effort=effort, tell=self.tell,
        )  # fmt: skip

    def numbers(self, values: Mapping[str, Floats]) -> dict[str, Floats]:
        return numbers_of(self.prior, values, self.robot)

    def parts(self, trials: Sequence[TrialRecord], effort: Effort) -> Fit:
        """Return all that the trials tell."""
        if not self.evidence(trials):
            return self._as_it_is()
        posterior, of_commands = self._posteriors(trials, effort)
        numbers, draws = self.robots(posterior)
        patterns = [] if of_commands is None else self._patterns(trials, of_commands)
        found = misfits(self.evidence(trials), self.simulate, draws, key=self.seed)
        fitted = tuple(_fitted(parameter, posterior) for parameter in self.prior)
        parts = Fit(
            fitted=fitted,
            numbers=numbers,
            draws=draws,
            method=METHOD,
            notes=(
                *_bound_by_prior(fitted),
                *(_said_of(misfit) for misfit in found),
                *_patterns_in_words(patterns),
            ),
            misspecified=any(misfit.is_too_large for misfit in found)
            or any(pattern.is_too_large for pattern in patterns),
            misspecification_p=_smallest_p(found, patterns),
            evidence=_evidence_of(found, patterns),
        )
        return compare_on_trials(
            parts,
            trials,
            lambda some: self.robots(self.posterior(some, "least")),
            self.ensemble,
            seed=self.seed,
        )

    def _patterns(self, trials: Sequence[TrialRecord], posterior: Posterior) -> list[Pattern]:
        usable = [trial for trial in trials if len(trial.commands) >= LEAST_STEPS]
        numbers = self.numbers(posterior.values)
        return residual_patterns(
            usable, self.ensemble, self.robot, self.arena, numbers, key=self.seed + len(usable)
        )

    def robots(self, posterior: Posterior) -> tuple[dict[str, float], dict[str, Floats]]:
        """Return the robot's numbers at the median of a posterior, and in each of its draws."""
        middle = {name: np.median(value, keepdims=True) for name, value in posterior.values.items()}
        estimate = {name: float(value[0]) for name, value in self.numbers(middle).items()}
        return estimate, self.numbers(posterior.values)

    def chosen(self, posterior: Posterior, n: int, number: int) -> list[TrialPlan]:
        """Return the n trials that tell most of how controllers do that were not tried."""
        rng = np.random.default_rng([self.seed, 2])
        given = excitation(self.arena, self.robot.radius, N_CANDIDATES // 2, STEPS, rng)
        controllers = random_controllers(N_CANDIDATES, int(rng.integers(2**31)))
        driven = [TrialPlan(genome=genome, steps=STEPS) for genome in controllers[: N_CANDIDATES // 2]]
        places = posterior.places[:N_ASKED]
        numbers = self.numbers(values_of(self.prior, places))
        informations = []
        for k, plan in enumerate([*given, *driven]):
            (one,) = self._unseen(plan)
            vectors = self.simulate(one, numbers, self.seed + k)
            informations.append(information_of(places, vectors, one.finest))
        starts = np.tile(self.arena.start, (N_CANDIDATES // 2, 1))
        held_out = controllers[N_CANDIDATES // 2 :]
        goal = self.ensemble.drive(held_out, starts, STEPS, numbers, self.seed, keep=()).coverage
        which = next_trials(places, informations, n, goal)
        plans = [[*given, *driven][k] for k in which]
        return [TrialPlan(**{**vars(plan), "number": number + k}) for k, plan in enumerate(plans)]

    def _unseen(self, plan: TrialPlan) -> list[Evidence]:
        """Predict the information in a trial that was not run."""
        n, s = plan.steps, len(self.robot.range)
        commands = plan.commands if plan.genome is None else np.zeros((n, 2))
        start = plan.start or self.arena.start
        x, y, heading = start
        trial = TrialRecord((x, y, heading), 0.0, commands, np.zeros((n, s)), np.zeros(n, np.bool_), ())
        return evidence_of([trial], [plan.genome], self.robot, self.arena)

    def _as_it_is(self) -> Fit:
        """Return the calibration without trials: the robot's own numbers."""
        plain = self.robot.centers()
        numbers = {e.number: plain[e.number] for parameter in self.prior for e in parameter.expand}
        return Fit(
            fitted=(),
            numbers=numbers,
            draws={name: (value,) for name, value in numbers.items()},
            method="None: no trials.",
            notes=("No trial was observed: these are the robot file's numbers.",),
        )


def _fitted(parameter: Parameter, posterior: Posterior) -> Fitted:
    draws = posterior.values[parameter.name]
    low, middle, high = np.quantile(draws, [0.05, 0.5, 0.95])
    spread = float(parameter.scale(draws).std()) / parameter.width
    identified = is_identified(spread, 1.0 / np.sqrt(12.0))
    return Fitted(
        name=parameter.name,
        estimate=float(middle),
        low=float(low),
        high=float(high),
        prior_low=parameter.prior.lowest,
        prior_high=parameter.prior.highest,
        identified=identified,
        unit=parameter.unit,
        advice="" if identified else f"To identify it, record {parameter.advice}.",
    )


def _bound_by_prior(fitted: Sequence[Fitted]) -> tuple[str, ...]:
    """Return a note on the parameters of motion and contact that the prior limits; none if there are none.

    Noise is left out: a robot without any is at the lower end.
    """
    bound = [each for each in fitted if each.is_bound and each.name in (*MOTION, *CONTACT)]
    if not bound:
        return ()
    names = ", ".join(
        f"{each.name} ({significant(each.prior_low, 3)} to {significant(each.prior_high, 3)} {each.unit}".rstrip()
        + ")"
        for each in bound
    )
    return (
        f"Intervals that reach an end of their prior: {names}. The prior is around the robot file's numbers and may "
        "not include this robot. Start from a robot model with other numbers (--base FILE).",
    )


def _said_of(misfit: Misfit) -> str:
    most = f"expected at most {misfit.tolerated:.0%}"
    return f"{misfit.kind}: {misfit.share:.0%} of its variance is neither predicted nor chance, {most}."


def _patterns_in_words(patterns: Sequence[Pattern]) -> list[str]:
    """Return a note on the largest pattern of each kind that is too large, or that there is none.

    Without poses, there are no patterns and no notes. The other patterns are mostly shadows of the largest: a robot has
    most of its headings in some part of the arena.
    """
    largest: dict[str, Pattern] = {}
    for pattern in patterns:
        if pattern.is_too_large:
            largest.setdefault(pattern.kind, pattern)
    if patterns and not largest:
        return [
            "What the fit leaves goes with no time, trial, heading, place, command, or stall by more than expected."
        ]
    return [
        f"{pattern.message} {_percent(pattern.share)} of the variance of {pattern.kind} goes with {pattern.goes_with}, "
        f"expected at most {_percent(pattern.tolerated)}."
        for pattern in largest.values()
    ]


def _percent(share: float) -> str:
    return f"{100 * share:.2g}%"


def _smallest_p(found: Sequence[Misfit], patterns: Sequence[Pattern]) -> float:
    """Return the smallest p over kinds of observation, and of the strongest pattern, times their number."""
    values = [misfit.p for misfit in found]
    if patterns:
        values.append(min(pattern.p for pattern in patterns))
    return min(1.0, len(values) * min(values))


def _evidence_of(found: Sequence[Misfit], patterns: Sequence[Pattern]) -> dict[str, dict[str, float]]:
    shares = {"misfit": {misfit.kind: round(misfit.share, 4) for misfit in found}}
    if patterns:
        shares["patterns"] = {
            f"{pattern.kind} by {pattern.goes_with}": round(pattern.share, 6) for pattern in patterns
        }
    return shares

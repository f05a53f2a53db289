"""A gap: its plan in words, and its measurement, whose report grows with each round of trials.

`GapJob` is what pages see; `measure` runs in a process of its own.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

from realitygap._wording import duration, platform_in_words, with_interval
from realitygap.errors import RealityGapError, StudyError
from realitygap.gap import SHOWN
from realitygap.orders import CloseOrder, GapOrder, read_order
from realitygap.platforms import names_a_port, platform_of, split_spec
from realitygap.report import write_closed_gap, write_gap_report
from realitygap.robots import is_in_this_program
from realitygap.stats import Estimate, controllers_for_margin, detectable_difference, spread_of_differences
from realitygap.study import GapStudy, close_gap, gap_between
from realitygap.world import read_calibration

from ._channel import Channel, Pulses
from ._files import check_name, platform_in
from ._job import MeasuringJob, Pace
from ._messages import GapDone, GapMeasured, GapWork, Interrupted, Message, ScorePairs, TrialCount
from ._mistakes import Mistakes

ABOVE_THE_REPORT = ("rms", "level", "srcc", "noise_ceiling")
"""Measures that the page shows above the report."""
NOISE, SPREAD = 0.01535, 0.07753
"""Standard deviations of coverage in the pilot on sim, as `pilot_spreads` finds them: trials of one controller about
their mean, and true differences, for which a plan takes half the spread of controllers."""
_OF_TRIALS = ("sim", "target", "controllers", "task", "observe", "arena", "noise", "randomize", "seed")
"""Settings that trials depend on: with others, a gap is another one."""
STEPS = 100
"""Commands of a trial."""
PLACING_S = 20.0
"""Time to place a robot before a trial [s]."""


def plan_words(n: int, trials: int, target: str, margin: float | None = None) -> str:
    """Return how many trials on the target a measurement needs, and which differences it can detect.

    Args:
        n: Number of controllers, 2 or more.
        trials: Number of trials of each controller, 1 or more.
        target: Name of the target.
        margin: Margin of equivalence in coverage, if any.
    """
    total = n * trials
    seconds = trial_seconds(target)
    time = "" if seconds is None else f" (about {duration(total * seconds)})"
    least = detectable_difference(n, spread=SPREAD, noise=NOISE, trials=trials)
    words = (
        f"Needs {total:,} trials on the target{time}. With these, mean differences in coverage above {least:.2g} are "
        "detectable."
    )
    if margin is not None:
        needed = controllers_for_margin(margin, spread_of_differences(SPREAD, NOISE, trials))
        words += f" Equivalence within {margin:g} needs {'too many' if needed is None else f'{needed:,}'} controllers."
    return words


def trial_seconds(target: str) -> float | None:
    """Return the time of a trial on a robot [s]; None for a simulator, and for a target that cannot be timed."""
    if not names_a_port(target):
        return None
    try:
        command_s = float(platform_of(target).command_s)
    except RealityGapError:
        return None
    _, _, port = target.partition(":")
    if not is_in_this_program(port):
        return STEPS * command_s + PLACING_S
    speed = dict(parse_qsl(port.partition("?")[2])).get("speed", "1")
    try:
        return STEPS * command_s / float(speed)
    except (ValueError, ZeroDivisionError):
        return None


def gap_mistakes(root: Path, values: Mapping[str, Any], *, closes: bool = False) -> Mistakes:
    """Return what is wrong in the fields of a gap; a field that is missing is not checked."""
    mistakes = Mistakes()
    mistakes.in_order(GapOrder, values, root)
    if "name" in values:
        with mistakes.in_field("name"):
            check_name(values["name"])
            if not (closes or mistakes.problems):  # closing compares the orders of its folder
                _refuse_taken(root / "gaps" / f"{values['name']}.html", values)
    if "target" in values and "target" not in mistakes.problems and not values.get("witness"):
        with mistakes.in_field("target"):
            if platform_in(root, values["target"]).needs_person:
                raise StudyError(
                    "In the lab, a gap needs a target without an operator. For an emulator in another program, "
                    "enter its witness. For a robot, use the command: realitygap gap"
                )
    return mistakes


def _refuse_taken(page: Path, values: Mapping[str, Any]) -> None:
    """Refuse a name if its report is about another gap, or about more trials.

    Raises:
        StudyError: It is.
    """
    if not page.exists():
        return
    try:
        before = read_order(page)
    except StudyError:
        before = None
    if not isinstance(before, GapOrder):
        raise StudyError(f"There is another report {page.stem}. Choose another name.")
    other = [
        field.face.label
        for field in GapOrder.fields()
        if field.name in _OF_TRIALS and values.get(field.name, field.default) != getattr(before, field.name)
    ]
    if other:
        raise StudyError(f"The gap {page.stem} has other settings ({', '.join(other)}). Choose another name.")
    if any(values.get(name, 0) < getattr(before, name) for name in ("n_controllers", "trials")):
        raise StudyError(
            f"The gap {page.stem} has {before.n_controllers:,} controllers with {before.trials:,} trials each. Enter "
            "at least as many to continue it, or choose another name."
        )


def free_name(root: Path, sim: str, target: str) -> str:
    """Return a name for a gap of two platforms that no file has, such as sim-worn-1."""
    parts = [split_spec(spec) for spec in (sim, target)]
    words = [
        Path(rest).stem if rest and not re.match("/|.*://", rest) else platform for platform, rest in parts
    ]
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", "-".join(words)).strip("-._")[:60] or "gap"
    folder = root / "gaps"
    taken = {path.stem for path in folder.iterdir()} if folder.is_dir() else set()
    numbered = (f"{name}-{n}" for n in itertools.count(2))
    return next(free for free in itertools.chain([name], numbered) if free not in taken)


class GapJob(MeasuringJob):
    """A gap at work.

    Attributes:
        name: Name of its files.
        closes: True if it calibrates, and measures again.
        order: The order.
        platform: The target.
        n_trials: Number of trials on each platform.
        trials: Number of trials that are done, by platform; also those of a calibration.
        totals: Number of trials that are needed, in the same way.
        is_complete: Whether all trials are done.
        verdict: Verdict of the last report; empty before the first one.
        measures: Name and value of each measure of the last report.
        intervals: Trials of each controller, and the RMS gap with its interval, of each report that has one.
        pairs: Scores of each controller on both sides, as `pairs_of` returns them; None before the first report.
        before: The same before a calibration; None if the gap is not closed.
        n_reports: Number of reports so far.
    """

    def __init__(
        self, order: GapOrder, page: Path, root: Path, changed: Callable[[], None], *, closes: bool = False
    ) -> None:
        self.name = page.stem
        self.closes = closes
        self.order = order
        self.n_trials = order.n_trials
        self.trials: dict[str, int] = {}
        self.totals: dict[str, int] = {}
        self._pace = Pace()
        self.is_complete = self._is_calibrated = False
        self.verdict = ""
        self.measures: list[tuple[str, str]] = []
        self.intervals: list[tuple[int, float, float, float]] = []
        self.pairs: ScorePairs | None = None
        self.before: ScorePairs | None = None
        self.n_reports = 0
        super().__init__(GapWork(order.message(), str(page), closes), order.target, root, changed)

    @property
    def can_close(self) -> bool:
        """True if a calibration may close the gap that was measured."""
        return self.is_complete and self.order.can_close

    @property
    def can_explain(self) -> bool:
        """True if the parts of a calibrated simulator may explain the gap that was measured."""
        order = self.order
        is_plain = order.trials > 1 and not (order.why or order.noise or order.lock or order.blind)
        return self._is_calibrated and is_plain and order.task in (None, "coverage")

    @property
    def has_met(self) -> bool:
        """True if a robot has driven."""
        return bool(self.trials) and bool(self.port)

    @property
    def progress(self) -> str:
        """Progress in words."""
        if self.outcome is not None:
            return self.outcome
        if not self.trials:
            return "Starting…"
        if self.closes:
            return f"{self._phase}{self._pace.words}"
        done = ", ".join(f"{name} {n:,}" for name, n in self.trials.items())
        return f"{done} of {self.n_trials:,} trials{self._pace.words}"

    @property
    def share(self) -> float:
        """Share of the trials that are done, 0 to 1; if it closes a gap, of the present phase."""
        done, total = sum(self.trials.values()), 2 * self.n_trials
        if self.closes and self.trials:
            name = next(reversed(self.trials))
            done, total = self.trials[name], self.totals[name]
        return min(done / max(total, 1), 1.0)

    @property
    def _phase(self) -> str:
        """The present phase of closing a gap, with its trials."""
        name = next(reversed(self.trials))
        action, on, spec = name.rpartition(" on ")  # such as: calibrating on jyro
        return f"{action}{on}{platform_in_words(spec, '')}: {self.trials[name]:,} of {self.totals[name]:,} trials"

    @property
    def robot_action(self) -> str:
        """Sentence that states that a robot is in use."""
        return "The robot is driving trials of a gap." if self.has_robot else ""

    @property
    def _done_words(self) -> str:
        if self.closes and self.trials:
            return f"{self._phase}. They are saved."
        n_done = next(iter(self.trials.values()), 0)  # the target is the first that is told of
        return f"{n_done:,} of {self.n_trials:,} trials on the target. They are saved."

    def _take(self, message: Message) -> None:
        match message:
            case TrialCount():
                known = self.trials.get(message.name, 0)
                self.trials[message.name] = max(known, message.done)  # each round simulates from the start
                self.totals[message.name] = message.total
                if self.closes and known == 0:
                    self._pace = Pace()  # trials of another phase take another time
                self._pace.note(self.share)
            case GapMeasured():
                self.verdict, self.measures = message.verdict, message.measures
                self.pairs, self.before = message.pairs, message.before
                if message.rms is not None:
                    self.intervals = [*self.intervals, (message.trials, *message.rms)]
                self.n_reports += 1
            case GapDone():
                self.is_complete, self._is_calibrated = True, message.is_calibrated
                self._conclude("Complete.")
            case Interrupted():
                self._conclude(f"Stopped after {self._done_words}")
            case _:
                super()._take(message)


# in a process


def measure(channel: Channel, work: GapWork) -> None:
    """Measure repeatedly with more trials of each controller. Trials of the target are kept, and never driven again."""
    order, page, pulses = GapOrder(**work.order), Path(work.page), Pulses(channel)

    def tell(name: str, done: int, total: int) -> None:
        channel.report(TrialCount(name, done, total), name, is_last=done == total)

    if work.closes:
        closing = order.to_order(CloseOrder, out=page.with_suffix(""))
        closed = close_gap(closing, pulse=pulses.tell, tell=tell)
        write_closed_gap(closed, page)
        pairs, before = pairs_of(closed.after.study), pairs_of(closed.before.study)
        channel.say(
            GapMeasured(order.trials, closed.verdict, _titled(closed.main_measures), None, pairs, before)
        )
        channel.say(GapDone())
        return
    # a locked design has one number of trials, and an explanation needs them all
    is_once = order.lock or order.blind or order.why
    for trials in (order.trials,) if is_once else rounds(order.trials):
        gap = gap_between(order.model_copy(update={"trials": trials}), pulse=pulses.tell, tell=tell)
        write_gap_report(gap, page)
        channel.say(_measured(gap.study, trials))
    is_calibrated = read_calibration(split_spec(order.sim)[1]) is not None
    channel.say(GapDone(is_calibrated))


def _titled(measures: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return measures with the names, and in the order, of the page of a gap; others come last."""
    titles = [shown.title for shown in SHOWN]
    named = [(name[:1].upper() + name[1:], words) for name, words in measures]
    return sorted(named, key=lambda row: titles.index(row[0]) if row[0] in titles else len(titles))


def _measured(study: GapStudy, trials: int) -> GapMeasured:
    """Return the verdict and the measures of a gap, as its page shows them."""
    result = study.result
    measures = [
        (shown.title, _words(getattr(result, shown.name)))
        for shown in SHOWN
        if shown.name in ABOVE_THE_REPORT
    ]
    rms = result.rms
    interval = None
    if rms.value is not None and rms.low is not None and rms.high is not None:
        interval = (rms.value, rms.low, rms.high)
    return GapMeasured(trials, result.verdict, measures, interval, pairs_of(study))


def pairs_of(gap: GapStudy) -> ScorePairs:
    """Return the mean score of each controller on both sides, with its interval of 95 %."""
    sides = (gap.source, gap.target)
    ends = [side.intervals() for side in sides]
    return {
        "sides": [f"{side.in_words} ({side.label})" for side in sides],
        "score": gap.result.score,
        "points": [
            {
                "name": each.name,
                "isChampion": each.kind == "champion",
                "means": [float(side.means[k]) for side in sides],
                "ends": [[float(low[k]), float(high[k])] for low, high in ends],
            }
            for k, each in enumerate(gap.controllers)
        ],
    }


def _words(estimate: Estimate) -> str:
    """Return a measure with its interval, or the reason for its absence."""
    return estimate.refused or "not measured" if estimate.value is None else with_interval(estimate)


def rounds(trials: int) -> list[int]:
    """Return the numbers of trials of each controller after which there is a report: 2, 4, 8, and so on, and all."""
    steps = [2**k for k in range(1, 13) if 2**k < trials]
    return [*steps, trials]

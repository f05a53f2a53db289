"""A gap that is measured in its own process; the report grows with each round of trials."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any, Self

from realitygap._wording import with_interval
from realitygap.gap import SHOWN
from realitygap.orders import GapOrder
from realitygap.report import write_gap_report
from realitygap.stats import Estimate
from realitygap.study import GapStudy, gap_between

from ._channel import Channel, Message, Pulse

_TOLD_S = 0.2
"""Time between two messages on the progress [s]."""
ABOVE_THE_REPORT = ("rms", "level", "srcc", "noise_ceiling")
"""Measures that the page shows above the report."""


def work(channel: Channel, order: Message) -> None:
    """Measure a gap.

    Args:
        channel: To the server.
        order: `order`, the message of a `GapOrder`; and `page`, the file of the report.
    """
    _measure(channel, GapOrder(**order["order"]), Path(order["page"]))
    channel.say("done")


def _measure(channel: Channel, order: GapOrder, page: Path) -> None:
    """Measure repeatedly with more trials of each controller. Trials of the target are kept, and never driven again."""
    pulse = Pulse(channel)
    with _Telling(channel) as told:
        for trials in rounds(order.trials):
            part = order.model_copy(update={"trials": trials})
            gap = gap_between(part, pulse=pulse.tell, tell=told.show)
            write_gap_report(gap, page)
            channel.say("measured", trials=trials, **_measured(gap.study))


def _measured(study: GapStudy) -> dict[str, Any]:
    """Return the verdict and the measures of a gap, as its page shows them."""
    result = study.result
    measures = [
        (shown.title, _words(getattr(result, shown.name)))
        for shown in SHOWN
        if shown.name in ABOVE_THE_REPORT
    ]
    rms = None if result.rms.low is None else [result.rms.value, result.rms.low, result.rms.high]
    return {"verdict": result.verdict, "measures": measures, "rms": rms, "pairs": pairs_of(study)}


def pairs_of(gap: GapStudy) -> dict[str, Any]:
    """Return the mean score of each controller on both sides, with its interval of 95 %."""
    sides = (gap.source, gap.target)
    ends = [side.intervals() for side in sides]
    return {
        "sides": [f"{side.name} ({side.label})" for side in sides],
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


class _Telling:
    """Reports how many trials are done, not too often; the last number of several is never left out.

    It is used in a `with`: if the gap fails, the trials that were saved are reported before the failure, so that the
    page can offer to resume.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._lock = threading.Lock()
        self._waiting: dict[str, tuple[int, int]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._report()

    def show(self, name: str, done: int, total: int) -> None:
        """Report the number of trials on a platform."""
        with self._lock:
            is_due = not self._waiting
            self._waiting[name] = done, total
        if is_due:
            timer = threading.Timer(_TOLD_S, self._report)
            timer.daemon = True
            timer.start()
        if done == total:
            self._report()

    def _report(self) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, {}
        for name, (done, total) in waiting.items():
            self._channel.say("trials", name=name, done=done, total=total)

"""A gap that is measured or planned in its own process; the report grows with each round of trials."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from realitygap.gap import Estimate
from realitygap.report import write_gap_report
from realitygap.study import gap_between, plan_gap

from ._channel import Channel, Message

_TOLD_S = 0.2
"""Time between two messages on the progress [s]."""
MEASURES = {
    "rms": "RMS gap",
    "level": "Bias",
    "srcc": "Rank correlation",
    "noise_ceiling": "Ceiling of the rank correlation",
}
"""Measures that the page shows above the report."""


def work(channel: Channel, order: Message) -> None:
    """Measure, or plan.

    Args:
        channel: To the server.
        order: `plan`, the arguments of `plan_gap`; or `measure`, those of `gap_between`, with `page`, the file of the
            report, and `kept`, that of the target's trials.
    """
    if order.get("plan"):
        _plan(channel, dict(order["plan"]))
    else:
        _measure(channel, dict(order["measure"]), Path(order["page"]), Path(order["kept"]))
    channel.say("done")


def _plan(channel: Channel, values: dict[str, Any]) -> None:
    found = plan_gap(**values)
    rows = [{**vars(row), "on_target": row.on_target} for row in found.needed]
    channel.say(
        "plan", rows=rows, origin=found.spreads.origin, spread=found.spread, noise=found.spreads.noise
    )


def _measure(channel: Channel, values: dict[str, Any], page: Path, kept: Path) -> None:
    """Again and again with more trials of each controller: those of the target are kept and not driven again."""
    told = _Telling(channel)
    for trials in rounds(int(values.pop("trials"))):
        found = gap_between(**values, trials=trials, results=kept, tell=told.show)
        write_gap_report(found, page)
        result = found.study.result
        measures = [(title, _words(getattr(result, name))) for name, title in MEASURES.items()]
        channel.say("measured", trials=trials, verdict=result.verdict, measures=measures)


def _words(estimate: Estimate) -> str:
    """A measure with its interval, or why there is none."""
    if estimate.estimate is None:
        return estimate.refused or "not measured"
    text = f"{estimate.estimate:.3f}"
    return text if estimate.low is None else f"{text} [{estimate.low:.3f}, {estimate.high:.3f}]"


def rounds(trials: int) -> list[int]:
    """Trials of each controller after which there is a report: 2, 4, 8 and so on, and all."""
    steps = [2**k for k in range(1, 13) if 2**k < trials]
    return [*steps, trials]


class _Telling:
    """Tells how many trials are done, not too often."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._last = 0.0

    def show(self, name: str, done: int, total: int) -> None:
        """Report the number of trials on a platform."""
        now = time.monotonic()
        if now - self._last > _TOLD_S or done == total:
            self._last = now
            self._channel.say("trials", name=name, done=done, total=total)

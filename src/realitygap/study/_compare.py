"""The gap in a table of scores, as `realitygap compare` measures it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import realitygap
from realitygap._limits import is_file
from realitygap.errors import TableError, did_you_mean
from realitygap.gap import Comparison, ScoreGap
from realitygap.gap import compare_scores as compare_rows
from realitygap.logs import ScoreRow, read_scores
from realitygap.orders import CompareOrder, takes_order
from realitygap.records import is_observations

_SIM, _REAL = "sim", "real"


@dataclass(frozen=True)
class ComparedScores:
    """The gap between two platforms in a table of scores.

    Attributes:
        gaps: The gap of each task; one without tasks.
        order: The order.
    """

    gaps: tuple[ScoreGap, ...]
    order: CompareOrder

    def __repr__(self) -> str:
        first = self.gaps[0].result
        tasks = (
            f", {len(self.gaps)} tasks" if len(self.gaps) > 1 else f": level {first.level}, n={first.level.n}"
        )
        return f"{type(self).__name__}({first.source} → {first.target}{tasks})"

    @property
    def title(self) -> str:
        """Both platforms in words."""
        return self.gaps[0].result.title

    @property
    def verdict(self) -> str:
        """The finding of each task, as sentences."""
        return " ".join(
            f"{gap.task}: {gap.result.verdict}" if gap.task else gap.result.verdict for gap in self.gaps
        )

    def plot(self) -> realitygap.report.Drawing:
        """Draw the mean score of each controller of the first task on both platforms. On the line there is no gap."""
        return realitygap.report.draw_gap_pairs(self.gaps[0])

    def report(self, path: str | Path = "gap.html") -> Path:
        """Write the page and return its path, as `realitygap.report.write_compared_scores`."""
        return realitygap.report.write_compared_scores(self, path)

    @property
    def common_reasons(self) -> list[str]:
        """Reasons for missing numbers that are the same for all tasks."""
        first, *others = (gap.reasons for gap in self.gaps)
        return [reason for reason in first if all(reason in other for other in others)]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: the gap of each task."""
        return {"tasks": [gap.to_dict() for gap in self.gaps]}


@takes_order(CompareOrder)
def compare_scores(order: CompareOrder) -> ComparedScores:
    """Measure the gap between two platforms in a table of scores, as `realitygap compare`.

    Raises:
        TableError: A table cannot be read, or does not support a comparison. The message states the reason.
    """
    rows = [row for table in order.table for row in _read(table, order)]
    if order.task is not None:
        tasks = {row.task for row in rows}
        if order.task not in tasks:
            known = did_you_mean(order.task, tasks - {""}) or "The table has no column task."
            raise TableError(f"There is no task {order.task!r}. {known}")
        rows = [row for row in rows if row.task in (order.task, "")]
    sim, real = platforms_in(rows, order.sim, order.real)
    how = Comparison(
        sim,
        real,
        labels=(order.sim_label, order.real_label),
        score_range=order.ends,
        score=order.score or ("success" if order.binary else "score"),
        margin=order.margin,
        shared=order.shared,
        ties=order.ties,
        is_binary=order.binary,
        uses_blocks=not order.unpaired,
        seed=order.seed,
    )
    return ComparedScores(tuple(compare_rows(rows, how)), order)


def _read(table: str, order: CompareOrder) -> list[ScoreRow]:
    platform, equals, path = table.partition("=")
    if not equals or is_file(table):
        platform, path = "", table
    if is_observations(path):
        raise TableError(
            f"{path} has trials of one platform. Expected a table of scores of two. Compare its trials with a "
            f"simulator: realitygap gap sim recorded:{path}. Or print the comparison that it plans: realitygap trials "
            f"advise {path}"
        )
    return read_scores(
        Path(path), platform=platform, controller=order.controller or "", score=order.score or ""
    )


def platforms_in(
    rows: Sequence[ScoreRow], sim: str | None, real: str | None, words: tuple[str, str] = ("--sim", "--real")
) -> tuple[str, str]:
    """Return the platform that predicts and the one that is predicted.

    Args:
        rows: Rows of the table.
        sim, real: Their names; None for the names `sim` and `real`, or the other one of two.
        words: Options that name them.

    Raises:
        TableError: The table does not have them, or it is open which ones they are.
    """
    names = list(dict.fromkeys(row.platform for row in rows))
    if len(names) < 2:
        raise TableError(
            f"All scores are of the platform {names[0]}, expected two. Add those of the other one, in this table or in "
            "another: NAME=FILE"
        )
    chosen = {"sim": sim, "real": real}
    for word, name in zip(words, chosen.values(), strict=True):
        if name is not None and name not in names:
            raise TableError(f"There is no platform {name!r} ({word}). {did_you_mean(name, names)}")
    for option, other, default in (("sim", "real", _SIM), ("real", "sim", _REAL)):
        if chosen[option] is None and default in names and chosen[other] != default:
            chosen[option] = default
    for option, other in (("sim", "real"), ("real", "sim")):
        if chosen[option] is None and chosen[other] is not None and len(names) == 2:
            chosen[option] = next(name for name in names if name != chosen[other])
    sim, real = chosen["sim"], chosen["real"]
    if sim is None or real is None:
        raise TableError(
            f"The platforms are {', '.join(names)}. Name the one that predicts ({words[0]}) and the one that is "
            f"predicted ({words[1]})."
        )
    return sim, real

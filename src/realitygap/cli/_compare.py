"""`realitygap compare`: the gap in a table of scores."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import p_equation, with_interval
from realitygap.orders import CompareOrder

from ._gap import print_row
from ._options import Json, print_json
from ._order import command_of

if TYPE_CHECKING:
    from realitygap.gap import ScoreGap


LEAST_WITH_INTERVALS = 5
"""With fewer controllers, each controller is printed."""


@command_of(CompareOrder)
def compare(
    order: CompareOrder,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Page to write, with figures and tables (.html).")
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="Print all measures.")] = False,
    as_json: Json = False,
) -> None:
    """Measure the gap of a table, and print it."""
    if report is not None:
        realitygap.report.refuse_gap_page(report)
    compared = realitygap.study.compare_scores(order)
    if report is not None:
        realitygap.report.write_compared_scores(compared, report)
        echo(f"Written: {report}", err=True)
    if as_json:
        print_json(compared.to_dict() | {"order": order.record(), "report": report})
        return
    common = [] if full or len(compared.gaps) == 1 else compared.common_reasons
    for gap in compared.gaps:
        _print(gap, common, full=full)
        if len(compared.gaps) > 1:
            echo("")
    for reason in common:
        echo(reason)


def _print_controllers(gap: ScoreGap) -> None:
    """Print the mean of each controller on both platforms, and the difference."""
    names = [controller.name for controller in gap.controllers]
    width = max(map(len, names))
    echo(f"  {'':{width}}  {gap.source.in_words[:20]:20}  {gap.target.in_words[:20]:20}  difference")
    rows = zip(names, gap.source.estimates, gap.target.estimates, gap.differences, strict=True)
    for name, sim, real, difference in rows:
        p = difference.more.get("p")
        more = "" if p is None else f"  {p_equation(p)}"
        means = f"{with_interval(sim):20}  {with_interval(real):20}"
        echo(f"  {name:{width}}  {means}  {with_interval(difference, signs=True)}{more}")


def _print(gap: ScoreGap, common: Collection[str], *, full: bool) -> None:
    """Print title, verdict, measures, labels, n, and reasons of missing numbers, except those of all tasks."""
    result = gap.result
    echo(f"Gap in {result.score}: {result.title}{f', task {gap.task}' if gap.task else ''}")
    echo(result.verdict)
    if full:
        for measure in realitygap.gap.SHOWN:
            if not measure.name.startswith("energy"):  # tables have no paths
                print_row(measure.row, getattr(result, measure.name))
    else:
        for title, words in gap.main_measures:
            echo(f"  {title:23}{words}")
    if full or gap.source.is_binary or result.level.n < LEAST_WITH_INTERVALS:
        _print_controllers(gap)
    labels = " and ".join(dict.fromkeys(result.labels))
    echo(f"{labels}, {result.basis}, 95 % intervals")
    for reason in gap.remarks if full else gap.reasons:
        if reason not in common:
            echo(reason)

"""`realitygap compare`: the gap in a table of scores."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.orders import CompareOrder

from ._gap import print_row
from ._options import Json, print_json
from ._order import command_of

if TYPE_CHECKING:
    from realitygap.gap import ScoreGap


@command_of(CompareOrder)
def compare(
    order: CompareOrder,
    full: Annotated[bool, typer.Option("--full", help="Print all measures.")] = False,
    as_json: Json = False,
) -> None:
    """Measure the gap of a table, and print it."""
    compared = realitygap.study.compare_scores(order)
    if as_json:
        print_json(compared.to_dict() | {"order": order.record()})
        return
    common = [] if full else compared.common_reasons
    for gap in compared.gaps:
        _print(gap, common, full=full)
    for reason in common:
        echo(reason)


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
    labels = " and ".join(dict.fromkeys(result.labels))
    echo(f"{labels}, {result.basis}, 95 % intervals")
    for reason in gap.remarks if full else gap.reasons:
        if reason not in common:
            echo(reason)
    if gap.task:
        echo("")

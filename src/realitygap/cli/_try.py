"""`realitygap try`: a genome from a file, driven on any platform."""

from __future__ import annotations

import statistics

import realitygap
from realitygap._terminal import echo
from realitygap.orders import TryOrder

from ._code import AllowPlatforms
from ._json import print_json
from ._observer import attending_observer
from ._options import Json
from ._order import command_of


@command_of(TryOrder)
def try_genome(
    order: TryOrder,
    allow_code: AllowPlatforms = False,
    as_json: Json = False,
) -> None:
    """Drive the trials, and print the coverage."""
    observer = attending_observer(order.on, order.witness)
    tried = realitygap.study.try_genome(order, observer=observer)
    coverage = tried.coverage
    mean = statistics.fmean(coverage)
    if as_json:
        about = {"target": tried.target, "label": tried.label, "n_cells": tried.n_cells}
        print_json(about | {"mean": mean, "coverage": coverage, "order": order.record()})
        return
    echo(
        f"{tried.target} ({tried.label}): {len(coverage)} trial{'s' if len(coverage) > 1 else ''}, mean coverage "
        f"{mean:.3f} of {tried.n_cells} cells: {' '.join(f'{value:.3f}' for value in coverage)}"
    )

"""`realitygap try` and `transfer`: controllers of simulation on a target."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING

import realitygap
from realitygap._terminal import echo
from realitygap._wording import number, with_interval
from realitygap.orders import TransferOrder, TryOrder

from ._code import AllowPlatforms
from ._designs import deviations_of, print_deviations
from ._observer import attending_observer
from ._options import Json, print_json
from ._order import command_of
from ._progress import resumable

if TYPE_CHECKING:
    from realitygap.study import TransferResult
    from realitygap.trials import PortObserver


@command_of(TryOrder)
def try_genome(order: TryOrder, allow_code: AllowPlatforms = False, as_json: Json = False) -> None:
    """Drive the trials, and print the coverage, or what is shown of two controllers."""
    observer = attending_observer(order.on, order.witness)
    if order.against is not None:
        _try_pairs(order, observer, as_json=as_json)
        return
    tried = realitygap.study.try_genome(order, observer=observer)
    coverage = tried.coverage
    mean = statistics.fmean(coverage)
    if as_json:
        about = {"target": tried.target, "label": tried.label, "n_cells": tried.n_cells}
        about |= deviations_of(order.out)
        print_json(about | {"mean": mean, "coverage": coverage, "order": order.record()})
        return
    echo(
        f"{tried.target} ({tried.label}): {len(coverage)} trial{'s' if len(coverage) > 1 else ''}, mean coverage "
        f"{mean:.3f} of {tried.n_cells} cells: {' '.join(f'{value:.3f}' for value in coverage)}"
    )
    print_deviations(order.out)


def _try_pairs(order: TryOrder, observer: PortObserver | None, *, as_json: bool) -> None:
    with resumable(order.out):
        tried = realitygap.study.try_pairs(
            order,
            observer=observer,
            tell=lambda advice: echo(advice.line, err=True),
            say=lambda text: echo(text, err=True),
        )
    if as_json:
        about = {"target": tried.target, "label": tried.label, "file": tried.file}
        design = {} if tried.design is None else {"design": tried.design.to_dict()}
        print_json(about | tried.advice.to_dict() | design | {"order": order.record()})
        return
    echo(f"{tried.target} ({tried.label}), {tried.advice.score}, in {tried.file}")
    for sentence in tried.advice.sentences:
        echo(sentence)
    if tried.design is not None:
        echo(tried.design.line)
        echo(f"SHA-256 of the locked design: {tried.design.design.sha256}")


@command_of(TransferOrder)
def transfer(order: TransferOrder, allow_code: AllowPlatforms = False, as_json: Json = False) -> None:
    """Run the transfer, and print the result."""
    with resumable("All trials are saved."):
        result = realitygap.study.run_transfer(
            order,
            observer=attending_observer(order.to, order.witness),
            allow_code=allow_code,
            tell=lambda text: echo(text, err=True),
        )
    folder = order.folder
    if as_json:
        about = {"score": result.score, "folder": folder, "champions_folder": folder / "champions"}
        about |= deviations_of(folder)
        print_json(result.to_dict() | about | {"order": order.record()})
        return
    _print(result)
    print_deviations(folder)
    echo(f"Results: {folder}   champions: {folder / 'champions'}")


def _print(result: TransferResult) -> None:
    echo(
        f"{result.study}, {result.condition}: from simulation (SIM) to {result.target} ({result.label}), "
        f"{result.replicates} replicate{'s' if result.replicates > 1 else ''}, {result.fresh_trials} fresh trials "
        f"each, {result.score}"
    )
    wide = max(16, *(len(row.strategy) for row in result.strategies))
    echo(f"{'strategy':{wide}}{'budget':>7}{'on the target':>24}{'regret':>24}{'in simulation':>15}")
    for row in result.strategies:
        quality, regret = map(with_interval, (row.quality, row.regret))
        echo(f"{row.strategy:{wide}}{row.budget:>7}{quality:>24}{regret:>24}{number(row.simulated):>15}")
    echo(f"Regret is to {result.best_in_words}.")
    if result.replicates == 1:
        echo("Intervals are over the fresh trials of one champion. To compare strategies, add --replicates.")
    elif len(result.strategies) > 1 and result.advice is not None:
        echo(f"Looks after each replicate: {result.advice.summary}")

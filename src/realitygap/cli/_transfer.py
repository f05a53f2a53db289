"""`realitygap transfer`: strategies that transfer controllers to a target."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import between
from realitygap.orders import TransferOrder

from ._code import AllowPlatforms
from ._json import print_json
from ._observer import attending_observer
from ._options import Json
from ._order import command_of

if TYPE_CHECKING:
    from realitygap.stats import Estimate
    from realitygap.study import TransferResult


@command_of(TransferOrder)
def transfer(
    order: TransferOrder,
    allow_code: AllowPlatforms = False,
    as_json: Json = False,
) -> None:
    """Run the transfer, and print the result."""
    try:
        result = realitygap.study.run_transfer(
            order,
            observer=attending_observer(order.to, order.witness),
            allow_code=allow_code,
            tell=lambda text: echo(text, err=True),
        )
    except KeyboardInterrupt:
        echo("Interrupted. All trials are saved. Run the same command to resume.", err=True)
        raise typer.Exit(130) from None
    folder = order.folder
    if as_json:
        about = {"score": result.score, "folder": folder, "champions_folder": folder / "champions"}
        print_json(result.to_dict() | about | {"order": order.record()})
        return
    _print(result)
    echo(f"Results: {folder}   champions: {folder / 'champions'}")


def _with_interval(estimate: Estimate) -> str:
    ends = "" if estimate.ends is None else f" ({between(estimate)})"
    return f"{estimate.value:.3f}{ends}"


def _print(result: TransferResult) -> None:
    echo(
        f"{result.study}, {result.condition}: from simulation (SIM) to {result.target} ({result.label}), "
        f"{result.replicates} replicate{'s' if result.replicates > 1 else ''}, {result.fresh_trials} fresh trials "
        f"each, {result.score}"
    )
    echo(f"{'strategy':16}{'budget':>7}{'on the target':>24}{'regret':>24}{'in simulation':>15}")
    for row in result.strategies:
        quality, regret = map(_with_interval, (row.quality, row.regret))
        simulated = "-" if row.simulated is None else f"{row.simulated:.3f}"
        echo(f"{row.strategy:16}{row.budget:>7}{quality:>24}{regret:>24}{simulated:>15}")
    echo(f"Regret is to {result.best_in_words}.")
    if result.replicates == 1:
        echo("Intervals are over the fresh trials of one champion. To compare strategies, add --replicates.")

"""A transfer as it is ordered: from a study to a platform, both by name."""

from __future__ import annotations

from collections.abc import Callable

from realitygap.orders import ORDER_FILE, TransferOrder, takes_order
from realitygap.platforms import open_target
from realitygap.records import write_whole
from realitygap.trials import PortObserver

from .result import TransferResult
from .strategies import choose_condition, strategy_names, transfer_to


@takes_order(TransferOrder)
def run_transfer(
    order: TransferOrder,
    *,
    observer: PortObserver | None = None,
    allow_code: bool = False,
    tell: Callable[[str], None] | None = None,
) -> TransferResult:
    """Compare strategies that transfer controllers, as `realitygap transfer`.

    The folder states the order in a file, from which `realitygap again` repeats the transfer.

    Args:
        observer: Observer of a robot without a witness: it places the robot and reports what it drew.
        allow_code: True to run the Python file of a task that the user has not allowed before.
        tell: Called with the progress in words.

    Raises:
        StudyError: There is no such study, condition, strategy, or platform, or the target shows too little.
        RealityGapError: The robot failed, or files cannot be read or written.
    """
    strategy_names(order.strategy or "all")
    arena = choose_condition(order.study, order.condition, order.seed).arena.arena()
    with open_target(
        order.to,
        arena,
        witness=order.witness,
        observer=observer,
        processes=order.processes,
        key=order.seed,
    ) as target:
        result = transfer_to(target, order, order.study, allow_code=allow_code, tell=tell)
    write_whole(order.folder / ORDER_FILE, order.to_toml().encode(), within=order.folder)
    return result

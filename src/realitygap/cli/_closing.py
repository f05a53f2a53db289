"""`realitygap closing-the-gap`: the study that measures and shrinks the gap to many robots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.orders import ClosingOrder

from ._json import print_json
from ._options import Json
from ._order import command_of
from ._results import show_page

if TYPE_CHECKING:
    from realitygap.study import ClosingProgress, ClosingSummary


@command_of(ClosingOrder)
def closing(
    order: ClosingOrder,
    as_json: Json = False,
    open_page: Annotated[
        bool, typer.Option("--open", help="When done, show the page in the browser.")
    ] = False,
) -> None:
    """Run the study, or what is missing of it, print its goals, and write its page."""
    told = [0.0, -1]

    def tell(progress: ClosingProgress) -> None:
        # a line each minute, or where much is done
        if progress.n_done != told[1] and (progress.seconds - told[0] >= 60 or told[1] < 0):
            told[:] = [progress.seconds, progress.n_done]
            echo(
                f"{progress.n_done} of {progress.n_units} parts are done, after {progress.seconds / 60:.0f} minutes.",
                err=True,
            )

    try:
        summary = realitygap.study.closing_the_gap(order, tell=tell)
    except KeyboardInterrupt:
        echo("Interrupted. Finished parts are saved. Run the same command to resume.", err=True)
        raise typer.Exit(130) from None
    folder = order.folder
    page = realitygap.report.write_closing_page(summary, folder / "report.html")
    if as_json:
        print_json({**summary, "folder": folder, "report": page, "order": order.record()})
    else:
        _print(summary)
        echo(f"Results: {folder}   report: {page}")
    if open_page:
        show_page(page)


def _print(summary: ClosingSummary) -> None:
    of, label = len(summary["twins"]), summary["label"]
    if summary["plan"]["platforms"]:
        echo(f"{of} sitting{'s' * (of != 1)} ({label}), each with its own held-out controllers")
    else:
        echo(
            f"{of} twins ({label}), of which {summary['n_counted']} differ from the simulator (SIM) by more than three "
            "standard errors"
        )
    echo(f"{'goal':52}{'wanted':>16}{'figure':>9}{'95 % interval':>18}{'n':>9}  verdict")
    for name, wanted, figure, span, n, verdict in realitygap.report.goal_table(summary).rows:
        echo(f"{name:52}{wanted:>16}{figure:>9}{span:>18}{n:>9}  {verdict}")
    for sentence in realitygap.report.not_counted(summary):
        echo(sentence)
    if not summary["plan"]["platforms"]:
        echo(realitygap.report.SELECTION_NOTE)

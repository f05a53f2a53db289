"""`realitygap close`: measure a gap, calibrate, and measure it again."""

from __future__ import annotations

import shlex
from typing import Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import counted, trials_each
from realitygap.orders import CloseOrder

from ._code import AllowPlatforms
from ._options import Json, print_json
from ._order import command_of
from ._progress import TrialsBar
from ._results import show_page


@command_of(CloseOrder)
def close(
    order: CloseOrder,
    allow_code: AllowPlatforms = False,
    as_json: Json = False,
    open_page: Annotated[
        bool, typer.Option("--open", help="When done, show the page in the browser.")
    ] = False,
) -> None:
    """Measure, calibrate, measure again, print both gaps, and write the page."""
    folder = order.folder
    try:
        with TrialsBar(quiet=as_json) as bar:
            closed = realitygap.study.close_gap(order, allow_code=allow_code, tell=bar.show, say=bar.say)
    except KeyboardInterrupt:
        echo(f"Interrupted. Finished trials are in {folder}. Run the same command to resume.", err=True)
        raise typer.Exit(130) from None
    page = realitygap.report.write_closed_gap(closed, folder / "report.html")
    before, after = closed.before.study.result, closed.after.study.result
    if as_json:
        values: dict[str, Any] = {"before": before.to_dict(), "after": after.to_dict()}
        values |= {"change": closed.change.to_dict(), "verdict": closed.verdict}
        print_json(values | {"folder": folder, "report": page, "order": closed.order.record()})
        return
    echo(f"Gap in {after.score}: {closed.title}")
    echo(closed.verdict)
    for name, words in closed.main_measures:
        echo(f"  {name:20}{words}")
    labels = " and ".join(dict.fromkeys(after.labels))
    n = counted(after.level.n, "controller")
    echo(f"{labels}, {n}, {trials_each(after.trials)}, 95 % intervals")
    echo("The fit has seen none of these trials.")
    echo(f"Page: {page}. Calibrated simulator: sim:{shlex.quote(str(folder / 'fit.toml'))}")
    if open_page:
        show_page(page)

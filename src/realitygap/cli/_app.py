"""All commands together."""

from __future__ import annotations

from typing import Annotated

import typer

from realitygap._version import __version__

from ._audit import audit_results
from ._audit_distance import audit_distance
from ._bench import bench
from ._calibrate import calibrate
from ._emulate import emulate
from ._export import export
from ._gap import gap, plan
from ._lab import lab
from ._print_sheet import print_sheet
from ._results import digest, report
from ._robot import robot
from ._score import score
from ._show import show
from ._simulate import simulate
from ._study import new_study, run
from ._track import lens, print_tags, track
from ._transfer import transfer
from ._trials import trials
from ._try import try_genome
from ._twin import twin

app = typer.Typer(
    name="realitygap",
    help="Evolve robot controllers in simulation and on a real robot, measure the gap between the two honestly, "
    "and shrink it.",
    epilog="Example: realitygap run paper",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"realitygap {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    pass


app.command("run")(run)
app.command("new-study")(new_study)
app.command("report")(report)
app.command("show")(show)
app.command("export")(export)
app.command("lab")(lab)
app.command("digest")(digest)
app.command("audit-results")(audit_results)
app.command("audit-distance")(audit_distance)
app.command("calibrate")(calibrate)
app.command("simulate")(simulate)
app.command("emulate")(emulate)
app.command("bench")(bench)
app.add_typer(robot, name="robot")
app.add_typer(twin, name="twin")
app.command("trials")(trials)
app.command("track")(track)
app.command("print-tags")(print_tags)
app.command("lens")(lens)
app.command("print-sheet")(print_sheet)
app.command("score")(score)
app.command("gap")(gap)
app.command("plan")(plan)
app.command("transfer")(transfer)
app.command("try")(try_genome)

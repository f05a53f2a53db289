"""`realitygap closing-the-gap`: the study that measures and shrinks the gap to many robots."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError, did_you_mean

from ._browser import show_page
from ._json import print_json

if TYPE_CHECKING:
    from realitygap.study import ClosingPlan, ClosingProgress

CLOSING = "closing-the-gap"
"""Known without loading what carries it out."""


def closing(
    plan: Annotated[
        str,
        typer.Option(
            metavar="PLAN",
            help="Plan of the study. twins: MuJoCo twins of a Scribbler. fresh: other twins and "
            "controllers, without transfer. thymio: a Thymio in Enki and in Aseba's playground. "
            "playground: the same, with its infrared sensors.",
        ),
    ] = "twins",
    twins: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=900,
            help="Number of twins per family, or of sittings per robot. [default: from the plan]",
        ),
    ] = None,
    families: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Families of twins, or robots. [default: all in the plan]"),
    ] = None,
    budgets: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Calibration budgets, in trials. [default: 0,10,20,40]"),
    ] = None,
    observe: Annotated[
        str | None, typer.Option(metavar="LIST", help="Observation levels. [default: from the plan]")
    ] = None,
    small: Annotated[
        bool, typer.Option("--small", help="Run a small version, which takes minutes and shows no result.")
    ] = False,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the twins.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help=f"Folder for the results. [default: results/{CLOSING}, or results/{CLOSING}-PLAN]",
        ),
    ] = None,
    processes: Annotated[
        int | None,
        typer.Option(min=1, help="Number of twins to run in parallel. [default: all processors]"),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    open_page: Annotated[
        bool, typer.Option("--open", help="When done, show the page in the browser.")
    ] = False,
) -> None:
    """Measure and shrink the gap to many robots.

    The study calibrates to each twin of several families with a few trials, and transfers controllers to it. Twins need
    the extra 'twin'. With --plan thymio, the robot is a Thymio in simulators of other authors. You can interrupt the
    command at any time. Run the same command again to resume.

    Example: realitygap closing-the-gap --small

    Example: realitygap closing-the-gap --plan thymio --families enki

    In Python: realitygap.study.closing_the_gap("results/closing-the-gap")
    """
    chosen = _plan(
        plan, small=small, twins=twins, families=families, budgets=budgets, observe=observe, seed=seed
    )
    folder = CLOSING if plan == "twins" else f"{CLOSING}-{plan}"
    _run(chosen, out or Path("results") / folder, processes, as_json=as_json, open_page=open_page)


def _plan(
    name: str,
    *,
    small: bool,
    twins: int | None,
    families: str | None,
    budgets: str | None,
    observe: str | None,
    seed: int | None,
) -> ClosingPlan:
    """Return the plan that options describe.

    Raises:
        StudyError: A plan, family, budget or observation that there is not.
    """
    from realitygap.robots.twin import FAMILIES

    if name not in realitygap.study.PLANS:
        raise StudyError(f"--plan: unknown {name!r}. {did_you_mean(name, realitygap.study.PLANS)}")
    base = realitygap.study.PLANS[name][1 if small else 0]
    changes: dict[str, Any] = {}
    if twins is not None:
        changes["twins"] = twins
    if seed is not None:
        changes["seed"] = seed
    if families is not None:
        changes["families"] = _listed(families, "--families", base.platforms or FAMILIES)
    if observe is not None:
        changes["observations"] = _listed(observe, "--observe", realitygap.records.CALIBRATES)
    if budgets is not None:
        try:
            numbers = sorted({0, *(int(word) for word in budgets.split(","))})
        except ValueError:
            numbers = [-1]
        if numbers[0] < 0:
            raise StudyError(f"--budgets is {budgets!r}, expected numbers of trials, such as 0,10,20,40.")
        changes["budgets"] = tuple(numbers)
    return dataclasses.replace(base, **changes)


def _run(plan: ClosingPlan, folder: Path, processes: int | None, *, as_json: bool, open_page: bool) -> None:
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
        summary = realitygap.study.closing_the_gap(folder, plan, processes=processes, tell=tell)
    except KeyboardInterrupt:
        echo("Interrupted. Finished parts are saved. Run the same command to resume.", err=True)
        raise typer.Exit(130) from None
    page = realitygap.report.write_closing_page(summary, folder / "report.html")
    if as_json:
        print_json({**summary, "folder": folder, "report": page})
    else:
        _print(summary)
        echo(f"Results: {folder}   report: {page}")
    if open_page:
        show_page(page)


def _print(summary: dict[str, Any]) -> None:

    of, label = len(summary["twins"]), summary["label"]
    if summary["plan"]["platforms"]:
        echo(f"{of} sitting{'s' * (of != 1)} ({label}), each with its own held-out controllers")
    else:
        echo(
            f"{of} twins ({label}), of which {summary['n_counted']} differ from the simulator (SIM) by more than three "
            "standard errors"
        )
    echo(f"{'goal':52}{'wanted':>16}{'figure':>9}{'95 % interval':>18}{'n':>9}  verdict")
    for name, wanted, figure, span, n, verdict in realitygap.report.goal_table(summary):
        echo(f"{name:52}{wanted:>16}{figure:>9}{span:>18}{n:>9}  {verdict}")
    for sentence in realitygap.report.not_counted(summary):
        echo(sentence)
    if not summary["plan"]["platforms"]:
        echo(realitygap.report.SELECTION_NOTE)


def _listed(text: str, option: str, known: Any) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(word.strip() for word in text.split(",")))
    for name in names:
        if name not in known:
            raise StudyError(f"{option}: unknown {name!r}. {did_you_mean(name, known)}")
    return names

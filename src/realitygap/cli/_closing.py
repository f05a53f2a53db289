"""`realitygap run closing-the-gap`: the study of many twins, in which the gap is measured and shrunk."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from realitygap.errors import StudyError

if TYPE_CHECKING:
    from realitygap.study import ClosingPlan, ClosingProgress

CLOSING = "closing-the-gap"
"""Known without loading what carries it out."""


def refuse_options(study: str, options: Mapping[str, object]) -> None:
    """Refuse options that mean nothing for a study.

    Raises:
        StudyError: One of them is given.
    """
    given = [f"--{name}" for name, value in options.items() if value not in (None, False)]
    if given:
        raise StudyError(f"Of no meaning for the study {study!r}: {', '.join(given)}. Leave that out.")


def closing_plan(
    *,
    small: bool,
    twins: int | None,
    families: str | None,
    budgets: str | None,
    observe: str | None,
    seed: int | None,
) -> ClosingPlan:
    """The plan that options describe.

    Raises:
        StudyError: A family, budget or observation that there is not.
    """
    from realitygap.records import OBSERVATIONS
    from realitygap.robots.twin import FAMILIES
    from realitygap.study import SMALL, ClosingPlan

    changes: dict[str, Any] = {}
    if twins is not None:
        changes["twins"] = twins
    if seed is not None:
        changes["seed"] = seed
    if families is not None:
        changes["families"] = _listed(families, "--families", FAMILIES)
    if observe is not None:
        changes["observations"] = _listed(observe, "--observe", OBSERVATIONS)
    if budgets is not None:
        try:
            numbers = sorted({0, *(int(word) for word in budgets.split(","))})
        except ValueError:
            numbers = [-1]
        if numbers[0] < 0:
            raise StudyError(f"--budgets is {budgets!r}, expected numbers of trials, such as 0,10,20,40.")
        changes["budgets"] = tuple(numbers)
    return dataclasses.replace(SMALL if small else ClosingPlan(), **changes)


def run_closing(
    plan: ClosingPlan, out: Path | None, processes: int | None, *, as_json: bool, open_page: bool
) -> None:
    """Carry out the study, or what is missing of it, print its goals and write its page."""
    from realitygap.report import write_closing_page
    from realitygap.study import closing_the_gap

    folder = out or Path("results") / CLOSING
    told = [0.0, -1]

    def tell(progress: ClosingProgress) -> None:
        # a line each minute, or where much is done
        if progress.n_done != told[1] and (progress.seconds - told[0] >= 60 or told[1] < 0):
            told[:] = [progress.seconds, progress.n_done]
            typer.echo(
                f"{progress.n_done} of {progress.n_units} parts are done, after {progress.seconds / 60:.0f} minutes.",
                err=True,
            )

    try:
        summary = closing_the_gap(folder, plan, processes=processes, tell=tell)
    except KeyboardInterrupt:
        typer.echo("Interrupted. What is done is safe; the same command goes on where it stopped.", err=True)
        raise typer.Exit(130) from None
    page = write_closing_page(summary, folder / "report.html")
    if as_json:
        typer.echo(json.dumps({**summary, "folder": str(folder)}, indent=2))
    else:
        _print(summary)
        typer.echo(f"Results: {folder}   report: {page}")
    if open_page:
        from ._browser import show_page

        show_page(page)


def _print(summary: dict[str, Any]) -> None:
    from realitygap.report import goal_table, not_counted

    typer.echo(
        f"{len(summary['twins'])} twins (TWIN), of which {summary['n_counted']} differ from the simulator (SIM) by "
        "more than three standard errors"
    )
    typer.echo(f"{'goal':52}{'wanted':>16}{'figure':>9}{'95 % interval':>18}{'twins':>9}  verdict")
    for name, wanted, figure, span, n, verdict in goal_table(summary):
        typer.echo(f"{name:52}{wanted:>16}{figure:>9}{span:>18}{n:>9}  {verdict}")
    for sentence in not_counted(summary):
        typer.echo(sentence)


def _listed(text: str, option: str, known: Any) -> tuple[str, ...]:
    from realitygap.errors import did_you_mean

    names = tuple(dict.fromkeys(word.strip() for word in text.split(",")))
    for name in names:
        if name not in known:
            raise StudyError(f"{option}: unknown {name!r}. {did_you_mean(name, known)}")
    return names

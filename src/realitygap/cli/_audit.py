"""`realitygap audit-results` and `audit-distance`: what a small table can show, and what a distance weighs."""

from __future__ import annotations

import shutil
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import bracketed, significant
from realitygap.errors import RealityGapError

from ._options import Json, print_json
from ._tables import table_of, wide_console

if TYPE_CHECKING:
    from rich.table import Table

    from realitygap.report import Audit, AuditProgress

MANY_RUNS = 1000
"""Number of runs from which an audit takes seconds and reports its progress."""
WIDEST = 110
"""Letters of a line of prose, on a terminal that has more."""
_PROBLEMS = {"impossible": "no k/{n}", "cut": "cut, not rounded", "raised": "raised, not rounded"}


def audit_results(
    table: Annotated[
        Path, typer.Argument(metavar="FILE.csv", help="Table with the columns condition, run and value.")
    ],
    denominator: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Report the values that are not k/N. The paper has N = 72."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Report what a small table of results can show.

    For each pair of conditions, the audit prints the probability that a run of one is above a run of the other (A12),
    and the p of a permutation test. The test is exact up to ten runs against ten, and samples permutations for more
    runs. The audit also prints the smallest p that this number of runs can give, and the differences that they would
    detect. It assumes that runs are independent. Tables of thousands of runs take minutes.

    Example: realitygap audit-results examples/table-2.csv --denominator 72

    In Python: realitygap.report.audit_results("examples/table-2.csv", denominator=72)
    """
    audit = realitygap.report.audit_results(table, denominator=denominator, tell=_tell)
    if as_json:
        print_json(audit.to_dict() | {"file": table, "notes": realitygap.report.audit_notes(audit)})
        return
    _print(audit, table)


def _tell(progress: AuditProgress) -> None:
    """Print a line for each two conditions of a table that takes its time."""
    if progress.n_runs >= MANY_RUNS:
        echo(f"Comparing pair {progress.n_done + 1} of {progress.n_pairs} ...", err=True)


def _print(audit: Audit, path: Path) -> None:
    console = wide_console()
    console.print(_conditions_table(audit, str(path)))
    if audit.doubtful:
        console.print(_doubtful_table(audit))
    console.print(_pairs_table(audit))
    for note in realitygap.report.audit_notes(audit):
        echo(note)


def _conditions_table(audit: Audit, title: str) -> Table:
    """Return a table with a row for each condition."""
    table = table_of(title)
    _columns(table, ["condition"], ["runs", "mean", "sd", "median", "its 95 % interval"])
    for each in audit.conditions:
        median = (
            "too few runs"
            if each.median_low is None or each.median_high is None
            else f"{significant(each.median_low, 3)} to {significant(each.median_high, 3)}"
        )
        deviation = "-" if each.deviation is None else significant(each.deviation, 3)
        table.add_row(
            each.condition,
            f"{each.n:,}",
            significant(each.mean, 3),
            deviation,
            significant(each.median, 3),
            median,
        )
    return table


def _doubtful_table(audit: Audit) -> Table:
    """Return a table with a row for each value that is not the rounded share that it should be."""
    n = audit.denominator or 1
    table = table_of(f"Values that are not k/{n}, rounded")
    _columns(table, ["line", "condition", "run", "value", "problem", "nearest"], [])
    for each in audit.doubtful:
        digits = len(each.text.partition(".")[2]) + 1
        table.add_row(
            str(each.line),
            each.condition,
            each.run,
            each.text,
            _PROBLEMS[each.problem].format(n=n),
            f"{each.nearest}/{n} = {each.nearest / n:.{digits}f}",
        )
    return table


def _pairs_table(audit: Audit) -> Table:
    """Return a table with a row for each pair of conditions."""
    table = table_of(
        "Each two conditions",
        "A12: how likely a run of the first is above one of the second, [95 % interval]; p by permutation, "
        "Holm's over all pairs; least p: the smallest that so many runs can give; finds: the smallest "
        "difference found in 80 of 100 studies, in standard deviations",
    )
    _columns(table, ["pair"], ["A12", "p", "Holm", "least p", "finds"])
    table.add_column("what may be said", min_width=14)
    for each in audit.pairs:
        table.add_row(
            f"{each.one} -\n{each.other}",
            f"{each.a12.value:.2f}\n{bracketed(each.a12, 2, '[none]')}",
            f"{each.p:.2g}",
            f"{each.p_holm:.2g}",
            f"{each.smallest_p:.2g}",
            "-" if each.detectable is None else f"{each.detectable:.1f}",
            each.verdict,
        )
    return table


def _columns(table: Table, words: list[str], numbers: list[str]) -> None:
    for name in words:
        table.add_column(name)
    for name in numbers:
        table.add_column(name, justify="right", no_wrap=True)


def audit_distance(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="Distance: paper, ordered, jaccard, hamming, final, edit or alignment."
        ),
    ],
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="DIR", help="Folder of results whose trials to compare as well."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Figure to write (.svg, .pdf or .png).")
    ] = None,
    sort: Annotated[
        Literal["x-then-y", "y-then-x"],
        typer.Option(
            metavar="ORDER", help="Order of the cells in the paper's distance: x-then-y or y-then-x."
        ),
    ] = "x-then-y",
    straight: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1.0,
            metavar="P",
            help="Probability that a step of a random walk keeps its direction.",
        ),
    ] = 0.6,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the random walks and pairs.")] = 1,
    as_json: Json = False,
) -> None:
    """Report what a behavior distance weighs.

    The weight of a cell is the change in distance when the cell is added to a random walk, or removed from it. The
    relation with length is a rank correlation: the distance of two behaviors against their difference in visited cells.
    It is computed over random walks. If you name a folder, it is also computed over trials of different runs of each
    condition.

    Example: realitygap audit-distance paper -o paper.svg

    Example: realitygap audit-distance jaccard results/paper

    In Python: realitygap.report.audit_distance("jaccard", "results/paper")
    """
    try:
        if out is not None:
            realitygap.report.check_ending(out, (".pdf", ".png", ".svg"))
        audit = realitygap.report.audit_distance(name, folder, seed=seed, sort=sort, straight=straight)
        path = None if out is None else realitygap.report.save_distance(audit, out)
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    if as_json:
        print_json(audit.to_dict() | {"notes": realitygap.report.distance_notes(audit), "file": path})
    else:
        width = min(shutil.get_terminal_size().columns, WIDEST)
        for note in realitygap.report.distance_notes(audit):
            echo(textwrap.fill(note, width, subsequent_indent="  ", break_on_hyphens=False))
        if path is not None:
            echo(f"Written: {path}")

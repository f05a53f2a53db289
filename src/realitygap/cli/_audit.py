"""`realitygap audit-results`: what a small table can show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import realitygap
from realitygap._terminal import echo

from ._json import print_json
from ._options import Json

if TYPE_CHECKING:
    from realitygap.report import Audit, AuditProgress

MANY_RUNS = 1000
"""Number of runs from which an audit takes seconds and reports its progress."""


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
    from realitygap._console import PlainConsole

    from ._audit_tables import conditions_table, doubtful_table, pairs_table

    console = PlainConsole()
    console.print(conditions_table(audit, str(path)))
    if audit.doubtful:
        console.print(doubtful_table(audit))
    console.print(pairs_table(audit))
    for note in realitygap.report.audit_notes(audit):
        echo(note)

"""`realitygap audit-results`: what a small table can show."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from realitygap.report import Audit


def audit_results(
    table: Annotated[
        Path, typer.Argument(metavar="FILE.csv", help="With the columns condition, run and value.")
    ],
    denominator: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Values must be k/N: say which are not. The paper's: 72."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the audit as JSON.")] = False,
) -> None:
    """Say what a small table of results can show, and what it cannot.

    For each two conditions: how likely a run of one is above a run of the other (A12), the exact p, the
    smallest p that so many runs can give, and what they would find. Runs are taken as independent.

    Example: realitygap audit-results examples/table-2.csv --denominator 72

    In Python: realitygap.report.audit_results("examples/table-2.csv", denominator=72)
    """
    from realitygap.report import audit_results as audit_table

    audit = audit_table(table, denominator=denominator)
    if as_json:
        typer.echo(json.dumps(audit.to_dict(), indent=2))
        return
    _print(audit, table)


def _print(audit: Audit, path: Path) -> None:
    from rich.console import Console

    from realitygap.report import audit_notes

    from ._audit_tables import conditions_table, doubtful_table, pairs_table

    console = Console()
    console.print(conditions_table(audit, str(path)))
    if audit.doubtful:
        console.print(doubtful_table(audit))
    console.print(pairs_table(audit))
    for note in audit_notes(audit):
        typer.echo(note)

"""Deviations from a locked design, below the result of a command."""

from __future__ import annotations

from pathlib import Path

import realitygap
from realitygap._terminal import echo
from realitygap._wording import deviations_sentence


def deviations_of(source: Path | None) -> dict[str, list[str]]:
    """Return the deviations of trials from their locked design, for JSON; nothing without one."""
    if source is None or not source.exists():
        return {}
    names = (realitygap.records.LEDGER_NAME, realitygap.study.DESIGN_NAME)
    if source.is_dir() and not any((source / name).exists() for name in names):
        return {}
    report = realitygap.study.design_report(source)
    return {} if report is None else {"deviations": list(report.deviations)}


def print_deviations(source: Path | None) -> None:
    """Print the deviations of trials from their locked design; nothing without one."""
    for deviations in deviations_of(source).values():
        echo(deviations_sentence(deviations))

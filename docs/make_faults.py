"""The table of injected faults on the page "Robustness", computed from docs/data/faults.jsonl.

uv run python -m tests.faults --out docs/data/faults.jsonl            # takes hours
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
DATA = HERE / "data" / "faults.jsonl"
TITLES = {
    "interrupts": "Ctrl-C, twice in a row, in long commands",
    "simulated-kills": "SIGKILL of simulated studies",
    "physical-kills": "SIGKILL of studies on an emulated robot",
    **{f"{command}-kills": f"SIGKILL of `{command}`" for command in ("gap", "calibrate", "transfer", "try")},
    "wire": "faults on the wire to an emulated robot",
    "cluster": "Dask workers and schedulers killed",
    "full-disk": "disks that fill during a command",
    "mutations": "mutated input files",
}
"""Kinds of faults, in the order of the table."""


def page_parts() -> dict[str, str]:
    """Return the generated part of the page, by file."""
    lines = [json.loads(line) for line in DATA.read_text("utf-8").splitlines()]
    return {"parts/faults.md": faults_table(lines)}


def faults_table(lines: list[dict[str, Any]]) -> str:
    """Return the table of all kinds that were injected, one row each, and the machines."""
    rows = ["| fault | injected | failures | hours | version | last run |", "|---|---|---|---|---|---|"]
    for kind, title in TITLES.items():
        batches = [line for line in lines if line["kind"] == kind]
        if batches:
            n, failures = (sum(batch[key] for batch in batches) for key in ("n", "failures"))
            hours = sum(batch["seconds"] for batch in batches) / 3600
            last = batches[-1]
            rows.append(
                f"| {title} | {n:,} | {failures:,} | {hours:.2f} | {last['version']} | {last['date']} |"
            )
    machines = sorted({f"{line['machine']}, Python {line['python']}" for line in lines})
    return "\n".join([*rows, "", f"Machine: {'; '.join(machines)}.", ""])

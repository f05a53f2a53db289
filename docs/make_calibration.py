"""The tables of measured intervals: on the pages "Calibration" and "All parameters at once, from whole trials".

    uv run python docs/make_calibration.py

Takes docs/data/calibration.jsonl, to which benchmarks/calibration.py adds lines, and docs/data/closing/summary.json,
and writes tables into the pages and each parameter into docs/data/calibration.csv. Measuring takes an hour, by hand:

    data="--out docs/data/calibration.jsonl"
    uv run python benchmarks/calibration.py sim --n 24 --first-seed 1000 --observe track cells $data
    uv run python benchmarks/calibration.py motion --n 24 --first-seed 1000 $data
    uv run python benchmarks/calibration.py contact --n 24 --first-seed 1000 $data
    uv run python benchmarks/calibration.py sensors --n 12 --first-seed 1000 $data
    uv run python benchmarks/calibration.py flags --n 30 --first-seed 1001 $data
    uv run python benchmarks/calibration.py same --n 30 --first-seed 1001 $data
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

DOCS = Path(__file__).parent
PAGES = (DOCS / "explanations" / "calibration.md", DOCS / "explanations" / "inference.md")
MEASURED = DOCS / "data" / "calibration.jsonl"
EACH = DOCS / "data" / "calibration.csv"
CLOSING = DOCS / "data" / "closing" / "summary.json"
BLOCK = re.compile(r"(<!-- (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
Row = dict[str, Any]


def share(held: Sequence[bool]) -> str:
    """In percent, with how many of how many."""
    return f"{100 * np.mean(held):.1f} % ({sum(held)} of {len(held)})"


def by_draws(rows: Sequence[Row]) -> str:
    """How many of the identified parameters the posteriors themselves have near the truth, in percent."""
    expected = [chance for row in rows for chance in row.get("expected", {}).values()]
    return f"{100 * np.mean(expected):.1f} %" if expected else "–"


def intervals(rows: Sequence[Row]) -> str:
    """How many intervals hold the truth, and how many estimates are near it."""
    lines = [
        "| observed | robots | 90 % intervals that hold the truth | identified parameters near it | by the draws |",
        "|---|---|---|---|---|",
    ]
    for observe in ("track", "cells"):
        some = [row for row in rows if row["what"] == "sim" and row["observe"] == observe]
        held = [inside for row in some for inside in row["held"].values()]
        near = [close for row in some for close in row["near"].values()]
        lines.append(f"| `{observe}` | {len(some)} | {share(held)} | {share(near)} | {by_draws(some)} |")
    return "\n".join(lines) + "\n"


def kinds(rows: Sequence[Row]) -> str:
    """The same of calibrations of one kind of parameters."""
    lines = [
        "| `calibrate` | robots | 90 % intervals that hold the truth | identified parameters near it |",
        "|---|---|---|---|",
    ]
    for kind in ("motion", "contact", "sensors"):
        some = [row for row in rows if row["what"] == kind]
        held = [inside for row in some for inside in row["held"].values()]
        near = [close for row in some for close in row["near"].values()]
        lines.append(f"| `{kind}` | {len(some)} | {share(held)} | {share(near)} |")
    return "\n".join(lines) + "\n"


def flagged(rows: Sequence[Row], closing: Row) -> str:
    """Who is flagged as what `sim` cannot make, and what gaps are found where there are none."""
    alien = [row["misspecified"] for row in rows if row["what"] == "flags" and row["family"] == "alien"]
    drawn = [row["misspecified"] for row in rows if row["what"] == "sim" and row["observe"] == "track"]
    others = [
        bool(one["misspecified"])
        for twin in closing["twins"]
        for one in twin["calibrated"]
        if (one["observe"], one["budget"]) == ("track", closing["budget"])
    ]
    same = [row["excludes_no_gap"] for row in rows if row["what"] == "same"]
    return "\n".join(
        [
            "| of | what | how many |",
            "|---|---|---|",
            f"| twins `alien` | flagged | {sum(alien)} of {len(alien)} |",
            f"| twins of [closing the gap](closing-the-gap.md) | flagged | {sum(others)} of {len(others)} |",
            f"| robots of `sim` | flagged | {sum(drawn)} of {len(drawn)} |",
            f"| twins `same` | interval of the RMS gap to `sim` excludes 0 | {sum(same)} of {len(same)} |",
            "",
        ]
    )


def each(rows: Sequence[Row]) -> str:
    """A line for each parameter: robots whose interval holds it, that identify it, and that are near it."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    head = ["parameter"]
    ways = {}
    for observe in ("track", "cells"):
        ways[observe] = [row for row in rows if row["what"] == "sim" and row["observe"] == observe]
        head += [f"{observe}: held, of {len(ways[observe])}", "identified", "near"]
    writer.writerow(head)
    for name in ways["track"][0]["held"]:
        line = [name]
        for some in ways.values():
            near = [row["near"][name] for row in some if name in row["near"]]
            line += [sum(row["held"][name] for row in some), len(near), sum(near)]
        writer.writerow(line)
    return file.getvalue()


def rewrite(text: str) -> str:
    """A page with the tables of what was measured."""
    rows = [json.loads(line) for line in MEASURED.read_text("utf-8").splitlines()]
    closing = json.loads(CLOSING.read_text("utf-8"))
    blocks = {"intervals": intervals(rows), "kinds": kinds(rows), "flagged": flagged(rows, closing)}
    return BLOCK.sub(lambda found: found[1] + blocks[found[2]] + found[3], text)


def main() -> None:
    """Write the tables."""
    for page in PAGES:
        page.write_text(rewrite(page.read_text("utf-8")), "utf-8")
    EACH.write_text(each([json.loads(line) for line in MEASURED.read_text("utf-8").splitlines()]), "utf-8")


if __name__ == "__main__":
    main()

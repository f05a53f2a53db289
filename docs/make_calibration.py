"""The tables of measured intervals: on the pages "Calibration" and "All parameters at once, from whole trials".

    uv run python docs/make_calibration.py

Takes docs/data/calibration.jsonl, to which benchmarks/calibration.py adds lines, and docs/data/closing-2/flagged.csv,
and writes tables into the pages and each parameter into docs/data/calibration.csv and docs/data/calibration-kinds.csv.
Measuring takes an hour, by hand:

    data="--out docs/data/calibration.jsonl"
    uv run python benchmarks/calibration.py sim --n 40 --first-seed 11000 --observe track $data
    uv run python benchmarks/calibration.py sim --n 24 --first-seed 1000 --observe encoders cells $data
    uv run python benchmarks/calibration.py motion --n 24 --first-seed 1000 $data
    uv run python benchmarks/calibration.py contact --n 24 --first-seed 1000 $data
    uv run python benchmarks/calibration.py sensors --n 12 --first-seed 1000 $data
    uv run python benchmarks/calibration.py flags --n 30 --first-seed 1001 $data
    uv run python benchmarks/calibration.py same --n 30 --first-seed 1001 $data
    uv run python benchmarks/misspecification.py again --out docs/data/misspecification.jsonl
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
from scipy.stats import binom

from realitygap.calibration import TOLERATED
from realitygap.stats import Estimate, bca_mean, exact_share_interval, holm

DOCS = Path(__file__).parent
PAGES = (DOCS / "explanations" / "calibration.md", DOCS / "explanations" / "inference.md")
MEASURED = DOCS / "data" / "calibration.jsonl"
EACH = DOCS / "data" / "calibration.csv"
EACH_OF_KINDS = DOCS / "data" / "calibration-kinds.csv"
CHECKED = DOCS / "data" / "misspecification.jsonl"
EACH_CHECKED = DOCS / "data" / "misspecification.csv"
CLOSING = DOCS / "data" / "closing-2" / "flagged.csv"
BLOCK = re.compile(r"(<!-- (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
GOAL = 0.9
"""The share of robots whose interval must hold a parameter."""

RARE = 0.05
"""Parameters held so seldom that this or less is the chance of it, if the true share is the goal, are listed."""

HALF_AS_GOOD = 0.8
"""A true share with twice as many misses as the goal allows."""

OBSERVED = ("track", "encoders", "cells")

Row = dict[str, Any]


def over_robots(rows: Sequence[Row]) -> str:
    """Return the 95 % interval of the share held, over robots, as the parameters of a robot are not independent."""
    share = bca_mean(np.array([np.mean(list(row["held"].values())) for row in rows]))
    return "–" if share.ends is None else f"{100 * share.low:.1f} to {100 * share.high:.1f} %"


def held_by_name(rows: Sequence[Row]) -> dict[str, Estimate]:
    """Return for each parameter how many intervals hold it, of how many robots."""
    return {
        name: exact_share_interval(sum(row["held"][name] for row in rows), len(rows))
        for name in (rows[0]["held"] if rows else ())
    }


def count(part: Estimate) -> int:
    """Return how many of n robots a share is."""
    return round(part.value * part.n)


def bounds(part: Estimate) -> str:
    """Return the exact 95 % interval of a share in percent."""
    return f"{100 * part.low:.0f} to {100 * part.high:.0f} %"


def chance(part: Estimate) -> float:
    """Return the probability of so few or fewer if the true share is the goal."""
    return float(binom.cdf(count(part), part.n, GOAL))


def below(groups: dict[str, Sequence[Row]], column: str) -> str:
    """List the parameters that are held too seldom to be chance, one by one, and what so many robots can show."""
    found = [
        (group, name, part) for group, rows in groups.items() for name, part in held_by_name(rows).items()
    ]
    chances = np.array([chance(part) for *_, part in found])
    corrected = holm(chances)
    lines = [
        f"| {column} | parameter | held | 95 % interval | p | p (Holm, {len(found)}) |",
        "|---|---|---|---|---|---|",
    ]
    listed = sorted(np.flatnonzero(chances <= RARE), key=lambda k: (chances[k], k))
    for k in listed:
        group, name, part = found[k]
        lines.append(
            f"| `{group}` | `{name}` | {count(part)} of {part.n} | {bounds(part)} | {chances[k]:.2g} | "
            f"{corrected[k]:.2g} |"
        )
    n = max(part.n for *_, part in found)
    expected = sum(binom.cdf(most_listed(part.n), part.n, GOAL) for *_, part in found)
    power = binom.cdf(most_listed(n), n, HALF_AS_GOOD)
    text = (
        f"{len(listed)} of {len(found)} parameters have a p of {RARE} or less. If the true share were "
        f"{100 * GOAL:.0f} % for every parameter,\n{expected:.1f} would have such a p on average. A parameter that is "
        f"held in only {100 * HALF_AS_GOOD:.0f} % of robots has such a p in\n{100 * power:.0f} of 100 measurements of "
        f"{n} robots. So a larger p does not show that a parameter reaches the goal."
    )
    return ("\n".join(lines) + "\n\n" if listed else "") + text + "\n"


def most_listed(n: int) -> int:
    """Return the largest number of robots, of n, with which a parameter is listed."""
    return max((k for k in range(n) if binom.cdf(k, n, GOAL) <= RARE), default=-1)


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
        "| observed | robots | 90 % intervals with the true value | 95 % interval, over robots | identified parameters "
        "near it | expected |",
        "|---|---|---|---|---|---|",
    ]
    for observe in OBSERVED:
        some = [row for row in rows if row["what"] == "sim" and row["observe"] == observe]
        held = [inside for row in some for inside in row["held"].values()]
        near = [close for row in some for close in row["near"].values()]
        lines.append(
            f"| `{observe}` | {len(some)} | {share(held)} | {over_robots(some)} | {share(near)} | {by_draws(some)} |"
        )
    return "\n".join(lines) + "\n"


def kinds(rows: Sequence[Row]) -> str:
    """The same of calibrations of one kind of parameters."""
    lines = [
        "| `calibrate` | robots | 90 % intervals that hold the truth | 95 % interval, over robots | identified "
        "parameters near it |",
        "|---|---|---|---|---|",
    ]
    for kind in ("motion", "contact", "sensors"):
        some = [row for row in rows if row["what"] == kind]
        held = [inside for row in some for inside in row["held"].values()]
        near = [close for row in some for close in row["near"].values()]
        lines.append(f"| `{kind}` | {len(some)} | {share(held)} | {over_robots(some)} | {share(near)} |")
    return "\n".join(lines) + "\n"


def flagged(rows: Sequence[Row], closing: Sequence[Row]) -> str:
    """Who is flagged as what `sim` cannot make, and what gaps are found where there are none."""
    alien = [row["misspecified"] for row in rows if row["what"] == "flags" and row["family"] == "alien"]
    drawn = [row["misspecified"] for row in rows if row["what"] == "sim" and row["observe"] == "track"]
    of_families = [
        row for row in closing if row["simulator"] == "track" and row["family"] not in ("same", "alien")
    ]
    n_rejected, n_twins = (sum(int(row[name]) for row in of_families) for name in ("rejected", "twins"))
    same = [row["excludes_no_gap"] for row in rows if row["what"] == "same"]
    return "\n".join(
        [
            "| robots | result | number |",
            "|---|---|---|",
            f"| twins `alien` | flagged | {sum(alien)} of {len(alien)} |",
            f"| twins of [closing the gap](closing-the-gap.md) | flagged | {n_rejected} of {n_twins} |",
            f"| robots of `sim` | flagged | {sum(drawn)} of {len(drawn)} |",
            f"| twins `same` | interval of the RMS gap to `sim` excludes 0 | {sum(same)} of {len(same)} |",
            "",
        ]
    )


def checked(rows: Sequence[Row]) -> str:
    """How many twins the check flags: all of it, and its shares of the variance alone."""
    lines = [
        "| check | twins (TWIN) | flagged | 95 % interval | by the share of the variance alone |",
        "|---|---|---|---|---|",
    ]
    for name, check in (("final", "first"), ("again", "present")):
        for what, is_outside in (("made by hand", True), ("of the families", False)):
            some = [row for row in rows if row["set"] == name and (row["family"] == "outside") == is_outside]
            part = exact_share_interval(sum(row["flagged"] for row in some), len(some))
            alone = sum(any(share > TOLERATED[kind] for kind, share in row["misfit"].items()) for row in some)
            lines.append(
                f"| {check} | {what} | {count(part)} of {part.n} | {bounds(part)} | {alone} of {len(some)} |"
            )
    return "\n".join(lines) + "\n"


def each_checked(rows: Sequence[Row]) -> str:
    """What the check reports of each twin that was made by hand, with poses."""
    lines: list[list[object]] = [["twin", "flagged", "report"]]
    lines += [
        [
            row["sentence"],
            "yes" if row["flagged"] else "no",
            " ".join(note for note in row["notes"] if "goes with" in note or _is_beyond(note, row["misfit"])),
        ]
        for row in rows
        if row["family"] == "outside" and row["set"] == "again"
    ]
    return _csv(lines)


def _is_beyond(note: str, misfit: dict[str, float]) -> bool:
    """Return whether a note is of a kind of observation whose share is too large."""
    return any(note.startswith(f"{kind}:") and share > TOLERATED[kind] for kind, share in misfit.items())


def by_observation(rows: Sequence[Row]) -> dict[str, Sequence[Row]]:
    """Return the calibrations of everything, by what they observe."""
    return {
        observe: [row for row in rows if row["what"] == "sim" and row["observe"] == observe]
        for observe in OBSERVED
    }


def by_kind(rows: Sequence[Row]) -> dict[str, Sequence[Row]]:
    """Return the calibrations of one kind of parameters, by kind."""
    return {kind: [row for row in rows if row["what"] == kind] for kind in ("motion", "contact", "sensors")}


def each(rows: Sequence[Row]) -> str:
    """A line for each parameter: robots whose interval holds it, that identify it, and that are near it."""
    groups = by_observation(rows)
    head = ["parameter"]
    for observe, some in groups.items():
        head += [f"{observe}: held, of {len(some)}", "95 % interval", "identified", "near"]
    held = {observe: held_by_name(some) for observe, some in groups.items()}
    lines: list[list[object]] = [head]
    for name in held["track"]:
        line: list[object] = [name]
        for observe, some in groups.items():
            part = held[observe][name]
            near = [row["near"][name] for row in some if name in row["near"]]
            line += [count(part), bounds(part), len(near), sum(near)]
        lines.append(line)
    return _csv(lines)


def each_of_kinds(rows: Sequence[Row]) -> str:
    """The same of calibrations of one kind of parameters."""
    lines: list[list[object]] = [["calibrate", "parameter", "robots", "held", "95 % interval"]]
    lines += [
        [kind, name, part.n, count(part), bounds(part)]
        for kind, some in by_kind(rows).items()
        for name, part in held_by_name(some).items()
    ]
    return _csv(lines)


def _csv(lines: Sequence[Sequence[object]]) -> str:
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows(lines)
    return file.getvalue()


def measured() -> list[Row]:
    """Return what `benchmarks/calibration.py` measured."""
    return [json.loads(line) for line in MEASURED.read_text("utf-8").splitlines()]


def checks() -> list[Row]:
    """Return what `benchmarks/misspecification.py` measured."""
    return [json.loads(line) for line in CHECKED.read_text("utf-8").splitlines()]


def rewrite(text: str) -> str:
    """A page with the tables of what was measured."""
    rows = measured()
    closing = list(csv.DictReader(CLOSING.read_text("utf-8").splitlines()))
    blocks = {
        "intervals": intervals(rows),
        "below": below(by_observation(rows), "observed"),
        "kinds": kinds(rows),
        "below_kinds": below(by_kind(rows), "`calibrate`"),
        "flagged": flagged(rows, closing),
        "checked": checked(checks()),
    }
    return BLOCK.sub(lambda found: found[1] + blocks[found[2]] + found[3], text)


def main() -> None:
    """Write the tables."""
    for page in PAGES:
        page.write_text(rewrite(page.read_text("utf-8")), "utf-8")
    EACH.write_text(each(measured()), "utf-8")
    EACH_OF_KINDS.write_text(each_of_kinds(measured()), "utf-8")
    EACH_CHECKED.write_text(each_checked(checks()), "utf-8")


if __name__ == "__main__":
    main()

"""The tables of the page “Robots of other people”, from docs/data/real-data.json.

    python benchmarks/real_data.py --data DIR

measures and writes the figures; the tables are worked out from them when the documents are built.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from realitygap._wording import significant

DATA = Path(__file__).parent / "data" / "real-data.json"
LABEL = "REAL (others' robots)"
FITTED, NOMINAL, TABLE = "fitted", "nominal numbers", "lookup table"


def page_parts() -> dict[str, str]:
    """The generated parts of the page, by file."""
    found = json.loads(DATA.read_text("utf-8"))
    return {
        "parts/real-goals.md": goals(found),
        "parts/real-wall.md": errors(found["wall"]["held_out"]),
        "parts/real-wall-by.md": by_condition(found["wall"]["held_out"]["by"]),
        "parts/real-wall-fit.md": fitted(found["wall"]["fitted"]),
        "parts/real-labyrinth.md": labyrinth(found["labyrinth"]),
        "parts/real-labyrinth-fit.md": fitted(found["labyrinth"]["fitted"]),
        "parts/real-motors.md": motors(found["motors"]),
        "parts/real-cube.md": cube(found["cube"]),
    }


def verdicts(found: Mapping[str, Any]) -> list[tuple[bool, str, str, str]]:
    """Whether each goal is met, the goal, what was measured, and the limit; those that are missed come first."""
    limits, wall, run = found["goals"], found["wall"]["held_out"], found["labyrinth"]["held_out"]["errors"]
    between = next(iter(wall["more"].values()))
    median, worst = found["motors"]["errors"]["fitted: gain and soft dead band"]
    over = wall["errors"][FITTED] / wall["errors"][TABLE]
    rows = [
        ("Khepera at a wall: error of readings", wall["errors"][FITTED], limits["wall"], "{:.3f}"),
        (
            "Khepera at a wall: error of readings between 0.03 and 1",
            between[FITTED],
            limits["wall between"],
            "{:.3f}",
        ),
        (
            "Khepera at a wall: error over that of the lookup table",
            over,
            limits["wall over neighbors"],
            "{:.2f}",
        ),
        ("motors: error in percent of full speed, median", median, limits["motors"], "{:.2f}"),
        ("motors: the worst of 28", worst, limits["motors"], "{:.2f}"),
        (
            "labyrinth: error of positions over that of nominal numbers",
            run[FITTED] / run[NOMINAL],
            limits["labyrinth over nominal"],
            "{:.2f}",
        ),
    ]
    judged = [
        (value <= limit, goal, form.format(value), form.format(limit)) for goal, value, limit, form in rows
    ]
    return sorted(judged, key=lambda row: row[0])


def goals(found: Mapping[str, Any]) -> str:
    """The goals with their results, those that are missed first."""
    rows = [
        (f"**{'met' if is_met else 'missed'}**", goal, value, limit)
        for is_met, goal, value, limit in verdicts(found)
    ]
    return _table(("result", f"goal, {LABEL}", "measured", "at most"), rows)


def errors(held_out: Mapping[str, Any]) -> str:
    """Errors of the predictions of what the fit did not see."""
    more = list(held_out["more"])
    rows = [
        (name, f"{error:.4f}", *(f"{held_out['more'][key][name]:.4f}" for key in more))
        for name, error in held_out["errors"].items()
    ]
    unit = f" [{held_out['unit']}]" if held_out["unit"] else ""
    caption = f"{LABEL}, n = {held_out['n']:,}; error{unit}: {held_out['measure']}."
    return _table(("prediction", "error", *more), rows) + f"\n{caption}\n"


def by_condition(by: Mapping[str, Mapping[str, Mapping[str, float]]]) -> str:
    """Errors of the fit by condition, beside those of the nominal numbers and the lookup table."""
    rows = [
        (f"{kind} {value}", *(f"{found[name]:.4f}" for name in (FITTED, NOMINAL, TABLE)))
        for kind, values in by.items()
        for value, found in values.items()
    ]
    return _table(("where", FITTED, NOMINAL, TABLE), rows)


def fitted(rows: Sequence[Sequence[Any]]) -> str:
    """Parameters with their intervals."""
    cells = [
        (
            f"`{name}`",
            f"{significant(estimate, 3)} {unit}".strip(),
            f"{significant(low, 3)} to {significant(high, 3)}",
        )
        for name, estimate, low, high, unit in rows
    ]
    return _table(("parameter", "estimate", "90 % interval"), cells)


def labyrinth(found: Mapping[str, Any]) -> str:
    """Errors for both ways to hold out."""
    whole, blocks = found["held_out"], found["blocks"]
    rows = [
        (
            name,
            f"{whole['errors'][name]:.3f}",
            f"{whole['more']['at the end'][name]:.3f}",
            f"{blocks['errors'][name]:.3f}",
        )
        for name in whole["errors"]
    ]
    measures = [
        f"{name}: {each['measure']}, n = {each['n']}"
        for name, each in (("whole log", whole), ("blocks", blocks))
    ]
    caption = f"{LABEL}; {'; '.join(measures)}."
    heads = ("prediction", "last half [m]", "at its end [m]", "blocks [m]")
    return _table(heads, rows) + f"\n{caption[0].upper()}{caption[1:]}\n"


def motors(found: Mapping[str, Any]) -> str:
    """Errors of the motors, and of the fit by robot."""
    rows = [(name, f"{median:.2f}", f"{worst:.2f}") for name, (median, worst) in found["errors"].items()]
    residuals = ", ".join(f"{name} {error:.2f}" for name, error in found["by"].items())
    caption = f"{LABEL}, n = {found['n']} motors; error in percent of full speed. Fit by robot, median: {residuals}."
    return _table(("prediction", "median", "worst"), rows) + f"\n{caption}\n"


def cube(found: Mapping[str, Sequence[float]]) -> str:
    """Where a pushed cube ends by platform."""
    rows = [
        (f"`{name}`", str(n), f"{median:.4f}", f"{spread:.4f}") for name, (n, median, spread) in found.items()
    ]
    return _table(("platform", "trials", "end x, median [m]", "standard deviation [m]"), rows)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"

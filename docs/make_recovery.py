"""The study of damaged robots: table and figure of the page "A robot that recovers".

    uv run python docs/make_recovery.py     # after benchmarks/recovery.py analyze, which writes the data

Tables follow from docs/data/recovery.json when the documents are built; this command draws the figure.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from written import write_files

from realitygap.drawing import Ink
from realitygap.report.charts.house import Drawing, draw_wide
from realitygap.report.charts.lines import head
from realitygap.report.charts.rows import Row, draw_row, name_rows, stacked
from realitygap.report.charts.sheet import Sheet, grid
from realitygap.stats import mean_interval

HERE = Path(__file__).parent
DATA = HERE / "data" / "recovery.json"
FIGURE = HERE / "images" / "recovery.svg"
BUDGET = 10
REGAINED = 0.8
HIGHEST = 1.0


def page_parts() -> dict[str, str]:
    """Return the generated parts of the page, by file."""
    found = json.loads(DATA.read_text("utf-8"))
    return {
        "parts/recovery-words.md": words(found),
        "parts/recovery-table.md": table(found),
        "parts/recovery-families.md": families_table(found),
        "parts/recovery-parts.md": parts_table(found),
        "parts/recovery-best.md": best_table(found),
    }


def words(found: Mapping[str, Any]) -> str:
    """Return how much of the study is done, and which goals are met."""
    n = len(found["twins"])
    done = (
        f"{n} twins are done"
        if not found["missing"]
        else f"{n} of {n + len(found['missing'])} twins are done"
    )
    regained = found["families_that_regain"]
    (plain,) = [row for row in at_budget(found) if row["strategy"] == "plain"]
    kept = sum(share >= REGAINED for share in plain["of_intact"].values())
    return (
        f"{done}. Before the damage, the champion scores {number(found['intact'])} on them. "
        f"**The first goal is {met(found['goal_regained'])}**: with {BUDGET} trials, the best strategy of trial and "
        f"error, `{found['best']}`, regains 80 % of the intact score in {regained} of 5 families. But "
        f"`plain`, which spends no trial, keeps 80 % in {kept} of them, so this goal was too low. **The second goal is "
        f"{met(found['goal_combined'])}**: `trial-and-error-combined` is "
        f"{'' if found['goal_combined'] else 'not '}better than each of its parts with an interval that excludes 0.\n"
    )


def met(is_met: bool) -> str:
    """Say whether a goal is met."""
    return "met" if is_met else "missed"


def number(estimate: Mapping[str, Any], form: str = ".3f") -> str:
    """Return an estimate with its interval."""
    if estimate["low"] is None:
        return format(estimate["estimate"], form)
    return f"{estimate['estimate']:{form}} [{estimate['low']:{form}}, {estimate['high']:{form}}]".replace(
        "-", "−"
    )


def table(found: Mapping[str, Any]) -> str:
    """Return the mean score of each strategy by budget."""
    budgets = sorted({row["budget"] for row in found["table"] if row["budget"]})
    lines = [
        f"| strategy | {' | '.join(f'{budget} trials' for budget in budgets)} |",
        f"|---|{'---|' * len(budgets)}",
    ]
    score = {(row["strategy"], row["budget"]): row["score"] for row in found["table"]}
    for strategy in dict.fromkeys(row["strategy"] for row in found["table"]):
        own = [score.get((strategy, budget), score.get((strategy, 0))) for budget in budgets]
        lines.append(f"| `{strategy}` | {' | '.join('' if each is None else number(each) for each in own)} |")
    return "\n".join([*lines, ""])


def families_table(found: Mapping[str, Any]) -> str:
    """Return the share of the intact score of each strategy and family, with the budget of the goals."""
    rows = at_budget(found)
    families = list(rows[0]["of_intact"])
    lines = [
        f"| strategy | {' | '.join(f'`{family}`' for family in families)} |",
        f"|---|{'---|' * len(families)}",
    ]
    for row in rows:
        shares = " | ".join(f"{100 * row['of_intact'][family]:.0f} %" for family in families)
        lines.append(f"| `{row['strategy']}` | {shares} |")
    return "\n".join([*lines, ""])


def parts_table(found: Mapping[str, Any]) -> str:
    """Return what `trial-and-error-combined` scores less each of its parts."""
    lines = ["| part | combined less this part |", "|---|---|"]
    lines += [f"| `{part}` | {number(each, '+.3f')} |" for part, each in found["combined_minus_part"].items()]
    return "\n".join([*lines, ""])


def best_table(found: Mapping[str, Any]) -> str:
    """Return what the best strategy of trial and error scores more than each other strategy."""
    by_twin = [
        {each["strategy"]: each["score"] for each in twin["scores"] if each["budget"] in (0, BUDGET)}
        for twin in found["twins"]
    ]
    lines = [f"| strategy | `{found['best']}` less this strategy |", "|---|---|"]
    for name in by_twin[0]:
        if name != found["best"]:
            differences = np.array([scores[found["best"]] - scores[name] for scores in by_twin])
            lines.append(f"| `{name}` | {number(mean_interval(differences).to_dict(), '+.3f')} |")
    return "\n".join([*lines, ""])


def at_budget(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of the budget of the goals, and those that need no trial."""
    return [row for row in found["table"] if row["budget"] in (0, BUDGET)]


def draw_recovery(found: Mapping[str, Any]) -> Drawing:
    """Draw the score of each twin by strategy, and the means with their intervals."""
    rows = at_budget(found)
    names = ["intact", *(row["strategy"] for row in rows)]
    means = [found["intact"], *(row["score"] for row in rows)]
    by_twin = [[twin["intact"] for twin in found["twins"]]]
    for row in rows:
        key = (row["strategy"], row["budget"])
        by_twin.append(
            [
                each["score"]
                for twin in found["twins"]
                for each in twin["scores"]
                if (each["strategy"], each["budget"]) == key
            ]
        )
    n = len(found["twins"])
    caption = (
        f"Mean coverage on the damaged twin (TWIN) of what each strategy chose with {BUDGET} trials, and of the "
        f"champion before the damage. Small points: {n} twins. Large points and bars: means and 95 % intervals."
    )

    def draw(width: float) -> Sheet:
        sheet, (axes,) = grid(width, 1, 1, 0.27 * len(names))
        axes.set_xlim(0, HIGHEST)
        name_rows(axes, names, grid=False)
        for place, (mean, values) in enumerate(zip(means, by_twin, strict=True)):
            color = Ink.OURS if names[place].startswith("trial") else Ink.RUN
            ends = None if mean["low"] is None else (mean["low"], mean["high"])
            dots = np.array(values)
            draw_row(axes, place, Row(mean["estimate"], ends, dots, stacked(dots, HIGHEST), color, color))
        axes.set_xlabel("coverage on the twin, TWIN", labelpad=2)
        head(axes, "Recovery by strategy", f"{n} twins", stacked=True)
        return sheet

    return draw_wide(draw, "recovery", caption, "Coverage on damaged twins by strategy.")


def main() -> None:
    """Draw the figure."""
    write_files({FIGURE: draw_recovery(json.loads(DATA.read_text("utf-8"))).svg})


if __name__ == "__main__":
    main()

"""The study of many twins: tables, figures and sentences of the page "Closing the gap".

    uv run python docs/make_closing.py results/closing-the-gap

Takes the results of `realitygap run closing-the-gap`, whole or as far as they are, and writes into docs/data/closing
tables, the sentences of words.md and directions.md, and summary.json, and into docs/images/closing the figures. Every
number of the page comes from there. The study itself takes hours and is not run here.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.gap import mean_maximum_rank_violation
from realitygap.report import (
    FAMILY_HEAD,
    GOAL_HEAD,
    STRATEGY_HEAD,
    TWIN_HEAD,
    WHY_HEAD,
    draw_closing,
    family_table,
    goal_table,
    not_counted,
    strategy_table,
    twin_table,
    why_table,
)
from realitygap.study import summarize_closing

HERE = Path(__file__).parent
TABLES = HERE / "data" / "closing"
FIGURES = HERE / "images" / "closing"
NOTHING = "none"
FEW = 3
"""Controllers of each twin without which rank violations are told once more."""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A CSV file with at least one row: a table of nothing says so."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(head)
    listed = list(rows) or [[NOTHING, *[""] * (len(head) - 1)]]
    writer.writerows(listed)
    return file.getvalue()


def sentences(summary: dict[str, Any]) -> str:
    """What the page says in numbers, as paragraphs of Markdown."""
    plan, goals = summary["plan"], summary["goals"]
    done = (
        f"All {summary['n_units']} parts of the study are done."
        if summary["n_done"] == summary["n_units"]
        else f"**{summary['n_done']} of {summary['n_units']} parts of the study are done**; all figures are of these."
    )
    size = (
        f"{plan['twins']} twins of each of the families {', '.join(plan['families'])} (seeds from {plan['first_seed']} "
        f"on), {plan['controllers']} held-out controllers, {plan['trials']} trials of each on both sides; calibrated "
        f"by {', '.join(str(each) for each in plan['budgets'] if each)} trials; transfer with "
        f"{plan['transfer_budget']} trials, {plan['replicates']} replicates and "
        f"{plan['fresh_trials']} fresh trials. {done}"
    )
    counted = (
        f"{summary['n_counted']} of {len(summary['twins'])} twins differ from the simulator as it is by more than "
        f"three standard errors, and count. Goals are judged at {summary['budget']} trials."
    )
    if (plan["twins"], len(plan["families"])) < (10, 4):
        counted += " **This is less than the whole study: it shows that all of it works, and nothing else.**"
    met = [goal["name"] for goal in goals if goal["met"]]
    missed = [goal["name"] for goal in goals if goal["met"] is False]
    verdict = f"Met: {'; '.join(met) or NOTHING}.\n\nMissed: {'; '.join(missed) or NOTHING}."
    return (
        "\n\n".join([size, counted, verdict, *not_counted(summary), *_reasons(summary), *_of_order(summary)])
        + "\n"
    )


def _reasons(summary: dict[str, Any]) -> list[str]:
    """Of each goal of the gap that is missed: in which families, and what its calibrations say of themselves."""
    found = []
    for goal in summary["goals"]:
        if goal["met"] is not False or not goal["why"]:
            continue
        twins = goal["why"]
        families = sorted({each["family"] for each in twins})
        text = f"*{goal['name']}* is missed by {len(twins)} of {goal['n']} twins ({', '.join(families)})"
        checked = [each for each in twins if each.get("misspecification_p") is not None]
        if checked:
            flagged = sum(bool(each["misspecified"]) for each in checked)
            ends = sorted({name for each in checked for name in each["at_prior_end"]})
            text += (
                f": the posterior predictive check flags {flagged} of {len(checked)}; at an end of what was thought "
                f"possible lie {', '.join(f'`{name}`' for name in ends) or 'no parameters'}"
            )
        found.append(text + ".")
    return found


def _of_order(summary: dict[str, Any]) -> list[str]:
    """How far rank violations fall, and how far they would have to."""
    before = float(np.median([twin["gap"]["mmrv"] for twin in summary["twins"]]))
    floor = float(np.median([twin["gap"]["mmrv_floor"] for twin in summary["twins"]]))
    found = []
    for observe in summary["plan"]["observations"]:
        after = [_at_goal(twin, summary["budget"], observe) for twin in summary["twins"]]
        mmrv = [each["gap"]["mmrv"] for each in after if each is not None]
        if mmrv:
            now = float(np.median(mmrv))
            found.append(f"to {now:.4f} with `{observe}`, by {100 * (1 - now / before):.0f} %")
    if not found or not before:
        return []
    falls, wanted = " and ".join(found), 100 * (1 - 2 * floor / before)
    return [
        f"The median MMRV falls from {before:.4f} {falls}. Twice the median floor is {2 * floor:.4f}: a fall by "
        f"{wanted:.0f} %.",
        *_of_few(summary),
    ]


def _of_few(summary: dict[str, Any]) -> list[str]:
    """How much of the rank violations hangs on the controllers that are predicted worst."""
    n_random = summary["plan"]["controllers"] // 2  # they come first
    found = []
    for observe in summary["plan"]["observations"]:
        after = [_at_goal(twin, summary["budget"], observe) for twin in summary["twins"]]
        means = [each["means"] for each in after if each is not None]
        if not means:
            continue
        source, target = (np.array([each[side] for each in means]) for side in ("source", "target"))
        worst = np.argsort(-np.abs(source - target), axis=1)[:, :FEW]
        mended = source.copy()
        np.put_along_axis(mended, worst, np.take_along_axis(target, worst, axis=1), axis=1)
        median = float(np.median(mean_maximum_rank_violation(mended, target)))
        random = 100 * float(np.mean(worst < n_random))
        found.append(f"{median:.4f} with `{observe}` (of these controllers {random:.0f} % are random ones)")
    if not found:
        return []
    return [
        f"Few controllers make most of it. Were, on each twin, the {FEW} of {summary['plan']['controllers']} predicted "
        f"worst predicted exactly, the median would be {' and '.join(found)}."
    ]


def directions(summary: dict[str, Any]) -> str:
    """What prior results found, and whether it is so here, as a list in Markdown."""
    twins = [(twin, _at_goal(twin, summary["budget"], "track")) for twin in summary["twins"]]
    pairs = [(twin["gap"]["srcc"], after["gap"]["srcc"]) for twin, after in twins if after is not None]
    rises = sum(after > before for before, after in pairs)
    order = [float(np.median([pair[k] for pair in pairs])) if pairs else float("nan") for k in (0, 1)]
    coverage = {row["strategy"]: row["estimate"] for row in summary["strategies"]}
    plain = coverage.get("plain", float("nan"))
    gains = ", ".join(f"`{name}` {value - plain:+.3f}" for name, value in coverage.items() if name != "plain")
    return f"""\
* Jakobi, Husbands & Harvey (1995): controllers transfer best from a simulator whose noise is about that of the robot,
  worse from one with less *or more*. Not told here: noise is among what is fitted, and no condition has less or more of
  it than the fit. `realitygap transfer --strategy noise --strategy posterior` asks it of one target.
* Miglino, Nafasi & Taylor (1995), on a robot that is to wander over an arena: the correlation of simulated and real
  performance rises with noise in the simulation. Here SRCC, whose median over twins is {order[0]:.2f} with the
  simulator as it is, is {order[1]:.2f} calibrated by {summary["budget"]} trials (`track`), and rises on {rises} of
  {len(pairs)} twins; noise is among what was fitted, and not told apart. Miglino, Lund & Nolfi (1995) bring the two
  closer by sampling the robot's own sensors and motors, which is what calibrating does.
* Koos, Mouret & Doncieux (2013): few trials on the target, spent on learning where the simulation is wrong, find
  controllers that transfer. Here the same few trials change the simulation itself, or choose among champions, or are
  all that evolution has. In coverage on the twin over `plain`: {gains}. Their own strategy,
  `transferability`, is not among those of this study.
* Ligot & Birattari (2019): pseudo-reality, another simulator in place of the robot, reproduces which design methods
  drop in reality. It is what makes this study a test at all, and its limit: an order of methods may carry over to a
  robot; an amount may not.
"""


def _at_goal(twin: dict[str, Any], budget: int, observe: str) -> dict[str, Any] | None:
    """A twin's gap after calibrating by so many trials."""
    found: Iterable[dict[str, Any]] = twin["calibrated"]
    return next((each for each in found if (each["observe"], each["budget"]) == (observe, budget)), None)


def slim(summary: dict[str, Any]) -> str:
    """The summary as JSON, without what is only drawn."""
    twins = [
        {key: value for key, value in twin.items() if key not in ("means", "seconds")}
        for twin in summary["twins"]
    ]
    for twin in twins:
        twin["calibrated"] = [
            {key: value for key, value in each.items() if key != "means"} for each in twin["calibrated"]
        ]
    return json.dumps({**summary, "twins": twins}, indent=1) + "\n"


def main() -> None:
    """Write all that the page takes."""
    parser = argparse.ArgumentParser(description="Tables, figures and sentences of the study of many twins.")
    parser.add_argument("folder", type=Path, help="results of `realitygap run closing-the-gap`")
    summary = summarize_closing(parser.parse_args().folder)
    TABLES.mkdir(parents=True, exist_ok=True)
    FIGURES.mkdir(parents=True, exist_ok=True)
    texts = {
        TABLES / "goals.csv": table(GOAL_HEAD, goal_table(summary)),
        TABLES / "families.csv": table(FAMILY_HEAD, family_table(summary)),
        TABLES / "strategies.csv": table(STRATEGY_HEAD, strategy_table(summary)),
        TABLES / "twins.csv": table(TWIN_HEAD, twin_table(summary)),
        TABLES / "why.csv": table(WHY_HEAD, why_table(summary)),
        TABLES / "words.md": sentences(summary),
        TABLES / "directions.md": directions(summary),
        TABLES / "summary.json": slim(summary),
    }
    texts |= {FIGURES / f"{name}.svg": drawing.svg + "\n" for name, drawing in draw_closing(summary).items()}
    for path, text in texts.items():
        path.write_text(text, "utf-8")
        print(f"Written: {path}")


if __name__ == "__main__":
    main()

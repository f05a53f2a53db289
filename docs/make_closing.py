"""The study of many twins: tables, figures and sentences of the page "Closing the gap".

    uv run python docs/make_closing.py results/closing-the-gap
    uv run python docs/make_closing.py              # without results: tables and sentences from the stored data
    uv run python docs/make_closing.py --earlier    # the table of earlier runs, from the history of this repository

With results of `realitygap closing-the-gap`, complete or not, it writes the data of the page: summary.json and
means.csv, the mean coverage of each held-out controller on each twin. Tables and sentences follow from these two files;
figures are drawn from the results. The study takes hours and is not run here.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from written import write_files

from realitygap.errors import RealityGapError
from realitygap.gap import mean_maximum_rank_violation
from realitygap.report import (
    TableOnPage,
    draw_closing,
    family_table,
    goal_table,
    not_counted,
    strategy_table,
    twin_table,
    why_table,
)
from realitygap.stats import mean_interval, median_interval
from realitygap.study import summarize_closing
from realitygap.study._closing.summary import is_met

HERE = Path(__file__).parent
TABLES = HERE / "data" / "closing"
FIGURES = HERE / "images" / "closing"
NOTHING = "none"
FEW = 3
"""Number of worst-predicted controllers that the rank violations are computed without."""

RESAMPLES = 2000
NORMAL_STUDIES = 200
EARLIER = ("be3ec55", "027b5f5", "1383d9f")
"""Commits that published results on twins with seeds from 1000 on."""

CHANGED = (
    "first results",
    "shares of the draws with poses; noise of wheels that stand still",
    "grip and speed rise of `sim`; fits of motion and contact, regressions, shares of the draws",
)
"""What changed in `sim` and the fits since the results before."""

Values = NDArray[np.float64]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A CSV file with at least one row: a table of nothing says so."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(head)
    listed = list(rows) or [[NOTHING, *[""] * (len(head) - 1)]]
    writer.writerows(listed)
    return file.getvalue()


def csv_of(shown: TableOnPage) -> str:
    """A table of the report as a CSV file."""
    return table(shown.heads, shown.rows)


def sentences(summary: dict[str, Any]) -> str:
    """What the page says in numbers, as paragraphs of Markdown."""
    plan = summary["plan"]
    done = (
        f"All {summary['n_units']} parts of the study are done."
        if summary["n_done"] == summary["n_units"]
        else f"**{summary['n_done']} of {summary['n_units']} parts of the study are done**; all figures are of these."
    )
    size = (
        f"The study has {plan['twins']} twins of each of the families {', '.join(plan['families'])} "
        f"(seeds from {plan['first_seed']} on). It tries {plan['controllers']} held-out controllers, "
        f"with {plan['trials']} trials of each on both sides. "
        f"Twins are calibrated by {', '.join(str(each) for each in plan['budgets'] if each)} trials. "
        f"Transfer has {plan['transfer_budget']} trials, {plan['replicates']} replicates, and "
        f"{plan['fresh_trials']} fresh trials. {done}"
    )
    counted = (
        f"{summary['n_counted']} of {len(summary['twins'])} twins count: they differ from the uncalibrated simulator "
        f"by more than three standard errors. Goals are judged at {summary['budget']} trials."
    )
    if (plan["twins"], len(plan["families"])) < (10, 4):
        counted += " **This is less than the whole study. It shows only that every part works.**"
    parts = [
        size,
        counted,
        *verdicts(summary),
        *_of_stretch(summary),
        *not_counted(summary),
        *_reasons(summary),
    ]
    return "\n\n".join([*parts, *_of_order(summary)]) + "\n"


def done_parts(summary: Mapping[str, Any]) -> str:
    """Return how much of a study is done, as a sentence."""
    if summary["n_done"] == summary["n_units"]:
        return "All parts of the study are done."
    return f"**{summary['n_done']} of {summary['n_units']} parts of the study are done**; all figures are of these."


def verdicts(summary: Mapping[str, Any]) -> list[str]:
    """Return the goals that are met, open, and missed, as lists of Markdown."""
    names: dict[bool | None, list[str]] = {True: [], False: [], None: []}
    for goal in summary["goals"]:
        names[goal["met"]].append(goal["name"])
    return [
        "\n".join([f"{word}:", "", *(f"* {name}" for name in names[met] or [NOTHING])])
        for met, word in ((True, "Met"), (None, "Open"), (False, "Missed"))
    ]


def _of_stretch(summary: dict[str, Any]) -> list[str]:
    """Why a goal that the figure reaches and the interval does not is open."""
    return [
        f"*{goal['name']}* is open: the figure is {100 * goal['figure']:.1f} %, and its interval, "
        f"{100 * goal['low']:.1f} to {100 * goal['high']:.1f} %, contains the goal of {100 * goal['goal']:.0f} %."
        for goal in summary["goals"]
        if goal["met"] is None and goal["low"] is not None and goal["name"].startswith("fall")
    ]


def _reasons(summary: dict[str, Any]) -> list[str]:
    """Of each goal of the gap that is missed: in which families, and what its calibrations say of themselves."""
    found = []
    for goal in summary["goals"]:
        if goal["met"] is not False or not goal["why"]:
            continue
        twins = goal["why"]
        families = sorted({each["family"] for each in twins})
        text = f"{len(twins)} of {goal['n']} twins ({', '.join(families)}) miss *{goal['name']}*"
        checked = [each for each in twins if each.get("misspecification_p") is not None]
        if checked:
            flagged = sum(bool(each["misspecified"]) for each in checked)
            ends = sorted({name for each in checked for name in each["at_prior_end"]})
            text += (
                f". The posterior predictive check flags {flagged} of these {len(checked)}. Parameters at an end of "
                f"their prior: {', '.join(f'`{name}`' for name in ends) or NOTHING}"
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
        f"The median MMRV falls from {before:.4f} {falls}. To reach twice the median floor, "
        f"{2 * floor:.4f}, it would have to fall by {wanted:.0f} %.",
        *_of_few(summary),
    ]


def _of_few(summary: dict[str, Any]) -> list[str]:
    """How much of the rank violations is due to the controllers that are predicted worst."""
    found = []
    for observe in summary["plan"]["observations"]:
        source, target = means_of(summary, observe)
        if not len(source):
            continue
        left, worst = without_worst(source, target)
        rng = np.random.default_rng(1)
        spread = np.sqrt(np.mean((source - target) ** 2, axis=1, keepdims=True))
        normal = [
            without_worst(target + spread * rng.normal(size=target.shape), target)[0]
            for _ in range(NORMAL_STUDIES)
        ]
        low, high = np.percentile(normal, [2.5, 97.5])
        random = np.mean(worst < summary["plan"]["controllers"] // 2)
        found.append(
            f"With `{observe}`, {100 * left:.0f} % of the median MMRV would be left ({100 * random:.0f} % of the worst "
            f"are random controllers). Normal errors of equal size would leave {100 * low:.0f} to {100 * high:.0f} %."
        )
    if not found:
        return []
    return [
        f"How much of the MMRV is due to a few controllers? Suppose that the {FEW} worst-predicted of the "
        f"{summary['plan']['controllers']} controllers were predicted exactly on each twin. {' '.join(found)}"
    ]


def without_worst(source: Values, target: Values) -> tuple[float, NDArray[np.int64]]:
    """Return the share of the median MMRV that is left if the worst-predicted controllers are predicted exactly.

    Args:
        source: (t, c) mean coverage in simulation of c controllers, for t twins.
        target: (t, c) mean coverage on the twins.

    Returns:
        The share, and the (t, FEW) places of these controllers.
    """
    worst = np.argsort(-np.abs(source - target), axis=1)[:, :FEW]
    exact = source.copy()
    np.put_along_axis(exact, worst, np.take_along_axis(target, worst, axis=1), axis=1)
    before, after = (np.median(mean_maximum_rank_violation(each, target)) for each in (source, exact))
    return float(after / before), worst


def means_of(summary: dict[str, Any], observe: str) -> tuple[Values, Values]:
    """Return mean coverages in simulation, as it is or calibrated, and on the twins, (t, c) each."""
    rows = [
        twin if observe == "none" else _at_goal(twin, summary["budget"], observe) for twin in summary["twins"]
    ]
    means = [row["means"] for row in rows if row is not None]
    source, target = (np.array([each[side] for each in means]) for side in ("source", "target"))
    return source, target


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
  and worse from one with less *or more* noise. This study does not test it: noise is fitted, and no condition has less
  or more noise than the fit. To test it on one target, run `realitygap transfer --strategy noise --strategy posterior`.
* Miglino, Nafasi & Taylor (1995), on a robot that should explore an arena: the correlation of simulated and real
  performance rises with noise in the simulation. Here, the median SRCC over twins is {order[0]:.2f} with the
  uncalibrated simulator and {order[1]:.2f} after {summary["budget"]} trials (`track`). It rises on {rises} of
  {len(pairs)} twins. Noise was fitted together with other parameters, so its effect is not separate. Miglino, Lund &
  Nolfi (1995) bring simulation and robot closer by sampling the robot's own sensors and motors, as calibration does.
* Koos, Mouret & Doncieux (2013): a few trials on the target are spent on learning where the simulation is wrong. They
  find controllers that transfer. Here, the same number of trials changes the simulation itself, chooses among
  champions, or is all that evolution has. Coverage on the twin minus the coverage of `plain`: {gains}.
  This study does not include their own strategy, `transferability`.
* Ligot & Birattari (2019): pseudo-reality, another simulator in place of the robot, reproduces which design methods
  lose performance in reality. This makes this study a test, and also limits it: an order of methods may be the same
  on a robot, but an amount may not.
"""


def _at_goal(twin: dict[str, Any], budget: int, observe: str) -> dict[str, Any] | None:
    """A twin's gap after calibrating by so many trials."""
    found: Iterable[dict[str, Any]] = twin["calibrated"]
    return next((each for each in found if (each["observe"], each["budget"]) == (observe, budget)), None)


MEANS_HEAD = ("twin", "controller", "kind", "TWIN", "none", "cells", "track")
EXCESS_HEAD = ("observed", "twins", "MMRV", "floor", "excess", "95 % interval")
KIND_HEAD = (
    "controllers",
    "observed",
    "RMS gap before",
    "after",
    "fall",
    "95 %, twins",
    "95 %, seeds and controllers",
    "fall without noise",
)
EARLIER_HEAD = (
    "commit",
    "date",
    "twins",
    "fall, cells",
    "95 % interval",
    "fall, track",
    "95 % interval",
    "what changed since the row before",
)


def excess_table(summary: dict[str, Any]) -> Iterable[Sequence[str]]:
    """By how much the rank violation exceeds what the twin's noise causes, mean over twins, before and after."""
    for observe in ("none", *summary["plan"]["observations"]):
        rows = [
            twin if observe == "none" else _at_goal(twin, summary["budget"], observe)
            for twin in summary["twins"]
        ]
        gaps = [row["gap"] for row in rows if row is not None and row["gap"].get("mmrv_floor") is not None]
        if not gaps:
            continue
        violations, floors = (np.array([gap[name] for gap in gaps]) for name in ("mmrv", "mmrv_floor"))
        excess = mean_interval(violations - floors)
        ends = "–" if excess.ends is None else f"{excess.low:.4f} to {excess.high:.4f}"
        yield (
            observe,
            str(len(gaps)),
            f"{violations.mean():.4f}",
            f"{floors.mean():.4f}",
            f"{excess.value:.4f}",
            ends,
        )


def means_table(summary: dict[str, Any]) -> Iterable[Sequence[str]]:
    """Mean coverage of each held-out controller on each twin and in simulation, as it is and calibrated."""
    n_random = summary["plan"]["controllers"] // 2  # they come first
    for twin in summary["twins"]:
        after = [_at_goal(twin, summary["budget"], observe) for observe in MEANS_HEAD[-2:]]
        columns = [twin["means"]["target"], twin["means"]["source"]]
        columns += [[None] * len(columns[0]) if each is None else each["means"]["source"] for each in after]
        for k, row in enumerate(zip(*columns, strict=True)):
            kind = "random" if k < n_random else "champion"
            yield (
                twin["twin"],
                str(k),
                kind,
                *("" if value is None else f"{value:.6f}" for value in row),
            )


def results_in(folder: Path) -> dict[str, Any]:
    """Return the summary of a folder of results.

    Raises:
        SystemExit: The folder has no results that can be read. Python then prints the message alone.
    """
    try:
        return summarize_closing(folder)
    except RealityGapError as error:
        raise SystemExit(str(error)) from None


def stored_summary() -> dict[str, Any]:
    """The summary that the page was last made from, as far as tables and sentences need it."""
    summary: dict[str, Any] = json.loads((TABLES / "summary.json").read_text("utf-8"))
    rows: dict[str, list[dict[str, str]]] = {}
    with (TABLES / "means.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            rows.setdefault(row["twin"], []).append(row)
    for twin in summary["twins"]:
        columns = {name: [row[name] for row in rows[twin["twin"]]] for name in MEANS_HEAD[3:]}
        target = [float(value) for value in columns["TWIN"]]
        twin["means"] = {"source": [float(value) for value in columns["none"]], "target": target}
        for observe in MEANS_HEAD[-2:]:
            after = _at_goal(twin, summary["budget"], observe)
            if after is not None:
                after["means"] = {"source": [float(value) for value in columns[observe]], "target": target}
    for goal in summary["goals"]:
        goal["met"] = is_met(goal["low"], goal["high"], goal["goal"], goal["sense"])
    return summary


def kind_table(summary: dict[str, Any]) -> Iterable[Sequence[str]]:
    """The fall of the gap for random controllers and champions apart, in the columns of `KIND_HEAD`.

    The RMS gap of a part of the controllers has the noise of the trials in it: how much of it falls on each part is not
    stored. The last column bounds the fall without it: the noise of a part is at least 0 and, as parts are of equal
    size, at most twice the mean over all.
    """
    n = summary["plan"]["controllers"]
    parts = {"all": slice(0, n), "random": slice(0, n // 2), "champions": slice(n // 2, n)}
    source, target = means_of(summary, "none")
    before = (target - source) ** 2
    noise = before.mean(axis=1) - _rms(summary, "none") ** 2
    for name, part in parts.items():
        for observe in summary["plan"]["observations"]:
            source, target = means_of(summary, observe)
            after = (target - source) ** 2
            left = after.mean(axis=1) - _rms(summary, observe) ** 2
            falls = _falls(before[:, part], after[:, part])
            over_twins = median_interval(falls)
            low, high = _over_seeds(summary, before[:, part], after[:, part], halves=name == "all")
            if name == "all":
                within = f"{_percent(np.median(1 - _rms(summary, observe) / _rms(summary, 'none')))} %"
            else:
                least, most = (
                    float(np.median(1 - np.sqrt(np.maximum(low_after, 0) / np.maximum(high_before, 0))))
                    for low_after, high_before in (
                        (after[:, part].mean(axis=1), before[:, part].mean(axis=1) - 2 * noise),
                        (after[:, part].mean(axis=1) - 2 * left, before[:, part].mean(axis=1)),
                    )
                )
                within = f"{_percent(least)} to {_percent(most)} %"
            yield (
                name,
                observe,
                *(f"{np.median(np.sqrt(each[:, part].mean(axis=1))):.3f}" for each in (before, after)),
                f"{_percent(over_twins.value)} %",
                f"{_percent(over_twins.low)} to {_percent(over_twins.high)} %",
                f"{_percent(low)} to {_percent(high)} %",
                within,
            )


def _rms(summary: dict[str, Any], observe: str) -> Values:
    """(t,) RMS gaps over all controllers, noise removed."""
    rows = [
        twin if observe == "none" else _at_goal(twin, summary["budget"], observe) for twin in summary["twins"]
    ]
    return np.array([row["rms"]["estimate"] for row in rows if row is not None])


def _falls(before: Values, after: Values) -> Values:
    """(t,) falls of the RMS gap from (t, c) squared differences."""
    falls: Values = 1 - np.sqrt(after.mean(axis=1) / before.mean(axis=1))
    return falls


def _over_seeds(
    summary: dict[str, Any], before: Values, after: Values, *, halves: bool
) -> tuple[float, float]:
    """95 % of the median fall if seeds and controllers are resampled: bootstrap percentiles.

    The twins of a seed share the noise of their simulated trials, and all twins share the controllers. So a resampled
    seed brings its twins of all families, and a resampled controller counts for all twins; kinds are resampled apart.
    """
    families = len(summary["plan"]["families"])
    rng = np.random.default_rng(1)
    n_seeds, n = len(before) // families, before.shape[1]
    groups = np.split(np.arange(n), 2) if halves else [np.arange(n)]
    medians = []
    for _ in range(RESAMPLES):
        seeds = rng.integers(n_seeds, size=n_seeds)
        twins = (families * seeds[:, None] + np.arange(families)).ravel()
        controllers = np.concatenate([rng.choice(group, len(group)) for group in groups])
        drawn = np.ix_(twins, controllers)
        medians.append(np.median(_falls(before[drawn], after[drawn])))
    low, high = np.percentile(medians, [2.5, 97.5])
    return float(low), float(high)


def _percent(value: float) -> str:
    return f"{100 * value:.0f}".replace("-", "−")


def earlier_table() -> Iterable[Sequence[str]]:
    """Each publication of results on these twins, in the columns of `EARLIER_HEAD`, read from the history."""
    for commit, changed in zip(EARLIER, CHANGED, strict=True):
        shown = ("git", "show", f"{commit}:docs/data/closing/summary.json")
        summary = json.loads(subprocess.run(shown, capture_output=True, check=True, cwd=HERE).stdout)
        date = subprocess.run(
            ("git", "log", "-1", "--format=%cs", commit), capture_output=True, check=True, text=True, cwd=HERE
        ).stdout.strip()
        goals = {goal["name"]: goal for goal in summary["goals"]}
        figures = []
        for observe in ("cells", "track"):
            goal = goals[f"fall of the RMS gap, {observe}"]
            figures += [
                f"{100 * goal['figure']:.1f} %",
                f"{100 * goal['low']:.1f} to {100 * goal['high']:.1f} %",
            ]
        yield (commit, date, str(len(summary["twins"])), *figures, changed)


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


def texts(summary: dict[str, Any]) -> dict[str, str]:
    """Tables and sentences of the page, by file name."""
    return {
        "goals.csv": csv_of(goal_table(summary)),
        "families.csv": csv_of(family_table(summary)),
        "kinds.csv": table(KIND_HEAD, kind_table(summary)),
        "strategies.csv": csv_of(strategy_table(summary)),
        "twins.csv": csv_of(twin_table(summary)),
        "why.csv": csv_of(why_table(summary)),
        "words.md": sentences(summary),
        "directions.md": directions(summary),
        "summary.json": slim(summary),
        "means.csv": table(MEANS_HEAD, means_table(summary)),
        "excess.csv": table(EXCESS_HEAD, excess_table(summary)),
    }


def main() -> None:
    """Write the data, tables, sentences and figures of the page."""
    parser = argparse.ArgumentParser(description="Tables, figures and sentences of the study of many twins.")
    parser.add_argument("folder", type=Path, nargs="?", help="results of `realitygap closing-the-gap`")
    parser.add_argument("--earlier", action="store_true", help="write the table of earlier runs instead")
    options = parser.parse_args()
    if options.earlier:
        files = {TABLES / "earlier.csv": table(EARLIER_HEAD, earlier_table())}
    else:
        summary = stored_summary() if options.folder is None else results_in(options.folder)
        files = {TABLES / name: text for name, text in texts(summary).items()}
        if options.folder is not None:
            drawn = draw_closing(summary)
            files |= {FIGURES / f"{name}.svg": drawing.svg + "\n" for name, drawing in drawn.items()}
    write_files(files)


if __name__ == "__main__":
    main()

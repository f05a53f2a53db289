"""Distances of behaviors: the numbers and figures of the page "Distances of behaviors".

    uv run python docs/make_distances.py            # some 15 seconds
    uv run python docs/make_distances.py --times    # on an idle machine: how long one distance takes

Audits every distance on random walks, carries out `realitygap run distances` in a temporary folder, audits distances
on its trials, and writes docs/data/distances/*.csv and docs/images/distances/*.svg. `--times` writes the measured
times, docs/data/distances-times.csv, and nothing else.
"""

from __future__ import annotations

import argparse
import csv
import io
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import polars as pl
from written import write_files

from realitygap import ResultsFolder, run_study
from realitygap.evolution import DISTANCES
from realitygap.report import (
    DistanceAudit,
    audit_distance,
    compare_choices,
    compare_conditions,
    draw_choices,
    draw_distance,
    measure_variety,
)
from realitygap.report._distance_audit import random_walk
from realitygap.stats import Ends, Estimate, bca_interval, bca_mean, difference_of_means

HERE = Path(__file__).parent
TABLES = HERE / "data" / "distances"
FIGURES = HERE / "images" / "distances"
TIMES = HERE / "data" / "distances-times.csv"
DRAWN = ("paper", "jaccard", "alignment")
STRAIGHT = (0.0, 0.3, 0.6, 0.9)
AUDITED = "paper"
"""The condition on whose trials distances are audited."""


def make(folder: Path, replicates: int | None = None) -> tuple[dict[str, str], dict[str, str]]:
    """The tables and figures of the page, by file name; the study is carried out below `folder`."""
    audits = {name: audit_distance(name) for name in DISTANCES}
    study = run_study("distances", folder / "distances", replicates=replicates).folder
    tables = {
        "weights.csv": weights(audits),
        "lengths.csv": lengths(audits),
        "trials.csv": on_trials(study),
        "coverage.csv": coverage(study),
        "behaviors.csv": behaviors(study),
    }
    figures = {f"{name}.svg": draw_distance(audits[name], name=f"audit-{name}").svg + "\n" for name in DRAWN}
    figures["coverage.svg"] = draw_choices(study).svg + "\n"
    return tables, figures


# audits


def weights(audits: dict[str, DistanceAudit]) -> str:
    """What cells weigh on random walks."""
    rows = [
        [
            name,
            f"{each.front_over_back.value:.2f}",
            _span(each.front_over_back, ".2f"),
            "all alike" if each.order_correlation.value is None else _signed(each.order_correlation.value),
            "" if each.order_correlation.value is None else _span(each.order_correlation),
            f"{each.highest_over_lowest:.2f}",
        ]
        for name, each in audits.items()
    ]
    head = ["Distance", "first quarter over last", "95 % interval", "correlation with order", "95 % interval"]
    return _csv([*head, "highest over lowest"], rows)


def lengths(audits: dict[str, DistanceAudit]) -> str:
    """Spearman's correlation of distance with the difference in length, for walks more and less straight."""
    rows = []
    for name, audit in audits.items():
        row: list[object] = [name]
        for straight in STRAIGHT:
            usual = straight == audit.straight
            found = (audit if usual else audit_distance(name, straight=straight, n_walks=10)).confounds[0]
            row.append(f"{_signed(found.correlation.value)} ({_span(found.correlation)})")
        rows.append(row)
    return _csv(["Distance", *(f"straight on {100 * each:.0f} %" for each in STRAIGHT)], rows)


def on_trials(study: ResultsFolder) -> str:
    """The same on trials of one condition of the study, beside random walks."""
    rows = []
    for name, distance in DISTANCES.items():
        if distance.compares == "cells":
            found = audit_distance(name, study, n_walks=10).confounds
            chosen = [each for each in found if each.of in ("random walks", AUDITED)]
            rows.append(
                [
                    name,
                    *(f"{_signed(each.correlation.value)} ({_span(each.correlation)})" for each in chosen),
                ]
            )
    rows.append(["shorter within longer", *(f"{100 * each.contained:.0f} %" for each in chosen)])
    return _csv(["Distance", "random walks", f"trials of “{AUDITED}”"], rows)


# the study


def coverage(study: ResultsFolder) -> str:
    """Best coverage of a run with each distance, and each against the paper's."""
    compared = {each.one: each for each in compare_conditions(study) if each.other == "paper"}
    (choices,) = compare_choices(study)
    rows: list[list[object]] = []
    for choice in choices:
        each = compared.get(choice.condition)
        row: list[object] = [
            choice.condition,
            choice.n,
            f"{choice.median:.3f} ({_span(choice.interval, '.3f')})",
        ]
        if each is not None:
            row += [
                f"{_signed(each.size, '.3f')} ({_span(each.difference, '+.3f')})",
                f"{each.a12.value:.2f} ({_span(each.a12, '.2f')})",
                f"{each.p_holm:.2g}" if each.p_holm >= 1e-4 else "< 0.0001",
                "" if each.detectable is None else f"{each.detectable:.3f}",
                each.difference_verdict.partition(":")[0],
                "" if each.is_shown else each.equivalence,
            ]
        rows.append([*row, *[""] * (9 - len(row))])
    head = [
        "Condition",
        "n",
        "median",
        "mean − paper’s mean",
        "A12",
        "p (Holm)",
        "detectable",
        "Conclusion",
        "Equivalence",
    ]
    return _csv(head, rows)


def behaviors(study: ResultsFolder) -> str:
    """What evolves: cells visited, where they lie, how novelty goes with their number, and variety."""
    variety = {each.condition: each.jaccard for each in measure_variety(study)}
    runs = {name: _per_run(study, name) for name in variety}
    reference = runs["paper"]
    rows = []
    for name, frame in runs.items():
        moved = {}
        for what in ("cells", "column", "row"):
            one, other = frame[what].to_numpy(), reference[what].to_numpy()
            interval = bca_interval(difference_of_means, one, other, paired=True) if name != "paper" else None
            difference = "" if name == "paper" else _signed((one - other).mean())
            moved[what] = f"{difference} ({_span(interval)})" if difference else ""
        goes_with = frame["novelty"].drop_nulls().to_numpy()
        novel = f"{_signed(goes_with.mean())} ({_span(bca_mean(goes_with))})" if len(goes_with) else ""
        rows.append(
            [
                name,
                f"{frame['cells'].mean():.1f}",
                moved["cells"],
                f"{frame['column'].mean():.2f}",
                moved["column"],
                f"{frame['row'].mean():.2f}",
                moved["row"],
                novel,
                f"{variety[name].mean():.3f} ({_span(bca_mean(variety[name]), '.3f')})",
            ]
        )
    head = ["Condition", "cells of a trial", "− paper’s", "mean column", "− paper’s", "mean row"]
    return _csv([*head, "− paper’s", "novelty with cells", "variety"], rows)


def _per_run(study: ResultsFolder, condition: str) -> pl.DataFrame:
    """One row a run, of the trials after its first generation.

    `cells`: visited ones of a trial, on average; `column`, `row`: of the visited cells of a trial, averaged; `novelty`:
    Spearman's correlation of novelty and number of cells within a generation, averaged, null where there is none.
    """
    columns = 12
    rows = study.read(condition, columns=["replicate", "generation", "cells", "novelty"])
    cell = pl.element().cast(pl.Int64)
    trials = rows.filter(pl.col("generation") > 0).with_columns(
        n=pl.col("cells").list.len().cast(pl.Float64),
        column=pl.col("cells").list.eval(cell % columns).list.mean(),
        row=pl.col("cells").list.eval(cell // columns).list.mean(),
    )
    novelty = pl.corr("novelty", "n", method="spearman").fill_nan(None).alias("novelty")
    generations = trials.group_by("replicate", "generation", maintain_order=True).agg(
        pl.col("n", "column", "row").mean(), novelty
    )
    return generations.group_by("replicate", maintain_order=True).agg(
        pl.col("n").mean().alias("cells"), pl.col("column", "row", "novelty").mean()
    )


# times


def times(n: int = 200, seconds: float = 0.3) -> str:
    """Nanoseconds that one distance takes, of n random walks to each other: the least of several sweeps."""
    from realitygap.evolution._distances import measure_of, pack_behaviors
    from realitygap.kernels.neat.distances import distances_between

    rng = np.random.default_rng(1)
    walks = [random_walk(rng, 12, 6, 0.6) for _ in range(n)]
    found = np.empty((n, n))
    rows: list[list[object]] = []
    for name, distance in DISTANCES.items():
        measure = measure_of(name, 12, 6, "x-then-y")
        given = walks if distance.compares == "cells" else rng.random((n, 2))
        packed = pack_behaviors(measure, given, 12, 6)
        distances_between(measure, packed, packed, found)
        best, until = np.inf, time.process_time() + seconds
        while time.process_time() < until:
            since = time.process_time()
            distances_between(measure, packed, packed, found)
            best = min(best, time.process_time() - since)
        rows.append([name, distance.cost, f"{1e9 * best / n**2:.3g}"])
    return _csv(["Distance", "steps", "one distance [ns]"], rows)


# words


def _signed(value: float, form: str = "+.2f") -> str:
    text = f"{value:{form if form.startswith('+') else '+' + form}}"
    return text.replace("-", "−")


def _span(interval: Ends | Estimate | None, form: str = "+.2f") -> str:
    ends = interval.ends if isinstance(interval, Estimate) else interval
    return " to ".join(f"{end:{form}}".replace("-", "−") for end in ends or ())


def _csv(head: list[str], rows: Iterable[list[object]]) -> str:
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows([head, *rows])
    return file.getvalue()


def main() -> None:
    """Make them and write them anew."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--times", action="store_true", help="measure times instead")
    if parser.parse_args().times:
        write_files({TIMES: times()})
        return
    with tempfile.TemporaryDirectory() as temporary:
        for target, files in zip((TABLES, FIGURES), make(Path(temporary)), strict=True):
            write_files({target / name: text for name, text in files.items()})


if __name__ == "__main__":
    main()

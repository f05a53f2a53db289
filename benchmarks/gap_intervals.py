"""How often intervals and plans of the gap are wrong: simulated studies whose truth is known.

    python benchmarks/gap_intervals.py rms mmrv plan --out docs/data
    python benchmarks/gap_intervals.py printed --studies 200
    python benchmarks/gap_intervals.py coverage --studies 2000 --out docs/data

`rms` and `mmrv`: how often the upper end of the 95 % interval is below the truth, and the lower end above it; both
should be 2.5 %. `plan`: how often a study of the size that `realitygap plan --correlation` names shows it, by the rule
of the plan. `printed`: the same by the interval that `realitygap gap` prints. `coverage`: how often the interval of
each measure holds the truth, in 12 designs. Writes a table of each, `gap-NAME.csv`. Seeds are fixed.
"""

from __future__ import annotations

import argparse
import csv
import math
import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from realitygap.gap import (
    GapSide,
    bootstrap,
    mean_maximum_rank_violation,
    measure_gap,
    rank_violation_interval,
    rms_interval,
    square_differences,
)
from realitygap.stats import Ends, percentile_interval, plan_correlation

Values = NDArray[np.float64]

STUDIES = 4_000
RESAMPLES = 400

CELLS = 72
BETWEEN, NOISE = 0.1, 0.08
"""Standard deviations of controllers, and of one trial about its controller's mean, where scores are normal."""

FAILING = 0.15
"""Share of the controllers that have a gap, where few have one."""


COVERED_RESAMPLES = 1_000
MANY = 200_000
"""Controllers by which the truth of a measure is computed."""

ENDS = 0.1
"""Standard deviations of the final positions of a controller's trials, and of their shift over controllers [m]."""


class Setting(NamedTuple):
    """Studies with `shape` of true differences: their mean is `level`, and `spread` their standard deviation.

    Few: 15 % of the controllers have a gap of `spread`, the others none. Cells: coverages are multiples of 1 / 72.
    """

    controllers: int
    in_simulation: int
    on_target: int
    level: float
    spread: float
    shape: str = "normal"


SETTINGS = (
    Setting(5, 10, 10, 0.05, 0.05),
    Setting(6, 10, 10, 0.05, 0.05),
    Setting(8, 10, 10, 0.05, 0.05),
    Setting(10, 10, 10, 0.05, 0.05),
    Setting(20, 10, 10, 0.05, 0.05),
    Setting(30, 20, 20, 0.05, 0.05),
    Setting(8, 20, 4, 0.05, 0.05),
    Setting(20, 2, 2, 0.05, 0.05),
    Setting(10, 4, 4, 0.0, 0.06),
    Setting(20, 50, 5, 0.0, 0.03),
    Setting(10, 10, 10, 0.1, 0.0),
    Setting(5, 50, 50, 0.0, 0.1),
    Setting(10, 50, 50, 0.0, 0.1),
    Setting(20, 20, 20, 0.0, 0.1),
    Setting(5, 4, 4, 0.0, 0.0),
    Setting(10, 4, 4, 0.0, 0.0),
    Setting(20, 10, 10, 0.0, 0.0),
    Setting(30, 2, 2, 0.0, 0.0),
    Setting(8, 10, 10, 0.09, 0.06, "exponential"),
    Setting(20, 10, 10, 0.09, 0.06, "exponential"),
    Setting(60, 10, 10, 0.09, 0.06, "exponential"),
    Setting(30, 10, 10, 0.0, 0.2, "few"),
    Setting(8, 5, 5, 0.0, 0.1, "cells"),
    Setting(20, 10, 10, 0.03, 0.05, "cells"),
    Setting(30, 20, 20, -0.1, 0.1, "cells"),
)

COVERED = tuple(SETTINGS[k] for k in (0, 3, 4, 5, 6, 7, 9, 16, 19, 21, 23, 24))
"""The designs of the table of coverage."""

PLANS = ((0.9, 0.7, 0.8, 10), (0.9, 0.5, 0.8, 5), (0.8, 0.3, 0.9, 5))
"""Correlation, at least, reliability of both sides' means, trials of each controller."""

PLAN_HEAD = ("correlation", "at least", "reliability", "trials each", "controllers")


def qualities(setting: Setting, shape: tuple[int, ...], rng: np.random.Generator) -> tuple[Values, Values]:
    """Return the true qualities of controllers in simulation and on the target."""
    if setting.shape == "cells":
        source = np.clip(rng.beta(2, 3, shape), 0.02, 0.98)
        return source, np.clip(source + rng.normal(setting.level, setting.spread, shape), 0.02, 0.98)
    apart = {
        "normal": lambda: rng.normal(setting.level, setting.spread, shape),
        "exponential": lambda: setting.level + setting.spread * (rng.exponential(1, shape) - 1),
        "few": lambda: setting.level + setting.spread * (rng.random(shape) < FAILING),
    }[setting.shape]()
    source = rng.normal(0.3, BETWEEN, shape)
    return source, source + apart


def study(setting: Setting, rng: np.random.Generator) -> tuple[Values, Values]:
    """Return the trials of one study: (c, r) in simulation and (c, q) on the target."""
    source, target = trials_of(setting, qualities(setting, (setting.controllers, 1), rng), rng)
    return source, target


def true_rms(setting: Setting, rng: np.random.Generator) -> float:
    """Return the RMS gap of all controllers, by formula or, of cells, by two million of them."""
    if setting.shape == "cells":
        source, target = qualities(setting, (2_000_000,), rng)
        return math.sqrt(((target - source) ** 2).mean())
    if setting.shape == "few":
        return math.sqrt((1 - FAILING) * setting.level**2 + FAILING * (setting.level + setting.spread) ** 2)
    return math.hypot(setting.level, setting.spread)


def rms_ends(source: Values, target: Values, rng: np.random.Generator) -> Ends | None:
    """Return the interval of the RMS gap as `measure_gap` does, with fewer resamples."""
    squares = square_differences(source[None], target[None])[0]
    resampled = squares[rng.integers(0, len(squares), (RESAMPLES, len(squares)))].mean(axis=1)
    return rms_interval(target.mean(axis=1) - source.mean(axis=1), squares, resampled)


def violation(source: Values, target: Values) -> Values:
    """Return the MMRV of (b, c, r) and (b, c, q) trials."""
    return mean_maximum_rank_violation(source.mean(axis=2), target.mean(axis=2))


def true_violation(setting: Setting, rng: np.random.Generator) -> float:
    """Return the mean MMRV of studies."""
    drawn = [study(setting, rng) for _ in range(STUDIES)]
    return float(np.mean([violation(source[None], target[None]) for source, target in drawn]))


def violation_ends(source: Values, target: Values, rng: np.random.Generator) -> Ends | None:
    """Return the interval of the MMRV as `measure_gap` does."""
    if violation(source[None], target[None])[0] > 0:
        return rank_violation_interval(source.mean(axis=1), target.mean(axis=1))
    sides = GapSide("sim", "SIM", source), GapSide("target", "SIM", target)
    drawn = bootstrap({"mmrv": violation}, *sides, RESAMPLES, rng, smooth=True)["mmrv"]
    ends = percentile_interval(drawn, len(source))
    return None if ends is None else (0.0, ends[1])


Method = Callable[[Values, Values, np.random.Generator], Ends | None]
Truth = Callable[[Setting, np.random.Generator], float]


def misses(ends: Method, truth: Truth, studies: int) -> Iterator[list[str]]:
    """Yield the rows of a table of misses, its head first."""
    yield [
        "controllers", "trials in simulation", "on the target", "level", "spread", "differences", "truth",
        "upper end misses [%]", "lower end misses [%]", "mean width",
    ]  # fmt: skip
    for number, setting in enumerate(SETTINGS):
        rng = np.random.default_rng([16, number])
        true = truth(setting, rng)
        low, high = np.array(
            [ends(*study(setting, rng), rng) or (np.nan, np.nan) for _ in range(studies)], float
        ).T
        above, below = (f"{100 * share:.1f}" for share in ((high < true).mean(), (low > true).mean()))
        numbers = [str(each) for each in setting[:3]] + [f"{each:g}" for each in setting[3:5]]
        yield [*numbers, setting.shape, f"{true:.3f}", above, below, f"{(high - low).mean():.3f}"]


def normal_study(
    correlation: float, reliability: float, n: int, trials: int, rng: np.random.Generator
) -> list[Values]:
    """Return (n, trials) of both sides, of normal controllers with this rank correlation."""
    pearson = 2 * math.sin(math.pi * correlation / 6)
    latent = rng.multivariate_normal([0, 0], [[1, pearson], [pearson, 1]], n)
    noise = math.sqrt(trials * (1 - reliability) / reliability)
    return [latent[:, [side]] + noise * rng.normal(size=(n, trials)) for side in (0, 1)]


def is_shown(sides: list[Values], least: float, reliability: float) -> bool:
    """Return whether the rank correlation of means is above the attenuated least one, one-sided at 5 %."""
    seen = float(stats.spearmanr(*(side.mean(axis=1) for side in sides)).statistic)
    floor = 6 / math.pi * math.asin(math.sin(math.pi * least / 6) * reliability)
    error = math.sqrt((1 + seen**2 / 2) / (len(sides[0]) - 3))
    return math.atanh(min(seen, 1 - 1e-12)) - 1.6448536 * error > math.atanh(floor)


def is_printed(sides: list[Values], least: float) -> bool:
    """Return whether `realitygap gap` prints an interval of the correlation without noise that lies above."""
    source, target = (GapSide(name, "SIM", side) for name, side in zip(("sim", "target"), sides, strict=True))
    low = measure_gap(source, target, resamples=RESAMPLES).srcc_disattenuated.low
    return low is not None and low > least


def plans(studies: int) -> Iterator[list[str]]:
    """Yield the rows of a table of plans and of the share of other studies that show the correlation, head first."""
    yield [*PLAN_HEAD, "power of the plan", "shown in other simulated studies"]
    for number, (correlation, least, reliability, trials) in enumerate(PLANS):
        rng = np.random.default_rng([17, number])
        plan = plan_correlation(correlation, least=least, reliability=reliability, trials=trials)
        size = reliability, plan.controllers or 0, trials
        shown = np.mean(
            [is_shown(normal_study(correlation, *size, rng), least, reliability) for _ in range(studies)]
        )
        row = [f"{each:g}" for each in (correlation, least, reliability, trials, size[1])]
        yield [*row, f"{plan.power:.3f}", f"{shown:.3f}"]


def printed(studies: int) -> Iterator[list[str]]:
    """Yield the rows of a table of plans and of the share of studies whose printed interval shows it, head first."""
    yield [*PLAN_HEAD, "interval above the least one", "the same if the correlation is the least one"]
    for number, (correlation, least, reliability, trials) in enumerate(PLANS):
        rng = np.random.default_rng([18, number])
        plan = plan_correlation(correlation, least=least, reliability=reliability, trials=trials)
        size = reliability, plan.controllers or 0, trials
        shares = [
            np.mean([is_printed(normal_study(true, *size, rng), least) for _ in range(studies)])
            for true in (correlation, least)
        ]
        row = [f"{each:g}" for each in (correlation, least, reliability, trials, size[1])]
        yield [*row, *(f"{each:.3f}" for each in shares)]


def trials_of(setting: Setting, sides: tuple[Values, Values], rng: np.random.Generator) -> list[Values]:
    """Return trials of controllers with these true qualities, (c, r) in simulation and (c, q) on the target."""
    sizes = [(len(sides[0]), n) for n in (setting.in_simulation, setting.on_target)]
    if setting.shape == "cells":
        return [rng.binomial(CELLS, side, size) / CELLS for side, size in zip(sides, sizes, strict=True)]
    return [side + rng.normal(0, NOISE, size) for side, size in zip(sides, sizes, strict=True)]


def ends_of(setting: Setting, n: int, sizes: tuple[int, int], rng: np.random.Generator) -> list[Values]:
    """Return the final positions of trials of n controllers on both sides, (n, r, 2) and (n, q, 2)."""
    shift = rng.normal(0, ENDS, (n, 1, 2)) * (setting.level != 0 or setting.spread != 0)
    places = rng.normal(0, 1, (n, 1, 2))
    return [
        at + rng.normal(0, ENDS, (n, r, 2)) for at, r in zip((places, places + shift), sizes, strict=True)
    ]


def correlation(one: Values, other: Values) -> float:
    """Return Spearman's correlation."""
    return float(stats.spearmanr(one, other).statistic)


def true_ceiling(setting: Setting, rng: np.random.Generator) -> float:
    """Return the noise ceiling of as many controllers: means of trials against those of new trials."""
    repeats = []
    for _ in range(STUDIES):
        sides = qualities(setting, (setting.controllers, 1), rng)
        pairs = zip(*(trials_of(setting, sides, rng) for _ in range(2)), strict=True)
        repeats.append([correlation(*(trials.mean(axis=1) for trials in pair)) for pair in pairs])
    return math.sqrt(math.prod(np.nanmean(repeats, axis=0)))


def truths(setting: Setting, rng: np.random.Generator) -> dict[str, float]:
    """Return the truth of each measure, of many controllers or, if it depends on their number, of as many."""
    sides = qualities(setting, (MANY, 1), rng)
    one = trials_of(setting, sides, rng)
    means = [side.mean(axis=1) for side in one]
    single = [side[:, 0] for side in one]
    above = (single[1] > single[0]).mean() + (single[1] == single[0]).mean() / 2
    studies = [study(setting, rng) for _ in range(STUDIES)]
    halves = [np.array_split(rng.permuted(target, axis=1), 2, axis=1) for _, target in studies]
    size = setting.on_target // 2
    floors = [violation(first[None, :, :size], second[None, :, :size])[0] for first, second in halves]
    (x, also_x), (y, also_y) = (side.swapaxes(0, 1) for side in ends_of(setting, MANY, (2, 2), rng))
    apart, within, also_within = (
        float(np.linalg.norm(one - other, axis=1).mean()) for one, other in ((x, y), (x, also_x), (y, also_y))
    )
    level = float((sides[1] - sides[0]).mean())
    return {
        "level": level,
        "rms": true_rms(setting, rng),
        "a12": float(above),
        "srcc": correlation(*means),
        "srcc_disattenuated": correlation(*(side[:, 0] for side in sides)),
        "noise_ceiling": true_ceiling(setting, rng),
        "mmrv": float(np.mean([violation(source[None], target[None]) for source, target in studies])),
        "mmrv_floor": float(np.mean(floors)),
        "energy_ends": 2 * apart - within - also_within,
        "spread": float((sides[1] - sides[0]).std()),
        "equivalence": level,
    }


def coverage(studies: int) -> Iterator[list[str]]:
    """Yield the rows of a table of coverage, head first: how often the interval of each measure holds the truth."""
    yield [
        "controllers", "trials in simulation", "on the target", "level", "spread", "differences", "measure", "truth",
        "refused [%]", "holds the truth [%]", "upper end misses [%]", "lower end misses [%]",
    ]  # fmt: skip
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads of several processes wait for each other
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        for rows in pool.map(coverage_of, range(len(COVERED)), [studies] * len(COVERED)):
            yield from rows


def coverage_of(number: int, studies: int) -> list[list[str]]:
    """Return the rows of a design."""
    setting = COVERED[number]
    rng = np.random.default_rng([19, number])
    true = truths(setting, rng)
    found: dict[str, list[Ends]] = {name: [] for name in true}
    for _ in range(studies):
        ends = ends_of(setting, setting.controllers, setting[1:3], rng)
        sides = [
            GapSide(name, "SIM", values, ends=places)
            for name, values, places in zip(("sim", "target"), study(setting, rng), ends, strict=True)
        ]
        result = measure_gap(*sides, margin=0.05, resamples=COVERED_RESAMPLES)
        for name, kept in found.items():
            if (interval := getattr(result, name).ends) is not None:
                kept.append(interval)
    head = [str(each) for each in setting[:3]] + [f"{each:g}" for each in setting[3:5]] + [setting.shape]
    rows = []
    for name, kept in found.items():
        row = [*head, name, f"{true[name]:.3f}", f"{100 * (1 - len(kept) / studies):.1f}"]
        if not kept:
            rows.append([*row, "", "", ""])
            continue
        low, high = np.array(kept).T
        below, above = float((high < true[name] - 1e-9).mean()), float((low > true[name] + 1e-9).mean())
        rows.append([*row, *(f"{100 * share:.1f}" for share in (1 - below - above, below, above))])
    return rows


def main() -> None:
    """Parse, simulate, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tables", nargs="+", choices=("rms", "mmrv", "plan", "printed", "coverage"))
    parser.add_argument("--studies", type=int, default=STUDIES)
    parser.add_argument("--out", type=Path, default=Path(), metavar="FOLDER")
    given = parser.parse_args()
    for name in given.tables:
        rows = {
            "rms": lambda: misses(rms_ends, true_rms, given.studies),
            "mmrv": lambda: misses(violation_ends, true_violation, given.studies),
            "plan": lambda: plans(given.studies),
            "printed": lambda: printed(given.studies),
            "coverage": lambda: coverage(given.studies),
        }[name]()
        with (given.out / f"gap-{name}.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            for row in rows:
                writer.writerow(row)
                print(*row, sep="\t", flush=True)


if __name__ == "__main__":
    main()

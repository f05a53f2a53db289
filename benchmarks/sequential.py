"""How often sequential tests are wrong, how often they find a difference, and how many pairs they need.

    python benchmarks/sequential.py power errors binary --out docs/data
    python benchmarks/sequential.py power errors binary --neighbors ENV/lib/python3.11/site-packages --out docs/data

`power`: normal scores, independent within a pair; each study ends at twice the pairs of a paired t test with a power of
0.8, and 4 more. `errors`: studies without a difference, of 100 pairs. `binary`: successes and failures. Each writes a
table, `sequential-NAME.csv`. Seeds are fixed. With `--neighbors`, the folder of another environment that has
fieldtrial, its stopping rules are applied to the same studies.

Columns: `signs`, our sign-symmetric test, with its stakes for binary scores if all are 0 or 1; `means`, our bounded
betting; `mixture`, bets on the mean with constant fractions, averaged, which is a form of tests of bounded means;
`fieldtrial`, its anytime-valid test of paired differences; `looks`, its five looks with boundaries of O'Brien and
Fleming; `savi`, the test of Turner & Grünwald (2023) for two shares, each side at half of 5 %. The authors of N-SCORE
(arXiv 2603.13616) report that it needs as many trials as that test if it knows that scores are binary, and 4 to 5 %
more otherwise. Its program is not public here.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from realitygap.stats import BINARY_LAMBDAS, SequentialTest, plan_pairs

Values = NDArray[np.float64]
Ends = NDArray[np.int64]
Test = Callable[[Values, Values], Ends]
"""Returns for each of many studies, (studies, pairs) scores of A and of B, the pair at which it claims; 0 for none."""

STUDIES = 1_500
ALPHA = 0.05
FRACTIONS = np.arange(1, 20) / 20
"""Constant bets of the mixture, in parts of what can be lost."""


def signs(a: Values, b: Values) -> Ends:
    """The sign-symmetric test."""
    is_binary = bool(np.isin(a, (0, 1)).all() and np.isin(b, (0, 1)).all())
    test = SequentialTest(lambdas=BINARY_LAMBDAS) if is_binary else SequentialTest()
    return test.stops(a - b)


def means(a: Values, b: Values) -> Ends:
    """Bounded betting."""
    return SequentialTest(null="mean").stops(a - b)


def mixture(a: Values, b: Values) -> Ends:
    """Bets on the mean with constant fractions, averaged over fractions and both signs."""
    logs = [np.cumsum(np.log1p(bet * (a - b)), axis=1) for part in FRACTIONS for bet in (part, -part)]
    log_e = np.logaddexp.reduce(np.array(logs), axis=0) - math.log(len(logs))
    return first(log_e >= -math.log(ALPHA))


def savi(a: Values, b: Values) -> Ends:
    """Turner & Grünwald (2023), section 2: plug-in bets on two shares, for each direction at half of the error rate."""
    ends = []
    for one, other in ((a, b), (b, a)):  # bets that the first is larger
        before = np.arange(one.shape[1])
        high = (np.cumsum(one, axis=1) - one + 2) / (before + 3)
        low = (np.cumsum(other, axis=1) - other + 1) / (before + 3)
        equal = (high + low) / 2
        is_bet = high > low
        null_high, null_low = np.where(is_bet, equal, high), np.where(is_bet, equal, low)
        gain = (
            _log_share(one, high)
            + _log_share(other, low)
            - _log_share(one, null_high)
            - _log_share(other, null_low)
        )
        ends.append(first(np.cumsum(gain, axis=1) >= -math.log(ALPHA / 2)))
    return np.where((ends[0] > 0) & (ends[1] > 0), np.minimum(*ends), np.maximum(*ends))


def _log_share(values: Values, share: Values) -> Values:
    return np.log(np.where(values > 0.5, share, 1 - share))


def t_each(a: Values, b: Values) -> Ends:
    """A paired t test after each pair from the second on, as people look without a plan."""
    d, n = a - b, np.arange(1, a.shape[1] + 1)
    mean = np.cumsum(d, axis=1) / n
    variance = (np.cumsum(d**2, axis=1) - n * mean**2) / np.maximum(n - 1, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = mean / np.sqrt(np.maximum(variance, 1e-300) / n)
    critical = np.append(np.inf, stats.t.ppf(1 - ALPHA / 2, n[1:] - 1))
    return first((np.abs(t) > critical) & (np.abs(mean) > 1e-12))


def fieldtrial(a: Values, b: Values) -> Ends:
    """Its anytime-valid test: the capital against a mean difference of 0."""
    from fieldtrial.stats import capital_process

    capital = np.array([capital_process((row + 1) / 2, 0.5, ALPHA) for row in np.clip(a - b, -1, 1)])
    return first(capital > 1 / ALPHA)


def looks(a: Values, b: Values) -> Ends:
    """Its five looks, at equal parts of the maximum, with the paired t statistic in the place of z."""
    from fieldtrial.stats import spending_boundaries

    design = spending_boundaries([0.2, 0.4, 0.6, 0.8, 1.0], alpha=ALPHA)
    most, ends = a.shape[1], np.zeros(len(a), np.int64)
    for part, bar in zip(design.information, design.boundaries, strict=True):
        n = max(round(part * most), 3)
        d = (a - b)[:, :n]
        spread = d.std(axis=1, ddof=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.abs(d.mean(axis=1)) / spread * math.sqrt(n)
        is_crossed = np.where(spread > 0, t >= stats.t.isf(stats.norm.sf(bar), n - 1), False)
        ends = np.where((ends == 0) & is_crossed, n, ends)
    return ends


def first(reached: NDArray[np.bool_]) -> Ends:
    """Return the pair at which each study is first true, from 1 on; 0 if it never is."""
    return np.where(reached.any(axis=1), reached.argmax(axis=1) + 1, 0)


OURS: dict[str, Test] = {"signs": signs, "means": means, "mixture": mixture}
NEIGHBORS: dict[str, Test] = {"fieldtrial": fieldtrial, "looks": looks}


def summary(tests: dict[str, Test], a: Values, b: Values) -> dict[str, str]:
    """Return the share of studies that claim a difference, and the mean number of pairs, by test."""
    found = {}
    for name, test in tests.items():
        ends = test(a, b)
        pairs = np.where(ends > 0, ends, a.shape[1]).mean()
        found[name] = f"{(ends > 0).mean():.2f} / {pairs:.0f}"
    return found


def power(tests: dict[str, Test], studies: int) -> Iterator[dict[str, str]]:
    """Yield the powers and mean pairs for normal scores."""
    for difference in (0.05, 0.10, 0.20):
        for sd in (0.05, 0.10, 0.15):
            plan = plan_pairs(difference, sd * math.sqrt(2))
            most = min(2 * (plan.fixed or 0) + 4, 200)
            rng = np.random.default_rng(round(1000 * difference + 10 * sd))
            a, b = (
                np.clip(rng.normal(center, sd, (studies, most)), 0, 1)
                for center in (0.5 + difference / 2, 0.5 - difference / 2)
            )
            about = {
                "difference": f"{difference:.2f}",
                "sd of a trial": f"{sd:.2f}",
                "fixed pairs": str(plan.fixed),
            }
            yield about | {"maximum": str(most)} | summary(tests, a, b)


def errors(tests: dict[str, Test], studies: int) -> Iterator[dict[str, str]]:
    """Yield the shares of studies that claim a difference by 100 pairs, although there is none."""
    rng, k = np.random.default_rng(11), 100
    shape = (studies, k)
    drift = np.linspace(0.25, 0, 2 * k)
    coin = rng.integers(0, 2, shape)
    turns = [np.clip(rng.normal(0.5, 0.1, shape) + drift[i::2], 0, 1) for i in (0, 1)]
    cases = {
        "normal": [np.clip(rng.normal(0.5, 0.1, shape), 0, 1) for _ in range(2)],
        "skewed: Beta(0.6, 2.4)": [rng.beta(0.6, 2.4, shape) for _ in range(2)],
        "binary, 50 %": [rng.integers(0, 2, shape).astype(float) for _ in range(2)],
        "binary, 10 %": [(rng.random(shape) < 0.1).astype(float) for _ in range(2)],
        "falling battery, coin decides the order": [np.where(coin, *turns), np.where(coin, *turns[::-1])],
        "falling battery, A always first": turns,
        "coverage of 72 cells": [rng.binomial(72, 0.3, shape) / 72 for _ in range(2)],
        "equal means: Beta(0.3, 2.7) and a constant": [rng.beta(0.3, 2.7, shape), np.full(shape, 0.1)],
    }
    for name, (a, b) in cases.items():
        shares = {
            each: f"{(test(a, b) > 0).mean():.3f}" for each, test in (tests | {"t test each": t_each}).items()
        }
        yield {"both controllers": name} | shares


def binary(tests: dict[str, Test], studies: int) -> Iterator[dict[str, str]]:
    """Yield the powers and mean pairs for successes and failures."""
    for one, other, most in (
        (0.9, 0.3, 20),
        (0.9, 0.5, 40),
        (0.7, 0.3, 60),
        (0.75, 0.6, 100),
        (0.95, 0.8, 100),
    ):
        rng = np.random.default_rng(round(100 * one + 10 * other))
        a, b = ((rng.random((studies, most)) < share).astype(float) for share in (one, other))
        about = {"successes": f"{100 * one:.0f} % and {100 * other:.0f} %", "maximum": str(most)}
        yield about | summary(tests | {"savi": savi}, a, b)


TABLES = {"power": power, "errors": errors, "binary": binary}


def main() -> None:
    """Simulate the tables, print them, and write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tables", nargs="+", choices=TABLES)
    parser.add_argument("--studies", type=int, default=STUDIES)
    parser.add_argument("--neighbors", type=Path, help="folder of packages in which fieldtrial is installed")
    parser.add_argument("--out", type=Path, help="folder for the tables")
    options = parser.parse_args()
    tests = dict(OURS)
    if options.neighbors is not None:
        sys.path.append(str(options.neighbors))  # last, so that its NumPy is not used
        tests |= NEIGHBORS
    for name in options.tables:
        rows = list(TABLES[name](tests, options.studies))
        lines = [list(rows[0]), *(list(row.values()) for row in rows)]
        for line in lines:
            print(" | ".join(line))
        if options.out is not None:
            path = options.out / f"sequential-{name}.csv"
            with path.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file, lineterminator="\n").writerows(lines)
            print(f"Written: {path}")


if __name__ == "__main__":
    main()

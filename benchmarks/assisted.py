"""How often assisted intervals of a mean miss, and how wide they are: simulated studies whose truth is known.

    python benchmarks/assisted.py --out docs/data

A study has n units with a score on the target and in simulation, and 200 more in simulation only. Scores are beta
distributed; `correlation` is that of the normal numbers behind both scores. In a fleet of 30, each unit has two trials
on the target with noise, and the truth is the mean of the 30. PPI++ is Angelopoulos, Duchi & Zrnic (2023), with its
normal quantile; it is the published neighbor. Writes `assisted.csv`. Seeds are fixed.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from realitygap.stats import assisted_mean

Values = NDArray[np.float64]

STUDIES = 4_000
OTHERS, FLEET = 200, 30
NOISE = 0.05
"""Standard deviation of one trial of a fleet's unit; there are two of each."""


class Setting(NamedTuple):
    """Scores are beta (a, b); fleet or population."""

    of: str
    a: float
    b: float
    correlation: float
    n: int


SETTINGS = tuple(
    Setting(of, a, b, correlation, n)
    for of, a, b in (("population", 2.0, 3.0), ("population", 0.6, 2.4), ("fleet", 2.0, 3.0))
    for correlation in (0.3, 0.6, 0.9)
    for n in (5, 10, 20, 40)
    if of == "population" or n < FLEET
)


def units(setting: Setting, size: int, rng: np.random.Generator) -> tuple[Values, Values]:
    """Return the scores of units on the target and in simulation."""
    one, other = rng.normal(size=(2, size))
    other = setting.correlation * one + np.sqrt(1 - setting.correlation**2) * other
    real, simulated = (stats.beta.ppf(stats.norm.cdf(each), setting.a, setting.b) for each in (one, other))
    return real, simulated


def ppi_plus(real: Values, driven: Values, others: Values) -> tuple[float, float]:
    """Return the interval of PPI++ for a mean."""
    n, m = len(real), len(others)
    everything = np.concatenate([driven, others])
    weight = np.cov(real, driven, ddof=0)[0, 1] / ((1 + n / m) * everything.var())
    weight = float(np.clip(weight, 0, 1))
    mean = float((real - weight * driven).mean() + weight * others.mean())
    error = np.sqrt((real - weight * driven).var() / n + weight**2 * others.var() / m)
    reach = float(stats.norm.ppf(0.975) * error)
    return mean - reach, mean + reach


def rows(studies: int) -> Iterator[list[str]]:
    """Yield the rows of the table, its head first."""
    yield [
        "mean of", "scores", "correlation", "driven", "refused [%]", "target alone misses [%]", "assisted misses [%]",
        "PPI++ misses [%]", "width to target alone", "worth, median",
    ]  # fmt: skip
    for number, setting in enumerate(SETTINGS):
        rng = np.random.default_rng([39, number])
        fleet = setting.of == "fleet"
        missed, ratios, worth = [], [], []
        for _ in range(studies):
            real, simulated = units(setting, FLEET if fleet else setting.n + OTHERS, rng)
            truth = float(real.mean()) if fleet else setting.a / (setting.a + setting.b)
            seen = real[: setting.n]
            if fleet:
                seen = np.clip(seen + rng.normal(0, NOISE / np.sqrt(2), setting.n), 0, 1)
            driven, others = simulated[: setting.n], simulated[setting.n :]
            noise = NOISE**2 / 2 if fleet else None
            found = assisted_mean(seen, driven, others, fleet=fleet, noise=noise, within=(0, 1))
            alone, ours = found.real_only.ends, found.estimate.ends
            if ours is None or alone is None:
                continue
            ends = (alone, ours, ppi_plus(seen, driven, others))
            missed.append([not low <= truth <= high for low, high in ends])
            ratios.append(found.width_ratio or np.nan)
            worth.append(found.worth or 0.0)
        shares = [f"{100 * share:.1f}" for share in np.mean(missed, axis=0)]
        if fleet:
            shares[2] = ""  # it is of a population
        yield [
            "these 30" if fleet else "population", f"beta({setting.a:g}, {setting.b:g})", f"{setting.correlation:g}",
            str(setting.n), f"{100 * (1 - len(missed) / studies):.1f}", *shares, f"{np.nanmean(ratios):.2f}",
            f"{np.median(worth):.1f}",
        ]  # fmt: skip


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--studies", type=int, default=STUDIES)
    parser.add_argument("--out", type=Path, default=Path("docs/data"))
    options = parser.parse_args()
    with (options.out / "assisted.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        for row in rows(options.studies):
            writer.writerow(row)
            print(*row, sep="\t", flush=True)


if __name__ == "__main__":
    main()

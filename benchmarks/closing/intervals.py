"""How often the intervals of the study hold the truth, in simulated studies of 8 twins in each of 4 families.

    python -m benchmarks.closing.intervals --out docs/data/closing-2

Means have normal values; one family may spread more than the others, for which the degrees of freedom make no
allowance. Falls have mean squares with a lognormal distribution, whose tail is long, and the same fall in all families.
Seeds are fixed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from .analysis import pooled_fall, stratified_mean
from .plan import FAMILIES
from .tables import as_csv

TWINS = 8
NAMES = [family for family in FAMILIES for _ in range(TWINS)]


def of_means(spread: float, studies: int, seed: int = 1) -> float:
    """Return how often the interval of the mean holds it, if one family spreads that much more than the others."""
    rng = np.random.default_rng(seed)
    scale = np.repeat([spread, 1.0, 1.0, 1.0], TWINS)
    found = [
        stratified_mean((rng.standard_normal(len(NAMES)) * scale).tolist(), NAMES).ends
        for _ in range(studies)
    ]
    return float(np.mean([ends is not None and ends[0] <= 0 <= ends[1] for ends in found]))


def of_falls(spread: float, studies: int, *, proportional: bool, fall: float = 0.6, seed: int = 2) -> float:
    """Return how often the interval of a fall holds it.

    Args:
        spread: Standard deviation of the logarithm of a mean square.
        studies: Number of simulated studies.
        proportional: Whether a mean square after calibrating is a share of that before. Else they are independent.
        fall: The true fall, the same in all families.
        seed: Seed of the studies.
    """
    rng = np.random.default_rng(seed)
    held = 0
    for _ in range(studies):
        before, after = rng.lognormal(-(spread**2) / 2, spread, (2, len(NAMES)))
        if proportional:
            after *= before
        ends = pooled_fall(before.tolist(), ((1 - fall) ** 2 * after).tolist(), NAMES, fall)[0].ends
        held += ends is not None and ends[0] <= fall <= ends[1]
    return held / studies


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--studies", type=int, default=4000)
    options = parser.parse_args()
    if options.studies < 1:
        parser.error(f"--studies is {options.studies}, expected at least 1")
    options.out.mkdir(parents=True, exist_ok=True)
    n = options.studies
    rows = [
        ("mean", "all families spread alike", of_means(1, n)),
        ("mean", "one family spreads 3 times as much", of_means(3, n)),
        ("mean", "one family spreads 15 times as much", of_means(15, n)),
    ]
    for spread in (0.5, 1.0):
        for proportional in (False, True):
            how = "in proportion to those before" if proportional else "independent of those before"
            held = of_falls(spread, n, proportional=proportional)
            rows.append(("fall", f"logarithms of mean squares spread by {spread:g}; {how}", held))
    text = as_csv([{"interval": a, "twins": b, "holds": f"{100 * c:.1f} %"} for a, b, c in rows])
    (options.out / "intervals.csv").write_text(text)
    print(text, end="")


if __name__ == "__main__":
    main()

"""Measure what the parts of a step cost in `sim`, and how far robots end from where many parts lead them.

    python benchmarks/parts.py [--json]

The trials are those of `realitygap bench realism`. Their steps have one part until the delayed command begins, and four
more. Each row has other numbers of parts. The error is the distance between the places of the same robot, with the same
noise, after 20 steps (10 s) with these parts and with 32 times as many as usual.

Example: NUMBA_CPU_NAME=x86-64-v3 NUMBA_CPU_FEATURES= python benchmarks/parts.py
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from environments import machine
from realitygap.kernels.math.peak import peak_flops
from realitygap.study._realism import AVOIDING, PRESSED, RealisticTrials

PARTS = ((4, 1), (3, 1), (2, 1), (1, 1))  # after the delayed command begins, and before
FINEST = (128, 32)
STEPS = 20
SECONDS = 1.0
REPEATS = 5
KINDS = {"pressed": (PRESSED, False), "boxes": (AVOIDING, True)}


def with_parts(name: str, parts: tuple[int, int]) -> RealisticTrials:
    """Return the trials of `realitygap bench realism` with other numbers of parts."""
    weights, boxes = KINDS[name]
    trials = RealisticTrials(weights, boxes=boxes)
    trials.shape = trials.shape._replace(substeps=parts[0], late_substeps=parts[1])
    return trials


def places(name: str, parts: tuple[int, int]) -> NDArray[np.float64]:
    """Return where the robots are after `STEPS` steps, (n, 2) in meters."""
    trials = with_parts(name, parts)
    trials.rules = trials.rules._replace(n_steps=STEPS)
    trials.run()
    return trials.ended


def measure(name: str) -> list[dict[str, Any]]:
    """Return a row for each of `PARTS`."""
    finest = places(name, FINEST)
    rows = []
    for parts in PARTS:
        trials = with_parts(name, parts)
        rates = [trials.rate(SECONDS) / (peak_flops() / 1e9) for _ in range(REPEATS)]
        away = np.hypot(*(places(name, parts) - finest).T)
        rows.append(
            {
                "kind": name,
                "parts": parts[0],
                "parts_before": parts[1],
                "per_gflop": float(np.median(rates)),
                "median_error_mm": float(np.median(away) * 1e3),
                "error_of_nine_of_ten_mm": float(np.quantile(away, 0.9) * 1e3),
            }
        )
    return rows


def main() -> None:
    """Measure, and print a table or data."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true", help="print data instead of a table")
    options = parser.parse_args()
    rows = [row for name in KINDS for row in measure(name)]
    if options.json:
        print(json.dumps({"machine": machine(), "rows": rows}, indent=1))
        return
    print(
        f"{'robots':10}{'parts':>8}{'robot-steps per GFlop':>24}{'median error':>16}{'nine of ten within':>20}"
    )
    for row in rows:
        parts = f"{row['parts']} + {row['parts_before']}"
        print(
            f"{row['kind']:10}{parts:>8}{row['per_gflop']:>24,.0f}"
            f"{row['median_error_mm']:>13.1f} mm{row['error_of_nine_of_ten_mm']:>17.1f} mm"
        )


if __name__ == "__main__":
    main()

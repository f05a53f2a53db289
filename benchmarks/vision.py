"""How well cells are read off photographs of sheets, as JSON.

`python benchmarks/vision.py judge --sheets 200` photographs as many synthetic sheets (five of each of 40 evolutions
on `sim`, eight pens each; every sheet with other paper, ink, light and camera), scores them, and says the
intersection over union of the visited cells, how often coverage is within one cell, and of the cells said to be so
sure how many are right. `python benchmarks/vision.py fit --sheets 48` does the same with other seeds, and finds from
them how much each sign of a crossed cell counts; `src/realitygap/vision/_cells.py` has what it prints.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.testing import Difficulty, driven_paths, photograph_sheet
from realitygap.vision import SheetLayout, read_photo, score_sheet
from realitygap.world import cells_along, paper_arena

GENERATIONS = 5  # sheets of an evolution
FIRST_JUDGED = 1  # seed of the first evolution that is judged
FIRST_FITTED = 3011  # of the first one that the confidence is fitted to; by those before the method was made
BINS = ((0.5, 0.7), (0.7, 0.85), (0.85, 0.95), (0.95, 0.99), (0.99, 1.0))  # of confidence


@dataclass(frozen=True)
class Read:
    """A trace as it is and as it was read; of each cell whether it is crossed, and with what probability."""

    sheet: int
    pen: int
    truth: NDArray[np.bool_]
    probability: NDArray[np.float64]
    features: NDArray[np.float64]
    seconds: float


def main() -> None:
    """Carry out what the arguments say, and print it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("judge", "fit"))
    parser.add_argument("--sheets", type=int, default=200, help="how many")
    parser.add_argument(
        "--difficulty", type=float, default=1.0, help="0 is a scan of a clean sheet, 1 a bad day"
    )
    parser.add_argument("--no-key", action="store_true", help="pens are not tried in their boxes")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--out", type=Path, help="a file, instead of printing it")
    parser.add_argument("--each", action="store_true", help="also every trace")
    options = parser.parse_args()
    first = FIRST_JUDGED if options.what == "judge" else FIRST_FITTED
    jobs = [
        (first + k // GENERATIONS, k % GENERATIONS, options.difficulty, not options.no_key)
        for k in range(options.sheets)
    ]
    traces: list[Read] = []
    with ProcessPoolExecutor(options.processes) as pool:
        for sheet in pool.map(read_one, jobs):
            traces += sheet
            if options.out is not None:  # what is interrupted leaves the figures of what was done
                options.out.write_text(told(traces, options) + "\n", "utf-8")
    if options.out is None:
        print(told(traces, options))


def told(traces: list[Read], options: argparse.Namespace) -> str:
    """What is asked for, as JSON."""
    summary = summarize(traces)
    if options.what == "fit":
        summary["coefficients"] = fit(traces)
    if options.each:
        summary["each"] = list(each(traces))
    return json.dumps(summary, indent=1)


@cache
def _paths(seed: int) -> list[list[NDArray[np.float64]]]:
    return driven_paths(seed, paper_arena(), generations=GENERATIONS)


def read_one(job: tuple[int, int, float, bool]) -> list[Read]:
    """The traces of a sheet: of which evolution, which generation, how difficult, and whether pens were tried."""
    seed, generation, difficulty, has_key = job
    arena = paper_arena()
    layout = SheetLayout.of(arena)
    paths = _paths(seed)[generation]
    number = GENERATIONS * seed + generation
    photo = photograph_sheet(layout, paths, number, Difficulty(*[difficulty] * 4), has_key=has_key)
    image = read_photo(photo.jpeg)
    began = time.process_time()
    score = score_sheet(image, layout)
    seconds = time.process_time() - began
    found = []
    for trace, path in zip(score.traces, paths, strict=True):
        truth = np.zeros(arena.grid.n_cells, np.bool_)
        truth[list(cells_along(path, arena.grid))] = True
        found.append(Read(number, trace.pen, truth, trace.probability, trace.features, seconds))
    return found


def summarize(traces: list[Read]) -> dict[str, Any]:
    """What the issue asks of them all."""
    ious = np.array([_iou(trace) for trace in traces])
    off = np.array([abs(int((trace.probability >= 0.5).sum()) - int(trace.truth.sum())) for trace in traces])
    truth = np.concatenate([trace.truth for trace in traces])
    said = np.concatenate([trace.probability for trace in traces])
    right = (said >= 0.5) == truth
    sure = np.maximum(said, 1 - said)
    both, either = (truth & (said >= 0.5)).sum(), (truth | (said >= 0.5)).sum()
    bins = []
    for low, high in BINS:
        inside = (sure >= low) & ((sure < high) | (high == 1.0))
        if inside.any():
            bins.append(
                {
                    "said": [low, high], "cells": int(inside.sum()),
                    "said_mean": round(float(sure[inside].mean()), 4), "right": round(float(right[inside].mean()), 4),
                }
            )  # fmt: skip
    return {
        "sheets": len({trace.sheet for trace in traces}),
        "traces": len(traces),
        "iou_mean": round(float(ious.mean()), 4),
        "iou_median": round(float(np.median(ious)), 4),
        "iou_of_all_cells": round(float(both / either), 4),
        "coverage_within_one_cell": round(float((off <= 1).mean()), 4),
        "coverage_exact": round(float((off == 0).mean()), 4),
        "confidence": bins,
        "seconds_a_sheet": round(float(np.median([trace.seconds for trace in traces])), 2),
    }


def each(traces: list[Read]) -> Iterator[dict[str, Any]]:
    """Every trace: what is missing and what is too much."""
    for trace in traces:
        said = trace.probability >= 0.5
        yield {
            "sheet": trace.sheet, "pen": trace.pen, "n": int(trace.truth.sum()), "iou": round(_iou(trace), 3),
            "missing": np.flatnonzero(trace.truth & ~said).tolist(),
            "extra": np.flatnonzero(said & ~trace.truth).tolist(),
        }  # fmt: skip


def fit(traces: list[Read]) -> list[float]:
    """Coefficients of a logistic regression of crossed cells on their signs, with a weak pull towards 0."""
    from scipy.optimize import minimize

    x = np.concatenate([trace.features for trace in traces])
    y = np.concatenate([trace.truth for trace in traces]).astype(np.float64)

    def cost(w: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        z = x @ w
        p = 1 / (1 + np.exp(-z))
        loss = np.sum(np.logaddexp(0, z) - y * z) + 0.5 * np.sum(w[1:] ** 2) * 0.5
        slope = x.T @ (p - y)
        slope[1:] += 0.5 * w[1:]
        return float(loss), slope

    found = minimize(cost, np.zeros(x.shape[1]), jac=True, method="L-BFGS-B")
    return [round(float(value), 3) for value in found.x]


def _iou(trace: Read) -> float:
    said = trace.probability >= 0.5
    return float((said & trace.truth).sum() / max((said | trace.truth).sum(), 1))


if __name__ == "__main__":
    main()

"""Do two people who count the cells of the same lines agree?"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from realitygap._wording import bracketed, counted
from realitygap.errors import LedgerError
from realitygap.records import Ledger, open_ledger
from realitygap.stats import BCA_SMALLEST_N, CONFIDENCE, RESAMPLES, SEED, Estimate


@dataclass(frozen=True)
class Agreement:
    """The agreement of two people on the cells that lines cross.

    Attributes:
        n_trials: Number of trials counted by two people.
        n_cells: Total number of judged cells: every reachable cell of each trial.
        same: Share of cells that both judge alike [0..1].
        kappa: Cohen's kappa: 1 for perfect agreement, 0 for agreement by chance. No value if all cells are alike, and
            no interval below 10 trials.
    """

    n_trials: int
    n_cells: int
    same: float
    kappa: Estimate

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, with the ends of the interval of kappa."""
        kappa = {"kappa": self.kappa.value, "low": self.kappa.low, "high": self.kappa.high}
        return {"n_trials": self.n_trials, "n_cells": self.n_cells, "same": self.same, **kappa}

    @property
    def sentence(self) -> str:
        """Return the agreement in words."""
        judged = f"{counted(self.n_trials, 'trial')} counted by two people, {counted(self.n_cells, 'cell')}"
        if self.kappa.value is None:
            return f"{judged}: all judged alike, and no kappa without both kinds of cells."
        interval = (
            f"no interval below {BCA_SMALLEST_N} trials"
            if self.kappa.ends is None
            else f"95 % interval {bracketed(self.kappa)}, trials resampled whole"
        )
        return f"{judged}: {100 * self.same:.1f} % judged alike. Cohen's kappa {self.kappa.value:.3f} ({interval})."


def measure_agreement(folder: str | Path) -> Agreement:
    """Measure how well the second counts of trials agree with the first ones.

    Args:
        folder: Folder of results with a ledger, or a file in which a command saved trials.

    Raises:
        LedgerError: there is none, or no trial was counted by two.

    Source: Cohen (1960), Educational and Psychological Measurement 20(1). Cells of one line depend on each other, so
    the interval comes from a bootstrap (BCa) that resamples whole trials.
    """
    with open_ledger(folder, writable=False) as ledger:
        first, second = _counted(ledger, "score"), _counted(ledger, "second")
        sizes = {name: about["n_cells"] for name, about in ledger.conditions().items()}
        if not sizes:
            sizes[""] = ledger.arena.grid.n_cells
        n_cells = {trial.trial: sizes[trial.condition] for trial in ledger.trials() if trial.state != "void"}
    both = sorted(first.keys() & second.keys() & n_cells.keys())
    if not both:
        raise LedgerError(
            f"{folder}: no trial was counted by two people yet. The second one enters what they see by `realitygap "
            "trials score TRIALS --second`."
        )
    tables = np.array([_table(first[trial], second[trial], n_cells[trial]) for trial in both], np.float64)
    kappa = float(_kappa(*tables.T))
    same = float(tables[:, [0, 3]].sum() / tables.sum())
    return Agreement(len(both), int(tables.sum()), same, _with_interval(kappa, tables))


def _counted(ledger: Ledger, role: str) -> dict[int, set[int]]:
    """The cells of each trial as last entered in a role."""
    return {
        row["trial"]: set(row["cells"])
        for row in ledger.scores()
        if row["role"] == role and row["undone"] is None
    }


def _table(one: set[int], other: set[int], n_cells: int) -> tuple[int, int, int, int]:
    """Cells that both, only the one, only the other, and neither mark."""
    return len(one & other), len(one - other), len(other - one), n_cells - len(one | other)


def _kappa(*table: npt.ArrayLike, axis: int = -1) -> npt.NDArray[np.float64]:
    """Return kappa of tables of cells that both, only the one, only the other, and neither mark, added up."""
    a, b, c, d = (np.asarray(part, np.float64).sum(axis=axis) for part in table)
    n = a + b + c + d
    observed = (a + d) / n
    expected = ((a + b) * (a + c) + (d + b) * (d + c)) / (n * n)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((observed - expected) / (1 - expected))


def _with_interval(kappa: float, tables: npt.NDArray[np.float64]) -> Estimate:
    """Return kappa with its interval, for (t, 4) tables of t trials."""
    n = len(tables)
    value = kappa if np.isfinite(kappa) else None
    if n < BCA_SMALLEST_N:
        return Estimate(value, None, None, n, needed=BCA_SMALLEST_N)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # where all resamples give the same there is no interval
        ends = scipy.stats.bootstrap(
            tuple(tables.T), _kappa, paired=True, vectorized=True, confidence_level=CONFIDENCE, method="BCa",
            n_resamples=RESAMPLES, random_state=np.random.default_rng(SEED),
        ).confidence_interval  # fmt: skip
    if not (np.isfinite(ends.low) and np.isfinite(ends.high)):
        return Estimate(value, None, None, n)
    return Estimate(value, float(ends.low), float(ends.high), n, method="BCa")

"""Repeated trials of controllers on one platform."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import finite_numbers
from realitygap.stats import CONFIDENCE, Range, t_interval

Values = NDArray[np.float64]


@dataclass(frozen=True)
class GapSide:
    """c controllers, each tried r times on one platform.

    Attributes:
        name: Name of the platform, as the user gave it.
        label: SIM, TWIN, EMULATED or REAL.
        values: (c, r) quality of each trial, such as coverage 0..1.
        cells: (c, r, n_cells) bool, True for the cells that each trial crossed; no rows if they are unknown.
        ends: (c, r, 2) final position of each trial [m]; no rows if they are unknown.
        score_range: Minimum and maximum of the quality, 0 and 1 of coverage; infinite without a limit. Intervals
            end within it.
    """

    name: str
    label: str
    values: Values
    cells: NDArray[np.bool_] = field(default_factory=lambda: np.empty((0, 0, 0), np.bool_))
    ends: Values = field(default_factory=lambda: np.empty((0, 0, 2)))
    score_range: Range = (-np.inf, np.inf)

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or 0 in self.values.shape:
            raise ValueError(
                f"values of {self.name} has shape {self.values.shape}, expected (controllers, trials), at least one of "
                "each."
            )
        finite_numbers(f"values of {self.name}", self.values)
        low, high = self.score_range
        least, most = float(self.values.min()), float(self.values.max())
        if not low <= least <= most <= high:
            raise ValueError(
                f"values of {self.name} are from {least:g} to {most:g}, expected numbers in the score range, "
                f"{low:g} to {high:g}."
            )
        for name, array in (("cells", self.cells), ("ends", self.ends)):
            if len(array) and array.shape[:2] != self.values.shape:
                raise ValueError(
                    f"{name} of {self.name} has shape {array.shape}, expected {(*self.values.shape, array.shape[-1])}."
                )

    @property
    def n(self) -> int:
        """Controllers."""
        return len(self.values)

    @property
    def trials(self) -> int:
        """Trials of each."""
        return int(self.values.shape[1])

    @property
    def means(self) -> Values:
        """Return the mean quality of each controller, (c,)."""
        return np.asarray(self.values.mean(axis=1))

    def intervals(self, confidence: float = CONFIDENCE) -> tuple[Values, Values]:
        """Return both ends of the interval of each controller's mean by t, (c,); the means if there is one trial."""
        freedom = max(self.trials - 1, 1)
        return t_interval(self.means, np.sqrt(self.noise), freedom, self.score_range, confidence)

    @property
    def noise(self) -> Values:
        """Return the part of the variance of each mean that is noise of trials, (c,); 0 if there is one trial."""
        if self.trials < 2:
            return np.zeros(self.n)
        return np.asarray(self.values.var(axis=1, ddof=1) / self.trials)

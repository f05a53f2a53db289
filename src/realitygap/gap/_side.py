"""Repeated trials of controllers on one platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap._wording import counted_range, platform_in_words
from realitygap.errors import finite_numbers
from realitygap.stats import CONFIDENCE, Estimate, Method, Range, exact_share_interval, t_interval

Values = NDArray[np.float64]


@dataclass(frozen=True)
class GapSide:
    """c controllers, each tried r times on one platform; or their mean quality alone.

    Attributes:
        name: Name of the platform, as the user gave it.
        label: SIM, TWIN, EMULATED or REAL.
        values: (c, r) quality of each trial, such as coverage 0..1. If the numbers of trials differ, r is the largest
            one, and the rest of each row is nan.
        cells: (c, r, n_cells) bool, True for the cells that each trial crossed; no rows if they are unknown.
        ends: (c, r, 2) final position of each trial [m]; no rows if they are unknown.
        score_range: Minimum and maximum of the quality, 0 and 1 of coverage; infinite without a limit. Intervals
            end within it.
        n_trials: Number of trials of each controller, if the numbers differ.
        are_means: True if the values are means of unknown trials, (c, 1). Their noise is unknown.
        is_binary: True if the values are successes (1) and failures (0). Intervals of means are then those of shares.
        title: Name in sentences. Default: derived from the name.
    """

    name: str
    label: str
    values: Values
    cells: NDArray[np.bool_] = field(default_factory=lambda: np.empty((0, 0, 0), np.bool_))
    ends: Values = field(default_factory=lambda: np.empty((0, 0, 2)))
    score_range: Range = (-np.inf, np.inf)
    n_trials: tuple[int, ...] = ()
    are_means: bool = False
    is_binary: bool = False
    title: str = ""

    @classmethod
    def of_trials(
        cls,
        name: str,
        label: str,
        trials: Sequence[ArrayLike],
        score_range: Range = (-np.inf, np.inf),
        title: str = "",
    ) -> GapSide:
        """Return a side whose controllers may have different numbers of trials.

        Args:
            name, label, score_range, title: Attributes of the side.
            trials: Quality of the trials of each controller, c sequences with at least one number each.

        Raises:
            ValueError: A controller has no trial, or a number is not finite or out of range.
        """
        rows = [np.asarray(row, float) for row in trials]
        counts = tuple(len(row) for row in rows)
        values = np.full((len(rows), max(counts, default=0)), np.nan)
        for row, given in zip(values, rows, strict=True):
            row[: len(given)] = given
        return cls(
            name,
            label,
            values,
            score_range=score_range,
            n_trials=counts if len(set(counts)) > 1 else (),
            title=title,
        )

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or 0 in self.values.shape:
            raise ValueError(
                f"values of {self.name} has shape {self.values.shape}, expected (controllers, trials), at least one of "
                "each."
            )
        if self.n_trials:
            self._check_ragged()
        given = self.values[np.arange(self.values.shape[1]) < self.counts[:, None]]
        finite_numbers(f"values of {self.name}", given)
        low, high = self.score_range
        least, most = float(given.min()), float(given.max())
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

    def _check_ragged(self) -> None:
        """Raise an error if the numbers of trials do not fit to the values.

        Raises:
            ValueError: They do not.
        """
        c, r = self.values.shape
        if len(self.n_trials) != c or not all(0 < n <= r for n in self.n_trials):
            raise ValueError(
                f"n_trials of {self.name} is {self.n_trials}, expected {c} whole numbers from 1 to {r}."
            )
        if len(self.cells) or len(self.ends):
            raise ValueError(f"{self.name} has cells or ends, expected the same number of trials of each.")

    @property
    def in_words(self) -> str:
        """The name in sentences."""
        return self.title or platform_in_words(self.name, self.label)

    @property
    def n(self) -> int:
        """Controllers."""
        return len(self.values)

    @property
    def counts(self) -> NDArray[np.int64]:
        """Return the number of trials of each controller, (c,)."""
        return np.array(self.n_trials or [self.values.shape[1]] * self.n, np.int64)

    @property
    def trials(self) -> int:
        """Trials of each; the fewest, if the numbers differ."""
        return int(self.counts.min())

    @property
    def trials_in_words(self) -> str:
        """The number of trials of each controller, such as `10 trials each`."""
        return (
            "means without trials"
            if self.are_means
            else f"{counted_range(self.counts.tolist(), 'trial')} each"
        )

    @property
    def means(self) -> Values:
        """Return the mean quality of each controller, (c,)."""
        return trial_means(self.values)

    def intervals(self, confidence: float = CONFIDENCE) -> tuple[Values, Values]:
        """Return both ends of the interval of each controller's mean, (c,); the means if there is one trial.

        The interval is by t; for successes, that of Clopper and Pearson.
        """
        if self.is_binary and not self.are_means:
            counts = np.column_stack([np.rint(self.means * self.counts), self.counts]).astype(int).tolist()
            ends = [exact_share_interval(k, n, confidence).ends for k, n in counts]
            low, high = np.array(ends, float).T
            return low, high
        freedom = np.maximum(self.counts - 1, 1)
        return t_interval(self.means, np.sqrt(self.noise), freedom, self.score_range, confidence)

    @property
    def estimates(self) -> list[Estimate]:
        """Return the mean of each controller, with its interval if it has several trials; n is their number."""
        if self.are_means:
            return [Estimate(mean, None, None, 0, "mean without trials") for mean in self.means.tolist()]
        method: Method = "Clopper-Pearson" if self.is_binary else "t"
        return [
            Estimate(mean, low, high, n, method=method)
            if n > 1 or self.is_binary
            else Estimate.of_few(mean, n, 2, "trials")
            for mean, low, high, n in zip(
                self.means.tolist(),
                *map(np.ndarray.tolist, self.intervals()),
                self.counts.tolist(),
                strict=True,
            )
        ]

    @property
    def noise(self) -> Values:
        """Return the part of the variance of each mean that is noise of trials, (c,); 0 if there is one trial."""
        if self.values.shape[1] < 2:
            return np.zeros(self.n)
        return trial_noise(self.values)


def trial_means(values: Values) -> Values:
    """Return means over the last axis, without the nan at the end of rows with fewer trials."""
    if np.isnan(values[..., -1]).any():
        return np.asarray(np.nanmean(values, axis=-1))
    return np.asarray(values.mean(axis=-1))


def trial_noise(values: Values) -> Values:
    """Return the variance of means over the last axis, from that of the trials; 0 for a single trial."""
    if not np.isnan(values[..., -1]).any():
        return np.asarray(values.var(axis=-1, ddof=1) / values.shape[-1])
    counts = (~np.isnan(values)).sum(axis=-1)
    squares = np.nansum((values - trial_means(values)[..., None]) ** 2, axis=-1)
    return np.asarray(squares / (np.maximum(counts - 1, 1) * counts))

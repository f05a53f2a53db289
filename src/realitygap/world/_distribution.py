"""Distributions of numbers in files and studies."""

from __future__ import annotations

import functools
import math
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from realitygap.settings import Settings

from ._quantiles import exponential, logarithm, normal_quantile

FARTHEST = 6.5  # standard deviations: farther than any of 32 random bits takes a normal number
KINDS = ("uniform", "normal", "log_uniform", "choice")
Pair = tuple[float, float]


class Distribution(Settings):
    """The distribution of a number: one of four kinds, and the frequency of its samples.

    Written in TOML as { uniform = [a, b] }, { normal = [mean, deviation] }, { log_uniform = [a, b] } or
    { choice = [a, b, c] }, with `per`, `least` and `most` where wanted.

    Raises:
        ValueError: No kind or more than one, ends in the wrong order, or a limit that leaves nothing.
    """

    uniform: Pair | None = Field(None, description="Minimum and maximum of a uniform distribution.")
    normal: Pair | None = Field(None, description="Mean and standard deviation.")
    log_uniform: Pair | None = Field(
        None, description="Minimum and maximum above 0 of a distribution whose logarithm is uniform."
    )
    choice: tuple[float, ...] | None = Field(
        None, description="Numbers of which one is drawn, all with the same probability."
    )
    per: Literal["trial", "run", "study"] = Field(
        "trial", description="Scope of each sample: one trial, one run, or the whole study."
    )
    least: float | None = Field(None, description="Minimum. Lower samples are set to it.")
    most: float | None = Field(None, description="Maximum. Higher samples are set to it.")
    together: str = Field(
        "",
        max_length=80,
        description="Word that joins numbers: those with the same word use the same random number. Choices of one "
        "length are then drawn row by row.",
    )

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            came = " and ".join(given) or "none"
            raise ValueError(f"expected one of uniform, normal, log_uniform and choice, got {came}")
        for kind, ends in (("uniform", self.uniform), ("log_uniform", self.log_uniform)):
            if ends is not None and not ends[0] <= ends[1]:
                raise ValueError(f"expected {kind} = [lower, upper], got [{ends[0]:g}, {ends[1]:g}]")
        if self.log_uniform is not None and self.log_uniform[0] <= 0:
            raise ValueError(f"expected log_uniform above 0, got {self.log_uniform[0]:g}")
        if self.normal is not None and self.normal[1] < 0:
            raise ValueError(f"expected a standard deviation of at least 0, got {self.normal[1]:g}")
        if self.choice is not None and not self.choice:
            raise ValueError("expected choice with at least one number, got none")
        if self.least is not None and self.most is not None and self.least > self.most:
            raise ValueError(f"least is {self.least:g}, more than most, {self.most:g}")
        return self

    @property
    def lowest(self) -> float:
        """Smallest possible value."""
        return self._limited(self._ends()[0])

    @property
    def highest(self) -> float:
        """Largest possible value."""
        return self._limited(self._ends()[1])

    @property
    def center(self) -> float:
        """Representative value, such as for a drawing: the mean, the geometric mean of ratios, or the first choice."""
        if self.choice is not None:
            return self._limited(self.choice[0])
        if self.normal is not None:
            return self._limited(self.normal[0])
        low, high = self._ends()
        return self._limited(math.sqrt(low * high) if self.log_uniform is not None else (low + high) / 2)

    def of(self, uniforms: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return samples as a function of uniform random numbers; the same bits on every machine.

        Args:
            uniforms: Any shape, 0 <= u < 1.

        Returns:
            Numbers of the same shape that increase with u (choices in their order).
        """
        u = np.asarray(uniforms, dtype=np.float64)
        if self.uniform is not None:
            drawn = self.uniform[0] + u * (self.uniform[1] - self.uniform[0])
        elif self.normal is not None:
            drawn = self.normal[0] + self.normal[1] * normal_quantile(u)
        elif self.log_uniform is not None:
            low, high = self.log_uniform
            ratio = logarithm(np.float64(high)) - logarithm(np.float64(low))
            drawn = np.clip(low * exponential(u * ratio), low, high)
        else:
            values = self._choices
            drawn = values[np.minimum((u * len(values)).astype(np.int64), len(values) - 1)]
        least, most = self.least, self.most
        return np.asarray(drawn if least is None and most is None else np.clip(drawn, least, most))

    @functools.cached_property
    def _choices(self) -> NDArray[np.float64]:
        return np.array(self.choice, dtype=np.float64)

    def _ends(self) -> Pair:
        if self.normal is not None:
            reach = FARTHEST * self.normal[1]
            return self.normal[0] - reach, self.normal[0] + reach
        if self.choice is not None:
            return min(self.choice), max(self.choice)
        ends = self.uniform if self.uniform is not None else self.log_uniform
        return ends if ends is not None else (math.nan, math.nan)

    def _limited(self, value: float) -> float:
        value = value if self.least is None else max(value, self.least)
        return value if self.most is None else min(value, self.most)

    def to_dict(self) -> dict[str, object]:
        """Return plain values without defaults; `Distribution(**values)` restores it."""
        return self.model_dump(mode="json", exclude_defaults=True)

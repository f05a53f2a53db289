"""All measures of a gap together."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from realitygap._wording import (
    counted,
    gap_equivalence,
    level_verdict,
    platform_in_words,
    rank_verdict,
    reproduces,
    trials_each,
    with_interval,
)
from realitygap.drawing import ShownAsCard
from realitygap.stats import Estimate

COVERAGE = "coverage"
"""The score of the paper's task."""


class Measure(NamedTuple):
    """A measure of a gap, as tables show it.

    Attributes:
        name: The attribute of `GapResult`.
        row: Name in a terminal, at most 32 letters.
        title: Name on a page.
        meaning: Meaning in words; `{score}` is replaced by the score of trials.
    """

    name: str
    row: str
    title: str
    meaning: str


SHOWN: tuple[Measure, ...] = (
    Measure(
        "rms",
        "RMS gap",
        "RMS gap",
        "root mean square over controllers of the difference in {score}, with noise subtracted",
    ),
    Measure(
        "raw_rms",
        "  noise not removed",
        "Raw RMS",
        "root mean square of the difference in {score}, noise not removed",
    ),
    Measure(
        "level",
        "level: target minus simulator",
        "Level",
        "mean difference in {score}, target minus simulator",
    ),
    Measure(
        "spread",
        "  spread over controllers",
        "Spread",
        "standard deviation over controllers of the true difference in {score}: 0 if one number corrects all of them",
    ),
    Measure(
        "a12",
        "A12: target above simulator",
        "A₁₂",
        "how likely a trial on the target is above one of the same controller in simulation",
    ),
    Measure(
        "srcc",
        "rank correlation",
        "Rank correlation",
        "Spearman’s, over controllers, of the mean {score}",
    ),
    Measure(
        "pearson",
        "linear correlation",
        "Linear correlation",
        "Pearson’s, over controllers, of the mean {score}",
    ),
    Measure(
        "noise_ceiling",
        "  noise ceiling",
        "Noise ceiling",
        "the correlation that noise leaves of a perfect one, by split halves",
    ),
    Measure(
        "srcc_disattenuated",
        "  without noise",
        "Without noise",
        "the correlation over its ceiling, at most 1",
    ),
    Measure("mmrv", "rank violation (MMRV)", "MMRV", "mean maximum rank violation, in {score} on the target"),
    Measure(
        "mmrv_floor",
        "  of the target by itself",
        "MMRV floor",
        "that of one half of the target’s trials by the other half",
    ),
    Measure(
        "mean_violation",
        "mean violation of pairs",
        "Mean violation",
        "mean over all pairs of controllers of the violation, in {score} on the target",
    ),
    Measure(
        "energy",
        "energy distance of cells",
        "Energy distance, cells",
        "of visited cells, mean over controllers [√cells]",
    ),
    Measure(
        "energy_ends",
        "energy distance of ends [m]",
        "Energy distance, ends",
        "of the places where trials end, mean over controllers [m]",
    ),
    Measure(
        "equivalence",
        "equivalence (interval of 90 %)",
        "Equivalence",
        "the level with the 90 % interval of two one-sided tests",
    ),
)
"""All measures of a gap, in the order of tables."""

_LATE = ("a12", "energy_ends", "raw_rms", "pearson", "mean_violation", "spread")  # after the others in JSON

MEASURES = tuple(each.name for each in SHOWN if each.name not in _LATE)
"""Names of the measures that come first in JSON, each with estimate, low, high, and n."""


@dataclass(frozen=True)
class GapResult(ShownAsCard):
    """The gap between two platforms: the transfer gap, of the same controllers on both.

    Differences are target minus simulator: below 0 where the target does worse than the simulator says.

    Attributes:
        source: Name of the simulator.
        target: Name of the target.
        labels: Labels of both: SIM, TWIN, EMULATED or REAL.
        trials: Number of trials of each controller on both; the fewest, if the numbers differ; 0 for means alone.
        rms: Root mean square over controllers of the difference of means, the variance of noise taken out.
        raw_rms: The same with the noise.
        level: Mean over controllers of the difference of means.
        spread: Standard deviation over controllers of the true difference, without noise.
        each: Expected difference of each controller: its own, drawn toward those of all by as much as its trials are
            noisy; `more` has p of no difference, corrected over controllers. Empty if `spread` is refused.
        a12: Probability that a trial on the target is above one of the same controller in simulation.
        srcc: Spearman's correlation of means over controllers.
        pearson: Pearson's correlation of means over controllers.
        srcc_disattenuated: The rank correlation divided by the noise ceiling.
        noise_ceiling: The correlation that noise alone leaves of a perfect one.
        mmrv: Mean maximum rank violation of the simulator's order, in units of the target's quality; `more` has the
            number of pairs that tie on one platform only.
        mmrv_floor: The violation of one half of the target's trials by the other half.
        mean_violation: Mean violation over all pairs of controllers.
        energy: Energy distance of behaviors (visited cells), mean over controllers; `more` has its p.
        equivalence: The level with the 90 % interval of TOST; `more` has margin, p and whether they are equivalent.
        energy_ends: Energy distance of the final positions of trials [m]; refused if they are unknown.
        misspecified: True if the simulator cannot reproduce the observations; None without a check.
        luck: Loss of champions on fresh seeds on the platform that selected them; refused if no champion was selected.
        reevolved: Champions evolved and tried on the target minus champions evolved and tried in simulation; refused
            if there are none.
        notes: Notes on the result.
        score: Score of trials, with its unit, such as `distance along walls [m]`.
        most_trials: Largest number of trials of a controller on both.
        paired: True if trial k of a controller had the same conditions on both.
        words: Both platforms in words. Default: derived from their names.
    """

    source: str
    target: str
    labels: tuple[str, str]
    trials: tuple[int, int]
    rms: Estimate
    raw_rms: Estimate
    level: Estimate
    a12: Estimate
    srcc: Estimate
    pearson: Estimate
    srcc_disattenuated: Estimate
    noise_ceiling: Estimate
    mmrv: Estimate
    mmrv_floor: Estimate
    mean_violation: Estimate
    energy: Estimate
    equivalence: Estimate
    energy_ends: Estimate
    spread: Estimate
    each: tuple[Estimate, ...] = ()
    misspecified: bool | None = None
    luck: Estimate = field(default_factory=lambda: Estimate.refusal(0, "No controller was selected."))
    reevolved: Estimate = field(default_factory=lambda: Estimate.refusal(0, "Nothing was evolved apart."))
    notes: tuple[str, ...] = ()
    score: str = COVERAGE
    most_trials: tuple[int, int] = (0, 0)
    words: tuple[str, str] = ("", "")
    paired: bool = False

    def __repr__(self) -> str:
        n = f"n={self.rms.n}×{self.trials[1]}"
        return f"{type(self).__name__}({self.source} → {self.target}: RMS {self.rms}, {n})"

    @property
    def excludes_no_gap(self) -> bool:
        """True if the interval of the RMS gap begins above 0."""
        return self.rms.low is not None and self.rms.low > 0

    @property
    def title(self) -> str:
        """The two platforms in words."""
        return " against ".join(self._names)

    @property
    def verdict(self) -> str:
        """Whether the simulator can be trusted for level and for ranking."""
        sentences = [
            level_verdict(*self._names, self.score, self.level, self.rms, self.equivalence),
            rank_verdict(self.srcc, self.noise_ceiling, self.srcc_disattenuated),
        ]
        if self.misspecified:
            sentences.append(reproduces(is_misspecified=True))
        return " ".join(sentences)

    @property
    def basis(self) -> str:
        """The numbers of controllers and of trials, in words."""
        return f"{counted(self.level.n, 'controller')}, {self.trials_in_words}"

    @property
    def _names(self) -> tuple[str, str]:
        """The simulator and the target in words."""
        if all(self.words):
            return self.words
        sim, target = map(platform_in_words, (self.source, self.target), self.labels)
        return sim, target

    @property
    def trials_in_words(self) -> str:
        """The number of trials of each controller, such as `5 trials of each on both platforms`."""
        return trials_each(self.trials, self.most_trials, self._names)

    @property
    def main_measures(self) -> list[tuple[str, str]]:
        """Name and value of the measures that matter most, in words."""
        ceiling = f", noise ceiling {with_interval(self.noise_ceiling)}"
        return [
            ("level", _words(self.level)),
            ("RMS gap", _words(self.rms)),
            ("rank correlation", _words(self.srcc) + ("" if self.noise_ceiling.value is None else ceiling)),
            ("equivalence", gap_equivalence(self.equivalence) or self.equivalence.refused),
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the measures, `misspecified`, `verdict`, and what they are of; `score` if that is not coverage."""
        named = {name: getattr(self, name).to_dict() for name in MEASURES}
        about = {
            "source": self.source,
            "target": self.target,
            "labels": list(self.labels),
            "trials": list(self.trials),
        }
        others = {name: getattr(self, name).to_dict() for name in (*_LATE, "luck", "reevolved")}
        return (
            named
            | {"misspecified": self.misspecified, "verdict": self.verdict}
            | others
            | {"notes": list(self.notes)}
            | about
            | ({} if self.score == COVERAGE else {"score": self.score})
        )

    def to_json(self) -> str:
        """Return the result as JSON."""
        return json.dumps(self.to_dict(), indent=2)


def _words(estimate: Estimate) -> str:
    """Return a measure with its interval, and the reason if one of them is missing."""
    words = with_interval(estimate)
    return f"{words}  {estimate.refused}" if estimate.refused else words

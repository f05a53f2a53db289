"""The wording of results: numbers with intervals, p values, and claims about networks that were selected.

The terminal, the lab, and the reports use these functions, so that one result reads the same everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the help of a command needs no NumPy
    from realitygap.stats import Estimate


@dataclass(frozen=True)
class Basis:
    """The scores that a claim about selected networks rests on.

    A network is selected for the best of many noisy scores. That score is too high by the luck of its trial. A claim
    rests on trials after the selection, or it says that luck is a part of it.

    Attributes:
        why_recorded: Reason why it rests on the scores that selected the networks; empty if it rests on fresh trials.
    """

    why_recorded: str = ""

    @property
    def is_fresh(self) -> bool:
        """True if it rests on trials after the selection."""
        return not self.why_recorded

    def claim(self, text: str) -> str:
        """Return a claim with what it rests on, as a sentence.

        Args:
            text: The claim without a period, in lower case unless it begins with a name.
        """
        return f"{'In fresh trials' if self.is_fresh else 'As recorded'}, {text}."

    @property
    def caveat(self) -> str:
        """The limit of a claim on recorded scores, as a clause; empty if the claim rests on fresh trials."""
        if self.is_fresh:
            return ""
        return f"recorded scores are the best of many noisy trials, so luck is part of them ({self.why_recorded})"


def joined(names: Sequence[str]) -> str:
    """Return names as a list in words; of more than two, the first two and the number of the others."""
    if len(names) > 2:
        return f"{names[0]}, {names[1]}, and {len(names) - 2} more"
    return " and ".join(names)


def highest(values: Mapping[str, float]) -> list[str]:
    """Return the names with the highest value; values that differ by rounding alone are equal."""
    most = max(values.values(), default=0.0)
    return [name for name, value in values.items() if round(value, 9) == round(most, 9)]


def highest_median(names: Sequence[str], medians: Sequence[str], of: str = "best coverage") -> str:
    """Return which conditions have the highest median, without a period.

    Args:
        names: All conditions that have it.
        medians: Their medians in words, of the first two.
        of: Score.
    """
    return f"{joined(names)} {'has' if len(names) == 1 else 'have'} the highest median {of}: {' and '.join(medians)}"


def signed(value: float, digits: int = 3) -> str:
    """Return a number with its sign, and a true minus."""
    text = f"{value:+.{digits}f}".replace("-", "−")
    return text.replace("−", "±").replace("+", "±") if float(f"{value:.{digits}f}") == 0 else text


def span(estimate: Estimate, digits: int = 3, *, signs: bool = False) -> str:
    """Return the interval in words; a dash without one."""
    if estimate.ends is None:
        return "–"
    low, high = (signed(end, digits) if signs else f"{end:.{digits}f}" for end in estimate.ends)
    return f"{low} to {high}" if signs else f"{low}–{high}"


def with_interval(estimate: Estimate, *, signs: bool = False) -> str:
    """Return a number with its interval in brackets, if it has one; a dash without a number."""
    if estimate.value is None:
        return "–"
    numbers = [estimate.value, *(estimate.ends or ())]
    value, *ends = (signed(number) if signs else f"{number:.3f}" for number in numbers)
    return f"{value} [{ends[0]}, {ends[1]}]" if ends else value


def p_in_words(p: float) -> str:
    """Return a p value: three decimals, or a power of ten; below 10⁻⁹ exactness is of no use."""
    if p >= 0.001:
        return f"{p:.3f}" if p < 0.9995 else "1"
    if p < 1e-9:
        return "< 10⁻⁹"
    digits, exponent = f"{p:.0e}".split("e")
    return f"{digits}·10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def p_equation(p: float, *, bound: bool = False) -> str:
    """Return p with its relation, such as `p = 0.012` or `p < 0.001`.

    Args:
        p: The value.
        bound: True if it is the largest of several.
    """
    if p < 0.001:
        return "p < 0.001"
    return f"p {'≤' if bound else '='} {p_in_words(p)}"

"""Audit of a small table of results: the conclusions that it supports, and those that it cannot."""

from __future__ import annotations

import csv
import io
import itertools
import math
import reprlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from realitygap._limits import MOST_TABLE_BYTES, read_file
from realitygap._wording import few_runs_verdict, higher_verdict, inconclusive_verdict
from realitygap.errors import TableError, whole_number
from realitygap.report._comparisons import difference_and_share
from realitygap.stats import (
    ALPHA,
    MEDIAN_SMALLEST_N,
    POWER,
    USUAL_EFFECTS,
    Estimate,
    a12_of_effect,
    detectable_effect,
    effect_of_a12,
    holm,
    median_interval,
    permutation_p,
    runs_for_a_claim,
    runs_needed,
    smallest_p,
)

COLUMNS = ("condition", "run", "value")
_MOST_MISTAKES = 20
_LONGEST_NUMBER = 40
_LARGEST_EXPONENT = 400


@dataclass(frozen=True)
class DoubtfulValue:
    """A value that is not the rounded share that it should be.

    Attributes:
        line: Line in the file, where the header is line 1; 0 without a file.
        condition: Its condition.
        run: Its run, as written.
        text: Value as written.
        problem: `impossible`: no k/N is near; `cut`: k/N with digits cut off instead of rounded; `raised`: k/N rounded
            up instead of down.
        nearest: Nearest k, out of N.
    """

    line: int
    condition: str
    run: str
    text: str
    problem: str
    nearest: int


@dataclass(frozen=True)
class AuditedCondition:
    """A condition of the table.

    Attributes:
        condition: Name of the condition.
        n: Number of runs.
        mean: Mean of its values.
        median: Median of its values.
        deviation: Standard deviation; None with one run.
        median_low, median_high: The 95 % interval of the median; None below 6 runs, which cannot give one.
    """

    condition: str
    n: int
    mean: float
    median: float
    deviation: float | None
    median_low: float | None
    median_high: float | None


@dataclass(frozen=True)
class AuditedPair:
    """Two conditions of the table, of independent runs.

    Attributes:
        one: First condition.
        other: Second condition.
        n: Number of runs of `one`.
        n_other: Number of runs of `other`.
        difference: Mean of `one` minus mean of `other`, with its BCa interval; without one below 10 runs.
        a12: Probability that a run of `one` is above a run of `other`; ties count half. Its interval is BCa, and
            Newcombe's below 10 runs; it has none if not even p < 0.05 is possible.
        p: Two-sided p of a permutation test of the difference of means.
        p_holm: P value corrected for all pairs of the table.
        smallest_p: Smallest p that this number of runs can give.
        can_claim: True if the corrected p can be below 0.05 at all.
        runs_for_a_claim: Smallest number of runs per condition with which it can.
        detectable: Smallest difference that this number of runs detects in 80 of 100 studies [standard deviations].
        detectable_a12: This difference as A12.
    """

    one: str
    other: str
    n: int
    n_other: int
    difference: Estimate
    a12: Estimate
    p: float
    p_holm: float
    smallest_p: float
    can_claim: bool
    runs_for_a_claim: int
    detectable: float | None
    detectable_a12: float | None

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, with the interval of each estimate and the verdict."""
        values: dict[str, Any] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, Estimate):
                ends = {"low": value.low, "high": value.high, "method": value.method}
                values |= {
                    field.name: value.value,
                    f"{field.name}_interval": None if value.ends is None else ends,
                }
            else:
                values[field.name] = value
        return values | {"verdict": self.verdict}

    @property
    def verdict(self) -> str:
        """The conclusion that the pair supports, in words."""
        if not self.can_claim:
            return f"{few_runs_verdict(self.runs_for_a_claim)} each at least"
        if self.p_holm < ALPHA:
            return higher_verdict(self.one, self.other, self.difference.value or 0.0)
        return inconclusive_verdict()


@dataclass(frozen=True)
class Audit:
    """The result of `audit_results`.

    Attributes:
        conditions: Conditions in the order of the file.
        denominator: Denominator against which values were checked; None if they were not.
        doubtful: Values that are no k/N, or not rounded.
        pairs: Pairs of conditions.
        runs_needed: Numbers of runs per condition that detect a small, medium and large effect in 80 of 100 studies.
    """

    conditions: list[AuditedCondition]
    denominator: int | None
    doubtful: list[DoubtfulValue]
    pairs: list[AuditedPair]
    runs_needed: dict[str, int]

    def to_dict(self) -> dict[str, Any]:
        """Return all results as plain values; each pair has its `verdict`."""
        values = asdict(self)
        values["pairs"] = [pair.to_dict() for pair in self.pairs]
        return values


@dataclass(frozen=True)
class _Row:
    line: int
    condition: str
    run: str
    text: str

    @property
    def value(self) -> float:
        return float(self.text)


@dataclass(frozen=True)
class AuditProgress:
    """The progress of an audit.

    Attributes:
        n_done: Number of compared pairs of conditions.
        n_pairs: Total number of pairs.
        n_runs: Number of lines of the table; thousands take minutes.
    """

    n_done: int
    n_pairs: int
    n_runs: int


Tell = Callable[[AuditProgress], None]


def audit_results(table: str | Path, *, denominator: int | None = None, tell: Tell | None = None) -> Audit:
    """Determine the conclusions that a small table of results supports, and those that it cannot.

    Runs are taken as independent. Every two conditions are compared by a permutation test of the difference
    of their means, corrected by Holm over all pairs. Detectable effects and numbers of runs are those of a t
    test at the 5 % level with 80 % power, which assumes normal values with the same spread in both.

    Args:
        table: CSV file with the columns condition, run and value. Other columns are ignored.
        denominator: N, if values must be k/N, such as a share of N cells.
        tell: Function that gets the progress before each comparison.

    Returns:
        The audit.

    Raises:
        TableError: The file cannot be read, or its columns or rows are wrong. The message names all wrong rows.
        TypeError, ValueError: `denominator` is not a whole number, or below 1.
    """
    if denominator is not None:
        denominator = whole_number("denominator", denominator, 1)
    return _audit(_read(Path(table)), denominator, tell)


def _audit(rows: Sequence[_Row], denominator: int | None, tell: Tell | None = None) -> Audit:
    names = list(dict.fromkeys(row.condition for row in rows))
    values = {name: np.array([row.value for row in rows if row.condition == name]) for name in names}
    doubtful = []
    for row in rows if denominator is not None else ():
        found = doubt(row.text, denominator or 1)
        if found is not None:
            doubtful.append(DoubtfulValue(row.line, row.condition, row.run, row.text, *found))
    return Audit(
        conditions=[_condition(name, values[name]) for name in names],
        denominator=denominator,
        doubtful=doubtful,
        pairs=compare_samples(values, tell),
        runs_needed={
            name: runs_needed(effect_of_a12(share), paired=False) or 0
            for name, share in USUAL_EFFECTS.items()
        },
    )


def _condition(name: str, values: npt.NDArray[np.float64]) -> AuditedCondition:
    deviation = float(values.std(ddof=1)) if len(values) > 1 else None
    median = median_interval(values)
    return AuditedCondition(
        name, len(values), float(values.mean()), median.value or 0.0, deviation, median.low, median.high
    )


def compare_samples(
    values: dict[str, npt.NDArray[np.float64]], tell: Tell | None = None
) -> list[AuditedPair]:
    """Every two of the conditions, of independent runs, in the order given."""
    names = list(itertools.combinations(values, 2))
    n_runs = sum(map(len, values.values()))
    raw = np.empty(len(names))
    for k, (name, other_name) in enumerate(names):
        if tell is not None:
            tell(AuditProgress(k, len(names), n_runs))
        raw[k] = permutation_p(values[name], values[other_name])
    floors = np.array([smallest_p(len(values[one]), len(values[other])) for one, other in names])
    corrected, best = holm(raw), holm(floors)
    pairs = []
    for k, (name, other_name) in enumerate(names):
        one, other = values[name], values[other_name]
        difference, share = difference_and_share(one, other, float(floors[k]), paired=False)
        effect = detectable_effect(min(len(one), len(other)), paired=False)
        pairs.append(
            AuditedPair(
                one=name,
                other=other_name,
                n=len(one),
                n_other=len(other),
                difference=difference,
                a12=share,
                p=float(raw[k]),
                p_holm=float(corrected[k]),
                smallest_p=float(floors[k]),
                can_claim=bool(best[k] < ALPHA),
                runs_for_a_claim=runs_for_a_claim(len(names), paired=False),
                detectable=effect,
                detectable_a12=None if effect is None else a12_of_effect(effect),
            )
        )
    return pairs


def doubt(text: str, denominator: int) -> tuple[str, int] | None:
    """Return the fault of a value that should be k/N, and the nearest k; None if there is no fault.

    Args:
        text: Value as written. The number of its decimals is its claimed precision.
        denominator: N.
    """
    written = Decimal(text)
    value = Fraction(written)
    exponent = written.as_tuple().exponent
    unit = Fraction(10) ** int(exponent)
    nearest = min(max(round(value * denominator), 0), denominator)
    share = Fraction(nearest, denominator)
    if abs(value - share) <= unit / 2:
        return None
    if 0 < share - value < unit:
        return "cut", nearest
    if 0 < value - share < unit:
        return "raised", nearest
    return "impossible", nearest


# reading


def _read(path: Path) -> list[_Row]:
    try:
        text = read_file(path, MOST_TABLE_BYTES).decode("utf-8-sig")
        with io.StringIO(text, newline="") as file:
            reader = csv.reader(file, skipinitialspace=True, strict=True)
            lines = [(reader.line_num, line) for line in reader if any(cell.strip() for cell in line)]
    except UnicodeDecodeError as error:
        raise TableError(
            f"{path}: not a text file (byte {error.start} is not UTF-8). Give a CSV file."
        ) from None
    except OSError as error:
        raise TableError(f"{path}: cannot be read ({error.strerror}). Give a CSV file.") from None
    except csv.Error as error:
        raise TableError(f"{path}: not a CSV file ({error}).") from None
    if not lines:
        raise TableError(
            f"{path}: is empty. Expected a line with {', '.join(COLUMNS)}, and a line for each run."
        )
    places = _places(path, lines[0][1])
    rows, mistakes = [], []
    for number, cells in lines[1:]:
        texts = [cells[place].strip() if place < len(cells) else "" for place in places]
        row = _Row(number, *texts)
        problem = _problem(row)
        if problem:
            mistakes.append(f"line {number}: {problem}")
        else:
            rows.append(row)
    mistakes += _doubles(rows)
    if mistakes:
        more = f"; and {len(mistakes) - _MOST_MISTAKES} more" if len(mistakes) > _MOST_MISTAKES else ""
        raise TableError(f"{path}: {'; '.join(mistakes[:_MOST_MISTAKES])}{more}.")
    if not rows:
        raise TableError(f"{path}: has no line below {','.join(COLUMNS)}. Expected one for each run.")
    if len({row.condition for row in rows}) == 1:
        raise TableError(
            f"{path}: has one condition only ({rows[0].condition!r}). Expected at least two, to be compared."
        )
    return rows


def _places(path: Path, header: Sequence[str]) -> list[int]:
    columns = [name.strip().lower() for name in header]
    missing = [name for name in COLUMNS if name not in columns]
    if missing:
        listed = reprlib.repr([name.strip() for name in header])[1:-1]
        raise TableError(
            f"{path}: has no column {' and no column '.join(missing)}. Expected {', '.join(COLUMNS)} in the first "
            f"line, which has {listed}."
        )
    twice = [name for name in COLUMNS if columns.count(name) > 1]
    if twice:
        raise TableError(f"{path}: has two columns {twice[0]!r}. Keep one of them.")
    return [columns.index(name) for name in COLUMNS]


def _problem(row: _Row) -> str:
    if not row.condition:
        return "no condition"
    if not row.run:
        return "no run"
    if not row.text:
        return "no value"
    try:
        is_number = (
            len(row.text) <= _LONGEST_NUMBER and math.isfinite(float(row.text)) and "_" not in row.text
        )
        # its fraction is computed exactly
        is_number = is_number and abs(int(row.text.lower().partition("e")[2] or 0)) <= _LARGEST_EXPONENT
    except ValueError:
        is_number = False
    # float() takes a little more than Decimal() does
    if not is_number or not row.text.isascii():
        return f"the value {row.text[:_LONGEST_NUMBER]!r} is not a number"
    return ""


def _doubles(rows: Sequence[_Row]) -> list[str]:
    seen: dict[tuple[str, str], int] = {}
    mistakes = []
    for row in rows:
        first = seen.setdefault((row.condition, row.run), row.line)
        if first != row.line:
            mistakes.append(
                f"line {row.line}: condition {row.condition!r} has run {row.run!r} already, in line {first}"
            )
    return mistakes


# words


def audit_notes(audit: Audit) -> list[str]:
    """Return the notes that belong to the tables, as sentences."""
    notes = []
    if audit.denominator is not None:
        n = sum(each.n for each in audit.conditions)
        notes.append(
            f"{len(audit.doubtful)} of {n} values are no k/{audit.denominator} as rounded."
            if audit.doubtful
            else f"All {n} values are k/{audit.denominator}, as rounded."
        )
    refused = [pair for pair in audit.pairs if not pair.can_claim]
    if refused:
        worst = max(refused, key=lambda pair: pair.smallest_p)
        notes.append(
            f"{worst.n} runs against {worst.n_other} cannot give a p below {worst.smallest_p:.2g}"
            + (
                f", and over {len(audit.pairs)} pairs (Holm) none below "
                f"{min(1.0, worst.smallest_p * len(audit.pairs)):.2g}"
                if len(audit.pairs) > 1
                else ""
            )
            + f". From {worst.runs_for_a_claim} runs each on, a difference could be shown."
        )
    few = [each.condition for each in audit.conditions if each.median_low is None]
    if few:
        notes.append(
            f"Fewer than {MEDIAN_SMALLEST_N} runs give no 95 % interval of the median: {', '.join(few)}."
        )
    needed = ", ".join(
        f"{n} for a {name} effect (A12 {USUAL_EFFECTS[name]})" for name, n in audit.runs_needed.items()
    )
    notes.append(
        f"Runs of each condition that find an effect in {100 * POWER:.0f} of 100 studies (t test at 5 %, two "
        f"conditions, normal values with one spread): {needed}."
    )
    return notes

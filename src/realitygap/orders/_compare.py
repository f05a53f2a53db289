"""The order of `compare`: the gap in a table of scores."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator

from ._field import argument, option
from ._order import Order
from ._shared import Seed, controller_option, score_option, seed_option

Label = Literal["SIM", "TWIN", "EMULATED", "REAL"]

UNIT_RANGE = "0:1"


def _as_texts(value: object) -> object:
    """Return one table or several as texts."""
    if isinstance(value, str | os.PathLike):
        return (os.fspath(value),)
    if isinstance(value, Iterable):
        return tuple(os.fspath(part) if isinstance(part, os.PathLike) else part for part in value)
    return value


class CompareOrder(Order):
    """Measure the gap in a table of scores.

    The table has columns controller (or policy), platform, and score, and a row for each trial (column trial) or for
    the mean of a controller. Optional columns are task, block, and n. No simulator or robot of realitygap is needed:
    the scores may be of any robots, simulators, and controllers. The table may also be the export of fieldtrial or the
    episode records of robostats (.jsonl), which have no platforms: name them before the files, as in sim=FILE.

    Reports level, RMS gap, correlations, and rank violations, with intervals over controllers. Tasks are compared
    apart. If the table does not support a measure, the report states the reason.

    Example: realitygap compare scores.csv

    Example: realitygap compare scores.csv --sim mujoco --real arm --margin 0.05 --report gap.html

    Example: realitygap compare sim=libero.jsonl real=fieldtrial.csv --binary

    In Python: realitygap.compare_scores("scores.csv", sim="mujoco", real="arm")
    """

    command: ClassVar[str] = "compare"

    table: Annotated[tuple[str, ...], BeforeValidator(_as_texts)] = argument(
        "TABLE", help="Tables of scores (.csv or .jsonl). NAME=FILE: all rows are of platform NAME."
    )
    sim: str | None = option(
        None,
        help="Platform that predicts.",
        default_is="sim",
        metavar="PLATFORM",
    )
    real: str | None = option(
        None,
        help="Platform that is predicted.",
        default_is="real",
        metavar="PLATFORM",
    )
    task: str | None = option(
        None, help="Task to compare.", default_is="all tasks, each apart", metavar="NAME"
    )
    score: str | None = score_option()
    range: str = option(
        UNIT_RANGE, help="Range of the scores, such as 0:100 for percent, or 0:inf.", metavar="LOW:HIGH"
    )
    margin: float | None = option(
        None,
        help="Largest difference in score that counts as equivalent, such as 0.05.",
        above=0,
        metavar="M",
    )
    binary: bool = option(
        False, help="Scores are successes (1) and failures (0), or shares of successes among n trials."
    )
    shared: bool = option(False, help="Leave out controllers and blocks that only one platform has.")
    unpaired: bool = option(False, help="Ignore the column block, which pairs trials of both platforms.")
    ties: Literal["both", "simpler"] = option(
        "both",
        help="Pairs that tie on one platform only: both, violated for both controllers; simpler, as its code counts.",
    )
    controller: str | None = controller_option()
    sim_label: Label = option("SIM", help="Label of the platform that predicts.")
    real_label: Label = option("REAL", help="Label of the platform that is predicted.")
    seed: Seed = seed_option()

    @property
    def ends(self) -> tuple[float, float]:
        """Minimum and maximum of the scores."""
        return range_ends(self.range)

    def conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield the field and the message for each setting that cannot be, or that others exclude."""
        if not self.table:
            yield "table", "expected at least one table, got none."
        low, high = range_ends(self.range)
        if not low < high:
            yield (
                "range",
                f"expected LOW:HIGH, such as 0:100, with the lower number first, got {self.range!r}.",
            )
        if self.sim is not None and self.sim == self.real:
            yield "real", f"expected another platform than --sim, got {self.real}."


def range_ends(text: str) -> tuple[float, float]:
    """Return both ends of a range; nan if the text has none."""
    parts = re.split(r"[:,\s]+", text.strip())
    try:
        low, high = (float(part) for part in parts)
    except ValueError:
        return math.nan, math.nan
    return low, high
